"""The code of a link's twins: what their methods call, and the text of the methods for a message's signals.

Compiled methods must name their arguments, so they are made as text of names, kinds and shapes alone.
"""

from __future__ import annotations

import hashlib
import linecache
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from quadvis.block import reached, uniform
from quadvis.block.signals import NO_FRAME
from quadvis.links.message import FRAME

WHOLE, LOST, SPOILT = range(3)  # the fates of a frame


def nanoseconds(time: Any) -> Any:
    """Return a time (s) in whole nanoseconds."""
    return round(time * 1e9)


def draw(self: Any) -> None:
    """Choose the fate and the delay of the next frame."""
    self.fate, self.delay = WHOLE, 0.0
    if self.jitter > 0.0 or self.loss > 0.0 or self.spoils > 0.0:
        self.delay = self.jitter * (1.0 - uniform(self.noise))
        is_lost = uniform(self.noise) < self.loss
        is_spoilt = uniform(self.noise) < self.spoils
        if is_lost:
            self.fate = LOST
        elif is_spoilt:
            self.fate = SPOILT


def arrival(self: Any, time: Any) -> Any:
    """Return when a frame comes that is sent now."""
    return max(self.last, max(time, self.through) + self.latency + self.delay)


def newest(whole: Any, stamps: Any, arrivals: Any, time: Any) -> Any:
    """Return the place of the newest entry that has come and was sent before now; -1 if there is none."""
    now = nanoseconds(time)
    for place in range(min(whole, stamps.size)):
        if stamps[place] < now and reached(time, arrivals[place]):
            return place
    return -1


def come(count: Any, arrivals: Any, time: Any) -> Any:
    """Return how many of so many instants have been reached; ``arrivals`` has the latest of them first."""
    place = 0
    while place < min(count, arrivals.size) and not reached(time, arrivals[place]):
        place += 1
    return count - place


class SignalShape(NamedTuple):
    """What decides over the code for one signal."""

    name: str
    scalar: str
    shape: tuple[int, ...]
    is_time: bool
    nan: bool

    @property
    def unit(self) -> str:
        """The unit of its ports."""
        return "s" if self.is_time else "1"

    @property
    def type(self) -> str:
        """Its type as a declaration writes it."""
        return self.scalar + (f"[{','.join(map(str, self.shape))}]" if self.shape else "")

    def ring(self, places: int) -> list[tuple[str, str]]:
        """Return the outputs of the sender that hold this signal of all entries, with their types."""
        if self.scalar == FRAME:
            return [(f"ring_{self.name}_{place}", FRAME) for place in range(places)]
        return [(f"ring_{self.name}", f"{self.scalar}[{','.join(map(str, (places, *self.shape)))}]")]


def common_ports(places: int) -> list[tuple[str, str]]:
    """Return the outputs of a sender about its frames, with their types."""
    return [
        ("whole", "int64"), ("stamps", f"int64[{places}]"), ("arrivals", f"float64[{places}]"),
        ("gaps", f"int64[{places}]"), ("spoilt", "int64"), ("spoilt_at", f"float64[{places}]"),
    ]  # fmt: skip


def port_unit(name: str) -> str:
    """Return the unit of one of the common ports."""
    return "s" if name in ("arrivals", "spoilt_at") else "1"


def initial_name(name: str) -> str:
    """Return the name of what holds a signal's value before the first message."""
    return f"initial_{name}"


def output_text(shapes: Sequence[SignalShape], places: int) -> Iterator[str]:
    """Yield the lines of a sender's ``output``: what is kept, and the frame that is sent now."""
    rings = _rings(shapes, places)
    frames = [shape for shape in shapes if shape.scalar == FRAME]
    yield f"def output(self, {', '.join(shape.name for shape in shapes)}, time):"
    yield "    whole, spoilt, comes = self.entries, self.wrong, arrival(self, time)"
    yield "    spoilt_at = self.kept_spoilt_at.copy()"
    for ring, kept, _ in rings:
        yield f"    {ring} = {kept}.copy()"
    for shape in frames:
        yield f"    {', '.join(name for name, _ in shape.ring(places))} = self.kept_{shape.name}"
    yield "    if self.fate == WHOLE:"
    for ring, kept, value in rings:
        yield f"        {ring}[1:] = {kept}[:-1]"
        yield f"        {ring}[0] = {value}"
    for shape in frames:
        names = [name for name, _ in shape.ring(places)]
        yield f"        {', '.join(names)} = {', '.join((shape.name, *names[:-1]))}"
    yield "        whole += 1"
    yield "    elif self.fate == SPOILT:"
    yield "        spoilt_at[1:] = self.kept_spoilt_at[:-1]"
    yield "        spoilt_at[0] = comes"
    yield "        spoilt += 1"
    found = [name for name, _ in common_ports(places)]
    found += [name for shape in shapes for name, _ in shape.ring(places)]
    yield f"    return {', '.join(found)}"


def update_text(shapes: Sequence[SignalShape], places: int) -> Iterator[str]:
    """Yield the lines of a sender's ``update``: the frame is kept, and the fate of the next one chosen."""
    yield f"def update(self, {', '.join(shape.name for shape in shapes)}, time):"
    yield "    comes, whole = arrival(self, time), self.entries"
    yield "    if self.fate == WHOLE:"
    for _, kept, value in _rings(shapes, places):
        yield f"        {kept}[1:] = {kept}[:-1].copy()"
        yield f"        {kept}[0] = {value}"
    for shape in shapes:
        if shape.scalar == FRAME:
            yield f"        self.kept_{shape.name} = ({shape.name}, *self.kept_{shape.name}[:-1])"
    yield "        self.entries += 1"
    yield "    elif self.fate == SPOILT:"
    yield "        self.kept_spoilt_at[1:] = self.kept_spoilt_at[:-1].copy()"
    yield "        self.kept_spoilt_at[0] = comes"
    yield "        self.wrong += 1"
    yield "    self.through = max(time, self.through) + self.latency"
    yield "    self.last = comes"
    yield "    self.sent += 1"
    yield "    draw(self)"


def _rings(shapes: Sequence[SignalShape], places: int) -> list[tuple[str, str, str]]:
    """Return what is kept of each entry: the variable, the state, and the new value in terms of a method."""
    found = [
        ("stamps", "self.kept_stamps", "nanoseconds(time)"),
        ("arrivals", "self.kept_arrivals", "comes"),
        ("gaps", "self.kept_gaps", "self.sent - whole"),
    ]
    plain = [shape.name for shape in shapes if shape.scalar != FRAME]
    return found + [(f"ring_{name}", f"self.kept_{name}", name) for name in plain]


def receive_text(shapes: Sequence[SignalShape], places: int) -> Iterator[str]:
    """Yield the lines of a receiver's ``output``."""
    names = [name for name, _ in common_ports(places)]
    names += [name for shape in shapes for name, _ in shape.ring(places)]
    yield f"def output(self, {', '.join(names)}, time):"
    yield "    at = newest(whole, stamps, arrivals, time)"
    for shape in shapes:
        name = shape.name
        if shape.scalar == FRAME:
            yield f"    {name} = NO_FRAME"
        elif shape.shape:
            yield f"    {name} = self.{initial_name(name)}.copy()"
        else:
            yield f"    {name} = self.{initial_name(name)}"
    yield "    stamp, lost = 0, 0"
    yield "    if at >= 0:"
    yield "        stamp, lost = stamps[at], gaps[at]"
    for shape in shapes:
        name = shape.name
        if shape.scalar == FRAME:
            yield f"        {name} = ({', '.join(port for port, _ in shape.ring(places))},)[at]"
        elif shape.shape:
            yield f"        {name}[...] = ring_{name}[at]"
        else:
            yield f"        {name} = ring_{name}[at]{' != 0' if shape.scalar == 'bool' else ''}"
    found = [shape.name for shape in shapes]
    yield f"    return {', '.join(found)}, time - stamp * 1e-9, lost, come(spoilt, spoilt_at, time)"


SCOPE = {
    "NO_FRAME": NO_FRAME, "SPOILT": SPOILT, "WHOLE": WHOLE, "arrival": arrival, "come": come, "draw": draw,
    "nanoseconds": nanoseconds, "newest": newest,
}  # fmt: skip


def methods_of(text: str) -> dict[str, Any]:
    """Return the functions of a text, whose lines Python finds as it finds those of a file."""
    name = f"<link {hashlib.sha256(text.encode()).hexdigest()[:16]}>"
    linecache.cache[name] = (len(text), None, text.splitlines(keepends=True), name)
    scope: dict[str, Any] = dict(SCOPE)
    exec(compile(text, name, "exec", dont_inherit=True), scope)
    return {method: scope[method] for method in ("output", "update") if method in scope}
