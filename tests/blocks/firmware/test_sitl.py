"""The datagrams of the firmware: what a state says of attitude, rates and forces, and what motors say."""

from __future__ import annotations

import math
import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis_blocks.firmware._sitl import motor_commands, quaternion, state_packet

angles = st.tuples(st.floats(-math.pi, math.pi), st.floats(-1.5, 1.5), st.floats(-math.pi, math.pi))


def turned(roll: float, pitch: float, yaw: float) -> np.ndarray:
    """Return the matrix from the craft's axes to north, east, down: Rz(yaw) Ry(pitch) Rx(roll)."""
    cr, sr, cp, sp, cy, sy = (f(a) for a in (roll, pitch, yaw) for f in (math.cos, math.sin))
    about_roll = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    about_pitch = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    return np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]]) @ about_pitch @ about_roll


@given(angles)
def test_the_quaternion_turns_as_the_three_angles_do(attitude: tuple[float, float, float]) -> None:
    w, *rest = quaternion(*attitude)
    v = np.array(rest)
    cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    matrix = (w * w - v @ v) * np.eye(3) + 2 * np.outer(v, v) + 2 * w * cross
    np.testing.assert_allclose(matrix, turned(*attitude), atol=1e-12)


def test_a_state_has_its_numbers_where_the_firmware_looks() -> None:
    numbers = struct.unpack("<18d", state_packet((0.0, 0.0, math.pi), (0.1, 0.2, 0.3), (1.0, 2.0, -9.0)))
    assert numbers[0] == 0.0
    assert numbers[1:4] == (0.1, 0.2, 0.3)
    assert numbers[4:7] == (-1.0, 2.0, -9.0)  # of the specific force: minus forward, right, down
    np.testing.assert_allclose(numbers[7:11], (0, 0, 0, 1), atol=1e-12)
    assert numbers[17] == 101325.0


def test_at_rest_the_acceleration_is_minus_gravity_upwards() -> None:
    """As Betaflight's own example sends it for a craft that stands still."""
    found = struct.unpack("<18d", state_packet((0, 0, 0), (0, 0, 0), (0, 0, -9.80665)))[4:7]
    assert found == (0.0, 0.0, -9.80665)


@pytest.mark.parametrize(
    ("pulses", "commands"),
    [
        ((1000.0, 1250.0, 1500.0, 2000.0), (0.0, 0.25, 0.5, 1.0)),
        ((0.0, 900.0, 2100.0, 1e9), (0.0, 0.0, 1.0, 1.0)),
    ],
)
def test_pulses_are_commands_from_0_to_1(pulses: tuple[float, ...], commands: tuple[float, ...]) -> None:
    assert motor_commands(struct.pack("<H2x16f", 4, *pulses, *[0.0] * 12)) == commands


@given(st.binary(max_size=100))
def test_any_packet_gives_commands_in_their_range_or_none(packet: bytes) -> None:
    found = motor_commands(packet)
    assert found is None or (len(found) == 4 and all(0.0 <= command <= 1.0 for command in found))
    if len(packet) < 68:
        assert found is None
