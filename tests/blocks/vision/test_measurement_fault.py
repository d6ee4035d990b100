import numpy as np
import pytest

from quadvis.block import Frame
from quadvis.testing import Driven, drive
from quadvis_blocks.vision._fault_timing import TIMING
from quadvis_blocks.vision.frame_fault import FrameFault
from quadvis_blocks.vision.measurement_fault import KINDS, SHAPES, MeasurementFault

BEGIN, END, COUNT = 10, 20, 30  # ticks
MIDDLE = np.array([226.0, 161.0])
STAMPS = np.round(0.1 * np.arange(COUNT) - 0.1, 9)
CENTRES = MIDDLE + np.random.default_rng(1).normal(0.0, 50.0, (COUNT, 4, 2))


def fail(kind: str) -> Driven:
    block = MeasurementFault(kind=kind, begin=0.1 * BEGIN, duration=0.1 * (END - BEGIN))
    return drive(block, centres=CENTRES, instant=STAMPS, rate="10 Hz")


@pytest.mark.parametrize("kind", KINDS)
def test_before_and_after_the_fault_measurements_pass_untouched(kind: str) -> None:
    found = fail(kind)
    for part in (slice(0, BEGIN), slice(END, COUNT)):
        assert np.array_equal(found.faulty[part], CENTRES[part])
        assert np.array_equal(found.faulty_stamp[part], STAMPS[part])
    same = np.array_equal(found.faulty, CENTRES) and np.array_equal(found.faulty_stamp, STAMPS)
    assert same == (kind == "none")


@pytest.mark.parametrize("kind", TIMING)
def test_what_comes_when_and_with_which_stamp_is_the_same_as_with_pictures(kind: str) -> None:
    found = fail(kind)
    frames = [Frame(np.full((2, 2, 3), k, np.uint8), stamp, k + 1) for k, stamp in enumerate(STAMPS)]
    block = FrameFault(kind=kind, begin=0.1 * BEGIN, duration=0.1 * (END - BEGIN))
    shown = drive(block, frame=frames, rate="10 Hz").faulty
    assert [frame.stamp for frame in shown] == pytest.approx(found.faulty_stamp.tolist(), nan_ok=True)
    assert np.array_equal([CENTRES[frame.pixels[0, 0, 0]] for frame in shown], found.faulty)


@pytest.mark.parametrize("kind", SHAPES)
def test_shapes_leave_the_stamps_alone(kind: str) -> None:
    assert np.array_equal(fail(kind).faulty_stamp, STAMPS)


def test_a_turned_square_is_one_turned_about_the_middle_of_the_picture() -> None:
    assert fail("turned").faulty[BEGIN:END] == pytest.approx(2 * MIDDLE - CENTRES[BEGIN:END])


def test_a_mirrored_one_changes_left_and_right_alone() -> None:
    mirrored = fail("mirrored").faulty[BEGIN:END]
    assert mirrored[:, :, 0] == pytest.approx(2 * MIDDLE[0] - CENTRES[BEGIN:END, :, 0])
    assert np.array_equal(mirrored[:, :, 1], CENTRES[BEGIN:END, :, 1])


@pytest.mark.parametrize(("kind", "left"), [("no_target", 0), ("two_left", 2)])
def test_circles_go_missing(kind: str, left: int) -> None:
    seen = np.isfinite(fail(kind).faulty[BEGIN:END]).all(axis=2)
    assert (seen.sum(axis=1) == left).all()


def test_half_of_the_picture_takes_its_circles_along() -> None:
    gone = np.isnan(fail("half_gone").faulty[BEGIN:END, :, 0])
    assert np.array_equal(gone, CENTRES[BEGIN:END, :, 0] > MIDDLE[0])
