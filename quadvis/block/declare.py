"""The declarations of a block class: ports, states and parameters, with types, units and bounds."""

from __future__ import annotations

import enum
import math
import operator
import re
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadvis.block.signals import ANY, SCALARS, SignalType
from quadvis.errors import QuadvisError, sentence, suggestion
from quadvis.machine.datagrams import UDP, Address
from quadvis.units import parse_units

PORT_WANTED = "the path of a port, such as /dev/ttyUSB0, udp:HOST:PORT or pty:NAME"
CABLE_PORT = re.compile(r"pty:[A-Za-z_]\w*")


def entry_name(port: str, number: int) -> str:
    """Return the name of the input that is one signal of an input of any number."""
    return f"{port}[{number}]"


class ParameterError(QuadvisError):
    """A refused value: ``parameter`` is the name of the parameter, the text says what would be right."""

    def __init__(self, parameter: str, message: str) -> None:
        super().__init__(message)
        self.parameter = parameter


@dataclass(eq=False)
class Declared:
    """Base class of all declarations; a declaration takes the name of its class attribute."""

    type: str
    unit: str = "1"
    doc: str = field(default="", kw_only=True)
    name: str = field(default="", init=False)

    def __post_init__(self) -> None:
        self.signal = SignalType.parse(self.type)
        self.units = parse_units(self.unit)
        if self.signal.scalar == "frame" and self.signal.shape and not isinstance(self, State):
            problem = f"{type(self).__name__} cannot be '{self.type}': only a state holds several frames"
            raise TypeError(sentence(problem, "write frame"))
        if self.signal.is_sum or self.signal.optional or "*" in self.signal.shape[1:]:
            self._check_sizes()

    def _check_sizes(self) -> None:
        """Refuse sizes from which no length could follow."""
        signal, kind = self.signal, type(self).__name__
        if signal.is_sum and isinstance(self, In | Param):
            problem = f"{kind} cannot be '{self.type}': of a sum nobody knows the parts"
            raise TypeError(sentence(problem, "give it a size of its own"))
        if "*" in signal.shape[1:] and not isinstance(self, State | Work):
            problem = f"{kind} cannot be '{self.type}': only a state holds several values of any shape"
            raise TypeError(sentence(problem, "write [*]"))
        if signal.optional and not isinstance(self, Param if signal.shape == ANY else In):
            problem = f"{kind} cannot be '{self.type}'"
            raise TypeError(sentence(problem, "only a parameter can be [*?], only an input [n?]"))

    def __set_name__(self, owner: Any, name: str) -> None:
        self.name = name

    def __get__(self, block: Any, owner: Any = None) -> Any:
        if block is None:
            return self
        try:
            return block.__dict__[self.name]
        except KeyError:
            problem = f"{type(block).__name__}.{self.name} has no value before the block runs"
            raise AttributeError(problem) from None

    def __set__(self, block: Any, value: Any) -> None:
        block.__dict__[self.name] = value


@dataclass(eq=False)
class In(Declared):
    """An input port. A port with a ``default`` may stay unconnected.

    ``*inputs`` of a method means all inputs; of ``output``, all but those with ``direct=False``.

    With ``many=True`` it takes any number of signals, one at least: ``u = In("float64[*]", many=True)``. A
    diagram lists them, ``in: {u: [left.y, right.y]}``. The class has an input for each, ``u[0]``, ``u[1]``,
    as soon as their number is known; a method that asks for ``*u`` gets them as a tuple, in that order.
    """

    type: str = "float64"
    default: Any = field(default=None, kw_only=True)
    direct: bool = field(default=True, kw_only=True)
    many: bool = field(default=False, kw_only=True)

    def entries(self, count: int) -> list[In]:
        """Return the inputs that stand for a port of any number."""
        return [replace(self, many=False) for _ in range(count)]


@dataclass(eq=False)
class Out(Declared):
    """An output port. With ``nan=True``, NaN means "missing"; otherwise NaN or infinity stops the run."""

    type: str = "float64"
    nan: bool = field(default=False, kw_only=True)


@dataclass(eq=False)
class Derived(Declared):
    """Numbers that ``check`` computes from files and from parameters that cannot be tuned, and assigns.

    They are constant during a run, and in memory, so that compiled methods can read them.
    """

    type: str = "float64"


@dataclass(eq=False)
class State(Declared):
    """A state. Only ``start`` and ``update`` change it, and the solver by ``deriv`` if ``continuous``."""

    type: str = "float64"
    init: float = 0.0
    unit: str = field(default="1", kw_only=True)
    continuous: bool = field(default=False, kw_only=True)


@dataclass(eq=False)
class Work(Declared):
    """Scratch memory of one tick: ``output`` or ``read`` writes a result, ``update`` of that tick uses it.

    So nothing is computed twice. Work is not a state: no method reads values that an earlier tick has left,
    ``deriv`` never reads Work, and a snapshot holds zeros in its place.
    """

    type: str = "float64"
    unit: str = field(default="1", kw_only=True)


class Random(State):
    """A random stream (MRG32k3a), seeded by the engine from the run's seed and the block's path."""

    def __init__(self) -> None:
        super().__init__("int64[6]", doc="random stream")


class Param(Declared):
    """A parameter with type, unit and bounds (``min``/``max`` inclusive, ``above``/``below`` exclusive).

    A diagram must give a parameter that has no default. With ``choices`` the value is one of these names, or
    of those of an enumeration of Python; the methods see the index of the name. With ``tune=True`` the value
    may change between ticks of a run. A value of type ``file`` is a path relative to the diagram. It names a
    file or folder that the block reads, or writes if ``writes=True``. A value of type ``port`` is the path of
    a serial port, ``udp:HOST:PORT``, what the driver of a card takes, or ``pty:NAME``: one end of a cable
    that a real-time run makes. A value of type ``map`` is a map or a list; the block has it as JSON.

    With ``shown=True`` a picture of the diagram has the value under the name of the block: for the one or two
    parameters that say what the block does, such as the factor of a gain. A port is always shown.
    """

    def __init__(
        self,
        default: Any = None,
        type: str = "float64",
        unit: str = "1",
        *,
        min: float | None = None,
        max: float | None = None,
        above: float | None = None,
        below: float | None = None,
        choices: tuple[str, ...] | type[enum.Enum] = (),
        tune: bool = False,
        writes: bool = False,
        shown: bool = False,
        doc: str = "",
    ) -> None:
        self.writes, self.shown = writes, shown or type == "port"
        self.choices = choices if isinstance(choices, tuple) else tuple(choices.__members__)
        self.default, self.tune = default.name if isinstance(default, enum.Enum) else default, tune
        self.min, self.max, self.above, self.below = min, max, above, below
        self.is_file, self.is_port = type == "file", type == "port"
        self.is_map = type == "map"
        self.is_text = type in ("str", "file", "port", "map")
        super().__init__("int64" if self.choices or self.is_text else type, unit, doc=doc)
        if self.is_text:
            self.type, self.signal = type, SignalType("str", ())

    @property
    def required(self) -> bool:
        """True if a diagram must give a value."""
        return self.default is None

    def given(self, value: Any) -> Any:
        """Return `accept` of a value, or of the default if the value is None."""
        value = self.default if value is None else value
        if value is None:
            raise ParameterError(self.name, f"parameter '{self.name}' is missing; give {self.wanted()}")
        return self.accept(value)

    def accept(self, value: Any) -> Any:
        """Return ``value`` as the methods will see it; ParameterError if type, shape or range is wrong."""
        if self.choices:
            return self._accept_choice(value)
        if self.is_text:
            if not isinstance(value, str):
                raise ParameterError(self.name, f"{self.name} must be a text, got {value!r}")
            if self.is_port and not _is_port(value):
                raise ParameterError(self.name, f"{self.name} must be {PORT_WANTED}, got {value!r}")
            return value
        if type(value) is float and self._takes_number and not math.isnan(value):
            self._check_range(value)
            return value
        array = _numbers(value)
        if array is None or not _fits(array, self.signal.scalar):
            raise ParameterError(self.name, f"{self.name} must be {self.wanted()}, got {value!r}")
        if not self.signal.unify(array.shape, {}):
            found = f"{self.name} must be {self.wanted()}, got {_shape_text(array.shape)}"
            raise ParameterError(self.name, found)
        self._check_range(array)
        if array.shape:
            return array.astype(self.signal.scalar)
        return SCALARS[self.signal.scalar](array)

    @cached_property
    def _takes_number(self) -> bool:
        return self.signal.scalar == "float64" and self.signal.unify((), {})

    def _accept_choice(self, value: Any) -> int:
        value = value.name if isinstance(value, enum.Enum) else value
        if value in self.choices:
            return self.choices.index(value)
        problem = f"{self.name} must be {self.wanted()}, got {value!r}"
        raise ParameterError(self.name, sentence(problem, suggestion(str(value), self.choices)))

    def _check_range(self, value: float | NDArray[np.float64]) -> None:
        unit = "" if self.unit == "1" else f" {self.unit}"
        for bound, words, holds in (
            (self.min, "at least", operator.ge),
            (self.max, "at most", operator.le),
            (self.above, "above", operator.gt),
            (self.below, "below", operator.lt),
        ):
            if bound is None:
                continue
            held = holds(value, bound)
            if not (held if isinstance(held, bool) else held.all()):
                wrong = value if isinstance(held, bool) else np.asarray(value)[~held].flat[0]
                problem = f"{self.name} must be {words} {bound:g}{unit}, got {wrong:g}{unit}"
                raise ParameterError(self.name, problem)

    def wanted(self) -> str:
        """Describe a right value in words."""
        if self.choices:
            return "one of " + ", ".join(self.choices)
        if self.is_file or self.is_port:
            return "a path" if self.is_file else PORT_WANTED
        one, many = _WORDS[self.signal.scalar]
        unit = "" if self.unit == "1" else f" in {self.unit}"
        if self.signal.shape == ANY:
            return f"{one} or an array of {many}{unit}"
        return f"{_shape_text(self.signal.shape)}, {many}{unit}" if self.signal.shape else f"{one}{unit}"


class FixedInput(Param):
    """A value that ``write`` gets in place of one of the inputs.

    It has the type and unit of that input, and no default: only the author of a diagram knows the device.
    """

    def __init__(self, input: str, *, doc: str = "") -> None:
        super().__init__(doc=doc)
        self.input = input

    def stand_for(self, port: In) -> None:
        """Take the type and unit of the input."""
        self.type, self.unit, self.signal, self.units = port.type, port.unit, port.signal, port.units


class Safe(FixedInput):
    """The value of an input at every end of a run."""


class Initial(FixedInput):
    """The value of an input of an output device before its first command."""


_WORDS = {
    "float64": ("a number", "numbers"),
    "int64": ("a whole number", "whole numbers"),
    "bool": ("true or false", "true or false"),
    "str": ("a text", "texts"),
}


def _is_port(value: str) -> bool:
    """Return whether a text can be a port; udp:// begins the address of a stream of pictures."""
    if value.startswith("pty:"):
        return CABLE_PORT.fullmatch(value) is not None
    if value.startswith(UDP) and not value.startswith(f"{UDP}//"):
        return Address.of(value) is not None
    return bool(value)


def _numbers(value: Any) -> NDArray[np.float64] | None:
    """Return a value as an array of numbers; None if it is anything else, or if a number is NaN."""
    try:
        if np.asarray(value).dtype.kind in "SU":
            return None
        array = np.array(value, dtype=float)
    except (TypeError, ValueError, OverflowError):
        return None
    return None if np.isnan(array).any() else array


def _fits(array: NDArray[np.float64], scalar: str) -> bool:
    """Return whether slots of this kind can hold the numbers."""
    if scalar == "bool":
        return bool(((array == 0) | (array == 1)).all())
    return scalar == "float64" or bool(((array == np.round(array)) & (np.abs(array) < 2.0**63)).all())


def _shape_text(shape: tuple[int | str, ...]) -> str:
    return f"{' x '.join(map(str, shape))} values" if shape else "one value"
