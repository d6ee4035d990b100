"""Tests of the block hardware.can_out."""

from __future__ import annotations

import math
import pickle
import struct
from pathlib import Path
from typing import Any

import can
import pytest

from quadvis.block import ParameterError
from quadvis.machine.ports import PortError
from quadvis.realtime.outlet import Outlet, OutputPort
from quadvis_blocks.hardware._can import CanBus, OpenBus, piece_of
from quadvis_blocks.hardware._protocol.description import FrameId
from quadvis_blocks.hardware.can_out import CanOut
from tests.blocks.hardware.can_frames import FRAMES, written
from tests.blocks.hardware.test_can_in import engine

BUS = "can:virtual:can_out"
GIVEN: dict[str, Any] = {
    "port": BUS, "message": "actuator", "initial_position": 0.0, "safe_position": -math.pi / 4,
    "initial_current": 1.0, "safe_current": 0.0,
}  # fmt: skip
ENGINE = {
    f"{kind}_{name}": 0 for kind in ("initial", "safe") for name in ("speed", "torque", "gear", "running")
}


def test_frames_are_those_of_struct_and_python_can_sends_them(tmp_path: Path) -> None:
    """The guardian's outlet sends the initial frame, the command's, and at the end the safe one."""
    device = CanOut(**GIVEN, protocol=written(tmp_path))
    peer = can.Bus(interface="virtual", channel="can_out")
    frames: list[bytes | None] = [None]
    port = pickle.loads(pickle.dumps(OutputPort.of(device, "out", BUS)))  # as it goes to the guardian
    outlet = Outlet(port, lambda: frames[0])
    outlet.open()
    outlet.serve(0, safe=False)
    frames[0] = device.frame(math.radians(12.3), 5.0)
    outlet.serve(20_000_000, safe=False)
    outlet.serve(40_000_000, safe=True)
    outlet.finish(60_000_000)
    heard = [peer.recv(0) for _ in range(4)]
    assert heard.pop() is None
    assert [(each.arbitration_id, each.is_extended_id) for each in heard] == [(0x18FF50E5, True)] * 3
    assert [bytes(each.data) for each in heard] == [
        struct.pack(">hH", 0, 100),
        struct.pack(">hH", 123, 500),
        struct.pack(">hH", -450, 0),
    ]
    peer.shutdown()


def test_a_counter_and_its_checksum_go_on_with_each_frame(tmp_path: Path) -> None:
    device = CanOut(port=BUS, message="engine", protocol=written(tmp_path), **ENGINE)
    sealer = pickle.loads(pickle.dumps(device.sealer()))
    frame = device.frame(1500 * 2 * math.pi / 60, 20.0, 3, 1)
    head = piece_of(device.frame_id, b"")
    for number in range(40):
        assert sealer.seal(frame, 0) == head + bytes(engine(6000, 200, 3, 1, number % 16).data)


def test_several_devices_may_have_one_bus_but_not_one_frame(tmp_path: Path) -> None:
    path = written(tmp_path)
    one, two = CanOut(**GIVEN, protocol=path), CanOut(port=BUS, message="engine", protocol=path, **ENGINE)
    assert list(one.settings.claims(BUS)) != list(two.settings.claims(BUS))
    assert list(one.settings.claims(BUS)) == list(CanOut(**GIVEN, protocol=path).settings.claims(BUS))
    assert list(CanBus(500_000).claims(BUS)) == []


class Full:
    """A bus whose adapter has no room, or which is down."""

    def __init__(self, error: Exception) -> None:
        self.error = error

    def send(self, frame: Any, timeout: float) -> None:
        raise self.error


def test_a_bus_without_room_takes_nothing_and_one_that_is_down_is_lost() -> None:
    piece = piece_of(FrameId(1), b"x")
    assert OpenBus(can, Full(can.CanOperationError("Transmit buffer full"))).write(piece) == 0
    for error in (can.CanOperationError("down", 100), OSError("gone")):
        with pytest.raises(PortError, match="the CAN bus is gone: "):
            OpenBus(can, Full(error)).write(piece)


def test_what_cannot_be_sent_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "bus.yaml"
    path.write_text(FRAMES.replace("type: u16, scale: 0.01", "type: f32"))
    with pytest.raises(ParameterError, match="safe_current must lie between 0 and 20, as current does"):
        CanOut(**GIVEN | {"safe_current": 21.0}, protocol=str(path))
    with pytest.raises(
        ParameterError, match=r"initial_torque must lie between -204\.8 and 204\.7, as torque"
    ):
        CanOut(port=BUS, message="engine", protocol=str(path), **ENGINE | {"initial_torque": 300.0})
