"""What is asked of an autopilot, as messages: rates, time-outs, modes, to be armed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Protocol

from quadvis.errors import QuadvisError
from quadvis_blocks.mavlink._arming import ARM as ASKED_TO_ARM
from quadvis_blocks.mavlink._arming import GIVEN_UP, NO_MODE, Arming, ArmingRequest
from quadvis_blocks.mavlink._complaints import Complaints
from quadvis_blocks.mavlink._identity import PX4, AutopilotIdentity
from quadvis_blocks.mavlink._packets import LooseMessage
from quadvis_blocks.mavlink._rates import MeasuredRates
from quadvis_blocks.mavlink._telemetry import FlightState
from quadvis_blocks.mavlink._timeouts import AutopilotTimeouts

SET_INTERVAL, COMMAND_ARM, SET_MODE = 511, 400, 176  # MAV_CMD
OWN_MODE = 1  # MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
ACCEPTED, IN_PROGRESS = 0, 5  # MAV_RESULT
RESULTS = {1: "not now", 2: "denied", 3: "unsupported", 4: "failed", 6: "cancelled"}


class Speaker(Protocol):
    """Who makes messages of a dialect."""

    def loose(self, name: str, **fields: Any) -> LooseMessage:
        """Return a message."""


class Requests:
    """Decides what to ask for next; QuadvisError if the autopilot is to be armed and must not be."""

    def __init__(
        self,
        speaker: Speaker,
        who: AutopilotIdentity,
        rates: MeasuredRates,
        timeouts: AutopilotTimeouts,
        arming: Arming,
        complaints: Complaints,
    ) -> None:
        self._speaker, self._who, self._complaints = speaker, who, complaints
        self.rates, self.timeouts, self.arming = rates, timeouts, arming

    def due(self, time: float, arm: bool, flight: FlightState) -> Iterator[LooseMessage]:
        """Yield the messages to be sent now."""
        self._complaints.look(time)
        if not self._who.is_known:
            self._complaints.asked(time)
            return
        for number, rate in self.rates.due(time).items():
            if number in self.rates.slow:
                self._complaints.slow(number, self.rates.slow[number], rate)
            yield self._command(SET_INTERVAL, number, round(1e6 / rate))
        for name in self.timeouts.due(time):
            yield self._speaker.loose(
                "PARAM_REQUEST_READ", **self._target(), param_id=name.encode(), param_index=-1
            )
        request = self._arm(time, arm, flight)
        if request is not None:
            yield self._asked(request)

    def answer(self, fields: Mapping[str, Any]) -> None:
        """Take the answer to a command."""
        result = fields["result"]
        if fields["command"] in (COMMAND_ARM, SET_MODE) and result not in (ACCEPTED, IN_PROGRESS):
            what = "its mode" if fields["command"] == SET_MODE else "to be armed or disarmed"
            why = RESULTS.get(result, f"result {result}")
            self._complaints.once(
                ("answer", fields["command"], result), f"the autopilot refuses {what}: {why}"
            )

    def said(self, fields: Mapping[str, Any]) -> None:
        """Take what the autopilot says in words: while it is asked to arm, it says why it does not."""
        if self.arming.state == ASKED_TO_ARM:
            text = fields["text"].split(b"\0")[0].decode("utf-8", "replace")
            self._complaints.once(("text", text), f"the autopilot says: {text}")

    def _arm(self, time: float, arm: bool, flight: FlightState) -> ArmingRequest | None:
        settled = self.timeouts.is_settled
        if arm and not flight.armed and settled and (why := self.timeouts.refusal()):
            raise QuadvisError(f"the autopilot is not armed: {why}")
        before = self.arming.state
        found = self.arming.step(time, arm, flight.armed, flight.mode, may=settled)
        if self.arming.state == GIVEN_UP != before:
            self._complaints.once(
                "given up", "the autopilot does not do what it was asked to; it is asked no more"
            )
        return found

    def _asked(self, request: ArmingRequest) -> LooseMessage:
        if request.mode == NO_MODE:
            return self._command(COMMAND_ARM, float(request.arm))
        if self._who.firmware == PX4:  # its number has two parts
            return self._command(SET_MODE, OWN_MODE, request.mode >> 16 & 0xFF, request.mode >> 24 & 0xFF)
        return self._command(SET_MODE, OWN_MODE, request.mode)

    def _command(self, command: int, *parameters: float) -> LooseMessage:
        given = {f"param{place}": float(value) for place, value in enumerate(parameters, 1)}
        return self._speaker.loose("COMMAND_LONG", **self._target(), command=command, **given)

    def _target(self) -> dict[str, int]:
        return {"target_system": self._who.system, "target_component": self._who.component}
