"""Tests of the block hardware.joystick_in."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import quadvis
from quadvis.block import ParameterError, SourceRecord
from quadvis.engine.engine import Engine
from quadvis.errors import QuadvisError, RunError
from quadvis.machine.capture import GOOD, OPENING
from quadvis.testing import drive
from quadvis_blocks.hardware._joystick_worker import JoystickReport
from quadvis_blocks.hardware.joystick_in import JoystickIn
from tests.blocks.hardware.events import Fifo, report
from tests.blocks.hardware.marks import add_mark

GIVEN: dict[str, Any] = {
    "device": "/dev/input/by-id/usb-x-event-joystick", "codes": "ABS_Y ABS_X BTN_TR",
    "lowest": [1.0, -1.0, -1.0], "highest": [0.0, 1.0, 1.0], "roles": "throttle stick switch",
    "dead_man": "BTN_TL",
}  # fmt: skip
SAFE, FULL = [0.0, 0.0, -1.0], [1.0, 1.0, 1.0]
CALM = quadvis.RealTime(priority=0, poll="0 s")
EDGE = 1e-6  # s: reports come before the step that sees them


class Source:
    """Reports by their instants, and a status by its own."""

    refused, text = 0, "a fake"

    def __init__(self) -> None:
        self.reports: list[tuple[float, JoystickReport]] = []
        self.status = GOOD

    def newest(self, time: float, after: float) -> SourceRecord | None:
        found = [each for each in self.reports if after < each[0] < time]
        if not found:
            return None
        stamp, made = found[-1]
        return SourceRecord(
            stamp, len([each for each in self.reports if each[0] <= stamp]), memoryview(made.pack())
        )


class Pilot:
    """A block at 50 Hz, and the reports of its device."""

    def __init__(self, engine: Engine, source: Source) -> None:
        self._engine, self._source, self._step = engine, source, 0
        self.pressed = self.renewed = -math.inf

    def step(
        self, shares: tuple[float, ...] | None = None, *, held: bool = True, press: bool = False
    ) -> dict[str, Any]:
        """Let a report come, or none, and return the outputs of the step after it."""
        self._step += 1
        stamp = 0.02 * self._step - EDGE
        if press:
            self.pressed = self.renewed = stamp
        if shares is not None:
            made = JoystickReport(shares, held, stamp - self.pressed, stamp - self.renewed)
            self._source.reports.append((stamp, made))
        self._engine.run(1)
        return {
            name: np.asarray(self._engine.read("block", name)).tolist()
            for name in JoystickIn.interface.outputs
        }

    def begin(self) -> None:
        """Have the dead-man released and pressed, all at full deflection."""
        self.step((0.0, 1.0, 1.0), held=False)
        row = self.step((0.0, 1.0, 1.0), press=True)
        assert (row["command"], row["valid"], row["held"]) == (FULL, True, True)


@pytest.fixture(params=[{}])
def pilot(request: pytest.FixtureRequest) -> Iterator[Pilot]:
    graph = drive(JoystickIn(**GIVEN, **request.param), rate="50 Hz", steps=1).engine.graph
    engine, source = Engine(graph), Source()
    engine.bound("block").source = source
    with engine:
        made = Pilot(engine, source)
        made.source = source  # type: ignore[attr-defined]
        engine.run(1)
        yield made
        source.status = GOOD


CHANGES = pytest.mark.parametrize("pilot", [{"reports": "changes"}], indirect=True)


def test_nothing_counts_before_the_dead_man_is_pressed(pilot: Pilot) -> None:
    row = pilot.step()
    assert (row["command"], row["valid"], row["held"]) == (SAFE, False, False) and math.isnan(row["age"])
    # It is held from the start: nobody saw it pressed.
    assert [pilot.step((0.0, 1.0, 1.0))["valid"] for _ in range(50)] == [False] * 50
    row = pilot.step((0.0, 1.0, 1.0), held=False)
    assert (row["command"], row["valid"]) == (SAFE, False)
    row = pilot.step((0.0, 0.25, 0.0), press=True)
    assert (row["command"], row["valid"]) == ([1.0, -0.5, -1.0], True)
    assert row["age"] == pytest.approx(EDGE, abs=1e-9)


def test_a_released_dead_man_is_safe_at_once_and_a_new_press_counts_at_once(pilot: Pilot) -> None:
    pilot.begin()
    row = pilot.step((0.0, 1.0, 1.0), held=False)
    assert (row["command"], row["valid"], row["held"]) == (SAFE, False, False)
    assert pilot.step((0.0, 1.0, 1.0), press=True)["command"] == FULL


def test_a_device_that_is_gone_is_safe_in_the_next_step_until_a_new_press(
    pilot: Any,
) -> None:
    pilot.begin()
    pilot.source.status = OPENING
    assert pilot.step()["command"] == SAFE
    pilot.source.status = GOOD
    rows = [pilot.step((0.0, 1.0, 1.0)) for _ in range(20)]  # it is back, with the dead-man held as before
    assert [row["valid"] for row in rows] == [False] * 20 and rows[-1]["command"] == SAFE
    pilot.step((0.0, 1.0, 1.0), held=False)
    assert pilot.step((0.0, 1.0, 1.0), press=True)["command"] == FULL


def test_a_silent_device_is_safe_after_300_ms_until_a_new_press(pilot: Pilot) -> None:
    pilot.begin()
    rows = [pilot.step() for _ in range(20)]
    assert [row["valid"] for row in rows] == [True] * 14 + [False] * 6  # 0.3 s + EDGE is too old
    assert rows[13]["command"] == FULL and rows[14]["command"] == SAFE
    assert not pilot.step((0.0, 1.0, 1.0))["valid"]
    pilot.step((0.0, 1.0, 1.0), held=False)
    assert pilot.step((0.0, 1.0, 1.0), press=True)["valid"]


def test_reports_without_a_change_go_on_for_ever(pilot: Pilot) -> None:
    pilot.begin()
    assert all(pilot.step((0.0, 1.0, 1.0))["command"] == FULL for _ in range(200))


@CHANGES
def test_of_a_device_that_reports_only_changes_the_dead_man_must_be_renewed(pilot: Pilot) -> None:
    pilot.begin()
    rows = [pilot.step() for _ in range(110)]
    assert [row["valid"] for row in rows] == [True] * 99 + [False] * 11
    # Other events are no renewal; nor is the dead-man, moved, before it is released and pressed.
    assert not pilot.step((0.0, 0.5, 1.0))["valid"]
    pilot.renewed = 0.02 * 113
    assert not pilot.step((0.0, 0.5, 1.0))["valid"]
    assert pilot.step((0.0, 0.5, 1.0), press=True)["valid"]
    rows = [pilot.step() for _ in range(80)]
    pilot.renewed = 0.02 * 195
    rows += [pilot.step((0.0, 0.5, 1.0)), *(pilot.step() for _ in range(80))]
    assert all(row["valid"] for row in rows)


def test_a_held_element_keeps_its_last_valid_command() -> None:
    block = JoystickIn(**GIVEN, on_loss="low hold high")
    assert block.doubts() == []
    block.open()
    block._last = np.array([0.5, -0.25, 1.0])
    assert block.output()[5].tolist() == [0.0, -0.25, 1.0]
    (doubt,) = JoystickIn(**GIVEN, on_loss="hold low low").doubts()
    assert doubt.parameter == "on_loss"


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"codes": "ABS_Y ABS_X"}, "codes must have 3 words, one for each element, got 2"),
        ({"codes": "ABS_Y ABS_X BTN_TRR"}, "codes must name axes and buttons, got 'BTN_TRR'; did you mean"),
        ({"codes": "ABS_Y ABS_X 17"}, "codes must name axes and buttons, got '17'; write such as ABS_X"),
        ({"dead_man": "BTN_TL BTN_TR"}, "dead_man must have 1 word, got 2"),
        ({"dead_man": ""}, "dead_man must have 1 word, got 0"),
        ({"highest": [1.0, 1.0, 1.0]}, "highest must be different from lowest, element by element"),
        ({"roles": "stick"}, "roles must have 3 words, one for each element, got 1"),
        ({"max_age": 0.5}, "max_age must be at most 0.3 s, got 0.5 s"),
        ({"renewal": 3.0}, "renewal must be at most 2 s, got 3 s"),
    ],
)
def test_what_cannot_be_meant_is_refused(wrong: dict[str, Any], words: str) -> None:
    with pytest.raises(ParameterError) as caught:
        JoystickIn(**{**GIVEN, **wrong})
    assert str(caught.value).startswith(words)


DIAGRAM = """
quadvis: 1
name: stick
rates: {{fast: 50 Hz}}
stop_time: 4 s
overload: {{action: warn}}
blocks:
  hands:
    block: hardware.joystick_in
    rate: fast
    with:
      device: "{}"
      codes: ABS_Y ABS_X BTN_TR
      lowest: [1, -1, -1]
      highest: [0, 1, 1]
      roles: throttle stick switch
      dead_man: BTN_TL
"""


def diagram(folder: Path, device: str) -> Path:
    path = folder / "stick.yaml"
    path.write_text(DIAGRAM.format(device))
    return path


def test_no_simulation_reaches_a_joystick_and_one_that_is_missing_is_named(tmp_path: Path) -> None:
    path = diagram(tmp_path, f"{tmp_path}/none")
    with pytest.raises(QuadvisError, match=r"block 'hands' reaches port '.*none', and only a real-time"):
        quadvis.load(path).run()
    assert (
        "is missing; plug it in, or give the path of another one"
        in JoystickIn(**{**GIVEN, "device": "77"}).missing()
    )


@pytest.mark.slow
def test_a_run_ends_in_a_sentence_if_no_joystick_is_there(tmp_path: Path) -> None:
    with pytest.raises(RunError, match=r"block 'hands': joystick '.*none' is missing; plug it in"):
        quadvis.load(diagram(tmp_path, f"{tmp_path}/none")).run(real_time=CALM)


class Hand(threading.Thread):
    """Full deflection and the dead-man held, reported at 100 Hz, with one silence and one loss."""

    def __init__(self, fifo: Fifo, begun: Path) -> None:
        super().__init__(daemon=True)
        self._fifo, self._begun, self._ended = fifo, begun, threading.Event()

    def run(self) -> None:
        fifo = self._fifo
        fifo.plug()
        with suppress(BrokenPipeError):  # the run has ended
            while not self._begun.exists():
                self._report(0)
            self._reports(0.3, 0)
            self._reports(0.7, 1)
            time.sleep(0.6)
            self._reports(0.3, 0)
            self._reports(0.5, 1)
            fifo.unplug()
            time.sleep(0.3)
            fifo.plug()
            while not self._ended.is_set():
                self._report(1)
        fifo.unplug()

    def end(self) -> None:
        self._ended.set()
        self.join()

    def _reports(self, seconds: float, held: int) -> None:
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            self._report(held)

    def _report(self, held: int) -> None:
        self._fifo.send(report(ABS_Y=-32767, ABS_X=32767, BTN_TR=1, BTN_TL=held))
        time.sleep(0.01)


@pytest.mark.slow
def test_a_run_is_safe_while_its_joystick_is_silent_or_gone(tmp_path: Path) -> None:
    fifo = Fifo(tmp_path / "joystick")
    hand = Hand(fifo, add_mark(tmp_path))
    hand.start()
    path = diagram(tmp_path, fifo.path)
    path.write_text(path.read_text() + "  mark: {block: own.mark, rate: fast}\n")
    result = quadvis.load(path, stop_time="6 s").run(real_time=CALM)
    hand.end()
    valid, age = result["hands.valid"], result["hands.age"]
    command = result["hands.command"]
    assert (command[valid] == FULL).all() and (command[~valid] == SAFE).all()
    assert not (valid & (age > 0.3)).any()
    changes = np.flatnonzero(np.diff(valid.astype(int))) + 1
    # Pressed; silent; pressed again; gone; back, with the dead-man held all the time: it stays safe.
    assert valid[changes].tolist() == [True, False, True, False]
    status = result["hands.status"]
    assert age[changes[1]] > 0.3 and status[changes[1]] == GOOD
    # On a busy machine the hand may have been silent, too, before the joystick is gone.
    assert (status[changes[3]] == OPENING or age[changes[3]] > 0.3) and (status == OPENING).any()
    assert status[-1] == GOOD
    assert result["hands.held"][-1]
