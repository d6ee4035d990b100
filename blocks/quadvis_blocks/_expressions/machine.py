"""State machines as diagrams declare them: states with values, and transitions; checked as a whole."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from quadvis.block import ParameterError
from quadvis.errors import quoted, sentence, suggestion
from quadvis.units import Unit, UnitError, parse_quantity
from quadvis.units.expression import Tree, parse_expression

STATES, TRANSITIONS, INITIAL = "states", "transitions", "initial"
ANY = "any"
KEYS = ("from", "to", "when", "after")
MOST_STATES = 100
_SECOND = Unit.parse("s")


class Transition(NamedTuple):
    """A way from states to another one, by their numbers, if a condition holds and after a time (s)."""

    sources: tuple[int, ...]
    target: int
    when: Tree | None
    after: float
    text: str


class Machine(NamedTuple):
    """States by name, the values of each with their unit ("" of truth values), and transitions in order."""

    states: tuple[str, ...]
    values: Mapping[str, tuple[tuple[float, ...] | tuple[bool, ...], str]]  # "": no unit
    transitions: tuple[Transition, ...]

    def lines(self) -> Iterator[str]:
        """Yield a line for each transition, as people read it."""
        for transition in self.transitions:
            names = [self.states[index] for index in transition.sources]
            every = len(names) == len(self.states) - 1 and len(names) > 1
            source = ANY if every else ", ".join(names)
            yield f"{source} → {self.states[transition.target]}: {transition.text}"


def plain(value: Any) -> Any:
    """Return a map or list that may be written as a text."""
    if not isinstance(value, str):
        return value
    try:
        return json.loads(value)
    except ValueError:
        return value


def read_machine(states: Any, transitions: Any, names: Collection[str]) -> Machine:
    """Return the machine of two parameters; ``names`` may stand in conditions.

    ParameterError says what is wrong.
    """
    found = _states(plain(states))
    values = dict(_values(found))
    listed = plain(transitions)
    if not isinstance(listed, list):
        raise ParameterError(TRANSITIONS, "transitions must be a list of {from, to, when, after}")
    names_of_states = tuple(found)
    read = tuple(
        _transition(f"transition {number}", each, names_of_states, names)
        for number, each in enumerate(listed, 1)
    )
    return Machine(names_of_states, values, read)


def check_machine(machine: Machine, initial: int) -> None:
    """Refuse states that are never reached, and transitions that are never taken."""
    reached, waiting = {initial}, [initial]
    while waiting:
        source = waiting.pop()
        for transition in machine.transitions:
            if source in transition.sources and transition.target not in reached:
                reached.add(transition.target)
                waiting.append(transition.target)
    for index, name in enumerate(machine.states):
        if index not in reached:
            first = quoted(machine.states[initial])
            problem = f"no transition leads from {first} to the state {quoted(name)}"
            raise ParameterError(STATES, sentence(problem, "add one, or leave the state out"))
    for number, transition in enumerate(machine.transitions):
        earlier = machine.transitions[:number]
        hidden = [_hidden_by(earlier, transition, source) for source in transition.sources]
        if all(hidden):
            words = f"transition {number + 1} can never be taken, since {hidden[0]} is always taken before"
            raise ParameterError(TRANSITIONS, sentence(words, "put it before that one, or leave it out"))


def _hidden_by(earlier: Sequence[Transition], transition: Transition, source: int) -> int:
    """Return the number of an earlier transition that always comes first from a state; 0 if none does."""
    for number, other in enumerate(earlier, 1):
        same = other.when is None or other.when == transition.when
        if source in other.sources and same and other.after <= transition.after:
            return number
    return 0


def _states(given: Any) -> dict[str, Mapping[str, Any]]:
    if isinstance(given, list) and all(isinstance(name, str) for name in given):
        given = dict.fromkeys(given)
    if not isinstance(given, dict) or not given:
        raise ParameterError(STATES, "states must be a list of names, or a map of names to values")
    if len(given) > MOST_STATES:
        raise ParameterError(STATES, f"there are {len(given)} states; at most {MOST_STATES} can be")
    for name, values in given.items():
        if not name.isidentifier() or name == ANY:
            raise ParameterError(STATES, f"a state cannot be called {quoted(name)}; use letters and digits")
        if values is not None and not isinstance(values, dict):
            problem = f"state {quoted(name)} must have a map of values"
            raise ParameterError(STATES, sentence(problem, "write such as {speed: 2 m/s}"))
    return {name: values or {} for name, values in given.items()}


def _values(states: Mapping[str, Mapping[str, Any]]) -> Iterator[tuple[str, tuple[Any, str]]]:
    names = dict.fromkeys(name for values in states.values() for name in values)
    for name in names:
        missing = [state for state, values in states.items() if name not in values]
        if missing:
            problem = f"state {quoted(missing[0])} has no value {quoted(name)}"
            raise ParameterError(STATES, sentence(problem, "give each state one"))
        yield name, _value(name, [values[name] for values in states.values()])


def _value(name: str, given: Sequence[Any]) -> tuple[Any, str]:
    if all(isinstance(value, bool) for value in given):
        return tuple(given), ""
    try:
        read = [parse_quantity(str(value)) for value in given]
    except UnitError as error:
        raise ParameterError(STATES, f"value {quoted(name)}: {error}") from None
    units = [unit.si for (value, unit) in read if value or unit.dimension] or [Unit()]
    for unit in units:
        if not unit.dimension_equals(units[0]):
            problem = f"value {quoted(name)} is in {units[0]} and in {unit}"
            raise ParameterError(STATES, sentence(problem, "give all states the same unit"))
    return tuple(value for value, _ in read), str(units[0])


def _transition(label: str, given: Any, states: tuple[str, ...], names: Collection[str]) -> Transition:
    if not isinstance(given, dict) or not {"from", "to"} <= given.keys() or not given.keys() <= {*KEYS}:
        odd = next((key for key in given if key not in KEYS), "") if isinstance(given, dict) else ""
        remedy = suggestion(odd, KEYS) if odd else "write {from: idle, to: run, when: 'u > 2 m', after: 1 s}"
        problem = f"{label} has the unknown key {quoted(odd)}" if odd else f"{label} lacks 'from' or 'to'"
        raise ParameterError(TRANSITIONS, sentence(problem, remedy))
    target = _index(label, given["to"], states)
    sources = given["from"] if isinstance(given["from"], list) else [given["from"]]
    if sources == [ANY]:
        found = tuple(index for index in range(len(states)) if index != target)
    else:
        found = tuple(_index(label, name, states) for name in sources)
    when = after = None
    try:
        if "when" in given:
            when = parse_expression(_text(given["when"]), names)
        after, unit = parse_quantity(_text(given.get("after", 0)))
        if after < 0 or (after and not unit.dimension_equals(_SECOND)):
            raise UnitError(f"'after' is {quoted(given['after'])}", "write a time such as '2 s'")
    except UnitError as error:
        raise ParameterError(TRANSITIONS, f"{label}: {error}") from None
    words = [f"after {given['after']}"] if "after" in given else []
    words = [*([_text(given["when"])] if "when" in given else []), *words]
    return Transition(found, target, when, after, ", ".join(words) or "at once")


def _text(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def _index(label: str, name: Any, states: tuple[str, ...]) -> int:
    if name not in states:
        problem = f"{label}: there is no state {quoted(name)}"
        raise ParameterError(TRANSITIONS, sentence(problem, suggestion(str(name), states)))
    return states.index(name)
