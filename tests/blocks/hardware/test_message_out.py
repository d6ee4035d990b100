"""Tests of the block hardware.message_out."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from crccheck.crc import Crc16Modbus

from quadvis.block import ParameterError
from quadvis.errors import DiagramError
from quadvis.testing import drive, drive_output
from quadvis_blocks.hardware.message_out import MessageOut
from tests.blocks.hardware.protocol.protocols import BYTES

SERVOS = r"""
quadvis: 1
name: servos
order: big
line: {baud: 115200}
initialise: ['\x01on']
terminate: '\x02off'
messages:
  drive:
    header: [0x7E]
    fields:
      - {name: thrust, type: u16, elements: 4, scale: 0.001, unit: N, range: [0, 2]}
      - {name: lamp, type: u8, range: [0, 1]}
    checksum: crc16_modbus
"""
GIVEN: dict[str, Any] = {
    "port": "pty:servos",
    "initial_thrust": [1.0, 1.0, 1.0, 1.0],
    "safe_thrust": [0.2, 0.2, 0.2, 0.2],
    "initial_lamp": 0,
    "safe_lamp": 1,
}


@pytest.fixture
def servos(tmp_path: Path) -> str:
    path = tmp_path / "servos.yaml"
    path.write_text(SERVOS)
    return str(path)


def theirs(*numbers: int) -> bytes:
    body = struct.pack(">4HB", *numbers)
    return b"\x7e" + body + struct.pack(">H", Crc16Modbus.calc(body))


def test_ports_and_values_follow_from_the_protocol(servos: str) -> None:
    device = MessageOut(**GIVEN, protocol=servos)
    interface = device.interface
    assert {name: (port.type, port.unit) for name, port in interface.inputs.items()} == {
        "thrust": ("float64[4]", "N"),
        "lamp": ("int64", "1"),
    }
    assert [*interface.outputs] == ["sent_thrust", "sent_lamp"]
    assert (device.initial_frame(), device.safe_frame()) == (
        theirs(1000, 1000, 1000, 1000, 0),
        theirs(200, 200, 200, 200, 1),
    )
    assert (device.beginning(), device.ending(), device.held) == (b"\x01on", b"\x02off", 0.0)


def test_of_one_value_the_names_are_short() -> None:
    device = MessageOut(
        port="pty:servo", format="%.2f", names="angle", units="deg", ranges="-90..90", terminator="\\n",
        checksum="xor", baud=9600, initial=0.0, safe=np.pi / 4,
    )  # fmt: skip
    assert [*device.interface.outputs] == ["sent"]
    assert (device.initial_frame(), device.safe_frame()) == (b"0.00*1E\n", b"45.00*2F\n")


def test_sent_is_what_is_on_the_wire(servos: str) -> None:
    thrust = np.array([[0.12345, -1.0, 2.5, 1.0], [0.0, 2.0, 1.9996, 0.0004]])
    found = drive(MessageOut(**GIVEN, protocol=servos), thrust=thrust, lamp=[0, 7])
    np.testing.assert_allclose(found.sent_thrust, [[0.123, 0, 2, 1], [0, 2, 2, 0]], atol=1e-12)
    assert found.sent_lamp.tolist() == [0, 1]


def test_a_peer_reads_the_commands_and_after_a_kill_the_safe_bytes(servos: str) -> None:
    device = MessageOut(**GIVEN, protocol=servos)
    thrust = np.array([[0.1, 0.2, 0.3, 0.4], [2.0, 0.0, 0.0, 0.0]])
    found = drive_output(device, thrust=thrust, lamp=[0, 1])
    assert found.commands == [theirs(100, 200, 300, 400, 0), theirs(2000, 0, 0, 0, 1)]
    assert found.safe == theirs(200, 200, 200, 200, 1)
    assert found.wire.startswith(b"\x01on" + 2 * theirs(1000, 1000, 1000, 1000, 0))
    assert found.wire.endswith(2 * found.safe + b"\x02off")


def test_what_is_sent_needs_a_range(tmp_path: Path) -> None:
    path = tmp_path / "bytes.yaml"
    path.write_text(BYTES.replace("range: [-1, 50]", "doc: no range"))
    given = {f"{kind}_{name}": 0 for kind in ("initial", "safe") for name in (
        "temperature", "mode", "trim", "armed", "height", "ticks")}  # fmt: skip
    gyro = {"initial_gyro": [0.0] * 3, "safe_gyro": [0.0] * 3}
    with pytest.raises(DiagramError, match=r"'height' is sent, so it needs a range; add such as") as caught:
        MessageOut(port="pty:x", protocol=str(path), message="imu", **given, **gyro)
    assert caught.value.faults[0].place.line == 24
    with pytest.raises(ParameterError, match=r"'a' is sent, so it needs a range; write such as -1\.\.1"):
        MessageOut(port="pty:x", format="<f", names="a", checksum="xor", baud=9600, initial=0.0, safe=0.0)


@pytest.mark.parametrize(
    ("given", "parameter", "words"),
    [
        (
            {"safe_thrust": [0.2, 0.2, 0.2, 2.1]},
            "safe_thrust",
            "safe_thrust must lie between 0 and 2, as thrust",
        ),
        ({"initial_lamp": 2}, "initial_lamp", "initial_lamp must lie between 0 and 1, as lamp does"),
        ({"initial_thrust": [1.0]}, "initial_thrust", "initial_thrust must be 4 values"),
        ({"baud": 300, "spacing": 0.1}, "spacing", "a frame of 12 bytes takes 400 ms at 300 baud 8N1"),
        ({"safe": 0}, "safe", "MessageOut has no parameter 'safe'"),
    ],
)
def test_what_cannot_be_sent_is_refused(
    servos: str, given: dict[str, Any], parameter: str, words: str
) -> None:
    with pytest.raises(ParameterError) as caught:
        MessageOut(**{**GIVEN, **given}, protocol=servos)
    assert (caught.value.parameter, words in str(caught.value)) == (parameter, True), str(caught.value)


def test_safe_values_are_wanted(servos: str) -> None:
    without = {name: value for name, value in GIVEN.items() if name != "safe_thrust"}
    with pytest.raises(ParameterError, match="parameter 'safe_thrust' is missing"):
        MessageOut(**without, protocol=servos)
