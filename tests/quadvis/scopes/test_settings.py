"""The settings of a scope: names, values, and what may change when."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.errors import QuadvisError
from quadvis.scopes.board import ScopeBoard
from quadvis.scopes.properties import READERS, property_name
from quadvis.scopes.settings import ScopeSettings
from tests.quadvis.scopes.model import source


def board(*settings: dict[str, Any]) -> ScopeBoard:
    made = ScopeBoard(source(), lambda package: None)
    for each in settings:
        made.add(ScopeSettings.read({"Signals": ["fast.x"], **each}))
    return made


def refused(call: Any, *arguments: Any) -> str:
    with pytest.raises(QuadvisError) as found:
        call(*arguments)
    return str(found.value)


@pytest.mark.parametrize("name", READERS)
def test_a_name_can_have_underscores(name: str) -> None:
    snake = "".join(f"_{letter.lower()}" if letter.isupper() else letter for letter in name).lstrip("_")
    assert property_name(snake) == property_name(name.lower()) == name


def test_settings_are_kept_in_one_form() -> None:
    given_ = {"type": "Target", "signals": "fast.x", "num_samples": 10.0, "trigger_mode": "freerun"}
    read = ScopeSettings.read({**given_, "grid": "off", "y_limit": [0, 2], "interleave": 3})
    plain = ScopeSettings(
        Type="target", Signals=("fast.x",), NumSamples=10, Grid=False, YLimit=(0.0, 2.0), Decimation=3
    )
    assert read == plain


@pytest.mark.parametrize(
    "given_, message",
    [
        ({"NumSample": 3}, "a scope has no property 'NumSample'; did you mean 'NumSamples'?"),
        (
            {"NumSamples": 3, "num_samples": 4},
            "NumSamples is given twice, also as 'num_samples'; give it once",
        ),
        ({"NumSamples": 0}, "NumSamples is '0'; give a whole number from 1 to 1000000000"),
        ({"NumSamples": True}, "NumSamples is 'True'; give a whole number from 1 to 1000000000"),
        ({"TriggerMode": "Singal"}, "TriggerMode is 'Singal'; did you mean 'Signal'?"),
        (
            {"TriggerLevel": float("nan")},
            "TriggerLevel is 'nan'; give a finite number, in the unit of the signal",
        ),
        ({"TriggerSample": -2}, "TriggerSample is '-2'; give a whole number from -1 to 1000000000"),
        ({"AutoRestart": "maybe"}, "AutoRestart is 'maybe'; give true or false"),
        ({"Signals": ["a.b", "a.b"]}, "the signal 'a.b' is there twice; name each signal once"),
        ({"Signals": 3}, "Signals are '3'; give a list of names such as 'craft.position[2]'"),
        ({"Type": "target", "YLimit": [2, 1]}, "YLimit goes from 2 to 1; give the least value first"),
        ({"Grid": False}, "Grid is for target scopes, and this is a host scope"),
        ({"Filename": "a.mcap"}, "Filename is for file scopes, and this is a host scope"),
    ],
)
def test_what_is_wrong_is_said_in_a_sentence(given_: dict[str, Any], message: str) -> None:
    assert refused(ScopeSettings.read, given_) == message


@pytest.mark.parametrize(
    "given_, message",
    [
        ({"Signals": []}, "scope 1 has no signals; give it Signals"),
        ({"TriggerMode": "Signal"}, "scope 1 waits for a signal; name it as its TriggerSignal"),
        ({"TriggerMode": "Scope"}, "scope 1 waits for another scope; give its number as TriggerScope"),
        ({"TriggerMode": "Scope", "TriggerScope": 7}, "scope 1 waits for scope 7, which is not there"),
        ({"TriggerMode": "Scope", "TriggerScope": 1}, "scope 1 waits for itself; give another TriggerScope"),
        ({"NumSamples": 3_000_000}, "NumSamples of scope 1 is above 2000000, the most for 1 trace"),
        ({"Type": "file"}, "scope 1 has no folder for its files; use a host scope"),
        (
            {"TriggerMode": "Software", "NumSamples": 3, "NumPrePostSamples": -4},
            "NumPrePostSamples of scope 1 is -4; a package has only 3 samples",
        ),
        (
            {"TriggerMode": "Software", "NumPrePostSamples": -200, "Decimation": 20_000},
            "NumPrePostSamples times Decimation of scope 1 is above 2000000, the most for 1 trace",
        ),
    ],
)
def test_a_scope_that_cannot_run_says_so_at_its_start(given_: dict[str, Any], message: str) -> None:
    made = board(given_)
    assert refused(made.start, 1) == message
    assert made[1].status == "Interrupted"


def test_a_running_scope_must_be_stopped_before_most_changes() -> None:
    made = board({"TriggerMode": "Signal", "TriggerSignal": "fast.x"})
    made.start(1)
    for name, value in {"NumSamples": 3, "Signals": ["slow.z"], "Decimation": 2}.items():
        assert refused(made.set, 1, {name: value}) == f"scope 1 is running; stop it before you change {name}"
    made.set(1, {"trigger_level": 2, "NumSamples": 250})  # the second one is no change
    assert made[1].settings.TriggerLevel == 2.0
    made.stop(1)
    made.set(1, {"NumSamples": 3, "Signals": ["slow.z"]})
    assert [trace.name for trace in made[1].plan.traces] == ["slow.z"]
    assert refused(made.set, 1, {"Type": "file"}) == (
        "scope 1 stays a host scope; add another one of the other type"
    )


def test_a_board_numbers_its_scopes_and_has_room_for_so_many() -> None:
    made = board(*[{}] * 3)
    made.remove(2)
    assert made.add(ScopeSettings()) == 2
    assert refused(made.add, ScopeSettings(), 3) == (
        "there is a scope 3 already; choose another number, or remove it"
    )
    assert refused(made.start, 9) == "there is no scope 9; there are: 1, 3, 2"
    for _ in range(8):
        made.add(ScopeSettings(Type="file"))
    assert refused(made.add, ScopeSettings(Type="file")) == (
        "there are 8 file scopes already; remove one first"
    )


def test_rows_that_come_late_or_in_no_order_are_refused() -> None:
    made = board()
    rows = np.zeros((2, 3), np.int64)
    made.feed("fast", np.array([0, 1]), rows)
    with pytest.raises(ValueError, match="come too late, or in no order"):
        made.feed("fast", np.array([1, 2]), rows)
    made.settle(10)
    with pytest.raises(ValueError, match="come too late, or in no order"):
        made.feed("fast", np.array([8, 9]), rows)


values = st.none() | st.booleans() | st.integers() | st.floats() | st.text() | st.lists(st.integers())


@given(st.dictionaries(st.sampled_from([*READERS, "x"]), values))
def test_any_values_make_settings_or_a_sentence(given_: dict[str, Any]) -> None:
    try:
        settings = ScopeSettings.read(given_)
    except QuadvisError as error:
        assert "\n" not in str(error)
    else:
        assert ScopeSettings.read(vars(settings)) == settings
