import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quadvis.block import Frame, ParameterError
from quadvis.testing import drive
from quadvis_blocks.vision.frame_delivery import FrameDelivery
from quadvis_blocks.vision.rendered_camera import RenderedCamera

CALIBRATION = str(Path(__file__).parents[3] / "diagrams" / "calib" / "camera.yaml")
HOVER = {"position": [0.1, -0.2, 1.4], "attitude": [0.0, 0.0, 0.0]}


def source(count, every=1, stamp=lambda k: 0.1 * k):
    """Frames that tell their number in their first pixel; each stays on the wire for some ticks."""
    frames = [Frame(np.full((1, 1, 3), k % 256, np.uint8), stamp(k), k + 1) for k in range(count)]
    return [frame for frame in frames for _ in range(every)]


def delivered(frames, rate="10 Hz", seed=1, **parameters):
    return list(drive(FrameDelivery(**parameters), frame=frames, rate=rate, seed=seed).delivered)


def numbers(frames):
    return [frame.sequence for frame in frames]


def test_without_parameters_frames_pass_by_reference_at_their_tick():
    frames = [Frame.none(), *source(40, every=2)]
    assert all(one is other for one, other in zip(delivered(frames), frames, strict=True))


def test_a_frame_comes_later_with_its_own_stamp_number_and_pixels():
    frames = source(10)
    found = delivered(frames, latency=0.3)
    assert numbers(found) == [0, 0, 0, 1, 2, 3, 4, 5, 6, 7]
    assert all(frame is frames[frame.sequence - 1] for frame in found[3:])


@pytest.mark.parametrize(
    "parameters",
    [
        {"latency": 0.25},
        {"latency": 0.05, "jitter": 0.3},
        {"drop_rate": 0.3},
        {"drop_rate": 0.4, "drop_burst": 3.0, "latency": 0.1},
        {"latency": 0.03, "jitter": 0.4, "drop_rate": 0.3, "drop_burst": 2.0, "blackout": (0.9, 0.4)},
        {"latency": 0.1, "jitter": 0.4, "blackout": (0.5, 0.3)},
    ],
)
def test_frames_arrive_as_those_of_the_simulated_camera_do(parameters):
    # Both draw from the stream `delivery` of a block of the same path and seed.
    def camera(**more):
        block = RenderedCamera(calibration=CALIBRATION, noise=0.0, every=3, **more)
        return list(drive(block, rate="30 Hz", steps=120, seed=3, **HOVER).frame)

    perfect, own = camera(), camera(**parameters)
    found = delivered(perfect, rate="30 Hz", seed=3, **parameters)
    assert numbers(found) == numbers(own)
    assert np.array_equal([frame.stamp for frame in found], [frame.stamp for frame in own], equal_nan=True)
    assert len(set(numbers(own))) > 12


def test_numbers_fall_when_a_frame_overtakes_another():
    found = numbers(delivered(source(400), latency=0.1, jitter=0.5))
    steps = np.diff(found)
    assert (steps < 0).any() and (steps > 1).any()
    assert len(set(found)) == 1 + np.count_nonzero(steps)  # no frame comes twice


@settings(max_examples=25, deadline=None)
@given(
    st.lists(st.tuples(st.integers(0, 3), st.booleans()), min_size=1, max_size=60),
    st.integers(0, 16),
    st.integers(0, 2**31),
)
def test_whatever_numbers_a_source_gives_each_change_is_one_frame(steps, late, seed):
    # Numbers stand still, rise, fall back to small ones, or are 0 for no frame.
    number, frames = 0, []
    for step, restarts in steps:
        number = step if restarts and step < 2 else number + step
        frames.append(Frame(np.zeros((1, 1, 3), np.uint8), math.nan, number) if number else Frame.none())
    found = delivered(frames, latency=0.1 * late, seed=seed)
    shown, expected = Frame.none(), []
    for k in range(len(frames)):
        came = k - late
        if came >= 0 and frames[came].sequence not in (0, frames[came - 1].sequence if came else 0):
            shown = frames[came]
        expected.append(shown)
    assert all(one is other for one, other in zip(found, expected, strict=True))


def test_stamps_of_the_source_decide_nothing():
    wild = [math.nan, math.inf, -5.0, 1e9, 0.0]
    found = delivered(source(20, stamp=lambda k: wild[k % 5]), latency=0.2, jitter=0.3, drop_rate=0.2)
    calm = delivered(source(20), latency=0.2, jitter=0.3, drop_rate=0.2)
    assert numbers(found) == numbers(calm) and len(set(numbers(calm))) > 8


def test_losses_are_of_frames_and_not_of_ticks():
    slow = numbers(delivered(source(2000, every=4), rate="40 Hz", drop_rate=0.3, drop_burst=2.0))
    fast = numbers(delivered(source(2000), drop_rate=0.3, drop_burst=2.0))
    assert slow[::4] == fast
    lost = 2000 - len(set(fast) - {0})
    assert lost / 2000 == pytest.approx(0.3, abs=4 * math.sqrt(0.3 * 0.7 / 2000 * 3.0))


def test_frames_that_come_in_the_blackout_never_arrive():
    found = numbers(delivered(source(12), latency=0.2, blackout=(0.3, 0.4)))
    assert found == [0, 0, 1, 2, 3, 3, 3, 3, 3, 8, 9, 10]


def test_the_longest_latency_has_room_for_all_frames_on_their_way():
    found = delivered(source(60), latency=1.6)
    assert numbers(found) == [0] * 16 + list(range(1, 45))
    with pytest.raises(ParameterError, match="latency and jitter together must be at most 16 frames"):
        delivered(source(1), latency=1.0, jitter=0.7)


def test_a_run_from_a_snapshot_in_the_middle_repeats():
    parameters = {"latency": 0.4, "jitter": 0.5, "drop_rate": 0.2, "drop_burst": 2.0}
    frames = source(60)
    whole = delivered(frames, **parameters)
    engine = drive(FrameDelivery(**parameters), frame=frames[:20], rate="10 Hz", seed=1).engine
    other = drive(FrameDelivery(**parameters), frame=source(1), rate="10 Hz", seed=9).engine
    memory, block, found = other.memory, other.program["block"], []
    with other:
        other.restore(engine.snapshot())
        for frame in frames[20:]:
            memory.write(block.inputs["frame"], frame)
            other.run(1)
            found.append(memory.read(block.outputs["delivered"]))
    assert all(one is other for one, other in zip(found, whole[20:], strict=True))
    assert len(set(numbers(found))) > 15
