"""Tests of the block hardware.can_in."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import can
import numpy as np
import pytest
from crccheck.crc import Crc8SaeJ1850

from quadvis.block import ParameterError
from quadvis.errors import DiagramError
from quadvis.testing.alone import ALONE, alone
from quadvis.units import parse_period
from quadvis_blocks.hardware import _can
from quadvis_blocks.hardware._protocol.reading import read_protocol
from quadvis_blocks.hardware.can_in import CanIn
from quadvis_blocks.hardware.message_in import MessageIn
from tests.blocks.hardware.can_frames import FRAMES, written

BUS = "can:virtual:can_in"


def engine(speed: int, torque: int, gear: int, running: int, number: int) -> can.Message:
    """Return a frame as struct, crccheck and python-can make it."""
    bits = torque & 0xFFF | gear << 12 | running << 31
    body = struct.pack("<HIB", speed, bits, number)
    return can.Message(
        arbitration_id=0x123, is_extended_id=False, data=body + bytes([Crc8SaeJ1850.calc(body)])
    )


class Reader:
    """The block at a bus, and a peer there."""

    def __init__(self, protocol: str, message: str = "engine") -> None:
        self.peer = can.Bus(interface="virtual", channel="can_in")
        self.block = CanIn(port=BUS, protocol=protocol, message=message)
        self.engine = alone(self.block, {}, {}, parse_period("100 Hz"))

    def step(self, *came: can.Message) -> dict[str, Any]:
        for frame in came:
            self.peer.send(frame)
        self.engine.run(1)
        names = self.block.interface.outputs
        return {name: np.asarray(self.engine.read(ALONE, name)).tolist() for name in names}


@contextmanager
def reading(folder: Path, message: str = "engine") -> Iterator[Reader]:
    made = Reader(written(folder), message)
    with made.engine:
        yield made
    made.peer.shutdown()


def test_the_newest_frame_counts_and_its_fields_are_those_of_the_file(tmp_path: Path) -> None:
    with reading(tmp_path) as reader:
        assert math.isnan(reader.step()["age"])
        found = reader.step(engine(4000, -123, 5, 1, 0), engine(6000, 200, 3, 0, 1))
        assert found["speed"] == pytest.approx(1500 * 2 * math.pi / 60)
        assert found["torque"] == pytest.approx(20.0)
        assert (found["gear"], found["running"], found["age"], found["lost"]) == (3, 0, 0.0, 1)
        found = reader.step(engine(0, -123, 5, 1, 2))
        assert found["torque"] == pytest.approx(-12.3)
        assert (found["running"], found["lost"]) == (1, 1)
        assert reader.step()["age"] == pytest.approx(0.01)


def test_frames_of_29_bits_and_of_motorola_are_read(tmp_path: Path) -> None:
    with reading(tmp_path, "actuator") as reader:
        data = struct.pack(">hH", -450, 1234)
        short = can.Message(arbitration_id=0x18FF50E5 & 0x7FF, is_extended_id=False, data=data)
        whole = can.Message(arbitration_id=0x18FF50E5, is_extended_id=True, data=data)
        found = reader.step(short, whole)
        assert (found["position"], found["current"]) == pytest.approx((math.radians(-45.0), 12.34))
        assert (found["others"], found["refused"]) == (1, 0)


def test_damaged_foreign_and_missing_frames_are_counted(tmp_path: Path) -> None:
    with reading(tmp_path) as reader:
        good = engine(1, 2, 3, 1, 0)
        spoilt = can.Message(
            arbitration_id=0x123, is_extended_id=False, data=b"\x01" + bytes(good.data)[1:-1] + b"!"
        )
        short = can.Message(arbitration_id=0x123, is_extended_id=False, data=bytes(good.data)[:-1])
        other = can.Message(arbitration_id=0x124, is_extended_id=False, data=bytes(good.data))
        remote = can.Message(arbitration_id=0x123, is_extended_id=False, is_remote_frame=True, dlc=8)
        broken = can.Message(arbitration_id=0x123, is_error_frame=True)
        found = reader.step(good, spoilt, short, other, remote, broken, engine(1, 2, 3, 1, 4))
        assert (found["refused"], found["others"]) == (3, 1)
        assert found["lost"] == 3 + 1  # 1, 2 and 3 are missing; the first one no step saw


def test_a_flood_holds_up_no_step(tmp_path: Path) -> None:
    with reading(tmp_path) as reader:
        for _ in range(2 * _can.MOST):
            reader.peer.send(engine(1, 2, 3, 1, 0))
        found = reader.step()
        assert (found["lost"], math.isnan(found["age"])) == (_can.MOST, True)  # nobody knows how old they are
        reader.step()
        assert reader.step(engine(8, 2, 3, 1, 0))["age"] == 0.0


@pytest.mark.parametrize(
    ("given", "parameter", "words"),
    [
        ({"port": "/dev/ttyACM0"}, "port", "port must be a CAN bus, such as can:socketcan:can0, got '/d"),
        ({"port": "can:can0"}, "port", "port must be a CAN bus"),
        ({"message": "engin"}, "message", "there is no message 'engin' in the protocol; did"),
        ({"message": ""}, "message", "message is missing; choose from 'engine', 'actuator'"),
        ({"bitrate": 1}, "bitrate", "bitrate must be at least 10000, got 1"),
    ],
)  # fmt: skip
def test_what_cannot_be_read_is_refused(
    tmp_path: Path, given: dict[str, Any], parameter: str, words: str
) -> None:
    with pytest.raises(ParameterError) as caught:
        CanIn(**{"port": BUS, "protocol": written(tmp_path), "message": "engine", **given})
    assert (caught.value.parameter, words in str(caught.value)) == (parameter, True), str(caught.value)


def test_a_message_belongs_to_a_bus_or_to_a_line(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match=r"'engine' has an id, so it is a frame on a CAN bus; use"):
        MessageIn(port="pty:x", protocol=written(tmp_path), message="engine")
    lab = str(Path(__file__).parents[3] / "diagrams" / "protocols" / "lab_imu.yaml")
    with pytest.raises(ParameterError, match="message 'imu' has no id, so it is no frame on a CAN bus; add"):
        CanIn(port=BUS, protocol=lab)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            "id: 0x123",
            "id: 0x800",
            "'id' must be a whole number of 11 bits, not '0x800'; write 'ex",
        ),
        ("id: 0x18FF50E5", "id: 0x20000000", "'id' must be a whole number of 29 bits, not '0x20000000'"),
        ("id: 0x123\n", "extended: true\n", "'extended' belongs to an 'id'; give it"),
        ("id: 0x123\n", "id: 0x123\n    header: x\n", "a frame with an id has no 'header'; leave it out"),
        ("type: u32", "type: u64", "a frame with an id has 8 bytes at most, and no text; these are 12 bytes"),
    ],
)
def test_the_file_of_a_frame_has_faults_of_its_own(tmp_path: Path, old: str, new: str, words: str) -> None:
    path = tmp_path / "bus.yaml"
    path.write_text(FRAMES.replace(old, new))
    with pytest.raises(DiagramError) as caught:
        read_protocol(path)
    assert words in str(caught.value)


def test_a_missing_package_and_a_missing_bus_are_reported_in_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    block = CanIn(port="can:no_such:can0", protocol=written(tmp_path), message="engine")
    assert block.missing() == ""
    with pytest.raises(Exception, match="CAN bus 'can:no_such:can0' cannot be opened: "):
        block.settings.open(block.port)
    monkeypatch.setattr(_can, "find_spec", lambda name: None)
    words = r"port 'can:no_such:can0' needs the package python-can; install quadvis\[can\]"
    with pytest.raises(Exception, match=words):
        block.settings.open(block.port)
    assert block.missing().endswith("install quadvis[can]")
