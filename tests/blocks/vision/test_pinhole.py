"""One point at a time against the same camera for many points, whose lens is checked against OpenCV's."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis_vision.camera.calibration import CameraCalibration
from quadvis_vision.camera.pinhole import NUMBERS, normalised, pinhole, pixel, pixel_slopes
from quadvis_vision.camera.two_planes import TwoPlanesCalibration

CALIB = Path(__file__).parents[3] / "diagrams" / "calib"
MATRIX = np.array([[430.0, 2.0, 226.0], [0.0, 438.0, 161.0], [0.0, 0.0, 1.0]])
LENSES = [np.zeros(5), np.array([-0.25, 0.08, 1e-3, -2e-3, 0.01])]
inside = st.tuples(st.floats(0, 451), st.floats(0, 321))


@pytest.mark.parametrize("lens", LENSES, ids=["straight", "bent"])
@given(place=inside)
def test_pixels_and_points_are_those_of_the_calibration_and_there_and_back(lens, place):
    calibration = CameraCalibration((452, 322), MATRIX, lens)
    camera = pinhole(calibration.numbers)
    assert camera.bends == lens.any()
    point = normalised(camera, *place)
    assert point == pytest.approx(calibration.normalise([place])[0], abs=1e-12)
    assert pixel(camera, *point) == pytest.approx(calibration.to_pixels([point])[0], abs=1e-9)
    assert pixel(camera, *point) == pytest.approx(place, abs=1e-6)


@pytest.mark.parametrize("lens", LENSES, ids=["straight", "bent"])
@given(place=inside)
def test_the_slopes_are_the_derivatives_of_the_pixel(lens, place):
    camera = pinhole([*MATRIX[0], *MATRIX[1, 1:], *lens.tolist()])
    x, y = normalised(camera, *place)
    step = 1e-6
    by_x = np.subtract(pixel(camera, x + step, y), pixel(camera, x - step, y)) / (2 * step)
    by_y = np.subtract(pixel(camera, x, y + step), pixel(camera, x, y - step)) / (2 * step)
    expected = (by_x[0], by_y[0], by_x[1], by_y[1])
    assert pixel_slopes(camera, x, y) == pytest.approx(expected, abs=1e-3)


def test_a_pixel_that_no_ray_reaches_is_nan():
    camera = pinhole(
        [100.0, 0.0, 0.0, 100.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0]
    )  # the picture ends at 0.385 of fx
    assert np.isfinite(normalised(camera, 38.0, 0.0)).all()
    assert np.isnan(normalised(camera, 40.0, 0.0)).all()
    assert np.isnan(normalised(camera, np.nan, 0.0)).all()


@given(st.tuples(*(st.floats(width=64),) * 2), st.tuples(*(st.floats(-1e3, 1e3),) * 5))
def test_nothing_raises_an_error(place, lens):
    camera = pinhole([430.0, 2.0, 226.0, 438.0, 161.0, *lens])
    assert len(pixel(camera, *normalised(camera, *place))) == 2


def test_the_maps_of_two_planes_are_a_pinhole_without_a_lens():
    planes = TwoPlanesCalibration.load(CALIB / "two_planes.yaml")
    assert len(planes.numbers) == NUMBERS
    camera = pinhole(planes.numbers)
    for place in [(10.0, 20.0), (300.0, 200.0), (226.0, 161.0)]:
        x, y = normalised(camera, *place)
        ray = np.array([x, y, 1.0])
        assert ray / np.linalg.norm(ray) == pytest.approx(planes.rays([place])[0], abs=1e-12)
