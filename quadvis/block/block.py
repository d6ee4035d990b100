"""The contract of a block: ports, parameters and state declared once, behaviour in plain methods.

A block's direct feedthrough is what its ``output`` asks for by name. Its parameters and states live in memory
that the engine owns (see ``quadvis.engine.memory``): snapshot, replay, tuning and scopes ask nothing of
the author.
"""

from __future__ import annotations

import inspect
import math
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, TypeVar

from quadvis.block.declare import Declared, In, Out, Param, ParameterError, Safe, State, Work
from quadvis.errors import QuadvisError, sentence, suggestion
from quadvis.machine.inputs import file_digest
from quadvis.machine.source_line import file_of, source_line
from quadvis.units import Unit

OWN_MODULES = "quadvis_own_blocks."  # before the names of modules that come with a diagram
METHODS = ("start", "read", "output", "write", "update", "deriv")
OUTSIDE = ("read", "write")
PORTS = "ports"
CHECKS = ("check", "check_written", "doubts")
FILES = ("reads", "read_file", "verify_files")
TAGS = ("not_replayable", "not_restorable", "harmless")
RESERVED = {
    "self", "time", "period", "interface", "numeric", "open", "close", "write_safe",
    PORTS, "ports_from", "with_ports", "made_for",
    *CHECKS, *FILES, *METHODS, *TAGS,
}  # fmt: skip

_Read = TypeVar("_Read")


@dataclass(frozen=True)
class Interface:
    """All that a block class declares, collected when the class is defined."""

    inputs: Mapping[str, In]
    outputs: Mapping[str, Out]
    params: Mapping[str, Param]
    states: Mapping[str, State]
    work: Mapping[str, Work]
    safe: Mapping[str, Safe]  # by the input that each stands for
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

    ``Gain(factor=2.0)`` is a block with its parameters chosen, and with ``period`` (s) if it is known;
    ParameterError if one is unknown, missing or out of range. It runs once the engine has bound it to memory.
    """

    interface: ClassVar[Interface]
    numeric: ClassVar[bool] = True
    not_replayable: ClassVar[str] = ""  # why a second run may differ from the first: "it reads a camera"
    not_restorable: ClassVar[str] = ""  # why it cannot go back to a snapshot: "the model has no way back"
    harmless: ClassVar[str] = ""  # why what it writes needs no safe value: "a file moves nothing"
    made_for: ClassVar[Mapping[str, Any] | None] = None  # the parameters from which a class has its ports
    period: float = math.nan

    def __init_subclass__(cls, *, numeric: bool | None = None, bound: bool = False) -> None:
        if bound:
            return
        if numeric is not None:
            cls.numeric = numeric
        cls.interface = _interface(cls)

    @classmethod
    def ports_from(cls) -> tuple[str, ...]:
        """Return the parameters on which the ports depend: those that the class method ``ports`` asks for."""
        ports = getattr(cls, "ports", None)
        return () if ports is None else tuple(inspect.signature(ports).parameters)

    @classmethod
    def with_ports(cls, parameters: Mapping[str, Any]) -> type[Block]:
        """Return the class with the ports that it has for these parameters, ParameterError if one is wrong.

        A class whose ports depend on parameters, as those of a model in a file do, has a class method
        ``ports``: it asks for parameters by name, and returns the ports by name. A method's ``*inputs`` are
        then all inputs, in that order.
        """
        names = cls.ports_from()
        if not names or cls.made_for is not None:
            return cls
        declared = cls.interface.params
        given = {name: declared[name].given(parameters.get(name)) for name in names}
        try:
            ports = getattr(cls, PORTS)(**given)
        except QuadvisError:
            raise
        except Exception as error:
            place = source_line(error, file_of(cls))
            reason = f"{type(error).__name__}: {error}{f' in {place}' if place else ''}"
            raise ParameterError(names[0], f"the ports cannot be made from {names[0]}: {reason}") from error
        members = {**ports, "__doc__": cls.__doc__, "__module__": cls.__module__, "made_for": given}
        return type(cls.__name__, (cls,), members)

    def __init__(self, *, period: float = math.nan, **parameters: Any) -> None:
        kind = type(self).with_ports(parameters)
        if kind is not type(self):
            self.__class__ = kind
        self.period = period
        declared = self.interface.params
        for name in parameters:
            if name not in declared:
                problem = f"{type(self).__name__} has no parameter '{name}'"
                raise ParameterError(name, sentence(problem, suggestion(name, declared)))
        for name, param in declared.items():
            self.__dict__[name] = param.given(parameters.get(name))
        self._kept: dict[str, Any] = {}  # what was made of files, by parameter
        self.check()
        self._digests = {
            param.name: file_digest(getattr(self, param.name))
            for param in declared.values()
            if param.is_file and not param.writes and param.name not in self._kept
            if os.path.isfile(getattr(self, param.name))
        }

    def check(self) -> None:
        """Refuse with ParameterError what no run can do with, so that `quadvis check` finds it.

        That is: parameters that contradict each other or do not go with ``self.period`` (s), and files that
        are not usable. It is called as the block is made, with a period of NaN where that is not known (so
        compare with it such that NaN refuses nothing), and before a run with a period that is another.
        """

    def check_written(self) -> None:
        """Refuse files that are there and must not be written over, with ParameterError.

        It is called once all inputs of the diagram are known and found safe; ``open`` looks again.
        """

    def reads(self) -> list[str]:
        """Return the files that a run reads: those that parameters name, and all files of a folder."""
        files = (param for param in self.interface.params.values() if param.is_file and not param.writes)
        return [path for path in (getattr(self, param.name) for param in files) if path]

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

    def write_safe(self, time: float) -> None:
        """Write the safe values outside: at every end of a run, before ``close``, if ``open`` succeeded."""
        write: Callable[..., None] | None = getattr(self, "write", None)
        if write is None or self.harmless:
            return
        safe, names = self.interface.safe, self.interface.arguments["write"]
        write(*(time if name == "time" else getattr(self, safe[name].name) for name in names))

    def close(self) -> None:
        """Release it; called even if ``open`` failed halfway."""


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
        names = _asked(function, tuple(inputs) if cls.ports_from() else None)
        allowed = {"start": (), "read": ("time",)}.get(method, (*inputs, "time"))
        for name in names:
            if name not in allowed:
                problem = f"{cls.__name__}.{method} asks for '{name}', which is not one of its inputs"
                raise TypeError(sentence(problem, suggestion(name, allowed)))
        arguments[method] = names
    for name in cls.ports_from():
        if name not in of(Param):
            problem = f"{cls.__name__}.{PORTS} asks for '{name}', which is not one of its parameters"
            raise TypeError(sentence(problem, suggestion(name, of(Param))))
    if cls.numeric and not arguments.keys().isdisjoint(OUTSIDE):
        problem = f"{cls.__name__} reads or writes outside, which no compiled method can"
        raise TypeError(sentence(problem, "say numeric=False"))
    if cls.numeric and any(state.signal.scalar == "frame" for state in states.values()):
        problem = f"{cls.__name__} keeps a frame as a state, which no compiled method can"
        raise TypeError(sentence(problem, "say numeric=False"))
    if any(item.signal.scalar == "frame" for item in of(Work).values()):
        problem = f"{cls.__name__} declares a frame as Work, which holds numbers"
        raise TypeError(sentence(problem, "keep it in an attribute that output sets and update reads"))
    if of(Work) and not {"output", "update"} <= arguments.keys():
        raise TypeError(f"{cls.__name__} declares Work, which goes from output to update, and has not both")
    if any(state.continuous for state in states.values()) != ("deriv" in arguments):
        raise TypeError(f"{cls.__name__}: continuous states and a deriv method go together")
    if outputs and "output" not in arguments:
        raise TypeError(f"{cls.__name__} declares outputs but has no output method")
    safe = _safe(cls, of(Safe).values(), inputs, arguments.get("write", ()))
    return Interface(inputs, outputs, of(Param), states, of(Work), safe, arguments)


def _asked(function: Callable[..., Any], inputs: tuple[str, ...] | None) -> tuple[str, ...]:
    """Return the names that a method asks for; ``*inputs`` asks for all inputs, None where they are fixed."""
    names: list[str] = []
    for name, parameter in tuple(inspect.signature(function).parameters.items())[1:]:
        every = parameter.kind == parameter.VAR_POSITIONAL and name == "inputs"
        names += inputs if every and inputs is not None else [name]
    return tuple(names)


def _safe(
    cls: type[Block], declared: Iterable[Safe], inputs: Mapping[str, In], written: Sequence[str]
) -> dict[str, Safe]:
    """Return the safe values by input; TypeError if one is missing or stands for no input of ``write``."""
    safe = {item.input: item for item in declared}
    for name, item in safe.items():
        if name not in written or name not in inputs:
            problem = f"{cls.__name__}.{item.name} stands for '{name}', which is no input of its write method"
            raise TypeError(sentence(problem, suggestion(name, written)))
        item.stand_for(inputs[name])
    for name in written:
        if name in inputs and name not in safe and not cls.harmless:
            problem = f"{cls.__name__}.write has no safe value for '{name}'"
            remedy = f"declare safe_{name} = Safe('{name}'), or say in 'harmless' why it needs none"
            raise TypeError(sentence(problem, remedy))
    return safe


def units_of(declared: Declared, count: int) -> tuple[Unit, ...]:
    """Return one unit per element of a port with ``count`` elements; a single unit holds for all of them."""
    return declared.units * count if len(declared.units) == 1 else declared.units
