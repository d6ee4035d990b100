"""A pilot who is there takes over and gives back: takeover.yaml with CRSF, with SBUS, and with a joystick."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import quadvis
from quadvis_blocks.hardware import _crsf, _sbus
from tests.blocks.hardware.events import Fifo, report
from tests.blocks.hardware.marks import add_mark
from tests.diagrams.golden import DIAGRAMS
from tests.quadvis.realtime.ptys import Pty, ptys

CALM = quadvis.RealTime(priority=0, poll="0 s")
AUTOMATIC, MANUAL = [1.0] * 4, [-1.0] * 4
PILOT, LAW = 0, 1  # control.source
LIVE = """
quadvis: 1
name: live
base: {{file: {}, variant: {}}}
overload: {{action: warn}}
params: {{receiver: "{}", transmitter: "{}"}}
blocks:
  mark: {{block: own.mark, rate: control}}
"""


class Phase:
    """What a pilot does for a while: his sticks and switches, or nothing at all."""

    def __init__(
        self, seconds: float, sticks: Sequence[float] = (0, 0, 0, 0), switches: Any = AUTOMATIC, held: int = 1
    ) -> None:
        self.seconds, self.sticks, self.switches, self.held = seconds, sticks, switches, held


SILENCE = Phase(1.5, switches=None)
FLIGHT = [
    Phase(0.2, held=0),  # a dead-man that was pressed before the run does not count
    Phase(1.0),
    Phase(0.7, (0, 0.6, 0, 0)),  # he moves the roll stick: that channel is his
    Phase(0.7),
    Phase(0.4, switches=[1.0, -1.0, 1.0, 1.0]),
    Phase(0.7),  # its switch off and on: the law has it back
    SILENCE,  # his radio fails: the law goes on
    Phase(0.3, held=0),
    Phase(0.7),
    Phase(0.7, switches=MANUAL),
    Phase(0.7),
]


class Pilot(threading.Thread):
    """Flies these phases once a run has begun; ``send`` sends sticks, switches, and whether he holds on."""

    def __init__(self, begun: Path, send: Callable[[Sequence[float], Sequence[float], int], None]) -> None:
        super().__init__(daemon=True)
        self._begun, self._send, self._ended = begun, send, threading.Event()

    def run(self) -> None:
        with suppress(OSError):  # the run has ended
            while not self._begun.exists():
                self._fly(Phase(0.02, held=0))
            for phase in FLIGHT:
                self._fly(phase)
            while not self._ended.is_set():
                self._fly(Phase(0.02))

    def end(self) -> None:
        self._ended.set()
        self.join()

    def _fly(self, phase: Phase) -> None:
        until = time.monotonic() + phase.seconds
        while time.monotonic() < until:
            if phase.switches is not None:
                self._send(phase.sticks, phase.switches, phase.held)
            time.sleep(0.01)


def radio(pty: Pty, encode: Callable[[list[int]], bytes]) -> Callable[..., None]:
    """Return what sends frames to a receiver's port: the channels of a transmitter in the order AETR."""

    def send(sticks: Sequence[float], switches: Sequence[float], _: int) -> None:
        collective, roll, pitch, yaw = sticks
        counts = [round(991.5 + 819.5 * value) for value in (roll, pitch, collective, yaw, *switches)]
        os.write(pty.peer, encode(counts + [992] * 8))

    return send


def joystick(fifo: Fifo) -> Callable[..., None]:
    """Return what reports axes and buttons, and the dead-man."""

    def send(sticks: Sequence[float], switches: Sequence[float], held: int) -> None:
        axes = {"ABS_Z": sticks[0], "ABS_X": sticks[1], "ABS_Y": sticks[2], "ABS_RX": sticks[3]}
        names = ("BTN_TRIGGER", "BTN_THUMB", "BTN_THUMB2", "BTN_TOP")
        buttons = {name: int(switch > 0) for name, switch in zip(names, switches, strict=True)}
        values = {name: round(32767 * value) for name, value in axes.items()}
        fifo.send(report(**values, **buttons, BTN_TOP2=held))

    return send


def flown(folder: Path, variant: str, port: str, send: Callable[..., None]) -> Any:
    """Return the result of a run with this pilot."""
    path = folder / "live.yaml"
    path.write_text(LIVE.format(DIAGRAMS / "takeover.yaml", variant, port, port))
    begun = add_mark(folder)
    pilot = Pilot(begun, send)
    pilot.start()
    result = quadvis.load(path, stop_time="11 s").run(real_time=CALM)
    pilot.end()
    return result


def check(result: Any) -> None:
    """Check who had the roll channel in which order, and that nothing jumped."""
    ok, source = result["radio.ok"], result["control.source"]
    roll, others = source[:, 1], source[:, [0, 2, 3]]
    changes = np.flatnonzero(np.diff(roll)) + 1
    begun = int(np.argmax(roll == LAW))  # sticks that have not come yet leave all channels to nobody
    later = [number for number in changes if number > begun]
    assert roll[[begun, *later]].tolist() == [LAW, PILOT, LAW, PILOT, LAW]
    assert set(np.flatnonzero(np.diff(others[begun:], axis=0).any(axis=1)) + begun + 1) == {*later[2:]}
    # The silence lies after the law has had the channel back, and changes nothing.
    silent = np.flatnonzero(~ok[begun:]) + begun
    assert silent.size > 15 and later[1] < silent[0] and silent[-1] < later[2]
    assert (source[silent] == LAW).all()
    stuck = np.flatnonzero(result["supervision/sticks.stale"][begun:]) + begun
    assert stuck.size > 5 and (result["supervision/sticks.y"][stuck] == 0).all()
    assert np.abs(result["gauge.jump"]).max() == 0
    assert result.passed or all(verdict.met for verdict in result.outcome.verdicts)
    moved = result["supervision/sticks.y"][later[0]]
    assert moved == pytest.approx([0.0, 0.6, 0.0, 0.0], abs=0.01)


@pytest.mark.slow
@pytest.mark.parametrize(("variant", "encode"), [("crsf", _crsf.encode), ("sbus", _sbus.encode)])
def test_a_pilot_takes_over_and_gives_back_by_radio(variant: str, encode: Any, tmp_path: Path) -> None:
    with ptys(1) as (pty,):
        result = flown(tmp_path, variant, pty.path, radio(pty, encode))
    assert result["radio.refused"][-1] <= 1
    check(result)


@pytest.mark.slow
def test_a_pilot_takes_over_and_gives_back_by_a_joystick(tmp_path: Path) -> None:
    fifo = Fifo(tmp_path / "stick")
    send = joystick(fifo)
    opened = threading.Thread(target=fifo.plug, daemon=True)
    opened.start()

    def after_opening(*values: Any) -> None:
        opened.join()
        send(*values)

    check(flown(tmp_path, "joystick", fifo.path, after_opening))
