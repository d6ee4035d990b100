"""Fault 4: serial lines that flip, drop and insert bytes, repeat and swap them, are cut and stall."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

import quadvis
from quadvis.links.frame import Decoder
from quadvis.links.message import Message
from quadvis_blocks.hardware._counts import HIGH, LOW
from quadvis_blocks.hardware._sbus import LENGTH, decode
from quadvis_blocks.hardware.imu_in import message_of
from tests.damage import DROP, FLIP, INSERT, Again, Bursts, Damage, Parity, Swapped, cut, spoilt
from tests.faults.bench import FLIGHT, MOST, PATIENCE, Bench, one_of
from tests.faults.lines import GOOD, STALLED, BadLine
from tests.processes import linux, wait_for
from tests.punctual import punctual
from tests.quadvis.links.test_frame import through_damage

pytestmark = [pytest.mark.faults, pytest.mark.slow, linux]

SHARE = 0.01  # of the bytes
LONG, SHORT, CALM = 1.2, 0.4, 0.8  # s of flight with a kind of damage, and after it
LEAST = 4  # frames of each line in each of these stretches, of about so many bytes:
CIRCLES, IMU = 90, 60
Random = np.random.Generator
KINDS: dict[str, Callable[[Random], Damage]] = {
    "flips": lambda random: spoilt(FLIP, SHARE, random),
    "drops": lambda random: spoilt(DROP, SHARE, random),
    "inserts": lambda random: spoilt(INSERT, SHARE, random),
    "bursts": Bursts,
    "again": Again,
    "swapped": lambda _: Swapped(),
    "cut": lambda _: cut,
}
# SBUS has parity and no checksum: a receiver cannot know of bytes that are right by parity and wrong.
RADIO_KINDS: dict[str, Callable[[Random], Damage]] = KINDS | {
    "flips": lambda random: Parity(spoilt(FLIP, SHARE, random), random),
    "inserts": lambda random: spoilt(DROP, SHARE, random),
    "bursts": lambda random: Parity(Bursts(random), random),
    "swapped": lambda _: cut,
}


def test_04_bad_lines_cost_frames_and_no_wrong_value_is_accepted(tmp_path: Path) -> None:
    flown = fly(tmp_path)
    for name in LINKS:
        no_wrong_value_is_accepted(name, flown)
        each_whole_frame_is_delivered_and_the_link_recovers_at_once(name, flown)
    no_wrong_command_is_accepted(flown)


def fly(folder: Path) -> Bench:
    """Fly with one kind of damage after the other on all lines, and a calm stretch after each."""
    random = np.random.default_rng(4)
    with Bench(folder) as bench:
        bench.flies(2.0)
        for kind in (*KINDS, STALLED):
            for line in (bench.circles, bench.imu, bench.rc):
                made = (RADIO_KINDS if line is bench.rc else KINDS).get(kind)
                line.turn(kind, None if made is None else made(random))
            goes_on(bench, SHORT if kind in ("cut", STALLED) else LONG)
            for line in (bench.circles, bench.imu, bench.rc):
                line.turn()
            goes_on(bench, CALM)
        bench.process.terminate()
        code, _, told = bench.ended()
        assert code == 143, told
        return bench


def goes_on(bench: Bench, seconds: float) -> None:
    """Let it fly on for so long (s), and until each line has had some frames."""
    until = bench.time + seconds
    least = {bench.circles: LEAST * CIRCLES, bench.imu: LEAST * IMU, bench.rc: LEAST * LENGTH}
    before = {line: len(line.sent) for line in least}
    bench.flies(until)
    wait_for(
        lambda: bench.has_ended or all(len(line.sent) >= before[line] + least[line] for line in least),
        PATIENCE,
    )


def frames_of(line: BadLine) -> list[tuple[int, bytes]]:
    """Return the frames of a link that were sent, each with the number of the byte that follows it."""
    found, place = [], 0
    for piece in bytes(line.sent).split(b"\0")[:-1]:
        place += len(piece) + 1
        found.append((place, piece + b"\0"))
    return found


class Through(NamedTuple):
    """Frames of a link: their stamps (ns), the phases of their ends, whether they came through whole."""

    stamps: np.ndarray
    kinds: np.ndarray
    whole: np.ndarray


def through(line: BadLine, message: Message) -> Through:
    """Return what came through a line: a frame is whole if all its bytes, and the end before it, did."""
    passed, stamps, kinds, whole = b"\0" + bytes(line.passed), [], [], []
    ends = [*(phase.begin for phase in line.phases[1:]), len(line.sent) + 1]
    for place, frame in frames_of(line):
        (arrival,) = Decoder(message).take(frame)
        stamps.append(arrival.stamp)
        kinds.append(line.phases[int(np.searchsorted(ends, place))].kind)
        whole.append(b"\0" + frame in passed)
    return Through(np.array(stamps), np.array(kinds), np.array(whole))


LINKS = {
    "circles": ("circle_line", ["centres", "detector_stamp"]),
    "imu": ("imu_line", ["gyro", "pitch", "roll"]),
}


SENT = {
    "centres": "detector.centres",
    "detector_stamp": "detector.stamp",
    "gyro": "craft/imu.gyro",
    "pitch": "craft/imu.pitch",
    "roll": "craft/imu.roll",
}


def message(name: str) -> Message:
    """Return the message of a line."""
    if name == "imu":
        return message_of("craft/imu")
    return {link.name: link for link in quadvis.load(FLIGHT, variant="hil").links}["circle_line"].message


def no_wrong_value_is_accepted(name: str, flown: Bench) -> None:
    """Check the values of a link."""
    link, signals = LINKS[name]
    held, sent = flown.log, through(getattr(flown, name), message(name))
    stamps = np.round((held.times(f"{link}.age") - held[f"{link}.age"]) * 1e9).astype(np.int64)
    came = np.isin(stamps, sent.stamps[sent.whole])
    first = stamps <= 0  # before the first frame
    assert (came | first).all()
    came &= ~first
    assert came.sum() > 20
    for signal in signals:
        values = held[f"{link}.{signal}"][came]
        given = held[SENT[signal]]
        at = np.searchsorted(held.stamps(SENT[signal]), stamps[came])
        assert np.array_equal(values, given[at], equal_nan=True), signal
    assert held[f"{link}.refused"][-1] > 10  # damage there was


def each_whole_frame_is_delivered_and_the_link_recovers_at_once(name: str, flown: Bench) -> None:
    """Check which frames of a link came."""
    link, _ = LINKS[name]
    held, sent = flown.log, through(getattr(flown, name), message(name))
    kinds = [*KINDS, STALLED, GOOD]
    share = {kind: sent.whole[sent.kinds == kind].mean() for kind in kinds}
    assert share[GOOD] > 0.9 and share["cut"] < 0.5 and share[STALLED] > 0.5
    spoilt_shares = [share[kind] for kind in ("flips", "drops", "inserts", "bursts")]  # few frames each
    assert 0.1 < np.mean(spoilt_shares) < 1.0
    # At the first frame that is whole again a link is there: only the one in which the damage ended is lost.
    changes = [place for place, (old, new) in enumerate(pairwise(sent.kinds), 1) if old != new == GOOD]
    assert len(changes) == len(KINDS) + 1
    assert all(sent.whole[place + 1 : place + 5].all() for place in changes)
    stamps = np.round((held.times(f"{link}.age") - held[f"{link}.age"]) * 1e9).astype(np.int64)
    delivered = np.unique(stamps[stamps > 0])
    # What is not delivered though it was whole: frames that a newer one has overtaken before a tick.
    missed = int(sent.whole[sent.stamps <= delivered[-1]].sum()) - len(delivered)
    lost = int(held[f"{link}.lost"][-1])
    assert lost <= (~sent.whole).sum() + (sent.kinds == "swapped").sum()
    steps = held["_times/target/imu.overruns"][-1]
    held_up = np.isin(sent.kinds, ["swapped", "again", STALLED]).sum() + len(changes)
    assert missed <= steps + held_up or (missed < sent.whole.sum() / 2 and not punctual(held))


def no_wrong_command_is_accepted(flown: Bench) -> None:
    """Check the commands from the radio."""
    sent = np.array([frame_command(frame) for frame in flown.frames])
    held = flown.log
    came = held["receiver/receiver.command"][held["receiver/receiver.good"]]
    assert one_of(np.round(came, 9), np.round(sent, 9)).all() and len(came) > 200
    assert held["receiver/receiver.refused"][-1] > 10


def frame_command(frame: bytes) -> np.ndarray:
    """Return the thrusts of a frame (N)."""
    found = decode(frame)
    assert found is not None and len(frame) == LENGTH
    return (np.array(found.counts[:4]) - LOW) / (HIGH - LOW) * MOST


def test_04_of_60_000_frames_through_noise_none_is_wrong_and_most_come() -> None:
    through_damage(60_000, 5)
