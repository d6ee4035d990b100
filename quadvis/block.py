"""The contract of a block: ports, parameters and state declared once, behaviour in plain methods.

A block's direct feedthrough is what its ``output`` asks for by name. Its parameters and states live in memory
that the engine owns (see ``quadvis.engine.memory``): snapshot, replay, tuning and scopes ask nothing of
the author.
"""

from __future__ import annotations

import inspect
import math
import os
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, TypeVar

import numpy as np
from numpy.typing import NDArray

from quadvis.errors import QuadvisError, sentence, suggestion
from quadvis.inputs import file_digest
from quadvis.units import Unit, parse_units

SCALARS = {"float64": float, "int64": int, "bool": bool}
METHODS = ("start", "output", "update", "deriv")
CHECKS = ("check", "check_period", "doubts")
FILES = ("reads", "read_file", "verify_files")
RESERVED = {"self", "time", "period", "interface", "numeric", *CHECKS, *FILES, "open", "close", *METHODS}

Shape = tuple[int, ...]
Sizes = dict[str, Any]  # symbol -> int; "*" -> Shape
_Read = TypeVar("_Read")
_SIZE = r"(?:[1-9]\d*|[a-z]\w*)"


class ParameterError(QuadvisError):
    """A value that a parameter cannot take: ``parameter`` names it, the text says what would be right."""

    def __init__(self, parameter: str, message: str) -> None:
        super().__init__(message)
        self.parameter = parameter


@dataclass(frozen=True, eq=False)
class Frame:
    """A picture on its way through a diagram. It travels by reference: never write into ``pixels``.

    ``pixels`` is uint8 (height, width, 3), blue-green-red; ``stamp`` is the middle of the exposure (s, run
    time); ``sequence`` counts frames from 1, and 0 means that there is none yet.
    """

    pixels: NDArray[np.uint8]
    stamp: float
    sequence: int

    @staticmethod
    def none() -> Frame:
        """Return the frame that says "no picture yet"."""
        return NO_FRAME


NO_FRAME = Frame(np.zeros((0, 0, 3), np.uint8), math.nan, 0)


@dataclass(frozen=True)
class SignalType:
    """What a port or state holds, a scalar kind and a shape: ``float64[4,2]``, ``float64[n]``, ``frame``."""

    scalar: str
    shape: tuple[int | str, ...]

    @staticmethod
    def parse(text: str) -> SignalType:
        """Read ``float64``, ``int64[3]``, ``float64[n]``, ``float64[*]`` (any shape) or ``frame``."""
        if text == "frame":
            return SignalType("frame", ())
        match = re.fullmatch(rf"(\w+)(?:\[({_SIZE}(?:, *{_SIZE})*|\*)\])?", text)
        if match is None or match[1] not in SCALARS:
            remedy = "write float64, int64 or bool, with a shape such as [3], [4,2], [n] or [*]"
            raise TypeError(sentence(f"'{text}' is not a signal type", remedy))
        sizes = re.findall(_SIZE, match[2]) if match[2] and match[2] != "*" else (match[2] or "")
        return SignalType(match[1], tuple(int(size) if size.isdigit() else size for size in sizes))

    def resolve(self, sizes: Sizes) -> Shape:
        """Return the shape with every symbol replaced; a symbol that nothing fixed becomes a scalar or 1."""
        if self.shape == ("*",):
            return tuple(sizes.get("*", ()))
        return tuple(sizes.get(size, 1) if isinstance(size, str) else size for size in self.shape)

    def unify(self, shape: Shape, sizes: Sizes) -> bool:
        """Match a concrete shape, adding what it fixes to ``sizes``; False if it does not fit."""
        if self.shape == ("*",):
            return bool(sizes.setdefault("*", shape) == shape)
        if len(shape) != len(self.shape):
            return False
        return all(
            (sizes.setdefault(size, length) if isinstance(size, str) else size) == length
            for size, length in zip(self.shape, shape, strict=True)
        )

    def __str__(self) -> str:
        return self.scalar + (f"[{','.join(map(str, self.shape))}]" if self.shape else "")


@dataclass(eq=False)
class Declared:
    """Base of everything that a block class declares; the class attribute's name becomes its name."""

    type: str
    unit: str = "1"
    doc: str = field(default="", kw_only=True)
    name: str = field(default="", init=False)

    def __post_init__(self) -> None:
        self.signal = SignalType.parse(self.type)
        self.units = parse_units(self.unit)

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
    """An input port. With a ``default`` it may stay unconnected."""

    type: str = "float64"
    default: Any = field(default=None, kw_only=True)


@dataclass(eq=False)
class Out(Declared):
    """An output port. ``nan=True`` where NaN says "missing"; elsewhere NaN or infinity stops the run."""

    type: str = "float64"
    nan: bool = field(default=False, kw_only=True)


@dataclass(eq=False)
class State(Declared):
    """A state; only ``start`` and ``update`` change it, or the solver through ``deriv`` if ``continuous``."""

    type: str = "float64"
    init: float = 0.0
    unit: str = field(default="1", kw_only=True)
    continuous: bool = field(default=False, kw_only=True)


class Random(State):
    """A random stream (MRG32k3a), seeded by the engine from the run's seed and the block's path."""

    def __init__(self) -> None:
        super().__init__("int64[6]", doc="random stream")


class Param(Declared):
    """A parameter: typed, with unit and bounds (``min``/``max`` inclusive, ``above``/``below`` exclusive).

    Without a default it must be given. ``choices`` makes it a name out of a few; the methods see its index.
    ``tune=True`` lets it change between ticks of a run. Type ``file`` is a path relative to the diagram, of a
    file or folder that the block reads, or with ``writes=True`` of one that it writes.
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
        choices: tuple[str, ...] = (),
        tune: bool = False,
        writes: bool = False,
        doc: str = "",
    ) -> None:
        self.writes = writes
        self.default, self.choices, self.tune = default, choices, tune
        self.min, self.max, self.above, self.below = min, max, above, below
        self.is_file, self.is_text = type == "file", type in ("str", "file")
        super().__init__("int64" if choices or self.is_text else type, unit, doc=doc)
        if self.is_text:
            self.type, self.signal = type, SignalType("str", ())

    @property
    def required(self) -> bool:
        """True if a diagram must give a value."""
        return self.default is None

    def accept(self, value: Any) -> Any:
        """Return ``value`` as the methods will see it; ParameterError if type, shape or range is wrong."""
        if self.choices:
            return self._accept_choice(value)
        if self.is_text:
            if not isinstance(value, str):
                raise ParameterError(self.name, f"{self.name} must be a text, got {value!r}")
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

    def _accept_choice(self, value: Any) -> int:
        if value in self.choices:
            return self.choices.index(value)
        problem = f"{self.name} must be {self.wanted()}, got {value!r}"
        raise ParameterError(self.name, sentence(problem, suggestion(str(value), self.choices)))

    def _check_range(self, array: NDArray[np.float64]) -> None:
        unit = "" if self.unit == "1" else f" {self.unit}"
        for bound, words, holds in (
            (self.min, "at least", np.greater_equal),
            (self.max, "at most", np.less_equal),
            (self.above, "above", np.greater),
            (self.below, "below", np.less),
        ):
            if bound is not None and not holds(array, bound).all():
                wrong = array[~holds(array, bound)].flat[0] if array.shape else float(array)
                problem = f"{self.name} must be {words} {bound:g}{unit}, got {wrong:g}{unit}"
                raise ParameterError(self.name, problem)

    def wanted(self) -> str:
        """Say in words what a right value is."""
        if self.choices:
            return "one of " + ", ".join(self.choices)
        one, many = _WORDS[self.signal.scalar]
        unit = "" if self.unit == "1" else f" in {self.unit}"
        if self.signal.shape == ("*",):
            return f"{one} or an array of {many}{unit}"
        return f"{_shape_text(self.signal.shape)}, {many}{unit}" if self.signal.shape else f"{one}{unit}"


_WORDS = {
    "float64": ("a number", "numbers"),
    "int64": ("a whole number", "whole numbers"),
    "bool": ("true or false", "true or false"),
    "str": ("a text", "texts"),
}


def _numbers(value: Any) -> NDArray[np.float64] | None:
    """Return a value as an array of numbers, None if it is something else; NaN is no number."""
    try:
        if np.asarray(value).dtype.kind in "SU":
            return None
        array = np.array(value, dtype=float)
    except (TypeError, ValueError, OverflowError):
        return None
    return None if np.isnan(array).any() else array


def _fits(array: NDArray[np.float64], scalar: str) -> bool:
    """Return whether a slot can hold the numbers."""
    if scalar == "bool":
        return bool(((array == 0) | (array == 1)).all())
    return scalar == "float64" or bool(((array == np.round(array)) & (np.abs(array) < 2.0**63)).all())


def _shape_text(shape: tuple[int | str, ...]) -> str:
    return f"{' x '.join(map(str, shape))} values" if shape else "one value"


@dataclass(frozen=True)
class Interface:
    """All that a block class declares, collected when the class is defined."""

    inputs: Mapping[str, In]
    outputs: Mapping[str, Out]
    params: Mapping[str, Param]
    states: Mapping[str, State]
    arguments: Mapping[str, tuple[str, ...]]  # method -> the names it asks for

    @property
    def feedthrough(self) -> frozenset[str]:
        """The inputs that ``output`` asks for."""
        return frozenset(self.arguments.get("output", ())) & frozenset(self.inputs)

    @property
    def continuous(self) -> tuple[State, ...]:
        """The states that a solver integrates."""
        return tuple(state for state in self.states.values() if state.continuous)


class Block:
    """One reusable unit of computation or input/output; see the module's docstring for the contract.

    ``Gain(factor=2.0)`` is a block with its parameters chosen; ParameterError if one is unknown, missing or
    out of range. It runs once the engine has bound it to memory.
    """

    interface: ClassVar[Interface]
    numeric: ClassVar[bool] = True
    period: float

    def __init_subclass__(cls, *, numeric: bool | None = None, bound: bool = False) -> None:
        if bound:
            return
        if numeric is not None:
            cls.numeric = numeric
        cls.interface = _interface(cls)

    def __init__(self, **parameters: Any) -> None:
        declared = self.interface.params
        for name in parameters:
            if name not in declared:
                problem = f"{type(self).__name__} has no parameter '{name}'"
                raise ParameterError(name, sentence(problem, suggestion(name, declared)))
        for name, param in declared.items():
            value = parameters.get(name, param.default)
            if value is None:
                raise ParameterError(name, f"parameter '{name}' is missing; give {param.wanted()}")
            self.__dict__[name] = param.accept(value)
        self._kept: dict[str, Any] = {}  # what was made of files, by parameter
        self.check()
        self._digests = {
            param.name: file_digest(getattr(self, param.name))
            for param in declared.values()
            if param.is_file and not param.writes and param.name not in self._kept
            if os.path.isfile(getattr(self, param.name))
        }

    def check(self) -> None:
        """Refuse parameters that contradict each other or name unreadable files, with ParameterError."""

    def reads(self) -> list[str]:
        """Return the files that a run reads: those that parameters name, and all files of a folder."""
        files = (param for param in self.interface.params.values() if param.is_file and not param.writes)
        return [path for path in (getattr(self, param.name) for param in files) if path]

    def check_period(self) -> None:
        """Refuse parameters that do not go with ``self.period`` (s), with ParameterError.

        It is called when a diagram is checked, as soon as the block's rate is known, and again before a run.
        """

    def doubts(self) -> list[ParameterError]:
        """Return what can be run, but is surely not what was meant at ``self.period`` (s): the warnings."""
        return []

    def read_file(self, name: str, read: Callable[[str], _Read]) -> _Read:
        """Return ``read(path)`` of the file that a parameter names; ParameterError tells what is wrong in it.

        It is read at the first call and kept, so that what ``check`` has seen is what ``open`` gets, whatever
        happens to the file meanwhile. Do not change what this returns.
        """
        if name not in self._kept:
            try:
                self._kept[name] = read(getattr(self, name))
            except ParameterError:
                raise
            except QuadvisError as error:
                reasons = "; ".join(str(error).splitlines())
                raise ParameterError(name, f"{name} is not usable: {reasons}") from None
        found: _Read = self._kept[name]
        return found

    def verify_files(self) -> None:
        """Refuse a file that was not kept and is not what it was when the block was made; before ``open``."""
        for name, digest in self._digests.items():
            path = getattr(self, name)
            if not os.path.isfile(path) or file_digest(path) != digest:
                problem = f"file '{path}' is not what it was when the diagram was loaded"
                raise ParameterError(name, sentence(problem, "load it again"))

    def open(self) -> None:
        """Acquire what the block needs outside the engine: a file, a port, a device."""

    def close(self) -> None:
        """Release it, hardware outputs at their safe value first; called even if ``open`` failed halfway."""


def _interface(cls: type[Block]) -> Interface:
    found: dict[str, Declared] = {}
    for base in reversed(cls.__mro__):
        found.update({name: value for name, value in vars(base).items() if isinstance(value, Declared)})
    for name in found:
        if name in RESERVED:
            raise TypeError(f"{cls.__name__}: '{name}' is reserved; choose another name")

    def of(kind: type[Any]) -> dict[str, Any]:
        return {name: value for name, value in found.items() if isinstance(value, kind)}

    inputs, outputs, states = of(In), of(Out), of(State)
    arguments = {}
    for method in METHODS:
        function = getattr(cls, method, None)
        if function is None:
            continue
        names = tuple(inspect.signature(function).parameters)[1:]
        allowed = () if method == "start" else (*inputs, "time")
        for name in names:
            if name not in allowed:
                problem = f"{cls.__name__}.{method} asks for '{name}', which is not one of its inputs"
                raise TypeError(sentence(problem, suggestion(name, allowed)))
        arguments[method] = names
    if cls.numeric and any(state.signal.scalar == "frame" for state in states.values()):
        problem = f"{cls.__name__} keeps a frame as a state, which no compiled method can"
        raise TypeError(sentence(problem, "say numeric=False"))
    if any(state.continuous for state in states.values()) != ("deriv" in arguments):
        raise TypeError(f"{cls.__name__}: continuous states and a deriv method go together")
    if outputs and "output" not in arguments:
        raise TypeError(f"{cls.__name__} declares outputs but has no output method")
    return Interface(inputs, outputs, of(Param), states, arguments)


def units_of(declared: Declared, count: int) -> tuple[Unit, ...]:
    """Return one unit per element of a port with ``count`` elements; a single unit holds for all of them."""
    return declared.units * count if len(declared.units) == 1 else declared.units
