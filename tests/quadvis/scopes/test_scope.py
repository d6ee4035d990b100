"""The rules of xPC Target's scopes, one by one."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from quadvis.errors import QuadvisError
from quadvis.scopes.board import ScopeBoard
from quadvis.scopes.package import Package
from quadvis.scopes.settings import ScopeSettings
from tests.quadvis.scopes.model import source

RAMP = np.arange(100.0)
SAW = np.arange(100.0) % 10 - 5  # crosses 0 upwards at 5, 15, ..., falls to -5 at 10, 20, ...


class Bench:
    """A board with the signal fast.x, fed tick by tick or in pieces."""

    def __init__(self, *settings: dict[str, Any], values: np.ndarray = RAMP) -> None:
        self.packages: list[Package] = []
        self.values = values
        self.board = ScopeBoard(source(), self.packages.append)
        for each in settings:
            self.board.add(ScopeSettings.read({"Signals": ["fast.x"], **each}))

    def to(self, tick: int, missing: tuple[int, ...] = ()) -> None:
        ticks = np.array([t for t in range(self.board.settled, tick) if t not in missing], np.int64)
        rows = np.zeros((len(ticks), 3))
        rows[:, 0] = self.values[ticks]
        self.board.feed("fast", ticks, rows.view(np.int64))
        self.board.settle(tick)

    def status(self, number: int = 1) -> str:
        return self.board[number].status

    def ticks(self, number: int = 1) -> list[list[int]]:
        return [each.ticks.tolist() for each in self.packages if each.scope == number]


def test_a_host_scope_in_freerun_hands_on_package_after_package_without_a_gap() -> None:
    bench = Bench({"NumSamples": 4, "NumPrePostSamples": -3})
    assert bench.status() == "Interrupted"
    bench.board.start(1)
    assert bench.status() == "Acquiring"
    bench.to(10)
    assert bench.ticks() == [[0, 1, 2, 3], [4, 5, 6, 7]]
    assert [each.sequence for each in bench.packages] == [0, 1]
    assert bench.packages[1].trigger is None
    assert bench.packages[1].times.tolist() == [0.004, 0.005, 0.006, 0.007]
    assert bench.packages[1].samples.tolist() == [[4], [5], [6], [7]]
    assert bench.status() == "Acquiring"


def test_a_host_scope_collects_one_package_and_is_finished_until_it_is_started_again() -> None:
    bench = Bench({"NumSamples": 3, "TriggerMode": "Software"})
    bench.board.start(1)
    assert bench.status() == "Ready for being Triggered"
    bench.to(5)
    bench.board.trigger(1)
    bench.to(7)
    assert bench.status() == "Acquiring"
    bench.to(9)
    assert (bench.status(), bench.ticks()) == ("Finished", [[5, 6, 7]])
    with pytest.raises(QuadvisError, match="scope 1 does not wait for a trigger; start it first"):
        bench.board.trigger(1)
    bench.board.start(1)
    assert bench.status() == "Ready for being Triggered"
    bench.board.trigger(1)
    bench.to(20)
    assert bench.ticks()[1:] == [[9, 10, 11]]


@pytest.mark.parametrize("settings", [{"AutoRestart": "on"}, {"Type": "target"}])
def test_a_target_scope_and_one_with_autorestart_wait_for_the_next_trigger(settings: dict[str, Any]) -> None:
    rest = {"NumSamples": 2, "TriggerMode": "Signal", "TriggerSignal": "fast.x", "TriggerSlope": "Rising"}
    bench = Bench({**rest, **settings}, values=SAW)
    bench.board.start(1)
    bench.to(30)
    assert bench.ticks() == [[5, 6], [15, 16], [25, 26]]
    assert bench.status() == "Ready for being Triggered"


@pytest.mark.parametrize(
    "slope, first",
    [("Rising", [5, 15, 25]), ("Falling", [10, 20, 30]), ("Either", [5, 10, 15, 20, 25, 30])],
)
def test_a_signal_triggers_at_the_sample_at_which_it_passes_the_level(slope: str, first: list[int]) -> None:
    settings = {"NumSamples": 1, "TriggerMode": "Signal", "TriggerSignal": "fast.x", "AutoRestart": True}
    bench = Bench({**settings, "TriggerSlope": slope}, values=SAW)
    bench.board.start(1)
    bench.to(35)
    assert bench.ticks() == [[tick] for tick in first]


@pytest.mark.parametrize(
    "shift, ticks", [(-3, [17, 18, 19, 20]), (0, [20, 21, 22, 23]), (2, [22, 23, 24, 25])]
)
def test_samples_before_and_after_the_trigger(shift: int, ticks: list[int]) -> None:
    bench = Bench({"NumSamples": 4, "NumPrePostSamples": shift, "TriggerMode": "Software"})
    bench.board.start(1)
    bench.to(20)
    bench.board.trigger(1)
    bench.to(40)
    assert bench.ticks() == [ticks]
    assert bench.packages[0].trigger == -shift


def test_pre_and_post_samples_are_counted_after_decimation() -> None:
    bench = Bench({"NumSamples": 4, "NumPrePostSamples": -2, "Decimation": 5, "TriggerMode": "Software"})
    bench.board.start(1)
    bench.to(9)
    assert bench.status() == "Acquiring"
    bench.board.trigger(1)  # has its effect when the samples before it are there
    bench.to(40)
    assert bench.ticks() == [[0, 5, 10, 15]]


def test_a_scope_is_not_triggered_before_its_ring_is_full() -> None:
    settings = {"TriggerMode": "Signal", "TriggerSignal": "fast.x", "TriggerSlope": "Rising"}
    bench = Bench({"NumSamples": 7, "NumPrePostSamples": -6, **settings, "AutoRestart": True}, values=SAW)
    bench.board.start(1)
    bench.to(6)
    assert bench.status() == "Ready for being Triggered"
    bench.to(60)
    # 5 is too early. The package ends at its trigger; six samples later all is ready for 25.
    assert bench.ticks() == [list(range(tick - 6, tick + 1)) for tick in (15, 25, 35, 45, 55)]


def test_a_scope_triggers_another_one_at_any_of_its_samples() -> None:
    """n = 0 .. N + P - 1 trigger it, larger ones never do."""
    for sample in range(8):
        bench = Bench(
            {"NumSamples": 4, "NumPrePostSamples": 2, "Decimation": 2, "TriggerMode": "Software"},
            {"NumSamples": 2, "TriggerMode": "Scope", "TriggerScope": 1, "TriggerSample": sample},
        )
        bench.board.start(2)
        bench.board.start(1)
        bench.to(10)
        bench.board.trigger(1)
        bench.to(50)
        assert bench.ticks(1) == [[14, 16, 18, 20]]
        start = 10 + 2 * sample
        assert bench.ticks(2) == ([[start, start + 1]] if sample <= 4 + 2 - 1 else [])


def test_a_delay_of_the_trigger_and_of_the_samples_is_the_same() -> None:
    """xPC Target: TriggerSample 10 does what NumPrePostSamples 10 does at TriggerSample 0."""
    found = []
    for sample, shift in ((10, 0), (0, 10)):
        second = {"TriggerMode": "Scope", "TriggerScope": 1, "TriggerSample": sample}
        bench = Bench(
            {"NumSamples": 20, "TriggerMode": "Software"},
            {"NumSamples": 5, "NumPrePostSamples": shift, **second},
        )
        for number in (1, 2):
            bench.board.start(number)
        bench.board.trigger(1)
        bench.to(40)
        found.append(bench.ticks(2))
    assert found == [[[10, 11, 12, 13, 14]]] * 2


@pytest.mark.parametrize("step", [1, 3])
def test_two_scopes_that_trigger_each_other_at_their_ends_acquire_without_a_gap(step: int) -> None:
    rest = {"NumSamples": 5, "TriggerMode": "Scope", "TriggerSample": -1, "Decimation": step}
    bench = Bench({**rest, "TriggerScope": 2}, {**rest, "TriggerScope": 1})
    for number in (1, 2):
        bench.board.start(number)
    bench.to(4)
    bench.board.trigger(1)
    started = 0
    for tick in range(5, 100):
        bench.to(tick)
        for number in (1, 2):  # as the script of the manual: upload, then start it again
            if bench.status(number) == "Finished":
                bench.board.start(number)
                started += 1
    whole = [tick for each in bench.packages for tick in each.ticks.tolist()]
    assert whole == list(range(4, 4 + step * len(whole), step))
    assert [each.scope for each in bench.packages] == ([1, 2] * 20)[: len(bench.packages)]
    assert started == len(bench.packages) > 3


def test_a_gap_free_double_scope_loses_no_sample_in_60_s() -> None:
    """Seven traces at 1 kHz, rows in batches of 20 ms."""
    rows = np.random.default_rng(1).standard_normal((60_000, 3))
    packages: list[Package] = []
    board = ScopeBoard(source(), packages.append)
    signals = ["fast.x", "fast.v", "fast.v[0]", "fast.v[1]", "fast.v[:1]", "fast.v[1:]"]
    for other in (2, 1):
        board.add(
            ScopeSettings.read(
                {"Signals": signals, "NumSamples": 256, "TriggerMode": "Scope", "TriggerScope": other}
                | {"TriggerSample": -1, "AutoRestart": True}
            )
        )
    for number in (1, 2):
        board.start(number)
    board.trigger(1)
    for tick in range(0, 60_000, 20):
        board.feed("fast", np.arange(tick, tick + 20), rows[tick : tick + 20].view(np.int64))
        board.settle(tick + 20)
    ticks = np.concatenate([each.ticks for each in packages])
    assert np.array_equal(ticks, np.arange(60_000 // 256 * 256))
    samples = np.concatenate([each.samples for each in packages])
    assert np.array_equal(samples, rows[: len(ticks)][:, [0, 1, 2, 1, 2, 1, 2]])
    assert sum(each.lost for each in packages) == 0


def test_a_package_says_how_many_ticks_the_run_left_out() -> None:
    bench = Bench({"NumSamples": 4})
    bench.board.start(1)
    bench.to(20, missing=(2, 3, 6, 7, 8))
    assert bench.ticks() == [[0, 1, 4, 5], [9, 10, 11, 12], [13, 14, 15, 16]]
    assert [each.lost for each in bench.packages] == [2, 3, 0]


def test_stop_interrupts_and_forgets_the_samples_of_a_host_scope() -> None:
    bench = Bench({"NumSamples": 4})
    bench.board.start(1)
    bench.to(6)
    bench.board.stop(1)
    assert bench.status() == "Interrupted"
    bench.to(20)
    bench.board.start(1)
    bench.to(30)
    assert bench.ticks() == [[0, 1, 2, 3], [20, 21, 22, 23], [24, 25, 26, 27]]


def test_a_scope_that_is_added_later_is_triggered_by_the_samples_that_are_to_come() -> None:
    bench = Bench({"NumSamples": 20, "TriggerMode": "Software"})
    bench.board.start(1)
    bench.board.trigger(1)
    bench.to(5)
    rest = {"Signals": ["fast.x"], "NumSamples": 1, "TriggerMode": "Scope", "TriggerScope": 1}
    for sample in (2, 10):
        bench.board.start(bench.board.add(ScopeSettings.read({**rest, "TriggerSample": sample})))
    bench.to(30)
    assert (bench.ticks(2), bench.ticks(3)) == ([], [[10]])


def test_a_trigger_that_comes_too_early_is_missed() -> None:
    bench = Bench(
        {"NumSamples": 3, "TriggerMode": "Software"},
        {"NumSamples": 6, "NumPrePostSamples": -5, "TriggerMode": "Scope", "TriggerScope": 1},
    )
    for number in (1, 2):
        bench.board.start(number)
    bench.board.trigger(1)
    bench.to(30)
    assert (bench.ticks(1), bench.ticks(2), bench.status(2)) == ([[0, 1, 2]], [], "Ready for being Triggered")


def test_scopes_of_other_rates_are_triggered_at_their_next_sample() -> None:
    bench = Bench({"NumSamples": 2, "TriggerMode": "Software"})
    number = bench.board.add(
        ScopeSettings(Signals=("slow.z",), NumSamples=2, TriggerMode="Scope", TriggerScope=1)
    )
    for each in (1, number):
        bench.board.start(each)
    bench.to(4)
    bench.board.trigger(1)
    slow = np.arange(0, 60, 3)
    rows = np.stack([np.zeros(20), slow / 1.0], 1)
    bench.to(5)
    bench.board.feed("slow", slow[2:], rows[2:].view(np.int64))
    bench.to(60)
    assert (bench.ticks(1), bench.ticks(2)) == ([[4, 5]], [[6, 9]])


def test_what_the_newest_samples_are() -> None:
    bench = Bench({"Type": "target", "NumSamples": 5})
    assert bench.board[1].picture() is None
    bench.board.start(1)
    bench.to(3)
    picture = bench.board[1].picture()
    assert picture is not None and picture.ticks.tolist() == [0, 1, 2]
    bench.to(8)
    picture = bench.board[1].picture()
    assert picture is not None and picture.ticks.tolist() == [3, 4, 5, 6, 7]
    assert picture.samples.tolist() == [[3], [4], [5], [6], [7]]


def test_a_new_run_begins_at_tick_0_and_finds_running_scopes_waiting() -> None:
    bench = Bench({"NumSamples": 4}, {"NumSamples": 4})
    bench.board.start(1)
    bench.to(6)
    bench.board.begin()
    bench.to(5)
    assert bench.ticks(1) == [[0, 1, 2, 3]] * 2
    assert [each.sequence for each in bench.packages] == [0, 1]
    bench.board.end()
    assert bench.status() == "Interrupted"


def test_scopes_trigger_each_other_in_the_order_of_ticks_in_one_batch_too() -> None:
    bench = Bench(
        {"NumSamples": 10},
        {"NumSamples": 2, "TriggerMode": "Scope", "TriggerScope": 1, "TriggerSample": 3, "Type": "target"},
        {"NumSamples": 1, "TriggerMode": "Scope", "TriggerScope": 2, "TriggerSample": -1, "AutoRestart": 1},
    )
    for number in (1, 2, 3):
        bench.board.start(number)
    bench.to(50)
    assert bench.ticks(2) == [[3, 4], [13, 14], [23, 24], [33, 34], [43, 44]]
    assert bench.ticks(3) == [[5], [15], [25], [35], [45]]
