"""Faults that a user can put right: where they are, what is wrong, what would be right.

Everything that a user's mistake can cause derives from `QuadvisError` and is shown as plain sentences, never
as a traceback. A check reports all faults at once: collect them in `Faults`, then call `Faults.check`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import ClassVar, NamedTuple, ParamSpec, TypeVar

from quadvis.characters import advice, character_name
from quadvis.discretion import is_foreign, without_quotes
from quadvis.synonyms import synonym

_Arguments = ParamSpec("_Arguments")
_Result = TypeVar("_Result")


class QuadvisError(Exception):
    """A fault with a message for the user; the command line prints it and ends with `exit_code`."""

    exit_code: ClassVar[int] = 2


class Odd(NamedTuple):
    """A character that was taken for an ASCII one, and where it stands."""

    line: int
    column: int
    character: str


@dataclass(frozen=True, order=True, slots=True)
class Place:
    """A position in a file; lines and columns count from 1, line 0 means the file as a whole.

    Of options of one name on a command line, ``column`` is the number, and ``line`` is 0.

    ``odd`` is a character of the text that begins there: should the text turn out to be wrong, that is why.
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
    """One thing that is wrong at one place; `subject` is a phrase such as "block 'velocity'"."""

    place: Place
    subject: str
    problem: str
    remedy: str = ""

    def __str__(self) -> str:
        """Return `file:line:column: block 'x': what is wrong; what would be right`."""
        subject = f"{self.subject}: " if self.subject else ""
        return _on_one_line(f"{self.place}: {subject}{sentence(self.problem, self.remedy)}")

    def explained(self) -> Fault:
        """Return the fault at the odd character of the text, if it holds one, with what to write for it."""
        odd = self.place.odd
        if odd is None:
            return self
        line, column = (odd.line, odd.column) if self.place.line else (0, self.place.column)
        named = character_name(odd.character) in self.problem
        remedy = self.remedy if named else advice(odd.character)
        return Fault(Place(self.place.file, line, column), self.subject, self.problem, remedy)

    def discreet(self) -> Fault:
        """Return the fault without a word of its file, if that is one whose contents are none of ours."""
        file = self.place.file
        if not self.place.line or not is_foreign(file):
            return self
        words = (without_quotes(part, file) for part in (self.subject, self.problem, self.remedy))
        return Fault(self.place, *words)


@dataclass(frozen=True, order=True, slots=True)
class Doubt(Fault):
    """What can be run, and is surely not what was meant."""

    def __str__(self) -> str:
        """Return `file:line:column: warning: block 'x': what is odd; what would be right`."""
        subject = f"{self.subject}: " if self.subject else ""
        return f"{self.place}: warning: {subject}{sentence(self.problem, self.remedy)}"


class DiagramError(QuadvisError):
    """Everything that is wrong with a diagram, one fault a line in the order of the files."""

    def __init__(self, faults: Iterable[Fault]) -> None:
        """Keep the faults, sorted by place and without repetitions."""
        self.faults: list[Fault] = sorted({fault.explained().discreet() for fault in faults})
        super().__init__("\n".join(str(fault) for fault in self.faults))


class RunError(QuadvisError):
    """A run that had to stop: which block and port, at which time (s), and why."""

    exit_code: ClassVar[int] = 1

    def __init__(self, reason: str, *, block: str = "", port: str = "", time: float | None = None) -> None:
        """Keep the parts; the message reads "block 'x', port 'y', t = 1.25 s: reason"."""
        self.reason, self.block, self.port, self.time = reason, block, port, time
        where = [f"block '{block}'"] if block else []
        where += [f"port '{port}'"] if port else []
        where += [f"t = {time:.9g} s"] if time is not None else []
        super().__init__(f"{', '.join(where)}: {reason}" if where else reason)


class Faults(list[Fault]):
    """The faults found so far; a check goes on after the first one, but not for ever.

    A file that is wrong everywhere would otherwise cost minutes and pages: at `LIMIT` faults `append` raises.
    """

    LIMIT = 200

    def __init__(self) -> None:
        """Begin with no fault, no warning and no subject."""
        super().__init__()
        self.subject = ""
        self.warnings: list[Doubt] = []
        self._explained: set[str] = set()

    def append(self, fault: Fault) -> None:
        """Keep a fault; raise `DiagramError` with all of them once there are too many to go on."""
        super().append(fault)
        if len(self) >= self.LIMIT:
            raise DiagramError(self)

    def add(self, place: Place, problem: str, remedy: str = "", *, subject: str | None = None) -> None:
        """Keep a fault about the present subject, or about the one given."""
        self.append(Fault(place, self.subject if subject is None else subject, problem, remedy))

    def once(self, rule: str) -> str:
        """Return a sentence that explains a rule the first time, and nothing after that."""
        if rule in self._explained:
            return ""
        self._explained.add(rule)
        return rule

    def warn(self, place: Place, problem: str, remedy: str = "", *, subject: str | None = None) -> None:
        """Keep a warning; it does not keep a diagram from running."""
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

    @contextmanager
    def about(self, subject: str) -> Iterator[None]:
        """Name the subject of every fault added inside: `with faults.about("block 'velocity'"): ...`."""
        before, self.subject = self.subject, subject
        try:
            yield
        finally:
            self.subject = before

    def check(self) -> None:
        """Raise `DiagramError` if there is any fault."""
        if self:
            raise DiagramError(self)


def sentence(problem: str, remedy: str = "") -> str:
    """Join what is wrong and what would be right."""
    return f"{problem}; {remedy}" if remedy else problem


def _on_one_line(text: str) -> str:
    """Return a text with everything written out that does not show, or would begin a new line."""
    return text if text.isprintable() else "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)


def quoted(text: object, limit: int = 40) -> str:
    """Return the text in quotes, fit for one line of a message: escaped and shortened."""
    raw = str(text)
    return repr(raw if len(raw) <= limit else raw[: limit - 3] + "...")


def suggestion(word: str, candidates: Iterable[str]) -> str:
    """Return the remedy for an unknown word: "did you mean 'y'?", a short list of what exists, or ""."""
    names = list(dict.fromkeys(candidates))
    best = closest(word, names)
    if best is not None:
        return f"did you mean {quoted(best)}?"
    if not 0 < len(names) <= 8:
        return ""
    return f"use {quoted(names[0])}" if len(names) == 1 else f"choose from {', '.join(map(quoted, names))}"


# Costs of one slip, in tenths of a changed letter. Swapped neighbours are the likeliest slip of the hand.
_EDIT, _SWAP, _PREFIX, _NO_GROUP, _OTHER_GROUP = 10, 7, 15, 2, 15
_LONGEST = 64


def closest(word: str, candidates: Iterable[str]) -> str | None:
    """Return the candidate that was most likely meant by a mistyped word, or None when none is near.

    Nearness is the edit distance with swapped neighbours counted as one slip; case and `-` for `_` do not
    count, and a dotted name (`signal.derivative`) is also found by its last part alone. On equal terms the
    same first letter wins, then the order of the candidates. Where none is near, a word that other programs
    use for one of them is taken.
    """
    if not 0 < len(word) <= _LONGEST:
        return None
    names = list(candidates)
    plain = _plain(word)
    found, least, same = None, _EDIT * _LONGEST, False
    for candidate in names:
        cost = _cost(plain, _plain(candidate), least)
        first = candidate[:1] == word[:1]
        if cost is not None and (cost < least or (cost == least and first and not same)):
            found, least, same = candidate, cost, first
    return found or synonym(word, names)


def _plain(word: str) -> str:
    return word.casefold().replace("-", "_").replace(" ", "_")


def _cost(word: str, candidate: str, limit: int) -> int | None:
    """Return how unlikely it is that `candidate` was meant, or None if it is above the limit."""
    whole = _distance(word, candidate, limit)
    if "." not in candidate:
        return whole
    more = _OTHER_GROUP if "." in word else _NO_GROUP
    tail = _distance(word.rpartition(".")[2], candidate.rpartition(".")[2], limit - more)
    if whole is None or tail is None:
        return whole if tail is None else tail + more
    return min(whole, tail + more)


def _distance(a: str, b: str, limit: int) -> int | None:
    """Return the optimal string alignment distance, or None above the limit or a third of the first word."""
    if a == b:
        return 0 if limit >= 0 else None
    short, long = sorted((len(a), len(b)))
    if short >= 3 and (a.startswith(b) or b.startswith(a)):
        cost = min(_PREFIX, _EDIT * (long - short))
        return cost if cost <= limit else None
    # A word that shares no letter is another word, however short.
    limit = min(limit, _EDIT * max(1, (len(a) + 1) // 3), _EDIT * long - 1)
    letters, others = set(a), set(b)
    least = max(long - short, len(letters - others), len(others - letters))
    if least * _EDIT > limit or long > _LONGEST:
        return None
    last: list[int] = []
    row = list(range(0, _EDIT * (len(b) + 1), _EDIT))
    for i, x in enumerate(a, 1):
        row, last = _next_row(i, x, a[i - 2] if i > 1 else "", b, row, last), row
        if min(row) > limit + _EDIT - _SWAP:
            return None
    return row[-1] if row[-1] <= limit else None


def _next_row(i: int, x: str, x_before: str, b: str, before: list[int], last: list[int]) -> list[int]:
    """Return the costs of making each beginning of `b` from `i` letters that end in `x_before`, `x`."""
    row = [_EDIT * i]
    y_before = ""
    for j, y in enumerate(b, 1):
        cost = before[j - 1] if x == y else _EDIT + min(before[j - 1], before[j], row[-1])
        if x == y_before and y == x_before and x_before:
            cost = min(cost, last[j - 2] + _SWAP)
        row.append(cost)
        y_before = y
    return row
