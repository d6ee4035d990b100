"""Faults 2 and 3: frames that are frozen, late, swapped or wrongly stamped, and pictures that are none.

What a late machine can break in a flight is judged if it was punctual.
"""

from __future__ import annotations

import signal
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

import quadvis
from quadvis_blocks.vision._fault_timing import TIMING
from quadvis_vision.simulation.picture_faults import PICTURES
from tests.faults.bench import FLIGHT, Bench
from tests.faults.frame_faults import FAILING, FaultySpell, eyes, spells
from tests.processes import linux
from tests.punctual import punctual
from tests.stages import mostly_slow

pytestmark = [pytest.mark.faults, linux]

CEILING = 4.5  # m
WRONG = 0.05  # m, the largest error of a pose that counts
JUMP = 3.0  # m/s, the fastest that the known position moves
POLICY = 0.3  # s after which the failsafe has taken notice
FRESH = 0
# What is flown on the bench, and what else `pytest -m long` flies there; the desk has all kinds. A torn
# picture may count as a pose, as chance has it.
BENCH = ["freeze", "swap", "back_stamp", "clock_restart", "black", "wrong_shape", "nan_pixels"]
OTHERS = ["freeze", "late", "repeated_stamp", "inf_stamp", "white", "noise", "one_channel", "no_pixels"]
DESK = [*TIMING, *PICTURES]
# Frames that all show the target at one other place, by stamps that are right: the inertial unit contradicts
# them for 0.3 s, and then they are believed.
BELIEVED = ("shifted",)
HARMLESS = ("dark", "bright", "grey", "half_black", "half_before", "tear")  # as it happens


class Seen(NamedTuple):
    """What a flight made of its frames: its signals, when which fault was on, and if all were in time."""

    signals: Mapping[str, Any]
    spells: list[FaultySpell]
    punctual: bool = True

    def during(self, name: str, spell: FaultySpell) -> np.ndarray:
        """Return the rows of a signal from the beginning of a fault until the next one begins."""
        return self.signals[name][self.when(name, spell)]

    def when(self, name: str, spell: FaultySpell) -> np.ndarray:
        """Return which rows these are."""
        times = self.signals.times(name)
        return (times >= spell.begin) & (times < spell.until)


def simulated(folder: Path) -> Seen:
    """Fly on the desk, with one fault after the other."""
    (folder / "failing_eyes.yaml").write_text(eyes(DESK))
    found = spells(DESK)
    path = folder / "desk.yaml"
    path.write_text(f"quadvis: 1\nname: desk\nbase: {{file: {FLIGHT}, variant: sim}}\nblocks:{FAILING}")
    return Seen(quadvis.load(path, stop_time=found[-1].until).run(), found)


def flown(folder: Path, kinds: Sequence[str] = BENCH) -> Seen:
    """Fly on the bench, with one fault after the other."""
    (folder / "failing_eyes.yaml").write_text(eyes(kinds))
    found = spells(kinds)
    with Bench(folder, made={"blocks": FAILING}) as bench:
        bench.flies(found[-1].until)
        bench.send(signal.SIGTERM)
        code, _, told = bench.ended()
        assert code == 143, told
    return Seen(bench.log, found, punctual(bench.log))


def errors(seen: Seen) -> np.ndarray:
    """Return the error (m) of the pose of each frame against where the craft was at its stamp."""
    at = seen.signals["supervision/news.instant"]
    times, body = seen.signals.times("craft/body.position"), seen.signals["craft/body.position"]
    true = np.stack([np.interp(at, times, body[:, axis]) for axis in range(3)], axis=1)
    pose = seen.signals["pose.position"]
    return np.abs(np.stack([pose[:, 0], pose[:, 1], CEILING - pose[:, 2]], axis=1) - true).max(axis=1)


def counted(seen: Seen) -> np.ndarray:
    """Return which poses count: of a new frame, plausible, and not refused by the estimator."""
    times = seen.signals.times("pose.position")
    refused = seen.signals["estimate/position.contradicted"]
    next_one = np.searchsorted(seen.signals.times("estimate/position.contradicted"), times)
    refused = refused[np.minimum(next_one, len(refused) - 1)]
    return seen.signals["supervision/news.fresh"] & seen.signals["supervision/check.plausible"] & ~refused


def flown_with_the_others(folder: Path) -> Seen:
    """Fly on the bench, with the faults that the other flight does not have."""
    return flown(folder, OTHERS)


@pytest.mark.parametrize("fly", mostly_slow([simulated, flown, flown_with_the_others], quick=0, slow=2))
def test_02_and_03_frames_that_fail_make_no_state_jump_and_no_pose_wrong(
    fly: Callable[[Path], Seen], tmp_path: Path
) -> None:
    seen = fly(tmp_path)
    an_estimate_is_invalid_and_not_wrong(seen)
    no_frame_is_new_twice_and_no_instant_goes_back(seen)
    the_state_does_not_jump(seen)
    the_failsafe_notices_and_vision_counts_again(seen)


def an_estimate_is_invalid_and_not_wrong(seen: Seen) -> None:
    """Check the poses that count."""
    error, counts = errors(seen), counted(seen)
    for spell in seen.spells:
        rows = seen.when("pose.position", spell) & counts
        wrong = error[rows & (error > WRONG)]
        if spell.kind in BELIEVED:
            assert len(wrong) and wrong.max() < 0.5, spell
        else:
            assert not len(wrong), (spell, wrong)
        assert rows.sum() >= (8 if seen.punctual else 1), spell  # frames count again afterwards


def no_frame_is_new_twice_and_no_instant_goes_back(seen: Seen) -> None:
    """Check what is taken for a new frame."""
    fresh = seen.signals["supervision/news.fresh"]
    instants = seen.signals["supervision/news.instant"][fresh]
    assert (np.diff(instants) > 0).all() and len(instants) > (10 if seen.punctual else 3) * len(seen.spells)
    frozen = next(spell for spell in seen.spells if spell.kind == "freeze")
    times = seen.signals.times("supervision/news.fresh")
    rows = (times >= frozen.begin + 0.25) & (times < frozen.end)  # the last good one was on its way for 0.1 s
    assert (rows.sum() >= 3 or not seen.punctual) and not fresh[rows].any()


def the_state_does_not_jump(seen: Seen) -> None:
    """Check how fast the known position moves."""
    known = seen.signals["supervision/height.known_position"]
    times = seen.signals.times("supervision/height.known_position")
    speed = np.abs(np.diff(known, axis=0)).max(axis=1) / np.diff(times)
    for spell in seen.spells:
        if spell.kind not in BELIEVED:
            rows = (times[1:] >= spell.begin) & (times[1:] < spell.until)
            assert speed[rows].max() < JUMP or not seen.punctual, spell


def the_failsafe_notices_and_vision_counts_again(seen: Seen) -> None:
    """Check the state of vision."""
    state, times = seen.signals["supervision/vision.state"], seen.signals.times("supervision/vision.state")
    for spell in seen.spells:
        rows = (times >= spell.begin) & (times < spell.until)
        gone = times[rows & (state != FRESH)]
        if spell.kind not in HARMLESS:
            # A frame that is on its way when the fault begins still counts, so one period more.
            assert len(gone) and (gone[0] - spell.begin <= POLICY + 0.1 or not seen.punctual), spell
        assert (state[rows & (times >= spell.end)] == FRESH).any(), spell
    body = seen.signals["craft/body.position"]
    assert np.abs(body - [0, 0, 1.5]).max() < 1.0 or not seen.punctual
