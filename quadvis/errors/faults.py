"""Faults that a user can correct: their places, their problems and their remedies.

Every error that a user's mistake can cause derives from `QuadvisError` and is shown as plain sentences, never
as a traceback. A check reports all faults together: it collects them in `Faults`, then calls `Faults.check`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from typing import ClassVar, NamedTuple, ParamSpec, TypeVar

from quadvis.errors.characters import advice, character_name
from quadvis.errors.discretion import is_foreign, without_quotes
from quadvis.errors.rules import each_rule_once
from quadvis.errors.unknown import UNKNOWN, Unknown
from quadvis.errors.words import on_one_line, sentence

_Arguments = ParamSpec("_Arguments")
_Result = TypeVar("_Result")


class QuadvisError(Exception):
    """A fault with a message for the user; the command line prints it and ends with `exit_code`."""

    exit_code: ClassVar[int] = 2


class OutOfRange(ArithmeticError):
    """A value that a block does not take: a run ends with this sentence, the block, the time and the value.

    A compiled method can raise it, with a text that is written out.
    """


class Odd(NamedTuple):
    """A character that looks like an ASCII one, and its place."""

    line: int
    column: int
    character: str


@dataclass(order=True, unsafe_hash=True, slots=True)  # a frozen one takes three times as long to make
class Place:
    """A position in a file; lines and columns count from 1, line 0 means the file as a whole.

    For options with the same name on a command line, ``column`` is the number of the option and ``line`` is
    0.

    ``odd`` is an odd character of the text that begins here: if the text is wrong, this character is the
    cause.
    """

    file: str
    line: int = 0
    column: int = 0
    odd: Odd | None = field(default=None, compare=False, repr=False)

    def __str__(self) -> str:
        """Return `file:line:column`."""
        return f"{self.file}:{self.line}:{self.column}" if self.line else self.file


@dataclass(frozen=True, order=True, slots=True)
class Fault:
    """One fault at one place; `subject` is a phrase such as "block 'velocity'"."""

    place: Place
    subject: str
    problem: str
    remedy: str = ""

    def __str__(self) -> str:
        """Return `file:line:column: block 'x': what is wrong; what would be right`."""
        subject = f"{self.subject}: " if self.subject else ""
        return on_one_line(f"{self.place}: {subject}{sentence(self.problem, self.remedy)}")

    def explained(self) -> Fault:
        """Return the fault at the odd character of the text, with the remedy for it, if the text has one."""
        odd = self.place.odd
        if odd is None:
            return self
        line, column = (odd.line, odd.column) if self.place.line else (0, self.place.column)
        named = character_name(odd.character) in self.problem
        remedy = self.remedy if named else advice(odd.character)
        return Fault(Place(self.place.file, line, column), self.subject, self.problem, remedy)

    def discreet(self) -> Fault:
        """Return the fault without any text of its file, if the file must not be quoted."""
        file = self.place.file
        if not self.place.line or not is_foreign(file):
            return self
        words = (without_quotes(part, file) for part in (self.subject, self.problem, self.remedy))
        return Fault(self.place, *words)


@dataclass(frozen=True, order=True, slots=True)
class Doubt(Fault):
    """A warning: the diagram runs, but this is surely not what was meant."""

    def __str__(self) -> str:
        """Return `file:line:column: warning: block 'x': what is odd; what would be right`."""
        subject = f"{self.subject}: " if self.subject else ""
        return f"{self.place}: warning: {subject}{sentence(self.problem, self.remedy)}"


class DiagramError(QuadvisError):
    """All faults of a diagram, one a line, in the order of the files."""

    def __init__(self, faults: Iterable[Fault]) -> None:
        """Keep the faults, sorted by place, without duplicates."""
        distinct = sorted({fault.explained().discreet() for fault in faults})
        self.faults: list[Fault] = list(each_rule_once(distinct))
        super().__init__("\n".join(str(fault) for fault in self.faults))


class RunError(QuadvisError):
    """A run that had to stop: the block, the port, the time (s) and the reason."""

    exit_code: ClassVar[int] = 1

    def __init__(self, reason: str, *, block: str = "", port: str = "", time: float | None = None) -> None:
        """Keep the parts; the message reads "block 'x', port 'y', t = 1.25 s: reason"."""
        self.reason, self.block, self.port, self.time = reason, block, port, time
        where = [f"block '{block}'"] if block else []
        where += [f"port '{port}'"] if port else []
        where += [f"t = {time:.9g} s"] if time is not None else []
        super().__init__(f"{', '.join(where)}: {reason}" if where else reason)


class Faults(list[Fault]):
    """The faults found so far; a check goes on after the first fault, up to a limit.

    At `LIMIT` faults `append` raises, because a file full of faults would cost minutes and pages.
    """

    LIMIT = 200

    def __init__(self) -> None:
        """Begin with no fault, no warning and no subject."""
        super().__init__()
        self.subject = ""
        self.warnings: list[Doubt] = []

    def append(self, fault: Fault) -> None:
        """Keep a fault; raise `DiagramError` with all faults once they are too many."""
        super().append(fault)
        if len(self) >= self.LIMIT:
            raise DiagramError(self)

    def add(self, place: Place, problem: str, remedy: str = "", *, subject: str | None = None) -> None:
        """Keep a fault about the present subject, or about ``subject``."""
        self.append(Fault(place, self.subject if subject is None else subject, problem, remedy))

    def warn(self, place: Place, problem: str, remedy: str = "", *, subject: str | None = None) -> None:
        """Keep a warning; the diagram can still run."""
        self.warnings.append(Doubt(place, self.subject if subject is None else subject, problem, remedy))

    def collect(
        self, read: Callable[_Arguments, _Result], *args: _Arguments.args, **kwargs: _Arguments.kwargs
    ) -> _Result | None:
        """Return what `read` returns, or None after keeping its faults: `faults.collect(node.number)`."""
        try:
            return read(*args, **kwargs)
        except DiagramError as error:
            for fault in error.faults:
                if fault not in self:
                    self.append(fault if fault.subject else replace(fault, subject=self.subject))
            return None

    def read(
        self, read: Callable[_Arguments, _Result], *args: _Arguments.args, **kwargs: _Arguments.kwargs
    ) -> _Result | Unknown:
        """Do the same as `collect`, for what is handed on: `UNKNOWN` in place of None."""
        found = self.collect(read, *args, **kwargs)
        return UNKNOWN if found is None else found

    def reported(self, place: Place) -> bool:
        """Say whether a fault at a place is kept."""
        return any(fault.place == place for fault in self)

    def about(self, subject: str) -> _About:
        """Name the subject of every fault added inside: `with faults.about("block 'velocity'"): ...`."""
        return _About(self, subject)

    def check(self) -> None:
        """Raise `DiagramError` if there is any fault."""
        if self:
            raise DiagramError(self)


class _About:
    """The subject of faults inside a `with` statement."""

    __slots__ = ("before", "faults", "subject")

    def __init__(self, faults: Faults, subject: str) -> None:
        self.faults, self.subject = faults, subject

    def __enter__(self) -> None:
        self.before, self.faults.subject = self.faults.subject, self.subject

    def __exit__(self, *_: object) -> None:
        self.faults.subject = self.before
