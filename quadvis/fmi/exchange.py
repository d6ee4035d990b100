"""What an FMU and its caller exchange: numbers in one buffer, which two processes may share.

 control words | inputs | outputs | tunable parameters | states | derivatives

Values of one type lie side by side, so that one call sets or gets them all. Who has only the buffer and a
`FmuSetup` as JSON can run the FMU: the caller's units, shapes and names stay with the caller.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

SLOT = 8
# Control words by their bytes: how many requests are answered, whether the caller sleeps until the next
# answer, the status, the time and the step (s), the number of a saved state, the length of a text, the text.
ANSWERED, SLEEPS, STATUS, TIME, STEP, NUMBER, LENGTH, TEXT = range(0, 8 * SLOT, SLOT)
TEXT_ROOM = 4096
DATA = TEXT + TEXT_ROOM

# Requests, each a byte.
STEP_ON, GET, SET_GET, SLOPES, COMPLETE, SAVE, RESTORE, FORGET, TUNE, END = b"sgxdcvrftq"

# Statuses as in FMI; further ones are ours.
OK, WARNING, DISCARD, ERROR, FATAL, PENDING = range(6)
ENDING, EVENT, NO_INSTANCE, NO_LIBRARY = range(10, 14)
STATUS_NAMES = ("OK", "Warning", "Discard", "Error", "Fatal", "Pending")

FORMATS = {
    2: {"Float64": "d", "Int32": "i", "Boolean": "i", "Enumeration": "i"},
    3: {
        "Float64": "d", "Float32": "f", "Int8": "b", "UInt8": "B", "Int16": "h", "UInt16": "H", "Int32": "i",
        "UInt32": "I", "Int64": "q", "UInt64": "Q", "Boolean": "?", "Enumeration": "q",
    },
}  # fmt: skip
SIZES = {"d": 8, "f": 4, "b": 1, "B": 1, "h": 2, "H": 2, "i": 4, "I": 4, "q": 8, "Q": 8, "?": 1}


class ExchangeSection(NamedTuple):
    """``size`` values of one type, side by side from ``offset`` (bytes) on; an array is one reference."""

    kind: str
    references: tuple[int, ...]
    size: int
    offset: int


class Laid(NamedTuple):
    """Sections of signals, one for each type, and the place (bytes) of each signal."""

    sections: tuple[ExchangeSection, ...]
    places: list[int]


class FixedValues(NamedTuple):
    """Values that are set once, before the FMU is initialised: texts, or numbers of one type."""

    kind: str
    references: tuple[int, ...]
    values: tuple[Any, ...]


@dataclass(frozen=True)
class FmuSetup:
    """All that is needed to run an FMU over a buffer. ``states`` is None for co-simulation.

    ``resources`` is a URI in FMI 2.0, a path in 3.0. ``states_at`` and ``slopes_at`` are bytes in the buffer.
    ``proxy`` is a library that formats messages of FMI 2.0, "" if there is none.
    """

    version: int
    name: str
    token: str
    library: str
    resources: str
    start_time: float
    fixed: tuple[FixedValues, ...]
    inputs: tuple[ExchangeSection, ...]
    outputs: tuple[ExchangeSection, ...]
    tunable: tuple[ExchangeSection, ...]
    states: int | None
    states_at: int
    slopes_at: int
    size: int
    serialises: bool
    completed_step: bool
    warnings: bool
    proxy: str = ""

    def plain(self) -> dict[str, Any]:
        """Return it as data that JSON can hold."""
        return asdict(self)

    @staticmethod
    def read(data: dict[str, Any]) -> FmuSetup:
        """Return what `plain` has given."""
        lists: dict[str, Any] = {
            "fixed": tuple(FixedValues(*each) for each in data["fixed"]),
            **{
                name: tuple(ExchangeSection(*each) for each in data[name])
                for name in ("inputs", "outputs", "tunable")
            },
        }
        return FmuSetup(**{**data, **lists})


class Room:
    """Lays sections out, one after the other."""

    def __init__(self) -> None:
        self.size = DATA

    def section(self, version: int, kind: str, references: Sequence[int], size: int) -> ExchangeSection:
        """Return a section for so many values of a type."""
        made = ExchangeSection(kind, tuple(references), size, self.size)
        self.take(SIZES[FORMATS[version][kind]] * size)
        return made

    def take(self, size: int) -> int:
        """Return the place of some bytes."""
        place = self.size
        self.size += -(-size // SLOT) * SLOT
        return place
