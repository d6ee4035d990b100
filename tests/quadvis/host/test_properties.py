import math
from typing import Any

import pytest

from quadvis.errors import QuadvisError
from quadvis.host.properties import number_of, seconds
from quadvis.host.target import Target


class Asked:
    """A connection that notes what is asked of the target."""

    name = "bench"

    def __init__(self) -> None:
        self.verbs: list[tuple[str, dict[str, Any]]] = []

    def operate(self, verb: str, **arguments: Any) -> dict[str, Any]:
        self.verbs.append((verb, arguments))
        return {}

    def request(self, verb: str, **arguments: Any) -> dict[str, Any]:
        return self.operate(verb, **arguments)


@pytest.mark.parametrize(
    ("value", "found"),
    [("30 s", 30.0), ("5 ms", 0.005), ("inf", math.inf), (2, 2.0), (math.inf, math.inf), ("30", 30.0)],
)
def test_a_time_of_a_target_is_a_number_or_a_text_with_its_unit(value: Any, found: float) -> None:
    assert seconds("StopTime", value) == found


@pytest.mark.parametrize(
    ("value", "problem"),
    [
        ("soon", "StopTime: 'soon' does not begin with a number"),
        ("5 m", "StopTime: '5 m' is in m, not in s"),
        ("-1 s", "StopTime: a time must be between 0 s and 1e9 s"),
        (None, "'StopTime' cannot be 'None'; give a number"),
        ([1], "'StopTime' cannot be '[1]'; give a number"),
        (10**400, "'StopTime' cannot be '1000"),
    ],
)
def test_what_is_no_time_is_refused_in_a_sentence(value: Any, problem: str) -> None:
    with pytest.raises(QuadvisError) as caught:
        seconds("StopTime", value)
    assert problem in str(caught.value)


def test_what_is_no_number_is_refused_in_a_sentence() -> None:
    assert number_of("MaxLogSamples", "1000") == 1000.0
    with pytest.raises(QuadvisError, match="'MaxLogSamples' cannot be 'many'; give a number"):
        number_of("MaxLogSamples", "many")


def test_properties_are_set_with_what_people_write() -> None:
    asked = Asked()
    tg = Target(connection=asked)  # type: ignore[arg-type]
    tg.StopTime = "30 s"
    assert (asked.verbs[-1][0], asked.verbs[-1][1]["StopTime"]) == ("settime", 30.0)
    with pytest.raises(QuadvisError, match="'ViewMode' cannot be 'some'; give a number"):
        tg.ViewMode = "some"


@pytest.mark.parametrize(
    "given", [{"variant": "hil"}, {"settings": {"k": 3}}, {"stop_time": "3 s"}, {"name": "other"}]
)
def test_an_application_that_is_kept_is_not_loaded_as_another_one(given: dict[str, Any]) -> None:
    asked = Asked()
    tg = Target(connection=asked)  # type: ignore[arg-type]
    (name,) = given
    with pytest.raises(QuadvisError, match=f"'loop' is loaded as it is kept, without {name}; name the file"):
        tg.load("loop", **given)
    assert not asked.verbs
    tg.load("loop")
    assert asked.verbs[-1][0] == "load"
    with pytest.raises(
        QuadvisError, match="a target loads a path, a diagram, or an application's name, not '3'"
    ):
        tg.load(3)  # type: ignore[arg-type]


def test_one_signal_of_a_scope_may_be_given_by_its_name() -> None:
    class Numbering(Asked):
        def operate(self, verb: str, **arguments: Any) -> Any:
            super().operate(verb, **arguments)
            return 1

    asked = Numbering()
    Target(connection=asked).addscope(signals="wave.y")  # type: ignore[arg-type]
    assert asked.verbs[-1][1]["values"] == {"signals": ["wave.y"]}
