"""The time-outs after which an autopilot no longer obeys set-points, read before it is armed."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator, Mapping
from typing import Any

from quadvis.errors import sentence
from quadvis_blocks.mavlink._identity import ARDUPILOT, PX4

AUTO = "auto"
NAMES: Mapping[int, tuple[str, ...]] = {
    PX4: ("COM_OF_LOSS_T", "COM_RC_LOSS_T"),
    ARDUPILOT: ("GUID_TIMEOUT", "RC_OVERRIDE_TIME"),
}
AGAIN = 0.5  # s between two requests for a parameter
TRIES = 10
REAL = 9  # MAV_PARAM_TYPE_REAL32; smaller ones are whole numbers
WHOLE = {1: "<B3x", 2: "<b3x", 3: "<H2x", 4: "<h2x", 5: "<I", 6: "<i"}  # in the bytes of the value, of PX4


class AutopilotTimeouts:
    """Time-outs of an autopilot (s), by the names of its parameters.

    ``names`` are texts with spaces in between, or "auto" for those of the firmware. ``limit`` (s) is what
    none of them may exceed.
    """

    def __init__(self, names: str, limit: float) -> None:
        self._given, self._limit = names, limit
        self._firmware: int | None = None
        self.values: dict[str, float] = {}
        self._asked, self._tries = -math.inf, 0

    @property
    def names(self) -> tuple[str, ...] | None:
        """The names of the parameters; None if they are not known yet."""
        if self._given != AUTO:
            return tuple(self._given.split())
        return None if self._firmware is None else NAMES.get(self._firmware, ())

    def meet(self, firmware: int) -> None:
        """Take note of what firmware the autopilot has."""
        self._firmware = firmware

    def due(self, time: float) -> Iterator[str]:
        """Yield the names of the parameters to ask for now."""
        missing = [name for name in self.names or () if name not in self.values]
        if missing and time >= self._asked + AGAIN and self._tries < TRIES:
            self._asked, self._tries = time, self._tries + 1
            yield from missing

    def take(self, fields: Mapping[str, Any]) -> None:
        """Take the value of a parameter from a PARAM_VALUE."""
        name = fields["param_id"].split(b"\0")[0].decode("ascii", "replace")
        if name not in (self.names or ()):
            return
        value, kind = float(fields["param_value"]), fields["param_type"]
        if kind < REAL and self._firmware == PX4 and kind in WHOLE:
            value = float(struct.unpack(WHOLE[kind], struct.pack("<f", value))[0])
        self.values[name] = value

    @property
    def longest(self) -> float:
        """The longest of all (s); NaN as long as one is not known."""
        names = self.names
        if not names or any(name not in self.values for name in names):
            return math.nan
        return max(self.values[name] for name in names)

    @property
    def is_settled(self) -> bool:
        """True if there is nothing more to wait for."""
        names = self.names
        return names is not None and (all(name in self.values for name in names) or self._tries >= TRIES)

    def refusal(self) -> str:
        """Return why the autopilot must not be armed, in a sentence; "" if nothing speaks against it."""
        names = self.names
        if names is None or (self._given == AUTO and not names):
            problem = "it is not known after which time without set-points the autopilot acts by itself"
            return sentence(problem, "name the parameters that say so in 'timeouts'")
        wrong = [text for name in names if (text := self._wrong(name))]
        if not wrong:
            return ""
        remedy = f"set it to more than 0 and at most {self._limit:g} s, or allow more by 'timeout_limit'"
        return sentence("; ".join(wrong), remedy)

    def _wrong(self, name: str) -> str:
        """Return what is wrong with a time-out; "" if nothing is."""
        if name not in self.values:
            return f"the autopilot does not say what its {name} is"
        value = self.values[name]
        if 0.0 < value <= self._limit:
            return ""
        named = f"{name} of the autopilot is {value:g} s"
        if not math.isfinite(value) or value < 0.0:
            return f"{named}, so the last set-point would hold for ever"
        return f"{named}, which turns it off" if value == 0.0 else f"{named}, longer than {self._limit:g} s"
