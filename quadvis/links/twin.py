"""The twins of a link in a simulation: a sender and a receiver, as blocks made for the link's message.

The sender keeps the last whole frames, with the instants at which they come; the receiver gives the newest
that has come by now and was sent before now, to the nanosecond. A frame waits until the one before it is
through, takes 10 bits a byte, and comes up to ``jitter`` later; it never overtakes another one. A frame that
is lost or spoilt takes its time, too. The newest entry stands at place 0, the one before it at place 1; there
are more places than frames can be on their way. So nothing rotates, and a steady loop is one for an analysis.

The classes are made as text, since compiled methods must name their arguments; equal messages share one.
"""

from __future__ import annotations

import functools
import hashlib
import keyword
import linecache
import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from quadvis.block import Block, Derived, In, Out, Param, Random, State, reached, uniform
from quadvis.block.block import RESERVED
from quadvis.block.signals import NO_FRAME
from quadvis.links.link import Link
from quadvis.links.message import FRAME, MessageSignal

WHOLE, LOST, SPOILT = range(3)  # the fates of a frame
COUNTERS = ("age", "lost", "refused")  # the outputs of a receiver beside the signals


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


class SenderTwin(Block, numeric=False):
    """Sends one message at each of its ticks over a link that is simulated."""

    link: Link
    latency = Param(unit="s", min=0.0, doc="time of a frame on the line")
    jitter = Param(unit="s", min=0.0, doc="the most that a frame is late besides")
    loss = Param(min=0.0, max=1.0, doc="share of the frames that never come")
    spoils = Param(min=0.0, max=1.0, doc="share of the frames that come with a wrong bit")
    noise = Random()
    fate = State("int64", doc="of the next frame")
    delay = State(unit="s", doc="of the next frame")
    sent = State("int64", doc="frames so far")
    entries = State("int64", doc="whole ones among them")
    wrong = State("int64", doc="spoilt ones among them")
    through = State(unit="s", doc="when the line is free")
    last = State(unit="s", doc="when the last frame comes")


class ReceiverTwin(Block, numeric=False):
    """Gives the newest message of a link that is simulated, its age, and the counts of frames."""

    link: Link
    stepwise = True


def places_of(link: Link) -> int:
    """Return how many frames a sender keeps: those on their way, the newest that has come, one to spare."""
    return max(1, math.ceil((link.latency + link.jitter) / float(link.period))) + 2


def sender_twin(link: Link) -> SenderTwin:
    """Return the sender of a link."""
    made: Any = _sender_class(_shapes(link), places_of(link))(
        latency=link.latency, jitter=link.jitter, loss=link.loss, spoils=link.spoilt
    )
    made.link = link
    found: SenderTwin = made
    return found


def receiver_twin(link: Link) -> ReceiverTwin:
    """Return the receiver of a link."""
    made: Any = _receiver_class(_shapes(link), places_of(link))()
    made.link = link
    for signal in link.message.signals:
        if signal.scalar != FRAME:
            setattr(made, _initial(signal.name), signal.initial)
    found: ReceiverTwin = made
    return found


def rings(link: Link) -> dict[str, str]:
    """Return the inputs of a receiver by the outputs of its sender, which have the same names."""
    names = [port for port, _ in _common(places_of(link))]
    for shape in _shapes(link):
        names += [port for port, _ in shape.ring(places_of(link))]
    return {name: name for name in names}


class _Shape(NamedTuple):
    """What decides over the code for one signal."""

    name: str
    scalar: str
    shape: tuple[int, ...]
    is_time: bool
    nan: bool

    @property
    def unit(self) -> str:
        return "s" if self.is_time else "1"

    @property
    def type(self) -> str:
        return self.scalar + (f"[{','.join(map(str, self.shape))}]" if self.shape else "")

    def ring(self, places: int) -> list[tuple[str, str]]:
        """Return the outputs of the sender that hold this signal of all entries, with their types."""
        if self.scalar == FRAME:
            return [(f"ring_{self.name}_{place}", FRAME) for place in range(places)]
        return [(f"ring_{self.name}", f"{self.scalar}[{','.join(map(str, (places, *self.shape)))}]")]


def _shapes(link: Link) -> tuple[_Shape, ...]:
    return tuple(
        _Shape(signal.name, signal.scalar, signal.shape, _is_time(signal), signal.nan)
        for signal in link.message.signals
    )


def _is_time(signal: MessageSignal) -> bool:
    """Say whether all elements are seconds: an analysis takes such outputs for instants."""
    return bool(signal.units) and all(str(unit) == "s" for unit in signal.units)


def _common(places: int) -> list[tuple[str, str]]:
    """Return the outputs of a sender about its frames, with their types."""
    return [
        ("whole", "int64"), ("stamps", f"int64[{places}]"), ("arrivals", f"float64[{places}]"),
        ("gaps", f"int64[{places}]"), ("spoilt", "int64"), ("spoilt_at", f"float64[{places}]"),
    ]  # fmt: skip


def _port_unit(name: str) -> str:
    return "s" if name in ("arrivals", "spoilt_at") else "1"


def _initial(name: str) -> str:
    return f"initial_{name}"


def count_ports() -> dict[str, Out]:
    """Return the outputs of a receiver beside the signals."""
    return {
        "age": Out(
            unit="s", doc="time since the newest message was sent, or since the start before the first"
        ),
        "lost": Out("int64", doc="frames that did not come whole, up to the newest one that did"),
        "refused": Out("int64", doc="frames that came and were not whole"),
    }


_SCOPE = {
    "NO_FRAME": NO_FRAME, "SPOILT": SPOILT, "WHOLE": WHOLE, "arrival": arrival, "come": come, "draw": draw,
    "nanoseconds": nanoseconds, "newest": newest,
}  # fmt: skip
_LOCAL = {"at", "comes", "stamp", "max"}
_PREFIXES = ("ring_", "kept_", "initial_")


def is_taken(name: str) -> bool:
    """Say whether a signal of a message cannot have a name, since the twins' own code has it."""
    own = {*RESERVED, *COUNTERS, *_SCOPE, *_LOCAL, *dir(SenderTwin), *dir(ReceiverTwin), *dict(_common(1))}
    return name in own or name.startswith(_PREFIXES) or keyword.iskeyword(name)


@functools.cache
def _sender_class(shapes: tuple[_Shape, ...], places: int) -> type[SenderTwin]:
    signals = {shape.name: In(shape.type, unit=shape.unit) for shape in shapes}
    outputs: dict[str, Any] = {name: Out(kind, unit=_port_unit(name)) for name, kind in _common(places)}
    states: dict[str, Any] = {
        f"kept_{name}": State(kind) for name, kind in _common(places) if kind.endswith("]")
    }
    for shape in shapes:
        for name, kind in shape.ring(places):
            outputs[name] = Out(kind, unit=shape.unit, nan=True)
        kept = f"frame[{places}]" if shape.scalar == FRAME else shape.ring(places)[0][1]
        states[f"kept_{shape.name}"] = State(kept)
    methods = _methods("\n".join((*_output_text(shapes, places), *_update_text(shapes, places))))
    members = {**signals, **outputs, **states, **methods, "__module__": __name__}
    members["start"] = _start
    numeric = not any(shape.scalar == FRAME for shape in shapes)
    return type("SenderTwin", (SenderTwin,), members, numeric=numeric)


def _start(self: Any) -> None:
    """Choose the fate of the first frame."""
    draw(self)


def _output_text(shapes: Sequence[_Shape], places: int) -> Iterator[str]:
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
    found = [name for name, _ in _common(places)]
    found += [name for shape in shapes for name, _ in shape.ring(places)]
    yield f"    return {', '.join(found)}"


def _update_text(shapes: Sequence[_Shape], places: int) -> Iterator[str]:
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


def _rings(shapes: Sequence[_Shape], places: int) -> list[tuple[str, str, str]]:
    """Return what is kept of each entry: the variable, the state, and the new value in terms of a method."""
    found = [
        ("stamps", "self.kept_stamps", "nanoseconds(time)"),
        ("arrivals", "self.kept_arrivals", "comes"),
        ("gaps", "self.kept_gaps", "self.sent - whole"),
    ]
    plain = [shape.name for shape in shapes if shape.scalar != FRAME]
    return found + [(f"ring_{name}", f"self.kept_{name}", name) for name in plain]


@functools.cache
def _receiver_class(shapes: tuple[_Shape, ...], places: int) -> type[ReceiverTwin]:
    inputs = {name: In(kind, unit=_port_unit(name)) for name, kind in _common(places)}
    initials: dict[str, Any] = {}
    for shape in shapes:
        inputs |= {name: In(kind, unit=shape.unit) for name, kind in shape.ring(places)}
        if shape.scalar != FRAME:
            initials[_initial(shape.name)] = Derived(shape.type)
    outputs = {shape.name: Out(shape.type, unit=shape.unit, nan=shape.nan) for shape in shapes}
    methods = _methods("\n".join(_receive_text(shapes, places)))
    members = {**inputs, **initials, **outputs, **count_ports(), **methods, "__module__": __name__}
    numeric = not any(shape.scalar == FRAME for shape in shapes)
    return type("ReceiverTwin", (ReceiverTwin,), members, numeric=numeric)


def _receive_text(shapes: Sequence[_Shape], places: int) -> Iterator[str]:
    names = [name for name, _ in _common(places)]
    names += [name for shape in shapes for name, _ in shape.ring(places)]
    yield f"def output(self, {', '.join(names)}, time):"
    yield "    at = newest(whole, stamps, arrivals, time)"
    for shape in shapes:
        name = shape.name
        if shape.scalar == FRAME:
            yield f"    {name} = NO_FRAME"
        elif shape.shape:
            yield f"    {name} = self.{_initial(name)}.copy()"
        else:
            yield f"    {name} = self.{_initial(name)}"
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


def _methods(text: str) -> dict[str, Any]:
    """Return the functions of a text, whose lines Python finds as it finds those of a file."""
    name = f"<link {hashlib.sha256(text.encode()).hexdigest()[:16]}>"
    linecache.cache[name] = (len(text), None, text.splitlines(keepends=True), name)
    scope: dict[str, Any] = dict(_SCOPE)
    exec(compile(text, name, "exec", dont_inherit=True), scope)
    return {method: scope[method] for method in ("output", "update") if method in scope}
