"""The contract of a block: ports, parameters and state declared once, behaviour in plain methods.

The inputs that ``output`` asks for by name are the block's direct feedthrough. Parameters and states live in
memory that the engine owns (see ``quadvis.engine.memory``), so snapshot, replay, tuning and scopes need no
code of the author.
"""

from __future__ import annotations

import inspect
import math
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, TypeVar

import numpy as np

from quadvis.block.declare import Declared, Derived, In, Out, Param, ParameterError, Random, Safe, State, Work
from quadvis.errors import QuadvisError, sentence, suggestion
from quadvis.machine.inputs import file_digest, read_once
from quadvis.machine.source_line import file_of, source_line

OWN_MODULES = "quadvis_own_blocks."  # prefix of the names of modules that come with a diagram
METHODS = ("start", "read", "output", "write", "update", "deriv")
OUTSIDE = ("read", "write")
PORTS = "ports"
CHECKS = ("check", "check_written", "doubts")
FILES = ("reads", "read_file", "verify_files")
TAGS = ("not_replayable", "not_restorable", "harmless")
RESERVED = {
    "self", "time", "period", "until", "interface", "numeric", "stepwise", "functions",
    "open", "close", "write_safe", "keep", "put_back", "brings_code",
    PORTS, "ports_from", "with_ports", "made_for",
    *CHECKS, *FILES, *METHODS, *TAGS,
}  # fmt: skip

_Read = TypeVar("_Read")


@dataclass(frozen=True)
class Interface:
    """All declarations of a block class, collected when the class is defined."""

    inputs: Mapping[str, In]
    outputs: Mapping[str, Out]
    params: Mapping[str, Param]
    derived: Mapping[str, Derived]
    states: Mapping[str, State]
    work: Mapping[str, Work]
    safe: Mapping[str, Safe]  # by the input that each value replaces
    arguments: Mapping[str, tuple[str, ...]]  # method -> the names that it asks for

    @cached_property
    def feedthrough(self) -> frozenset[str]:
        """The inputs that ``output`` asks for."""
        return frozenset(self.arguments.get("output", ())) & frozenset(self.inputs)

    @cached_property
    def continuous(self) -> tuple[State, ...]:
        """The states that a solver integrates."""
        return tuple(state for state in self.states.values() if state.continuous)

    @cached_property
    def streams(self) -> tuple[str, ...]:
        """The states that are random streams."""
        return tuple(name for name, state in self.states.items() if isinstance(state, Random))

    @cached_property
    def wanted(self) -> tuple[str, ...]:
        """The inputs that must be fed, since they have no default."""
        return tuple(name for name, port in self.inputs.items() if port.default is None)

    @cached_property
    def required(self) -> tuple[str, ...]:
        """The parameters that must be given."""
        return tuple(name for name, param in self.params.items() if param.required)

    @cached_property
    def files_read(self) -> tuple[Param, ...]:
        """The parameters that name a file or folder which the block reads."""
        return tuple(param for param in self.params.values() if param.is_file and not param.writes)

    @cached_property
    def files_written(self) -> tuple[Param, ...]:
        """The parameters that name a file or folder which the block writes."""
        return tuple(param for param in self.params.values() if param.writes)


class Block:
    """One reusable unit of computation or input/output; see the module's docstring for the contract.

    ``Gain(factor=2.0)`` makes a block from its parameters, and from ``period`` (s) where that is known;
    ParameterError if a parameter is unknown, missing or out of range. The block can run after the engine has
    bound it to memory.
    """

    interface: ClassVar[Interface]
    numeric: ClassVar[bool] = True
    stepwise: ClassVar[bool] = False  # whether outputs change at ticks only, though they depend on the time
    functions: ClassVar[tuple[Any, ...]] = ()  # plain functions with machine code that its methods call
    not_replayable: ClassVar[str] = ""  # why a second run may differ from the first: "it reads a camera"
    not_restorable: ClassVar[str] = ""  # why it cannot return to a snapshot: "the model has no way back"
    brings_code: ClassVar[str] = ""  # the parameter whose file a run executes
    harmless: ClassVar[str] = ""  # why its writes need no safe values: "a file moves nothing"
    made_for: ClassVar[Mapping[str, Any] | None] = None  # the parameters from which the ports were made
    period: float = math.nan
    until: float = math.inf  # time of the run's last tick (s), where it is known; not for compiled methods

    def __init_subclass__(cls, *, numeric: bool | None = None, bound: bool = False) -> None:
        if bound:
            return
        if numeric is not None:
            cls.numeric = numeric
        cls.interface = _interface(cls)

    @classmethod
    def ports_from(cls) -> tuple[str, ...]:
        """Return the names of the parameters on which the ports depend: the arguments of ``ports``."""
        ports = getattr(cls, "ports", None)
        return () if ports is None else tuple(inspect.signature(ports).parameters)

    @classmethod
    def with_ports(cls, parameters: Mapping[str, Any]) -> type[Block]:
        """Return the class with its ports for these parameters; ParameterError if a parameter is wrong.

        The ports of a class may depend on parameters, for example on the file of a model. Such a class has
        a class method ``ports``, which asks for parameters by name and returns the ports by name, and what
        else of the class depends on the file: parameters, states, methods, tags. ``*inputs`` of a method then
        stands for all inputs, in the order of ``ports``; of ``output``, for those that are ``direct``.
        """
        names = cls.ports_from()
        if not names:
            return cls
        declared = cls.interface.params
        given = {name: declared[name].given(parameters.get(name)) for name in names}
        if cls.made_for is not None:
            same = all(np.array_equal(given[name], cls.made_for[name]) for name in names)
            base: type[Block] = cls.__mro__[1]
            return cls if same else base.with_ports(parameters)
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
        self._kept: dict[str, Any] = {}  # results of `read_file`, by parameter
        self.check()
        self._digests = {
            param.name: file_digest(getattr(self, param.name))
            for param in self.interface.files_read
            if param.name not in self._kept and os.path.isfile(getattr(self, param.name))
        }

    def check(self) -> None:
        """Raise ParameterError for values that make a run impossible, so that `quadvis check` finds them.

        Such values are parameters that contradict each other or ``self.period`` (s), and unusable files.
        This method is called when the block is made, and before a run if the period has changed since then.
        The period is NaN where it is not known: write comparisons such that NaN refuses nothing.
        """

    def check_written(self) -> None:
        """Raise ParameterError for an existing file that must not be overwritten.

        This method is called when all inputs of the diagram are known and no block writes over one of them;
        ``open`` checks the file again.
        """

    def reads(self) -> list[str]:
        """Return the files that a run reads: the files that parameters name, and all files of a folder."""
        paths = (getattr(self, param.name) for param in self.interface.files_read)
        return [path for path in paths if path]

    def doubts(self) -> list[ParameterError]:
        """Return the warnings: values that can run, but are surely a mistake at ``self.period`` (s)."""
        return []

    def read_file(self, name: str, read: Callable[[str], _Read]) -> _Read:
        """Return ``read(path)`` of the file that a parameter names; ParameterError reports a fault in it.

        The file is read at the first call, and the result is kept. So ``open`` gets the same result as
        ``check``, even if the file has changed in between. Blocks of one diagram that give the same ``read``
        and path share the result: do not modify it.
        """
        if name not in self._kept:
            try:
                self._kept[name] = read_once(read, getattr(self, name))
            except ParameterError:
                raise
            except QuadvisError as error:
                reasons = "; ".join(str(error).splitlines())
                raise ParameterError(name, f"{name} is not usable: {reasons}") from None
        found: _Read = self._kept[name]
        return found

    def verify_files(self) -> None:
        """Refuse, before ``open``, a file that has changed since the block was made.

        Results that `read_file` keeps stay valid, so their files may change.
        """
        for name, digest in self._digests.items():
            path = getattr(self, name)
            if not os.path.isfile(path) or file_digest(path) != digest:
                problem = f"file '{path}' is not what it was when the diagram was loaded"
                raise ParameterError(name, sentence(problem, "load it again"))

    def open(self) -> None:
        """Acquire what the block needs outside the engine: a file, a port, a device."""

    def write_safe(self, time: float) -> None:
        """Write the safe values: at every end of a run, before ``close``, if ``open`` succeeded."""
        write: Callable[..., None] | None = getattr(self, "write", None)
        if write is None or self.harmless:
            return
        safe, names = self.interface.safe, self.interface.arguments["write"]
        write(*(time if name == "time" else getattr(self, safe[name].name) for name in names))

    def close(self) -> None:
        """Release what ``open`` has acquired. This method is called even if ``open`` failed halfway."""

    def keep(self) -> Any:
        """Return, for a snapshot between two ticks, what is outside of memory and later outputs depend on.

        Most blocks have all that in states, and return None.
        """

    def put_back(self, kept: Any) -> None:
        """Go back to what `keep` has returned; None is the state before the first tick.

        The states in memory are back by then. QuadvisError, in a sentence, if the block has no way back.
        """


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
        every = [name for name, port in inputs.items() if port.direct or method != "output"]
        names = _asked(function, tuple(every) if cls.ports_from() else None)
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
        raise TypeError(f"{cls.__name__} declares Work, which goes from output to update, but has not both")
    if any(state.continuous for state in states.values()) != ("deriv" in arguments):
        raise TypeError(f"{cls.__name__}: continuous states and a deriv method go together")
    if outputs and "output" not in arguments:
        raise TypeError(f"{cls.__name__} declares outputs but has no output method")
    safe = _safe(cls, of(Safe).values(), inputs, arguments.get("write", ()))
    return Interface(inputs, outputs, of(Param), of(Derived), states, of(Work), safe, arguments)


def _asked(function: Callable[..., Any], inputs: tuple[str, ...] | None) -> tuple[str, ...]:
    """Return the names that a method asks for; ``*inputs`` means these ``inputs``, if they are not None."""
    names: list[str] = []
    for name, parameter in tuple(inspect.signature(function).parameters.items())[1:]:
        every = parameter.kind == parameter.VAR_POSITIONAL and name == "inputs"
        names += inputs if every and inputs is not None else [name]
    return tuple(names)


def _safe(
    cls: type[Block], declared: Iterable[Safe], inputs: Mapping[str, In], written: Sequence[str]
) -> dict[str, Safe]:
    """Return the safe values by input; TypeError if one is missing or replaces no input of ``write``."""
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
