"""Tests of the block hardware.msp_in."""

from __future__ import annotations

import math
import os
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.testing.alone import ALONE, alone
from quadvis.units import parse_period
from quadvis_blocks.hardware._msp import (
    ANALOG,
    ANSWER,
    ATTITUDE,
    RAW_IMU,
    REFUSAL,
    REQUEST,
    STATUS,
    V1,
    V2,
    MspMessage,
    encode,
    take,
)
from quadvis_blocks.hardware.msp_in import WRONG_V1, MspIn
from tests.blocks.hardware.msp_peer import read_by_yamspy, yamspy
from tests.blocks.hardware.protocol.damage import flipped
from tests.blocks.hardware.pty_pair import heard, put

NUMBERS = {"v1": V1, "v2": V2}


class Controller:
    """A flight controller behind a pty: it answers the questions that it knows, when it is let."""

    def __init__(self, **given: Any) -> None:
        self.peer, self.port = os.openpty()
        self.block = MspIn(**{"port": os.ttyname(self.port), **given})
        self.engine = alone(self.block, {}, {}, parse_period("100 Hz"))
        self.answers: dict[int, bytes | None] = {
            ATTITUDE: struct.pack("<3h", 123, -45, 270),
            RAW_IMU: struct.pack("<9h", 0, 256, 512, 90, 45, -30, 1, 2, 3),
            ANALOG: struct.pack("<B2HhH", 168, 1000, 512, 1234, 1675),
            STATUS: struct.pack("<3HIB", 125, 0, 33, 0b101, 0),
        }
        self.asked: list[int] = []

    def hear(self) -> bytes:
        """Read the questions, and return the answers."""
        questions = bytearray(heard(self.peer))
        version = V1 if questions[1:2] == b"M" else V2
        answer = b""
        for question in take(questions):
            assert question is not None and question.direction == REQUEST and not question.payload
            self.asked.append(question.command)
            payload = self.answers[question.command]
            if payload is None:
                answer += encode(question.command, version=version, direction=REFUSAL)
            else:
                answer += encode(question.command, payload, version=version, direction=ANSWER)
        return answer

    def step(self, came: bytes = b"") -> dict[str, Any]:
        put(self.peer, self.port, came)
        self.engine.run(1)
        names = self.block.interface.outputs
        return {name: np.asarray(self.engine.read(ALONE, name)).tolist() for name in names}


@contextmanager
def controlled(**given: Any) -> Iterator[Controller]:
    made = Controller(**given)
    with made.engine:
        yield made
    os.close(made.peer)
    os.close(made.port)


@pytest.mark.parametrize("version", NUMBERS)
def test_a_controller_is_asked_and_its_answers_have_our_signs(version: str) -> None:
    with controlled(version=version) as controller:
        assert math.isnan(controller.step()["age"])
        found = controller.step(controller.hear())
        assert found["roll"] == pytest.approx(math.radians(12.3))
        assert found["pitch"] == pytest.approx(math.radians(4.5))  # Betaflight's -4.5: the nose is up
        assert found["yaw"] == pytest.approx(math.radians(-90.0))
        assert found["rates"] == pytest.approx(np.radians([90.0, -45.0, 30.0]))
        assert found["acceleration"] == pytest.approx([0.0, -9.80665 / 2, 9.80665])
        assert (found["voltage"], found["current"]) == pytest.approx((16.75, 12.34))
        assert found["signal_strength"] == pytest.approx(512 / 1023)
        assert (found["armed"], found["modes"]) == (True, 5)
        assert [found[name] for name in ("age", "rates_age", "status_age", "lost", "refused")] == [0.0] * 5


def test_battery_and_state_are_asked_less_often_and_nothing_twice_at_once() -> None:
    with controlled(status_every=0.2) as controller:
        for _ in range(50):
            controller.step(controller.hear())
        controller.hear()
        counts = {command: controller.asked.count(command) for command in controller.answers}
        assert counts[ATTITUDE] == counts[RAW_IMU] == 50
        assert counts[ANALOG] == counts[STATUS] == 3


def test_answers_that_do_not_come_are_lost_and_asked_for_again() -> None:
    with controlled() as controller:
        for _ in range(34):
            found = controller.step()
        controller.hear()
        assert controller.asked.count(ATTITUDE) == 4  # at 0, 0.11, 0.22 and 0.33 s
        assert found["lost"] == 2 * 3 + 2 * 1  # battery and state are due again after 0.5 s
        assert math.isnan(found["age"]) and math.isnan(found["status_age"])


def test_a_question_that_the_controller_does_not_know_is_counted() -> None:
    with controlled() as controller:
        controller.answers[RAW_IMU] = None
        controller.step()
        found = controller.step(controller.hear())
        assert (found["unknown"], found["age"], math.isnan(found["rates_age"])) == (1, 0.0, True)


def test_what_is_of_another_kind_or_makes_no_sense_is_counted() -> None:
    with controlled() as controller:
        controller.step()
        wrong = [struct.pack("<3h", *each) for each in ((1801, 0, 0), (0, 901, 0), (0, 0, 361), (0, 0, -181))]
        data = b"".join(encode(ATTITUDE, each, direction=ANSWER) for each in (*wrong, b"\0"))
        data += encode(200, direction=ANSWER) + encode(ATTITUDE, direction=REQUEST)
        found = controller.step(data)
        assert (found["refused"], found["others"], math.isnan(found["age"])) == (5, 2, True)


def test_a_lost_battery_voltage_of_old_firmware_is_in_tenths() -> None:
    with controlled() as controller:
        controller.answers[ANALOG] = struct.pack("<B2Hh", 168, 1000, 2000, -50)
        controller.step()
        found = controller.step(controller.hear())
        assert (found["voltage"], found["current"], found["signal_strength"]) == pytest.approx(
            (16.8, -0.5, 1.0)
        )


def test_only_v1_is_a_warning() -> None:
    assert MspIn(port="pty:fc").doubts() == []
    (doubt,) = MspIn(port="pty:fc", version="v1").doubts()
    assert "MSP v1 has an xor as its checksum" in str(doubt) and doubt.parameter == "version"


# Messages, as yamspy has them.

COMMANDS = st.integers(1, 254)


@given(COMMANDS, st.binary(max_size=40))
def test_requests_of_version_1_are_those_of_yamspy(command: int, payload: bytes) -> None:
    peer = yamspy()
    peer.send_RAW_msg(command, payload)
    assert encode(command, payload, version=V1) == peer.conn.sent


@given(st.integers(256, 65535), st.binary(max_size=40))
def test_requests_of_version_2_are_those_of_yamspy(command: int, payload: bytes) -> None:
    peer = yamspy()
    peer.send_RAW_msg(command, payload)
    assert encode(command, payload, version=V2) == peer.conn.sent


@pytest.mark.parametrize("version", [V1, V2])
@given(numbers=st.tuples(st.integers(-1800, 1800), st.integers(-900, 900), st.integers(0, 359)))
def test_yamspy_reads_an_attitude_as_we_do(version: int, numbers: tuple[int, int, int]) -> None:
    data = encode(ATTITUDE, struct.pack("<3h", *numbers), version=version, direction=ANSWER)
    roll, pitch, yaw = read_by_yamspy(data).SENSOR_DATA["kinematics"]
    block = MspIn(port="pty:fc")
    (message,) = take(bytearray(data))
    assert message is not None
    ours = block._attitude(message.payload)
    assert ours[:2] == pytest.approx((math.radians(roll), -math.radians(pitch)))
    assert math.cos(ours[2] - math.radians(yaw)) == pytest.approx(1.0)


def test_yamspy_reads_the_other_answers_as_we_do() -> None:
    imu = read_by_yamspy(encode(RAW_IMU, struct.pack("<9h", *range(-4, 5)), direction=ANSWER)).SENSOR_DATA
    assert (imu["accelerometer"], imu["gyroscope"]) == ([-4, -3, -2], [-1, 0, 1])
    peer = read_by_yamspy(
        encode(STATUS, struct.pack("<3HIB", 1, 2, 3, 0x80000001, 5), version=V1, direction=ANSWER)
    )
    assert peer.CONFIG["mode"] == 0x80000001
    peer = read_by_yamspy(encode(ANALOG, struct.pack("<B2HhH", 1, 2, 3, -4, 1675), direction=ANSWER))
    assert (peer.ANALOG["voltage"], peer.ANALOG["amperage"], peer.ANALOG["rssi"]) == (16.75, -0.04, 3)


# Damage.


def messages(count: int, version: int, seed: int = 4) -> list[bytes]:
    random = np.random.default_rng(seed)
    return [
        encode(
            ATTITUDE, random.integers(-900, 900, 3).astype("<i2").tobytes(), version=version, direction=ANSWER
        )
        for _ in range(count)
    ]


def taken(data: bytes, piece: int) -> list[MspMessage | None]:
    received, found = bytearray(), []
    for begin in range(0, len(data), piece):
        received += data[begin : begin + piece]
        found += list(take(received))
        assert len(received) <= 270
    return found


@pytest.mark.parametrize("version", [V1, V2])
def test_a_byte_that_is_missing_costs_one_message(version: int) -> None:
    random = np.random.default_rng(8)
    made = messages(3000, version)
    spoilt = [bytearray(each) for each in made]
    for each in spoilt[3::10]:
        del each[int(random.integers(len(each)))]
    found = [each.payload for each in taken(b"".join(spoilt), 501) if each is not None]
    good = [each[-7:-1] for number, each in enumerate(made) if number % 10 != 3]
    if version == V2:
        assert found == good
    else:  # of 300 spoilt ones the xor of some fits by chance
        assert len({*good} - {*found}) <= 12 and len({*found} - {*good}) <= 12


def test_all_lengths_and_a_million_random_bytes_do_no_harm() -> None:
    random, good = np.random.default_rng(2), messages(1, V2)[0]
    for head in (b"$M>", b"$X>"):
        for length in range(256):
            data = head + bytes([length]) + random.bytes(300) + 300 * b"\0" + good
            assert taken(data, 64)[-1] is not None
    noise = taken(random.bytes(1_000_000) + 300 * b"\0" + good, 4096)
    assert noise[-1] is not None and noise[-1].payload == good[-7:-1]
    assert sum(each is not None for each in noise) <= 3  # 1 in 2^24 places has a head, 1 of 256 fits its xor


@pytest.mark.slow
def test_the_warning_says_what_happens_and_version_2_is_better() -> None:
    wrong = {}
    for version in (V1, V2):
        random, made = np.random.default_rng(6), messages(1000, version)
        right = {each[-7:-1] for each in made}
        wrong[version] = 0
        for _ in range(300):
            for each in taken(flipped(b"".join(made), random), 4096):
                wrong[version] += each is not None and each.command == ATTITUDE and each.payload not in right
    assert WRONG_V1 / 1.5 < wrong[V1] / 0.3 < WRONG_V1 * 1.5
    assert wrong[V2] < wrong[V1] / 6
