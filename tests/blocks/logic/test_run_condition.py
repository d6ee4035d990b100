"""Tests of the block logic.run_condition: when the blocks of a part run."""

import pytest

from quadvis.testing import drive
from quadvis_blocks.logic.run_condition import RunCondition


def bools(text: str) -> list[bool]:
    return [letter == "1" for letter in text]


def text(values: object) -> str:
    return "".join("1" if value else "0" for value in values)  # type: ignore[attr-defined]


def test_it_runs_while_it_is_enabled() -> None:
    driven = drive(RunCondition(), when=bools("0110"))
    assert text(driven.enabled) == text(driven.active) == "0110"
    assert text(driven.restart) == "0000"


@pytest.mark.parametrize(
    ("edge", "wanted"), [("rising", "00010010"), ("falling", "00100100"), ("either", "00110110")]
)
def test_it_runs_at_edges_and_the_start_is_none(edge: str, wanted: str) -> None:
    assert text(drive(RunCondition(trigger_on=edge), trigger=bools("11011011")).active) == wanted


def test_states_are_set_back_as_often_as_it_is_enabled() -> None:
    driven = drive(RunCondition(states="reset"), when=bools("0110011"))
    assert text(driven.restart) == "0100010"


def test_a_reset_is_an_edge_that_also_counts_while_disabled() -> None:
    driven = drive(RunCondition(reset_on="rising"), when=bools("111000"), reset=bools("101101"))
    assert text(driven.restart) == "001001"


def test_outputs_are_shown_from_the_first_run_on() -> None:
    when = bools("0110010")
    assert text(drive(RunCondition(), when=when).shown) == "0111111"
    assert text(drive(RunCondition(outputs="reset"), when=when).shown) == "0110010"


def test_a_disabled_part_around_it_disables_it() -> None:
    around = bools("1100110")
    driven = drive(RunCondition(states="reset"), when=True, around_enabled=around, around_active=around)
    assert text(driven.active) == "1100110"
    assert text(driven.restart) == "1000100"


def test_between_two_triggers_around_it_nothing_changes() -> None:
    driven = drive(
        RunCondition(states="reset"),
        when=bools("1010011"),
        around_enabled=True,
        around_active=bools("1001001"),
    )
    assert text(driven.active) == "1000001"
    assert text(driven.enabled) == "1110001"
    assert text(driven.restart) == "1000001"


def test_an_edge_of_the_trigger_while_disabled_is_lost() -> None:
    driven = drive(RunCondition(trigger_on="rising"), when=bools("001111"), trigger=bools("011101"))
    assert text(driven.active) == "000001"


def test_a_fixed_one_stays_as_it_was() -> None:
    driven = drive(RunCondition(states="reset", reset_on="rising"), when=[True, True], reset=[False, False])
    engine = driven.engine
    snapshot = engine.snapshot()
    with engine:
        engine.restore(snapshot)
        engine.write("block", "fixed", True)
        engine.run(1)
        assert engine.read("block", "active") is True
        assert engine.read("block", "restart") is False


def test_a_restored_snapshot_makes_no_edge() -> None:
    engine = drive(RunCondition(trigger_on="rising"), trigger=[False, True, True]).engine
    snapshot = engine.snapshot()
    with engine:
        engine.restore(snapshot)
        engine.run(1)
        assert engine.read("block", "active") is False
