"""A state machine."""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np

from quadvis.block import Block, Derived, In, Out, Param, ParameterError, State, Work
from quadvis.block.instants import INSTANT
from quadvis.errors import quoted
from quadvis.units import UnitError
from quadvis.units.expression import Tree, names_of
from quadvis_blocks._expressions.code import CONSTANTS, CodeWriter, is_name, is_parameter, made, with_signals
from quadvis_blocks._expressions.kinds import Kinds
from quadvis_blocks._expressions.machine import (
    INITIAL,
    STATES,
    TRANSITIONS,
    Machine,
    check_machine,
    plain,
    read_machine,
)

OFF_ON = '["off", "on"]'
OWN = ("now", "entered", "begun", "following", "since")  # attributes of a machine
SWITCHED = '[{"from": "off", "to": "on", "when": "u"}, {"from": "on", "to": "off", "when": "not u"}]'


class StateMachine(Block):
    """States, and transitions between them by conditions on inputs and by time.

    ``states`` are names, or a map of names to values; each value becomes an output. ``transitions`` is a list
    of ``{from: idle, to: run, when: level > 2 m and start, after: 1 s}``: taken if the condition holds and
    the machine has been in the state for this time; one of both may be left out; ``from`` is a state, a list
    of states, or ``any``. The first one in the list that can be taken is taken, one at each tick, and outputs
    are those of the new state at that tick. At its first tick the machine is in its initial state, whatever
    the conditions say. Names in conditions are inputs, or parameters under ``with``. ``state`` is the number
    of the state, ``is_NAME`` says whether it is this one. Without ``states`` it is off or on, as u is.
    """

    free_names = "states, values, parameters and inputs"
    states = Param(OFF_ON, type="map", doc="names of states, or a map of names to values")
    transitions = Param(SWITCHED, type="map", doc="list of {from, to, when, after}, by priority")
    initial = Param("off", choices=("off", "on"), doc="the state at the first tick")
    u = In("bool", doc="a signal of the conditions")
    state = Out("int64", doc="number of the state, in the order of states, from 0")
    age = Out(unit="s", doc="time since the state was entered")
    now = State("int64", doc="number of the state")
    entered = State(doc="when it was entered (s)")
    begun = State("bool", doc="whether a tick has been")
    following = Work("int64", doc="the state from this tick on")
    since = Work(doc="when that was entered (s)")
    constants: ClassVar[tuple[float, ...]] = ()
    tables: ClassVar[Mapping[str, tuple[Any, ...]]] = {}

    example = """
        level: {block: sources.sine, rate: fast, with: {amplitude: 2 m, frequency: 0.5 Hz}}
        mode:
          block: logic.state_machine
          rate: fast
          with:
            states: {idle: {speed: 0}, run: {speed: 2 m/s}, stopped: {speed: 0}}
            initial: idle
            transitions:
              - {from: idle, to: run, when: level > high}
              - {from: run, to: stopped, after: 0.2 s}
              - {from: stopped, to: idle, when: level < 0}
            high: 1.5 m
          in: {level: level.y}
    """

    @classmethod
    def named(cls, given: Mapping[str, Any], inputs: Collection[str]) -> type[Block]:
        """Return the class for the states, transitions and values under ``with``."""
        for name in (STATES, TRANSITIONS):
            if name not in given:
                raise ParameterError("", f"parameter '{name}' is missing; give it under 'with'")
        texts = tuple(json.dumps(plain(given[name])) for name in (STATES, TRANSITIONS))
        values = tuple(name for name in given if name not in (STATES, TRANSITIONS, INITIAL))
        initial = given.get(INITIAL)
        base: Any = cls
        return _kind(base, texts, initial if isinstance(initial, str) else None, values, tuple(inputs))

    def picture_lines(self) -> tuple[str, ...]:
        """Return a line for each transition."""
        made_for = self.interface.params
        names = [*self.interface.inputs, *made_for]
        return tuple(read_machine(self.states, self.transitions, names).lines())

    def check(self) -> None:
        """Lay numbers and values of states down in memory."""
        if self.constants:
            setattr(self, CONSTANTS, np.array(self.constants))
        for name, table in self.tables.items():
            setattr(self, name, np.array(table))

    def start(self) -> None:
        """Begin in the initial state."""
        self.now = self.initial

    def output(self, time: float, u: bool) -> Any:
        """Return the state and its age."""
        following = (1 if u else 0) if self.begun else self.now
        self.following = following
        self.since = self.entered if self.begun and following == self.now else time
        return following, time - self.since

    def update(self) -> None:
        """Go on to the state that was returned."""
        self.now = self.following
        self.entered = self.since
        self.begun = True


@lru_cache(maxsize=256)
def _kind(
    cls: Any, texts: tuple[str, str], initial: str | None, values: tuple[str, ...], inputs: tuple[str, ...]
) -> type[Block]:
    for name in (*values, *inputs):
        right = is_name(name) if name in inputs else is_parameter(name)
        if not right or (name in values and name in OWN):
            raise ParameterError(name, f"{quoted(name)} cannot be a name here; choose another one")
    machine = read_machine(*texts, (*inputs, *values))
    if initial in machine.states:
        check_machine(machine, machine.states.index(initial))
    trees = [each.when for each in machine.transitions if each.when is not None]
    used = {name for tree in trees for name in names_of(tree)}
    for name in (*values, *inputs):
        if name not in used:
            raise ParameterError(name, f"no condition has {quoted(name)}; leave it out, or use it")
    outputs = _outputs(machine)
    for name in outputs:
        if name in (*values, *inputs, STATES, TRANSITIONS, INITIAL):
            problem = f"an output is called {quoted(name)}, too"
            raise ParameterError(STATES, f"{problem}; choose another name")
    return _made(cls, machine, outputs, values, inputs)


def _outputs(machine: Machine) -> dict[str, Out]:
    found = {
        "state": Out("int64", doc="number of the state, in the order of states, from 0"),
        "age": Out(unit="s", doc="time since the state was entered"),
    }
    for state in machine.states:
        found[f"is_{state}"] = Out("bool", doc=f"whether the state is {state}")
    for name, (_, unit) in machine.values.items():
        if name in found or not is_name(name):
            raise ParameterError(STATES, f"a value cannot be called {quoted(name)}; choose another name")
        found[name] = Out("float64" if unit else "bool", unit=unit or "1", doc="the value of the state")
    return found


def _made(
    cls: Any, machine: Machine, outputs: Mapping[str, Out], values: tuple[str, ...], inputs: tuple[str, ...]
) -> type[Block]:
    kinds = _kinds(machine, (*values, *inputs))
    words = {name: f"self.{name}" for name in values} | {name: name for name in inputs}
    writer = CodeWriter(words, f"self.{CONSTANTS}")
    tables = {f"_{name}": table for name, (table, _) in machine.values.items()}
    results = ["_n", "time - self.since", *(f"_n == {index}" for index in range(len(machine.states)))]
    results += [f"self._{name}[_n]{'' if unit else ' != 0'}" for name, (_, unit) in machine.values.items()]
    lines = [
        f"def output({', '.join(['self', 'time', *inputs])}):",
        "    _n = self.now",
        "    if self.begun:",
        *(f"        {line}" for line in _steps(machine, writer)),
        "    self.following = _n",
        "    self.since = self.entered if self.begun and _n == self.now else time",
        f"    return {', '.join(results)}",
        "",
    ]
    doc = "a value of the conditions"
    members: dict[str, Any] = {
        "u": None, "state": None, "age": None, "output": _nothing,
        STATES: Param(type="map", doc="names of states, or a map of names to values"),
        TRANSITIONS: Param(type="map", doc="list of {from, to, when, after}, by priority"),
        INITIAL: Param(choices=machine.states, doc="the state at the first tick"),
        "constants": tuple(writer.constants), "tables": tables, "made_for": {},
        "__doc__": cls.__doc__, "__module__": cls.__module__,
    }  # fmt: skip
    count = len(writer.constants)
    if count:
        members[CONSTANTS] = Derived(f"float64[{count}]", doc="numbers of the conditions (SI)")
    for name, (_, unit) in machine.values.items():
        members[f"_{name}"] = Derived(f"{'float64' if unit else 'bool'}[{len(machine.states)}]", doc="values")

    def kind_of(name: str) -> tuple[str, str]:
        return ("bool", "1") if kinds.is_truth(name) else ("float64", str(kinds.unit(name).reduced))

    for name in values:
        kind, unit = kind_of(name)
        members[name] = Param(None, kind, unit, tune=True, doc=doc)
    ports = {name: In(kind_of(name)[0], unit=kind_of(name)[1], doc=doc) for name in inputs}
    found: type[Block] = type(cls.__name__, (cls,), members)
    return with_signals(found, made("\n".join(lines))["output"], ("time", *inputs), ports, outputs)


def _nothing(self: Any) -> None:
    """Stand in for a method until the ports are there."""


def _kinds(machine: Machine, names: tuple[str, ...]) -> Kinds:
    """Return the kinds of the names in conditions, which must give truth values."""
    conditions: dict[str, Tree] = {}
    for number, each in enumerate(machine.transitions, 1):
        if each.when is not None:
            conditions[f"transition {number}"] = each.when
    try:
        kinds = Kinds(names, conditions)
    except UnitError as error:
        raise ParameterError(TRANSITIONS, str(error)) from None
    for name in conditions:
        if not kinds.is_truth(name):
            problem = f"the condition of {name} is a number"
            raise ParameterError(TRANSITIONS, f"{problem}; compare it, as in 'u > 0'")
    return kinds


def _steps(machine: Machine, writer: CodeWriter) -> list[str]:
    """Return the lines that choose the next state: for each state, its transitions in their order."""
    lines: list[str] = []
    for source in range(len(machine.states)):
        own = [each for each in machine.transitions if source in each.sources]
        if not own:
            continue
        lines.append(f"{'elif' if lines else 'if'} self.now == {source}:")
        for index, each in enumerate(own):
            parts = [writer.text(each.when)] if each.when is not None else []
            if each.after:
                parts.append(f"time - self.entered >= {writer.number(each.after - INSTANT)}")
            lines.append(f"    {'elif' if index else 'if'} {' and '.join(parts) or 'True'}:")
            lines.append(f"        _n = {each.target}")
    return lines or ["pass"]
