import math
from typing import Any

import numpy as np
import pytest

from quadvis.block import Frame
from quadvis.testing import drive
from quadvis_blocks.vision._fault_timing import TIMING
from quadvis_blocks.vision.frame_fault import KINDS, FrameFault
from quadvis_vision.simulation.picture_faults import PICTURES

BEGIN, END, COUNT = 10, 20, 30  # ticks


def pictures(count: int = COUNT) -> list[Frame]:
    """Pictures of noise, each stamped 0.1 s before it comes."""
    rng = np.random.default_rng(1)
    return [
        Frame(rng.integers(0, 256, (48, 64, 3), np.uint8), round(0.1 * k - 0.1, 9), k + 1)
        for k in range(count)
    ]


def fail(kind: str, frames: list[Frame]) -> list[Frame]:
    block = FrameFault(kind=kind, begin=0.1 * BEGIN, duration=0.1 * (END - BEGIN))
    found = drive(block, frame=frames, rate="10 Hz")
    assert found.active.tolist() == [BEGIN <= k < END for k in range(len(frames))]
    return list(found.faulty)


def numbers(frames: list[Frame]) -> list[int]:
    return [frame.sequence for frame in frames]


def test_there_are_at_least_twenty_five_kinds_beside_none() -> None:
    assert len(KINDS) - 1 >= 25 and len(set(KINDS)) == len(KINDS)


@pytest.mark.parametrize("kind", KINDS)
def test_before_and_after_the_fault_frames_pass_untouched(kind: str) -> None:
    frames = pictures()
    found = fail(kind, frames)
    assert found[:BEGIN] == frames[:BEGIN] and found[END:] == frames[END:]
    assert (found == frames) == (kind == "none")


@pytest.mark.parametrize(
    ("kind", "shown"),
    [
        ("drop", [10] * 10),
        ("bursts", [10, 10, 10, 14, 15, 16, 16, 16, 16, 20]),
        ("late", [10, 10, 10, 11, 12, 13, 14, 15, 16, 17]),
        ("swap", [10, 12, 11, 14, 13, 16, 15, 18, 17, 20]),
        ("freeze", list(range(11, 21))),
        ("alternate", list(range(11, 21))),
        ("outdated", list(range(11, 21))),
    ],
)
def test_frames_come_when_the_kind_says(kind: str, shown: list[int]) -> None:
    frames = pictures()
    found = fail(kind, frames)[BEGIN:END]
    assert numbers(found) == shown
    assert [frame.stamp for frame in found] == [frames[number - 1].stamp for number in shown]


@pytest.mark.parametrize(
    ("kind", "of"),
    [("freeze", [10] * 10), ("alternate", [9, 10] * 5), ("outdated", list(range(8, 18)))],
)
def test_old_pictures_come_under_new_stamps(kind: str, of: list[int]) -> None:
    frames = pictures()
    for frame, number in zip(fail(kind, frames)[BEGIN:END], of, strict=True):
        assert np.array_equal(frame.pixels, frames[number - 1].pixels)


@pytest.mark.parametrize(
    ("kind", "stamp"),
    [
        ("repeated_stamp", lambda k: 0.8),
        ("back_stamp", lambda k: 0.1 * k - 1.1),
        ("falling_stamp", lambda k: 0.1 * k - 0.1 - 0.2 * (k - BEGIN)),
        ("future_stamp", lambda k: 0.1 * k + 999.9),
        ("nan_stamp", lambda k: math.nan),
        ("inf_stamp", lambda k: math.inf),
        ("lagging_stamp", lambda k: 0.1 * k - 0.4),
        ("clock_restart", lambda k: 0.1 * k - 1.1),
    ],
)
def test_stamps_are_what_the_kind_says_and_pictures_pass(kind: str, stamp: Any) -> None:
    frames = pictures()
    for k, frame in enumerate(fail(kind, frames)[BEGIN:END], BEGIN):
        assert frame.stamp == pytest.approx(stamp(k), nan_ok=True)
        assert frame.pixels is frames[k].pixels and frame.sequence == frames[k].sequence


@pytest.mark.parametrize("kind", PICTURES)
def test_pictures_change_and_keep_their_stamps(kind: str) -> None:
    frames = pictures()
    for before, after in zip(frames[BEGIN:END], fail(kind, frames)[BEGIN:END], strict=True):
        assert (after.stamp, after.sequence) == (before.stamp, before.sequence)
        kinds = before.pixels.dtype == after.pixels.dtype and before.pixels.shape == after.pixels.shape
        assert not (kinds and np.array_equal(before.pixels, after.pixels))


def test_a_turned_picture_turned_again_is_what_it_was() -> None:
    frames = pictures()
    for before, after in zip(frames[BEGIN:END], fail("turned", frames)[BEGIN:END], strict=True):
        assert np.array_equal(after.pixels[::-1, ::-1], before.pixels)


@pytest.mark.parametrize("kind", [*TIMING, "half_before"])
def test_a_fault_from_the_first_frame_on_needs_no_frame_before(kind: str) -> None:
    found = drive(FrameFault(kind=kind), frame=[Frame.none(), *pictures(8)], rate="10 Hz").faulty
    assert found[0].sequence == 0 and len(found) == 9
