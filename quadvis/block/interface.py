"""What a block class declares, collected when the class is defined: ports, parameters, states, arguments."""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from quadvis.block.declare import (
    Declared,
    Derived,
    In,
    Out,
    Param,
    Random,
    Safe,
    State,
    Work,
    entry_name,
)
from quadvis.block.symbol import check_symbol
from quadvis.errors import sentence, suggestion

if TYPE_CHECKING:
    from quadvis.block.block import Block

METHODS = ("start", "read", "output", "write", "update", "deriv")
OUTSIDE = ("read", "write")
EVENTS = (CROSSING, EVENT) = ("crossing", "event")
PORTS = "ports"
CHECKS = ("check", "check_written", "doubts")
FILES = ("reads", "read_file", "verify_files")
TAGS = ("not_replayable", "not_restorable", "harmless")
RESERVED = {
    "self", "time", "period", "until", "interface", "numeric", "stepwise", "jumps", "functions",
    "example", "example_needs", "open", "close", "write_safe", "keep", "put_back", "brings_code",
    PORTS, "named", "free_names", "picture_lines", "picture_formula", "picture_signs",
    "symbol", "ports_from", "with_ports", "made_for", "entry_counts", "with_entries",
    *CHECKS, *FILES, *METHODS, *EVENTS, *TAGS,
}  # fmt: skip


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
    events: Mapping[str, tuple[str, ...]]  # the same of ``crossing`` and ``event``; empty without them

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
    def many(self) -> tuple[str, ...]:
        """The inputs of any number, as long as their number is open."""
        return tuple(name for name, port in self.inputs.items() if port.many)

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


def arguments_of_ports(cls: type[Block]) -> tuple[str, ...]:
    """Return the names for which the method ``ports`` of a class asks."""
    ports = getattr(cls, PORTS, None)
    return () if ports is None else tuple(inspect.signature(ports).parameters)


def _declarations(cls: type[Block]) -> dict[str, Declared]:
    """Return all declarations of a class; for an input of any number the inputs that stand for it."""
    found: dict[str, Declared] = {}
    for base in reversed(cls.__mro__):
        for name, value in vars(base).items():
            if isinstance(value, Declared):
                found[name] = value
            elif value is None:  # taken away by a subclass
                found.pop(name, None)
    if not cls.entry_counts:
        return found
    entries = {
        name: [entry_name(name, number) for number in range(count)]
        for name, count in cls.entry_counts.items()
    }
    inside = {entry for names in entries.values() for entry in names}
    return {
        entry: found[entry] for name in found if name not in inside for entry in entries.get(name, (name,))
    }


def interface_of(cls: type[Block]) -> Interface:
    """Return what a class declares; TypeError if its declarations contradict each other or its methods."""
    check_symbol(cls.symbol, cls.__name__)
    found = _declarations(cls)
    for name in found:
        if name in RESERVED:
            raise TypeError(f"{cls.__name__}: '{name}' is reserved; choose another name")

    def of(kind: type[Any]) -> dict[str, Any]:
        return {name: value for name, value in found.items() if isinstance(value, kind)}

    inputs, outputs, states = of(In), of(Out), of(State)
    for name, port in inputs.items():
        if port.many and port.default is not None:
            raise TypeError(
                f"{cls.__name__}.{name} takes any number of signals, one at least; leave out 'default'"
            )
    arguments = {}
    for method in METHODS:
        function = getattr(cls, method, None)
        if function is None:
            continue
        names = _asked(cls, method, inputs)
        allowed = {"start": (), "read": ("time",)}.get(method, (*inputs, "time"))
        for name in names:
            if name not in allowed:
                problem = f"{cls.__name__}.{method} asks for '{name}', which is not one of its inputs"
                raise TypeError(sentence(problem, suggestion(name, allowed)))
        arguments[method] = names
    events = _event_methods(cls, inputs)
    for name in arguments_of_ports(cls) if hasattr(cls, PORTS) else ():
        known = {
            **of(Param),
            **cls.entry_counts,
            **{name: port for name, port in inputs.items() if port.many},
        }
        if name not in known:
            problem = f"{cls.__name__}.{PORTS} asks for '{name}', which is not one of its parameters"
            raise TypeError(sentence(problem, suggestion(name, known)))
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
    return Interface(inputs, outputs, of(Param), of(Derived), states, of(Work), safe, arguments, events)


def _event_methods(cls: type[Block], inputs: Mapping[str, In]) -> dict[str, tuple[str, ...]]:
    """Return what ``crossing`` and ``event`` ask for; TypeError if a class has one of them alone."""
    found = {method: _asked(cls, method, inputs) for method in EVENTS if hasattr(cls, method)}
    if len(found) == 1:
        raise TypeError(f"{cls.__name__}: the methods {' and '.join(EVENTS)} go together")
    if found and not cls.numeric:
        raise TypeError(f"{cls.__name__} is not numeric, and only numeric blocks have events between ticks")
    for method, names in found.items():
        for name in names:
            if name not in (*inputs, "time"):
                problem = f"{cls.__name__}.{method} asks for '{name}', which is not one of its inputs"
                raise TypeError(sentence(problem, suggestion(name, inputs)))
    return found


def _asked(cls: type[Block], method: str, inputs: Mapping[str, In]) -> tuple[str, ...]:
    """Return the names that a method asks for.

    ``*u`` means all signals of an input of any number, ``*inputs`` all inputs of a class with ``ports``; of
    ``output``, those that are ``direct``.
    """
    names: list[str] = []
    for name, parameter in tuple(inspect.signature(getattr(cls, method)).parameters.items())[1:]:
        many = name in cls.entry_counts or (name in inputs and inputs[name].many)
        if many != (parameter.kind == parameter.VAR_POSITIONAL) and name in (*cls.entry_counts, *inputs):
            problem = f"{cls.__name__}.{method} asks for '{'' if many else '*'}{name}'"
            raise TypeError(sentence(problem, f"write '{'*' if many else ''}{name}'"))
        if name in cls.entry_counts:
            names += [entry_name(name, number) for number in range(cls.entry_counts[name])]
        elif name == "inputs" and parameter.kind == parameter.VAR_POSITIONAL and hasattr(cls, PORTS):
            names += [name for name, port in inputs.items() if port.direct or method != "output"]
        else:
            names.append(name)
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
