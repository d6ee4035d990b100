"""Run a single block without a diagram, for unit tests and for experiments."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np

from quadvis.block import ANY, Block, entry_name, parameter_sizes
from quadvis.engine.engine import Engine
from quadvis.engine.memory import Slot
from quadvis.native.choice import PYTHON, choose, use
from quadvis.testing.alone import ALONE, alone
from quadvis.units import parse_period


class Driven:
    """The results of a driven block: one attribute per output, with a leading time axis, and ``time`` (s)."""

    def __init__(self, time: np.ndarray[Any, Any], signals: dict[str, Any], engine: Engine) -> None:
        self.time = time
        self.signals = signals
        self.engine = engine

    def __getattr__(self, name: str) -> Any:
        try:
            return self.__dict__["signals"][name]
        except KeyError:
            raise AttributeError(f"the block has no output '{name}'") from None

    def state(self, name: str) -> Any:
        """Return the value of a state or of a parameter after the last step."""
        return self.engine.read(ALONE, name)


def drive(
    block: Block,
    *,
    rate: str | float | Fraction = 1,
    steps: int | None = None,
    solver: str = "ode4",
    seed: int = 0,
    engine: str = PYTHON,
    **inputs: Any,
) -> Driven:
    """Feed a block step by step and return its outputs.

    Each input is one constant value or an array (a list for frames) with a leading time axis; an input of any
    number is a list of them. ``rate`` is a
    rate such as "10 Hz", a period such as "5 ms", or a number in Hz. ``steps`` is needed if no input has a
    time axis. ``engine`` is that of a run; "native" runs the block's machine code, as a flight does.
    TypeError if an input is unknown or missing, or if its shape does not fit. QuadvisError if the engine
    cannot be had.
    """
    known = block.interface.inputs
    for name in inputs:
        if name not in known:
            names = ", ".join(known) or "none"
            raise TypeError(f"{type(block).__name__} has no input '{name}'; it has {names}")
    many = {name: inputs.pop(name) for name in block.interface.many if name in inputs}
    if many:
        block = block.with_entries(**{name: len(values) for name, values in many.items()})
    for name, values in many.items():
        inputs |= {entry_name(name, number): value for number, value in enumerate(values)}
    interface = block.interface
    sizes = parameter_sizes(block)
    series = {}
    for name, port in interface.inputs.items():
        value = inputs.get(name, port.default)
        if value is None:
            raise TypeError(f"{type(block).__name__} needs its input '{name}'")
        series[name] = series_of(name, port.signal, value, sizes)
    counts = {len(values) for values, constant in series.values() if not constant}
    if len(counts) > 1 or (not counts and steps is None):
        raise TypeError("inputs must have one length, or give steps")
    if counts and not 0 < (steps or 1) <= min(counts):
        raise TypeError("inputs must have at least one sample, and one for each of the steps")
    count = steps if steps is not None else counts.pop()
    period = parse_period(rate) if isinstance(rate, str) else 1 / Fraction(str(rate))
    first = {name: values[0] for name, (values, _) in series.items()}
    made = alone(block, first, sizes, period, solver, seed)
    use(made, choose(made, count, engine))
    return _drive(made, series, count)


def series_of(name: str, signal: Any, value: Any, sizes: dict[str, Any]) -> tuple[Any, bool]:
    """Return the values of an input, and whether they are one constant value."""
    if signal.scalar == "frame":
        return (value, False) if isinstance(value, list | tuple) else ([value], True)
    array = np.asarray(value)
    trial = dict(sizes)
    # Of an input that also takes scalars, [n?], a list has a time axis.
    whole = signal.shape != ANY and not (signal.optional and array.ndim)
    if whole and signal.unify(array.shape, trial):
        sizes.update(trial)
        return array[None], True
    if signal.shape == ANY and (array.ndim == 0 or sizes.get("*") == array.shape):
        # A scalar for a block of any shape is a constant: it takes the shape of the other inputs.
        return array[None], True
    if array.ndim == 0 or not signal.unify(array.shape[1:], sizes):
        raise TypeError(f"input '{name}' has shape {array.shape}, the block wants {signal}")
    return array, False


def _drive(engine: Engine, series: dict[str, tuple[Any, bool]], count: int) -> Driven:
    memory, block = engine.memory, engine.program[ALONE]
    rows: dict[str, list[Any]] = {name: [] for name in block.outputs}
    with engine:
        for k in range(count):
            for name, (values, constant) in series.items():
                memory.write(block.inputs[name], values[0 if constant else k])
            engine.run(1)
            for name, slot in block.outputs.items():
                rows[name].append(memory.read(slot))
    time = np.array([float(k * engine.period) for k in range(count)])
    signals = {name: _array(rows[name], slot) for name, slot in block.outputs.items()}
    return Driven(time, signals, engine)


def _array(rows: list[Any], slot: Slot) -> Any:
    """Return the values with a leading time axis; frames stay a list."""
    return rows if slot.scalar == "frame" else np.array(rows, slot.scalar).reshape(-1, *slot.shape)
