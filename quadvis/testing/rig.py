"""One block with many parameters and many inputs, for the conformance suite."""

from __future__ import annotations

import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any

import numpy as np

from quadvis.block import (
    ANY,
    Block,
    Frame,
    In,
    Interface,
    Param,
    ParameterError,
    Shape,
    Sizes,
    parameter_sizes,
)
from quadvis.engine.engine import Engine
from quadvis.engine.interpreter import Call
from quadvis.engine.layout import TIME, Placed
from quadvis.engine.memory import SLOT, Memory, Slot
from quadvis.testing.alone import ALONE, alone

STEPS = 16
PERIOD = Fraction(1, 10)
VECTOR = 3  # length of an axis that may have any length
BOOL = In("bool").signal
SCALES = (0.1, 1.0, 10.0)  # of random numbers
GARBAGE = {"float64": np.nan, "int64": -(2**40)}
Whole = tuple[bytes, tuple[Any, ...]]


@dataclass(frozen=True)
class Subject:
    """A block class to be checked, with the values that the suite cannot invent.

    ``given`` has values of parameters, at least of all parameters without a default. ``inputs`` has a list of
    values for each input that random numbers do not suit; the steps take them in turn. ``test`` is the path
    where the test of the block should be.
    """

    block: type[Block]
    given: Mapping[str, Any] = field(default_factory=dict)
    inputs: Mapping[str, Sequence[Any]] = field(default_factory=dict)
    test: Any = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "block", self.block.with_ports(self.given))

    def of_any_number(self, counts: Sequence[int]) -> list[Subject]:
        """Return the subject with each of some numbers of signals at its inputs of any number.

        Numbers that contradict parameters are left out.
        """
        many = self.block.interface.many
        found = []
        for count in counts if many else ():
            entries = dict.fromkeys(many, count)
            try:
                self.block(period=float(PERIOD), **self.given).with_entries(**entries)
            except ParameterError:
                continue
            found.append(replace(self, block=self.block.with_ports(self.given, entries)))
        assert found or not many, f"{' and '.join(many)} must take one of {counts} signals"
        return found if many else [self]

    def make(self, **parameters: Any) -> Block:
        """Return the block with some parameters, the others as given or at their defaults.

        ParameterError if the parameters contradict each other or ``PERIOD``.
        """
        return self.block(period=float(PERIOD), **{**self.given, **parameters})


@dataclass
class Rig:
    """A block alone in an engine, and its inputs, a value of each for each step."""

    engine: Engine
    series: list[dict[str, Any]]

    @property
    def memory(self) -> Memory:
        """The memory of the engine."""
        return self.engine.memory

    @property
    def placed(self) -> Placed:
        """The block's place in memory."""
        return self.engine.program[ALONE]

    @property
    def interface(self) -> Interface:
        """The declarations of the block, which may differ between rigs if ports depend on parameters."""
        return self.engine.graph[ALONE].block.interface

    @property
    def block(self) -> Any:
        """The block as its methods see it."""
        return self.engine.bound(ALONE)

    def call(self, method: str) -> Call | None:
        """Return a function that calls a method from slots to slots; None if the block has no such method."""
        return self.engine.call(ALONE, method)

    def feed(self, step: int) -> None:
        """Write the inputs of a step, and call ``read`` of the block, as at the beginning of a tick."""
        for name, value in self.series[step].items():
            self.memory.write(self.placed.inputs[name], value)
        read = self.call("read")
        if read is not None:
            read()

    def record(self) -> bytes:
        """Return the bytes of the block's parameters and states."""
        start = self.placed.position * SLOT
        return bytes(self.memory.raw[start : start + self.placed.record.kept * SLOT])

    def whole(self) -> Whole:
        """Return all of memory, Work included, and all frames, for `put_back` in the middle of a tick."""
        return bytes(self.memory.raw), tuple(self.memory.frames)

    def put_back(self, whole: Whole) -> None:
        """Restore the memory and frames that `whole` returned."""
        self.memory.raw[:], self.memory.frames[:] = whole

    def spoil_work(self) -> None:
        """Write useless values into the block's Work: NaN, a number far below 0, the other truth value."""
        memory = self.memory
        for name, work in self.engine.graph[ALONE].block.interface.work.items():
            slot, scalar = self.placed.field(name), work.signal.scalar
            memory.write(slot, ~memory.view(slot) if scalar == "bool" else GARBAGE[scalar])

    def contents(self) -> tuple[Any, ...]:
        """Return all of memory except Work, and all frames, in a form that can be compared."""
        memory = self.memory
        frames = [(frame.pixels.shape, frame.pixels.tobytes()) for frame in memory.frames]
        return memory.content(), frames, [(repr(frame.stamp), frame.sequence) for frame in memory.frames]

    def run(self, steps: range) -> list[tuple[Any, ...]]:
        """Return the contents after each step."""
        found = []
        for step in steps:
            self.feed(step)
            self.engine.run(1)
            found.append(self.contents())
        return found


def sources(placed: Placed, names: Sequence[str]) -> list[Slot]:
    """Return the slots of a method's arguments."""
    return [TIME if name == "time" else placed.inputs[name] for name in names]


def targets(placed: Placed, method: str) -> Mapping[str, Slot]:
    """Return the slots of the results of a method, by name."""
    return {"output": placed.outputs, "deriv": placed.slopes}.get(method, {})


def rigs(subject: Subject, *, missing: bool = False) -> Iterator[Rig]:
    """Yield a rig for every shape and choice; with ``missing``, some numbers in the inputs are NaN.

    A subject has the same rigs at every call.
    """
    interface = subject.block.interface
    declared = (*interface.inputs.values(), *interface.outputs.values(), *interface.params.values())
    free = any(item.signal.shape == ANY for item in declared)
    for shape in ((), (VECTOR,)) if free else ((),):
        for parameters in _parameters(subject, shape):
            yield _rig(subject, subject.make(**parameters), {"*": shape} if free else {}, STEPS, missing)


def extreme_rigs(subject: Subject) -> Iterator[tuple[str, Any, Rig]]:
    """Yield each parameter with each extreme value that the block accepts, and a rig with that value.

    The rig has inputs for one step.
    """
    params = subject.block.interface.params
    arrays = {
        name: param.default
        for name, param in params.items()
        if param.signal.shape == ANY and name not in subject.given
    }
    sizes = parameter_sizes(subject.make())
    for name, param in params.items():
        for value in () if param.is_text or param.choices else _extremes(param, sizes):
            try:
                block = subject.make(**arrays | {name: value})
            except ParameterError:
                continue
            yield name, value, _rig(subject, block, {"*": ()}, steps=1)


def _extremes(param: Param, sizes: Sizes) -> Iterator[Any]:
    """Yield values at the bounds of a parameter, and values far beyond any that a person would choose."""
    bounds = [bound for bound in (param.min, param.max) if bound is not None]
    bounds += [
        float(np.nextafter(bound, way))
        for bound, way in ((param.above, np.inf), (param.below, -np.inf))
        if bound is not None
    ]
    whole = param.signal.scalar == "int64"
    numbers = [0, 1, -1, 10**6, 2**62] if whole else [0.0, 1e-300, 1e-9, 1.0, -1.0, 1e3, 1e9, -1e9, 1e300]
    shape = param.signal.resolve(sizes | {"*": ()})
    for number in dict.fromkeys((*bounds, *numbers)):
        yield np.full(shape, number).tolist()


def _rig(subject: Subject, block: Block, sizes: Sizes, steps: int, missing: bool = False) -> Rig:
    interface = block.interface  # its own: kinds and units of ports may depend on parameters
    sizes |= parameter_sizes(block)
    for name, values in subject.inputs.items():
        interface.inputs[name].signal.unify(np.shape(values[0]), sizes)
    groups = (interface.inputs, interface.outputs, interface.states, interface.work)
    for item in (item for group in groups for item in group.values()):
        for size in item.signal.symbols:
            if size != "*":
                sizes.setdefault(size, VECTOR)
    series = _series(subject, interface.inputs, sizes, steps, missing)
    return Rig(alone(block, series[0], sizes, PERIOD, seed=1), series)


def _parameters(subject: Subject, shape: Shape) -> Iterator[dict[str, Any]]:
    """Yield the defaults, each other choice, and for a numeric block random numbers within the bounds.

    Choices that contradict other parameters are left out.
    """
    params = {
        name: param for name, param in subject.block.interface.params.items() if name not in subject.given
    }
    every = {
        name: np.full(shape, param.default).tolist()
        for name, param in params.items()
        if param.signal.shape == ANY
    }
    arrays = {name: value for name, value in every.items() if not params[name].signal.optional}
    yield arrays
    others = [every] if shape and every != arrays else []
    others += [{name: value} for name, param in params.items() for value in _choices(param)]
    real = {name: param for name, param in params.items() if param.signal.scalar == "float64"}
    if subject.block.numeric and real:
        others.append({name: _shaken(param, shape) for name, param in real.items()})
    for other in others:
        try:
            subject.make(**arrays | other)
        except ParameterError:
            continue
        yield arrays | other


def _choices(param: Param) -> list[Any]:
    """Return the values of a parameter other than its default, if it has choices or is true or false."""
    values: tuple[Any, ...] = (False, True) if param.signal == BOOL else param.choices
    return [value for value in values if value != param.default]


def _shaken(param: Param, shape: Shape) -> Any:
    """Return random numbers near the default and within the inclusive bounds."""
    rng = np.random.default_rng(zlib.crc32(param.name.encode()))
    default = np.asarray(param.default, float)
    if param.signal.shape == ANY:
        default = np.broadcast_to(default, shape)
    factor = rng.uniform(0.6, 1.4, default.shape)
    value = np.where(default == 0.0, factor, factor * default)
    least, most = -np.inf if param.min is None else param.min, np.inf if param.max is None else param.max
    return np.clip(value, least, most).tolist()


def _series(
    subject: Subject, inputs: Mapping[str, In], sizes: Sizes, steps: int, missing: bool
) -> list[dict[str, Any]]:
    rng = np.random.default_rng(zlib.crc32(subject.block.__name__.encode()))
    series: list[dict[str, Any]] = []
    for step in range(steps):
        row: dict[str, Any] = {}
        for name, port in inputs.items():
            if name in subject.inputs:
                row[name] = subject.inputs[name][step % len(subject.inputs[name])]
            elif series and rng.random() < 0.3:
                row[name] = series[-1][name]
            else:
                row[name] = _random(port, port.signal.resolve(sizes), rng, step, missing)
        series.append(row)
    return series


def _random(port: In, shape: Shape, rng: np.random.Generator, step: int, missing: bool) -> Any:
    if port.signal.scalar == "frame":
        pixels = rng.integers(0, 256, (48, 64, 3), np.uint8)
        return Frame(pixels, float(step * PERIOD), step + 1) if rng.random() < 0.8 else Frame.none()
    if port.signal.scalar == "bool":
        return rng.random(shape) < 0.7
    if port.signal.scalar == "int64":
        return rng.integers(-2, 9, shape)
    value = rng.normal(size=shape) * SCALES[rng.integers(len(SCALES))]
    return np.where(rng.random(shape) < 0.1, np.nan, value) if missing else value
