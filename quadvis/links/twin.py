"""The twins of a link in a simulation: a sender and a receiver, as blocks made for the link's message.

The sender keeps the last whole frames, with the instants at which they come; the receiver gives the newest
that has come by now and was sent before now, to the nanosecond. A frame waits until the one before it is
through, takes 10 bits a byte, and comes up to ``jitter`` later; it never overtakes another one. A frame that
is lost or spoilt takes its time, too. The newest entry stands at place 0, the one before it at place 1; there
are more places than frames can be on their way. So nothing rotates, and a steady loop is one for an analysis.

Each message has classes of its own, made once; `twin_code` has their methods.
"""

from __future__ import annotations

import functools
import keyword
import math
from typing import Any

from quadvis.block import Block, Derived, In, Out, Param, Random, State
from quadvis.block.interface import RESERVED
from quadvis.links.link import Link
from quadvis.links.message import FRAME, MessageSignal
from quadvis.links.twin_code import (
    SCOPE,
    SignalShape,
    common_ports,
    draw,
    initial_name,
    methods_of,
    output_text,
    port_unit,
    receive_text,
    update_text,
)

COUNTERS = ("age", "lost", "refused")  # the outputs of a receiver beside the signals


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
            setattr(made, initial_name(signal.name), signal.initial)
    found: ReceiverTwin = made
    return found


def rings(link: Link) -> dict[str, str]:
    """Return the inputs of a receiver by the outputs of its sender, which have the same names."""
    names = [port for port, _ in common_ports(places_of(link))]
    for shape in _shapes(link):
        names += [port for port, _ in shape.ring(places_of(link))]
    return {name: name for name in names}


def _shapes(link: Link) -> tuple[SignalShape, ...]:
    return tuple(
        SignalShape(signal.name, signal.scalar, signal.shape, _is_time(signal), signal.nan)
        for signal in link.message.signals
    )


def _is_time(signal: MessageSignal) -> bool:
    """Say whether all elements are seconds: an analysis takes such outputs for instants."""
    return bool(signal.units) and all(str(unit) == "s" for unit in signal.units)


def count_ports() -> dict[str, Out]:
    """Return the outputs of a receiver beside the signals."""
    return {
        "age": Out(
            unit="s", doc="time since the newest message was sent, or since the start before the first"
        ),
        "lost": Out("int64", doc="frames that did not come whole, up to the newest one that did"),
        "refused": Out("int64", doc="frames that came and were not whole"),
    }


_LOCAL = {"at", "comes", "stamp", "max"}
_PREFIXES = ("ring_", "kept_", "initial_")


def is_taken(name: str) -> bool:
    """Say whether a signal of a message cannot have a name, since the twins' own code has it."""
    own = {
        *RESERVED,
        *COUNTERS,
        *SCOPE,
        *_LOCAL,
        *dir(SenderTwin),
        *dir(ReceiverTwin),
        *dict(common_ports(1)),
    }
    return name in own or name.startswith(_PREFIXES) or keyword.iskeyword(name)


@functools.cache
def _sender_class(shapes: tuple[SignalShape, ...], places: int) -> type[SenderTwin]:
    signals = {shape.name: In(shape.type, unit=shape.unit) for shape in shapes}
    outputs: dict[str, Any] = {name: Out(kind, unit=port_unit(name)) for name, kind in common_ports(places)}
    states: dict[str, Any] = {
        f"kept_{name}": State(kind) for name, kind in common_ports(places) if kind.endswith("]")
    }
    for shape in shapes:
        for name, kind in shape.ring(places):
            outputs[name] = Out(kind, unit=shape.unit, nan=True)
        kept = f"frame[{places}]" if shape.scalar == FRAME else shape.ring(places)[0][1]
        states[f"kept_{shape.name}"] = State(kept)
    methods = methods_of("\n".join((*output_text(shapes, places), *update_text(shapes, places))))
    members = {**signals, **outputs, **states, **methods, "__module__": __name__}
    members["start"] = _start
    numeric = not any(shape.scalar == FRAME for shape in shapes)
    return type("SenderTwin", (SenderTwin,), members, numeric=numeric)


def _start(self: Any) -> None:
    """Choose the fate of the first frame."""
    draw(self)


@functools.cache
def _receiver_class(shapes: tuple[SignalShape, ...], places: int) -> type[ReceiverTwin]:
    inputs = {name: In(kind, unit=port_unit(name)) for name, kind in common_ports(places)}
    initials: dict[str, Any] = {}
    for shape in shapes:
        inputs |= {name: In(kind, unit=shape.unit) for name, kind in shape.ring(places)}
        if shape.scalar != FRAME:
            initials[initial_name(shape.name)] = Derived(shape.type)
    outputs = {shape.name: Out(shape.type, unit=shape.unit, nan=shape.nan) for shape in shapes}
    methods = methods_of("\n".join(receive_text(shapes, places)))
    members = {**inputs, **initials, **outputs, **count_ports(), **methods, "__module__": __name__}
    numeric = not any(shape.scalar == FRAME for shape in shapes)
    return type("ReceiverTwin", (ReceiverTwin,), members, numeric=numeric)
