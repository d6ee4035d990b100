"""A world for the variant that flies: a simulated craft behind real ports, and a camera of the network.

It takes thrusts from an SBUS line, sends an inertial unit's frames or lines of text over another line, and
serves what the craft's camera sees. The craft is held until the commands would let it hover, since it takes a
while until the first picture has been searched.
"""

from __future__ import annotations

import os
import threading
import time
import tty
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

import quadvis
from quadvis.links.frame import encode
from quadvis_blocks.hardware._counts import HIGH, LOW
from quadvis_blocks.hardware._protocol.encode import encode as encode_message
from quadvis_blocks.hardware._protocol.reading import read_protocol
from quadvis_blocks.hardware._sbus import LENGTH, START, decode
from quadvis_blocks.hardware.imu_in import message_of
from tests.camera_server import CameraServer, coded

DIAGRAMS = Path(__file__).parents[2] / "diagrams"
TICK = 0.01  # s, of the inertial unit
PICTURES = 10  # ticks between two pictures
MOST = 2.0  # N, the highest command on the line
HOVER = 1.22625  # N
NEAR, CALM = 0.3, 30  # N from the hover, for so many commands, before the craft is let go
WORLD = """
quadvis: 1
name: world
base: {flight}
without: {{blocks: [detector, pose, estimate, setpoint, supervision, control, gate, outputs, receiver],
  variants: [sim, hil, flight, text_imu], computers: [vision_pc, target],
  links: [pictures, circle_line, imu_line],
  params: [target, idle, camera, imu, rc, rc_in, circles_out, circles_in, imu_out, imu_in],
  summary: [xy, h, yaw, frames without target], rates: [sight, vision, control]}}
overload: {{}}
blocks:
  thrust: {{block: sources.constant, at: world, rate: imu, with: {{value: $hover}}}}
  craft: {{part: {parts}/craft.yaml, with: {{vehicle: $vehicle}}, in: {{thrust: thrust.y}}}}
  eyes:
    block: vision.rendered_camera
    rate: camera
    with: {{calibration: $calibration, ceiling: $ceiling, side: $side}}
    in:
      position: {{from: craft.position, across: sample}}
      attitude: {{from: craft.attitude, across: sample}}
log: {{}}
expect: []
"""


class World:
    """The world, from the beginning of the context to its end.

    ``positions`` are those of each tick (m) from when the craft is let go, ``latest`` is the greatest
    lateness of these ticks (s). ``server`` is the camera, which tests may let fail.
    """

    def __init__(self, folder: Path, *, text: bool = False) -> None:
        path = folder / "world.yaml"
        path.write_text(WORLD.format(flight=DIAGRAMS / "flight.yaml", parts=DIAGRAMS / "parts"))
        self._diagram = quadvis.load(path)
        self._commands, self.rc = _line()
        self._unit, self.imu = _line()
        self.server = CameraServer(period=1e-3)
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._pixels: Any = None
        self._shown = threading.Condition()
        protocol = read_protocol(DIAGRAMS / "protocols" / "lab_imu.yaml")
        self._text = protocol.messages["imu"] if text else None
        self.positions: list[Any] = []
        self.commands, self.latest = 0, 0.0
        self.error: BaseException | None = None

    def __enter__(self) -> World:
        self.server.make = self._picture
        self.server.__enter__()
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()
        self.server.__exit__()
        for descriptor in (self._commands, self._unit):
            os.close(descriptor)
        if self.error is not None:
            raise self.error

    @property
    def camera(self) -> str:
        """Where the camera is."""
        return self.server.url

    def _picture(self, number: int) -> bytes:
        """Wait for the next picture, and return it."""
        with self._shown:
            self._shown.wait(0.2)
            return coded(self._pixels)

    def _run(self) -> None:
        try:
            with self._diagram.start() as run:
                run.advance()
                self._go_on(run)
        except BaseException as error:
            self.error = error

    def _go_on(self, run: Any) -> None:
        received, moved, calm = bytearray(), False, 0
        tick, due = 0, time.monotonic()
        while not self._ended.is_set():
            thrust = self._newest(received)
            if thrust is not None:
                away = np.abs(thrust - HOVER).max()
                moved = moved or away > 2 * MOST / (HIGH - LOW)
                calm = calm + 1 if away < NEAR or calm >= CALM else 0
                run["thrust.value"] = thrust
            if moved and calm >= CALM:
                run.advance(TICK)
                self.positions.append(np.array(run["craft.position"]))
                self.latest = max(self.latest, time.monotonic() - due)
            self._send(run, tick)
            if tick % PICTURES == 0:
                with self._shown:
                    self._pixels = run["eyes.frame"].pixels
                    self._shown.notify_all()
            tick, due = tick + 1, due + TICK
            time.sleep(max(0.0, due - time.monotonic()))

    def _send(self, run: Any, tick: int) -> None:
        values = run["craft.rates"], run["craft.pitch"], run["craft.roll"]
        if self._text is not None:
            _write(self._unit, encode_message(self._text, [values[2], values[1], values[0]]))
            return
        message = message_of("craft/imu")
        _write(self._unit, encode(message, tick, round(tick * TICK * 1e9), message.pack(values)))

    def _newest(self, received: bytearray) -> Any:
        """Return the newest thrusts (N) that have come whole; None if none have."""
        received += _read(self._commands)
        found = None
        while len(received) >= LENGTH:
            frame = decode(received[:LENGTH])
            if frame is None:
                begin = received.find(START, 1)
                del received[: begin if begin > 0 else len(received)]
                continue
            del received[:LENGTH]
            self.commands += 1
            found = (np.array(frame.counts[:4]) - LOW) / (HIGH - LOW) * MOST
        return found


def _line() -> tuple[int, str]:
    """Return our end of a pair of ptys, and the path of the other one."""
    mine, theirs = os.openpty()
    tty.setraw(theirs)
    os.set_blocking(mine, False)
    return mine, os.ttyname(theirs)


def _read(descriptor: int) -> bytes:
    try:
        return os.read(descriptor, 4096)
    except OSError:
        return b""


def _write(descriptor: int, data: bytes) -> None:
    with suppress(OSError):
        os.write(descriptor, data)
