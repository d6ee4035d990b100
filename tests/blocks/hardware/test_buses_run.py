"""Runs in real time over a CAN bus, and with a flight controller that is asked and commanded at one port."""

from __future__ import annotations

import os
import select
import struct
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

import quadvis
from quadvis_blocks.hardware._msp import ANALOG, ANSWER, ATTITUDE, RAW_IMU, SET_RAW_RC, STATUS, encode, take
from tests.blocks.hardware.can_frames import written
from tests.quadvis.realtime.ptys import ptys

pytestmark = [pytest.mark.slow, pytest.mark.skipif(sys.platform != "linux", reason="real time is Linux's")]

CALM = quadvis.RealTime(priority=0, poll="0 s")
HEAD = """\
quadvis: 1
name: buses
rates: {fast: 100 Hz}
stop_time: 1 s
overload: {action: warn}
"""
CAN = """\
computers: {sender: {}, hearer: {}}
blocks:
  angle: {block: sources.sine, rate: fast, at: sender, with: {amplitude: 0.3 rad, frequency: 1 Hz}}
  out:
    block: hardware.can_out
    rate: fast
    at: sender
    with:
      port: "can:udp_multicast:239.74.163.21"
      protocol: PROTOCOL
      message: actuator
      spacing: 10 ms
      initial_position: 0
      safe_position: 45 deg
      initial_current: 0
      safe_current: 0
    in: {position: angle.y, current: 2.5 A}
  back:
    block: hardware.can_in
    rate: fast
    at: hearer
    with: {port: "can:udp_multicast:239.74.163.21", protocol: PROTOCOL, message: actuator}
"""
MSP = """\
blocks:
  stick: {block: sources.constant, rate: fast, with: {value: [0.25, -0.5]}}
  sticks:
    block: hardware.msp_rc_out
    rate: fast
    with:
      {port: PORT, spacing: 10 ms, channels: [1, 2], lowest: [-1, -1], highest: [1, 1], initial: [0, 0],
       safe: [0, 0]}
    in: {command: stick.y}
  controller: {block: hardware.msp_in, rate: fast, with: {port: PORT}}
"""


def test_frames_go_over_a_bus_from_one_computer_to_another(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("can.yaml").write_text(HEAD + CAN.replace("PROTOCOL", written(tmp_path)))
    result = quadvis.load("can.yaml").run(real_time=CALM)
    seen = result["back.age"] >= 0
    assert seen.sum() > 10
    assert result["back.refused"].max() == 0 and result["back.others"].max() == 0
    sent = {0.0, 0.785398, *np.round(result["out.sent_position"], 6)}  # the initial and the safe one, too
    assert {*np.round(result["back.position"][seen], 6)} <= sent
    assert result["back.current"][-1] == pytest.approx(2.5)


class Controller:
    """A flight controller at the end of a pty, which answers at once."""

    def __init__(self, peer: int) -> None:
        self.peer = peer
        self.sticks: list[tuple[int, ...]] = []
        self.damaged = self.asked = 0

    def work(self, received: bytearray) -> None:
        answers = {
            ATTITUDE: struct.pack("<3h", 100, 200, 30),
            RAW_IMU: struct.pack("<9h", *range(9)),
            ANALOG: struct.pack("<B2HhH", 168, 0, 0, 0, 1680),
            STATUS: struct.pack("<3HIB", 0, 0, 0, 1, 0),
        }
        if not select.select([self.peer], [], [], 0.02)[0]:
            return
        received += os.read(self.peer, 4096)
        for message in take(received):
            if message is None:
                self.damaged += 1
            elif message.command == SET_RAW_RC:
                self.sticks.append(struct.unpack("<8H", message.payload))
                os.write(self.peer, encode(SET_RAW_RC, direction=ANSWER))
            else:
                self.asked += 1
                os.write(self.peer, encode(message.command, answers[message.command], direction=ANSWER))


@contextmanager
def flying(peer: int) -> Iterator[Controller]:
    made, done, received = Controller(peer), threading.Event(), bytearray()

    def work() -> None:
        while not done.is_set():
            made.work(received)

    thread = threading.Thread(target=work)
    thread.start()
    try:
        yield made
    finally:
        done.set()
        thread.join()


def test_a_flight_controller_is_asked_and_commanded_at_one_port(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with ptys(1) as (pty,), flying(pty.peer) as controller:
        Path("msp.yaml").write_text(HEAD + MSP.replace("PORT", pty.path))
        result = quadvis.load("msp.yaml").run(real_time=CALM)
    seen = result["controller.age"] >= 0
    assert seen.sum() > 10
    assert result["controller.roll"][-1] == pytest.approx(np.radians(10.0))
    assert result["controller.pitch"][-1] == pytest.approx(np.radians(-20.0))
    assert result["controller.voltage"][-1] == pytest.approx(16.8)
    assert result["controller.refused"].max() == 0
    assert controller.asked > 20 and controller.damaged <= 1  # the first read may begin in a message
    assert set(controller.sticks) == {
        (1500, 1500, *[1000] * 6),
        (1625, 1250, *[1000] * 6),
    }
    assert controller.sticks[-1][:2] == (1500, 1500)
