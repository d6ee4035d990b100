"""State machines step by step, and what is refused when a diagram is loaded."""

from __future__ import annotations

import json
import re
from typing import Any

import numpy as np
import pytest

from quadvis.block import Block, ParameterError
from quadvis.testing import drive
from quadvis.testing.conformance import CHECKS, Subject
from quadvis_blocks.logic.state_machine import StateMachine

STATES = {
    "idle": {"speed": 0, "brake": True},
    "run": {"speed": "2 m/s", "brake": False},
    "hot": {"speed": "10 cm/s", "brake": True},
}
TRANSITIONS = [
    {"from": "idle", "to": "run", "when": "start and level > low"},
    {"from": "run", "to": "idle", "when": "not start"},
    {"from": "run", "to": "hot", "after": "0.3 s"},
    {"from": "hot", "to": "idle", "when": "level < low", "after": "0.2 s"},
]
GIVEN = {"states": STATES, "transitions": TRANSITIONS, "initial": "idle", "low": "1 m"}
INPUTS = ("start", "level")


def kind(*inputs: str, **given: Any) -> type[Block]:
    return StateMachine.named({**GIVEN, **given}, inputs or INPUTS)


def made(*inputs: str, **given: Any) -> Block:
    whole = {**GIVEN, "low": 1.0, **given}
    maps = {name: json.dumps(whole[name]) for name in ("states", "transitions")}
    return StateMachine.named(whole, inputs or INPUTS)(**{**whole, **maps})


def run(start: str, level: list[float] | float = 2.0, **given: Any) -> Any:
    """Return the outputs for a start signal such as "0011", ten ticks a second."""
    on = [sign == "1" for sign in start]
    return drive(made(**given), start=on, level=np.broadcast_to(level, len(on)), rate="10 Hz")


def test_states_follow_conditions_and_times() -> None:
    found = run("0111111111", [2, 2, 2, 2, 2, 2, 0, 0, 0, 2])
    assert found.signals["state"].tolist() == [0, 1, 1, 1, 2, 2, 0, 0, 0, 1]
    assert found.age == pytest.approx([0, 0, 0.1, 0.2, 0, 0.1, 0, 0.1, 0.2, 0])
    assert found.is_run.tolist() == [state == 1 for state in found.signals["state"]]
    assert found.speed.tolist() == [[0, 2, 0.1][state] for state in found.signals["state"]]
    assert found.brake.tolist() == [state != 1 for state in found.signals["state"]]


def test_the_first_tick_is_in_the_initial_state_whatever_the_conditions_say() -> None:
    assert run("1110").signals["state"].tolist() == [0, 1, 1, 0]
    assert run("0000", initial="run").signals["state"].tolist() == [1, 0, 0, 0]
    assert run("0000", initial="run").age == pytest.approx([0, 0, 0.1, 0.2])


def test_time_counts_from_the_first_tick() -> None:
    assert run("11111", initial="run").signals["state"].tolist() == [1, 1, 1, 2, 2]


def test_the_first_transition_that_can_be_taken_is_taken() -> None:
    both = [
        {"from": "idle", "to": "hot", "when": "start"},
        {"from": "idle", "to": "run", "when": "start or level > low"},
        {"from": "any", "to": "idle", "when": "not start"},
    ]
    assert run("011", 0.0, transitions=both).signals["state"].tolist() == [0, 2, 2]
    assert run("0110", transitions=[both[1], both[0], *both[2:]][:1] + both[::2]).signals[
        "state"
    ].tolist() == [
        0,
        1,
        1,
        0,
    ]


def test_one_transition_is_taken_at_each_tick() -> None:
    chain = [
        {"from": "idle", "to": "run", "when": "start and level > low"},
        {"from": "run", "to": "hot"},
    ]
    assert run("1111", transitions=chain).signals["state"].tolist() == [0, 1, 2, 2]


def test_several_states_may_share_a_transition() -> None:
    shared = [*TRANSITIONS[:1], {"from": ["run", "hot"], "to": "idle", "when": "not start"}, TRANSITIONS[2]]
    assert run("011000", transitions=shared).signals["state"].tolist() == [0, 1, 1, 0, 0, 0]


def test_units_of_values_and_conditions_are_found() -> None:
    interface = kind().interface
    assert interface.outputs["speed"].unit == "m/s"
    assert interface.outputs["brake"].type == "bool"
    assert interface.inputs["level"].unit == interface.params["low"].unit
    other = kind(transitions=replaced(0, when="start and level > low + 2 m"))
    assert other.interface.inputs["level"].unit == "m"


def replaced(number: int, **change: Any) -> list[dict[str, Any]]:
    """Return the transitions with one that is different; None takes a key away."""
    new = {key: value for key, value in {**TRANSITIONS[number], **change}.items() if value is not None}
    return [*TRANSITIONS[:number], new, *TRANSITIONS[number + 1 :]]


MOVE = "put it before that one, or leave it out"
WRONG = [
    (
        {"states": {**STATES, "lost": STATES["run"]}},
        "no transition leads from 'idle' to the state 'lost'; add one, or leave the state out",
    ),
    (
        {"transitions": replaced(3, **{"from": "run", "when": None, "after": "0.4 s"})},
        "transition 4 can never be taken, since 3 is always taken before; " + MOVE,
    ),
    (
        {"transitions": [*TRANSITIONS, {**TRANSITIONS[1], "to": "hot"}]},
        "transition 5 can never be taken, since 2 is always taken before; " + MOVE,
    ),
    (
        {"transitions": replaced(1, to="idel")},
        "transition 2: there is no state 'idel'; did you mean 'idle'?",
    ),
    (
        {"transitions": replaced(1, wen="start")},
        "transition 2 has the unknown key 'wen'; did you mean 'when'?",
    ),
    (
        {"transitions": replaced(1, to=None)},
        "transition 2 lacks 'from' or 'to'; write {from: idle, to: run, when: 'u > 2 m', after: 1 s}",
    ),
    (
        {"transitions": replaced(2, after="0.3 m")},
        "transition 3: 'after' is '0.3 m'; write a time such as '2 s'",
    ),
    (
        {"transitions": replaced(2, after="0.3")},
        "transition 3: 'after' is '0.3'; write a time such as '2 s'",
    ),
    (
        {"transitions": replaced(1, when="not strat")},
        "transition 2: 'not strat' holds 'strat', which is neither an input nor a parameter; "
        "did you mean 'start'?",
    ),
    (
        {"transitions": replaced(1, when="level + low")},
        "the condition of transition 2 is a number; compare it, as in 'u > 0'",
    ),
    (
        {"transitions": replaced(1, when="level > 1 s and level > 1 m")},
        "'>' joins s and m; give both the same unit",
    ),
    (
        {"transitions": "all"},
        "transitions must be a list of {from, to, when, after}",
    ),
    (
        {"states": {"idle": {"speed": 0}, "run": {}, "hot": {"speed": 1}}},
        "state 'run' has no value 'speed'; give each state one",
    ),
    (
        {"states": {"idle": {"speed": "1 m"}, "run": {"speed": "2 s"}, "hot": {"speed": 0}}},
        "value 'speed' is in m and in s; give all states the same unit",
    ),
    (
        {"states": ["idle", "run", "any"]},
        "a state cannot be called 'any'; use letters and digits",
    ),
    (
        {"states": []},
        "states must be a list of names, or a map of names to values",
    ),
    (
        {"high": "3 m"},
        "no condition has 'high'; leave it out, or use it",
    ),
]


@pytest.mark.parametrize(("given", "words"), WRONG)
def test_faults_say_what_is_wrong(given: dict[str, Any], words: str) -> None:
    with pytest.raises(ParameterError, match=f"^{re.escape(words)}$"):
        kind(**given)


def test_states_and_transitions_and_the_initial_state_must_be_given() -> None:
    with pytest.raises(ParameterError, match="parameter 'transitions' is missing"):
        StateMachine.named({"states": STATES}, INPUTS)
    assert kind().interface.params["initial"].required


def test_transitions_are_drawn() -> None:
    assert made().picture_lines()[:2] == ("idle → run: start and level > low", "run → idle: not start")


SUBJECT = {
    "states": json.dumps(STATES),
    "transitions": json.dumps(TRANSITIONS),
    "initial": "idle",
    "low": 0.1,
}


@pytest.mark.parametrize("check", [check for check in CHECKS if check not in ("tested", "compiles")])
def test_machines_conform(check: str) -> None:
    CHECKS[check](Subject(kind(), SUBJECT))


@pytest.mark.slow
def test_machines_are_compiled() -> None:
    CHECKS["compiles"](Subject(kind(), SUBJECT))
