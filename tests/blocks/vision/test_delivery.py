"""The arrival of frames, in both simulated cameras."""

import math
from itertools import groupby
from pathlib import Path

import numpy as np
import pytest

from quadvis.block import Block, Out, ParameterError
from quadvis.testing import drive
from quadvis_blocks.vision._delivery import (
    SEQUENCE,
    STAMP,
    DeliveringCamera,
    advance,
    deliver,
    draw,
    is_captured,
    take,
)
from quadvis_blocks.vision.geometric_camera import GeometricCamera
from quadvis_blocks.vision.rendered_camera import RenderedCamera
from tests.stages import mostly_slow

CALIBRATION = str(Path(__file__).parents[3] / "diagrams" / "calib" / "camera.yaml")
HOVER = {"position": [0.1, -0.2, 1.4], "attitude": [0.0, 0.0, 0.0]}


class Clock(DeliveringCamera, Block):
    """A camera whose frames show nothing."""

    sequence = Out("int64", doc="of the frame on the wire")
    stamp = Out(unit="s", doc="of the frame on the wire")

    def start(self):
        draw(self)

    def output(self, time):
        take(self, is_captured(self), time, time)
        deliver(self, time)
        return int(self.wire[SEQUENCE]), self.wire[STAMP]

    def update(self, time):
        advance(self, is_captured(self), time)
        self.ticks += 1


def clock(steps, rate="10 Hz", seed=1, **parameters):
    return drive(Clock(**parameters), rate=rate, steps=steps, seed=seed)


def first_seen(seen):
    """Sequence number, stamp and tick of every frame that was on the wire, when it came."""
    came = np.flatnonzero(np.diff(seen.sequence, prepend=0))
    return seen.sequence[came], seen.stamp[came], seen.time[came]


def test_both_cameras_deliver_the_same_frames_at_the_same_ticks():
    many = {
        "calibration": CALIBRATION, "every": 3, "latency": 0.05, "jitter": 0.3,
        "drop_rate": 0.3, "drop_burst": 2.0, "blackout": (0.9, 0.4),
    }  # fmt: skip
    geometric = drive(GeometricCamera(**many), rate="30 Hz", steps=90, seed=2, **HOVER)
    frames = drive(RenderedCamera(noise=0.0, **many), rate="30 Hz", steps=90, seed=2, **HOVER).frame
    assert geometric.sequence.tolist() == [frame.sequence for frame in frames]
    assert np.array_equal(geometric.stamp, [frame.stamp for frame in frames], equal_nan=True)
    assert (np.diff(geometric.sequence) < 0).any()


def test_a_frame_is_captured_at_every_so_many_ticks():
    seen = clock(10, rate="30 Hz", every=3)
    assert seen.sequence.tolist() == [1, 1, 1, 2, 2, 2, 3, 3, 3, 4]
    assert seen.stamp == pytest.approx(0.1 * (seen.sequence - 1))


def test_the_extra_time_is_uniform_up_to_the_jitter():
    numbers, stamps, times = first_seen(clock(20000, rate="1 kHz", every=10, latency=0.02, jitter=0.008))
    extra = times - stamps - 0.02
    assert np.array_equal(numbers, np.arange(1, len(numbers) + 1))  # below the time between frames: in order
    shares = [np.mean((extra > low / 1e3 + 1e-6) & (extra < low / 1e3 + 1e-3 + 1e-6)) for low in range(8)]
    assert sum(shares) == pytest.approx(1.0)
    assert shares == pytest.approx([1 / 8] * 8, abs=4 * math.sqrt(7 / 64 / len(extra)))


def test_an_older_frame_that_arrives_later_follows_with_a_smaller_number():
    seen = clock(6000, rate="100 Hz", every=10, latency=0.1, jitter=0.25)
    numbers, stamps, times = first_seen(seen)
    assert stamps == pytest.approx(0.1 * (numbers - 1))
    delays = times - stamps
    assert delays.min() > 0.1 - 1e-6 and delays.max() < 0.35 + 0.01 + 1e-6
    # Extra times u, v of neighbours: the older one comes later if u > v + 0.1, (0.25 - 0.1)^2 / 2 / 0.25^2.
    overtaken = np.mean(np.diff(numbers) < 0)
    assert 0.1 < overtaken < 0.3
    assert len(set(numbers.tolist())) == len(numbers)  # no frame comes twice


def test_of_frames_that_arrive_between_two_ticks_the_last_to_arrive_is_shown():
    # The same frames at the same chances, looked at every millisecond and every ten.
    fine = clock(8000, rate="1 kHz", every=10, latency=0.03, jitter=0.04)
    coarse = clock(800, rate="100 Hz", latency=0.03, jitter=0.04)
    assert np.array_equal(coarse.sequence, fine.sequence[::10])
    assert len(set(coarse.sequence.tolist())) < 700  # the others were overtaken unseen


@pytest.mark.parametrize("count", mostly_slow([6000, 30000]))
@pytest.mark.parametrize(("rate", "burst"), [(0.2, 1.0), (0.2, 5.0), (0.6, 3.0)])
def test_losses_have_their_share_and_their_runs_the_mean_length(rate, burst, count):
    arrived = np.diff(clock(count, drop_rate=rate, drop_burst=burst).sequence, prepend=0) != 0
    memory = 1 - 1 / burst  # correlation of neighbouring frames of the chain
    spread = math.sqrt(rate * (1 - rate) / count * (1 + memory) / (1 - memory))
    assert 1 - arrived.mean() == pytest.approx(rate, abs=4 * spread)
    runs = [len(list(group)) for lost, group in groupby(~arrived) if lost]
    assert np.mean(runs) == pytest.approx(burst / (1 - rate), abs=4 * np.std(runs) / math.sqrt(len(runs)))
    assert np.std(runs) == pytest.approx(math.sqrt(1 - (1 - rate) / burst) * burst / (1 - rate), rel=0.1)


def test_the_first_frame_is_lost_as_often_as_any_other():
    lost = [clock(1, drop_rate=0.5, drop_burst=10.0, seed=seed).sequence[0] == 0 for seed in range(400)]
    assert np.mean(lost) == pytest.approx(0.5, abs=4 * 0.5 / 20)


def test_all_or_nothing_is_lost_at_the_ends_of_the_range():
    assert not clock(200, drop_rate=1.0, drop_burst=3.0).sequence.any()
    assert clock(200, drop_rate=0.0, drop_burst=3.0).sequence.tolist() == list(range(1, 201))


def test_frames_captured_in_the_blackout_never_come():
    seen = clock(12, latency=0.2, blackout=(0.3, 0.4))
    assert seen.sequence.tolist() == [0, 0, 1, 2, 3, 3, 3, 3, 3, 8, 9, 10]


def test_losses_and_jitter_leave_the_noise_of_a_frame_as_it_is():
    calm, rough = (
        drive(GeometricCamera(calibration=CALIBRATION, **more), rate="10 Hz", steps=100, seed=4, **HOVER)
        for more in ({}, {"drop_rate": 0.4, "jitter": 0.5, "latency": 0.1})
    )
    kept = rough.sequence > 0
    assert kept.sum() > 50
    assert np.array_equal(rough.centres[kept], calm.centres[rough.sequence[kept] - 1])


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ({"latency": 1.7}, "latency must be at most 16 frames, 1.6 s, got 1.7 s"),
        (
            {"latency": 1.0, "jitter": 0.7},
            "latency and jitter together must be at most 16 frames, 1.6 s, got 1.7 s",
        ),
    ],
)
def test_frames_that_would_not_fit_into_the_queue_are_refused(parameters, words):
    with pytest.raises(ParameterError, match=words):
        clock(1, **parameters)


@pytest.mark.parametrize("every", [1, 2])
def test_the_queue_holds_the_longest_latency(every):
    seen = clock(40 * every, latency=1.0 * every, jitter=0.6 * every, every=every)
    numbers, stamps, times = first_seen(seen)
    assert len(numbers) > 15
    assert (times - stamps).max() <= 1.6 * every + 0.1 + 1e-6
