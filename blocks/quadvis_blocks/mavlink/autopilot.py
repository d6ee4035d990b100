"""An autopilot at the other end of a port: what it says, what is asked of it, and whether it is armed."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from quadvis.block import Counted, Input, NewsDevice, Param
from quadvis_blocks.mavlink import _telemetry as telemetry
from quadvis_blocks.mavlink._arming import NO_MODE, Arming
from quadvis_blocks.mavlink._autopilot_ports import AutopilotPorts
from quadvis_blocks.mavlink._complaints import Complaints
from quadvis_blocks.mavlink._dialect import dialect
from quadvis_blocks.mavlink._identity import AutopilotIdentity
from quadvis_blocks.mavlink._keys import KeptTimes, read_key
from quadvis_blocks.mavlink._packets import LooseMessage, loosened
from quadvis_blocks.mavlink._rates import MeasuredRates
from quadvis_blocks.mavlink._requests import Requests
from quadvis_blocks.mavlink._scanner import Packet, PacketScanner
from quadvis_blocks.mavlink._signing import SignatureCheck
from quadvis_blocks.mavlink._station import SYSTEMS, Station
from quadvis_blocks.mavlink._timeouts import AUTO, AutopilotTimeouts

MODES = 1 << 32
HEARD = (
    "HEARTBEAT", "ATTITUDE", "HIGHRES_IMU", "LOCAL_POSITION_NED", "PARAM_VALUE", "COMMAND_ACK", "STATUSTEXT",
)  # fmt: skip
MANY = 20  # requests in a frame
TOGETHER = 0.05  # s at least between two frames of requests, so that the guardian sends each
REFUSED, LOST = Counted.REFUSED, Counted.LOST


class Autopilot(Station, AutopilotPorts, NewsDevice, Input):
    """An autopilot that speaks MAVLink 2, such as PX4 or ArduPilot.

    It gives what ATTITUDE, HIGHRES_IMU, LOCAL_POSITION_NED and HEARTBEAT say, the newest of each, with its
    age; ``age`` is that of the attitude. Messages of others (ground stations, radios, gimbals) touch no
    signal and are counted. Which one is the autopilot is declared, or learned from its first heartbeat,
    and never changes.

    Rates of messages are asked for, measured over 2 s, and asked for again if less than 80 % comes, at
    most once a second: other stations on the link set theirs. Before ``arm`` is obeyed, the time-outs
    after which the autopilot acts without set-points are read, and the run ends with an error if one is
    off, endless, or longer than ``timeout_limit``. ``arm`` acts when it changes: an autopilot that is
    armed from elsewhere stays so.

    With a ``key`` only packets count that are signed with it, each once. See https://mavlink.io/en/.
    """

    harmless = "it asks, and repeats nothing; commands are those of other blocks"
    rate = "100 Hz"

    target_system = Param(
        0, type="int64", min=0, max=SYSTEMS, doc="number of its system; 0: by its heartbeat"
    )
    target_component = Param(0, type="int64", min=0, max=SYSTEMS, doc="number of its component; 0: the same")
    attitude_rate = Param(50.0, unit="Hz", min=0.0, max=1000.0, doc="of ATTITUDE; 0: not asked for")
    imu_rate = Param(0.0, unit="Hz", min=0.0, max=1000.0, doc="of HIGHRES_IMU; 0: not asked for")
    position_rate = Param(0.0, unit="Hz", min=0.0, max=1000.0, doc="of LOCAL_POSITION_NED; 0: not asked for")
    max_age = Param(0.5, unit="s", above=0.0, doc="age up to which an attitude is valid")
    timeouts = Param(
        AUTO,
        type="str",
        doc="names of its parameters that say after which time without set-points it acts, with spaces; "
        "auto: COM_OF_LOSS_T, COM_RC_LOSS_T of PX4, GUID_TIMEOUT, RC_OVERRIDE_TIME of ArduPilot; '': none",
    )
    timeout_limit = Param(1.0, unit="s", above=0.0, doc="what none of these may exceed")
    flight_mode = Param(
        NO_MODE, type="int64", min=NO_MODE, below=MODES, doc="its number of the mode to arm in; -1: as it is"
    )

    example = """
        autopilot: {block: mavlink.autopilot, rate: fast, with: {port: "udp::14540"}}
    """

    def check(self) -> None:
        """Refuse a dialect without the messages of an autopilot."""
        super().check()
        for name in HEARD:
            self.definition(name)

    def open(self) -> None:
        """Open the port; nobody has spoken."""
        known, key = dialect(self.dialect), self.key
        self._times = KeptTimes(key, signs=False) if key else None
        proof = SignatureCheck(read_key(key), self._times) if self._times is not None else None
        self._scanner = PacketScanner(known.numbers, proof)
        self._heard = {self.definition(name).number: name for name in HEARD}
        self._definitions = known.numbers
        self._who = AutopilotIdentity(int(self.target_system), int(self.target_component))
        self._complaints = Complaints(self.report, known.numbers, self._scanner.counts, bool(key))
        self._requests = Requests(
            self,
            self._who,
            MeasuredRates({self.definition(name).number: rate for name, rate in self._streams().items()}),
            AutopilotTimeouts(self.timeouts, self.timeout_limit),
            Arming(int(self.flight_mode)),
            self._complaints,
        )
        self._said = telemetry.Telemetry()
        self._waiting: list[LooseMessage] = []
        self._flushed = self._time = -math.inf
        super().open()

    def _streams(self) -> dict[str, float]:
        """Return the messages that may be asked for, with their rates (Hz)."""
        return {
            "ATTITUDE": self.attitude_rate,
            "HIGHRES_IMU": self.imu_rate,
            "LOCAL_POSITION_NED": self.position_rate,
        }

    def read(self, time: float) -> None:
        """Take all messages that have come."""
        self._time = time
        super().read(time)

    def decode(self, received: bytearray) -> Iterator[Any]:
        """Take whole packets off the beginning."""
        counts = self._scanner.counts
        damaged = counts.damaged
        for packet in self._scanner.take(received):
            yield from self._take(packet)
        yield from [REFUSED] * (counts.damaged - damaged)

    def _take(self, packet: Packet) -> Iterator[Any]:
        name = self._heard.get(packet.number, "")
        fields = self._definitions[packet.number].unpack(packet.payload) if name else {}
        if name == "HEARTBEAT":
            self._who.meet(packet, fields)
            if self._who.is_known:
                self._requests.timeouts.meet(self._who.firmware)
        if not self._who.speaks(packet):
            return
        self._complaints.answered()
        yield from [LOST] * packet.missing
        self._requests.rates.note(packet.number, self._time)
        if name == "PARAM_VALUE":
            self._requests.timeouts.take(fields)
        elif name == "COMMAND_ACK":
            self._requests.answer(fields)
        elif name == "STATUSTEXT":
            self._requests.said(fields)
        elif name:
            verdict = self._said.take(name, fields, self._time)
            if verdict is telemetry.MessageFate.TAKEN:
                yield from [self._values()] * (name == "ATTITUDE")
            else:
                yield LOST if verdict is telemetry.MessageFate.LATE else REFUSED

    def output(self) -> Any:
        """Return age, counts, and what the autopilot has said last."""
        return self._age, self._counts[LOST], self._counts[REFUSED], *self._values()

    def _values(self) -> tuple[Any, ...]:
        """Return the block's own outputs, in their order."""
        said, counts, requests, time = self._said, self._scanner.counts, self._requests, self._time
        return (
            bool(self._age <= self.max_age),
            *said.attitude,
            said.age("HIGHRES_IMU", time),
            *said.inertial,
            said.age("LOCAL_POSITION_NED", time),
            *said.local_position,
            said.age("HEARTBEAT", time),
            *said.flight,
            requests.arming.state,
            requests.timeouts.longest if math.isfinite(requests.timeouts.longest) else math.nan,
            self._who.system,
            requests.rates.requests,
            sum(self._who.others.values()),
            sum(counts.unknown.values()),
            sum(counts.differs.values()),
            sum(counts.rejected.values()),
        )

    def write(self, arm: bool, time: float) -> None:
        """Ask for what is due; QuadvisError if the autopilot is to be armed and must not be."""
        self._waiting += self._requests.due(time, arm, self._said.flight)
        if self._waiting and time >= self._flushed + TOGETHER:
            self._complaints.asked(time)
            self.tell(loosened(self._waiting[:MANY]))
            self._waiting, self._flushed = self._waiting[MANY:], time

    def close(self) -> None:
        """Close the port, and report what did not count."""
        if "_complaints" in self.__dict__:
            self._complaints.farewell(self._who.others)
        times, self._times = self.__dict__.get("_times"), None
        if times is not None:
            times.close()
        super().close()
