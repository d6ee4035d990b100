"""The numbers of section 6, equations (36)-(38), and what they say about each other."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from quadvis_vision.camera import two_planes
from quadvis_vision.camera.calibration import CameraCalibration
from quadvis_vision.camera.two_planes import TwoPlanesCalibration

CALIBRATIONS = Path(__file__).parents[2] / "diagrams" / "calib"

H1 = np.array([[0.0575, -0.0005, 0], [-0.0007, -0.0578, 0], [-9.7570, 7.5165, 1]])
H2 = np.array([[0.0466, -0.0003, 0], [-0.0006, -0.0468, 0], [-7.6024, 5.9127, 6]])
F = np.array([1.5928, -0.7846, 27.3204])
PRINTED_PIERCING = np.array([83.2578, 113.7901])
PIERCING = PRINTED_PIERCING[::-1]
V_R = np.array([465.0340, -4.4622, -86.2788])
V_C = np.array([-6.2345, -465.5784, -59.6475])
K = np.array([[430.0, 2, 226], [0, 438, 161], [0, 0, 1]])


@pytest.fixture(scope="module")
def paper():
    return TwoPlanesCalibration.load(CALIBRATIONS / "two_planes.yaml")


def grid(columns, rows, left=0.0, right=320.0, top=0.0, bottom=240.0):
    x, y = np.meshgrid(np.linspace(left, right, columns), np.linspace(top, bottom, rows))
    return np.column_stack([x.ravel(), y.ravel()])


def focus(h1, h2, pixels):
    return two_planes.focal_point(two_planes.apply(h1, 1, pixels), two_planes.apply(h2, 6, pixels))


def pixel_of(point, h):
    """Return the pixel that an affine map sends to x, y of a point."""
    return np.linalg.solve(h[:2, :2].T, point[:2] - h[2, :2])


def rms(residuals):
    return np.sqrt(np.mean(np.sum(residuals**2, axis=1)))


def refit(pixels):
    """Return the eight numbers of equation (5) from both planes over these pixels."""
    points = np.vstack([two_planes.apply(H1, 1, pixels), two_planes.apply(H2, 6, pixels)])
    return two_planes.image_plane(two_planes.unit(points - F), np.vstack([pixels, pixels]))


def test_the_file_holds_the_printed_numbers_with_the_piercing_point_in_order(paper):
    assert not paper.projective
    assert (paper.z1, paper.z2) == (1, 6)
    for found, printed in ((paper.H1, H1), (paper.H2, H2), (paper.F, F), (paper.V_R, V_R), (paper.V_C, V_C)):
        assert np.array_equal(found, printed)
    assert (paper.rho_p, paper.gamma_p) == tuple(PIERCING)


def test_the_matrices_of_36_multiply_rows_from_the_left(paper):
    g1, g2 = paper.back_project([[0.0, 0.0], [100.0, 50.0]])
    assert g1[0] == pytest.approx([-9.7570, 7.5165, 1])
    assert g2[0] == pytest.approx([-7.6024, 5.9127, 6])
    assert g1[1] == pytest.approx([5.75 - 0.035 - 9.7570, -0.05 - 2.89 + 7.5165, 1])


def test_the_focal_point_of_36():
    assert focus(H1, H2, grid(9, 7)) == pytest.approx([1.5844, -0.8255, 27.3346], abs=5e-4)


@pytest.mark.parametrize(("right", "bottom"), [(320, 240), (352, 288)])
@pytest.mark.parametrize("shape", [(9, 7), (5, 5), (17, 13)])
def test_the_focal_point_of_36_is_that_of_37_within_rounding(right, bottom, shape):
    difference = focus(H1, H2, grid(*shape, right=right, bottom=bottom)) - F
    assert (np.abs(difference) < [0.05, 0.06, 0.05]).all()
    low, high = np.array([-0.013, -0.045, 0.006]), np.array([-0.005, -0.025, 0.018])
    assert (low < difference).all() and (difference < high).all()


def test_rounding_of_36_moves_the_focal_point_by_more_than_its_distance_from_37():
    rng = np.random.default_rng(36)
    pixels = grid(9, 7)

    def blurred(h):
        noise = np.zeros((3, 3))
        noise[:, :2] = rng.uniform(-5e-5, 5e-5, (3, 2))  # the last printed digit
        return h + noise

    spread = np.std([focus(blurred(H1), blurred(H2), pixels) for _ in range(2000)], axis=0)
    assert spread == pytest.approx([0.044, 0.040, 0.066], rel=0.08)
    assert (np.abs(focus(H1, H2, pixels) - F) < 1.1 * spread).all()


def test_the_pixel_under_the_focal_point_shows_that_the_piercing_point_is_swapped():
    below = [pixel_of(F, H1), pixel_of(F, H2)]
    assert below[0] == pytest.approx([199.12, 141.90], abs=0.02)
    assert below[1] == pytest.approx([199.15, 141.83], abs=0.02)
    straight_down = -np.array([V_R[2], V_C[2]])
    assert straight_down + PIERCING == pytest.approx([200.07, 142.91], abs=0.01)
    assert straight_down + PIERCING == pytest.approx(below[0], abs=1.2)
    assert straight_down + PRINTED_PIERCING - below[0] == pytest.approx([-29.6, 31.5], abs=0.2)


@pytest.mark.parametrize(("h", "pixel"), [(H1, (114.05, 83.17)), (H2, (114.08, 82.88))])
def test_the_axis_of_37_pierces_the_image_at_the_swapped_point(h, pixel):
    axis = np.cross(V_R, V_C)
    found = pixel_of(F + axis * (h[2, 2] - F[2]) / axis[2], h)
    assert found == pytest.approx(pixel, abs=0.01)
    assert found == pytest.approx(PIERCING, abs=0.5)
    assert np.abs(found - PRINTED_PIERCING).min() > 30


def test_the_axis_of_37_is_tilted_though_affine_maps_know_no_tilt(paper):
    axis = np.cross(V_R, V_C)
    assert np.degrees(np.arccos(-axis[2] / np.linalg.norm(axis))) == pytest.approx(12.73, abs=0.01)
    assert paper.pinhole[1][2] == pytest.approx([0, 0, -1], abs=1e-12)


def test_equation_5_gives_37_over_part_of_the_picture():
    v_r, v_c, piercing = refit(grid(7, 7, 74.3, 224.1, 30.4, 198.3))
    assert v_r == pytest.approx([465.23, -3.63, -86.29], abs=0.01)
    assert v_c == pytest.approx([-6.97, -465.41, -59.27], abs=0.01)
    assert piercing == pytest.approx([113.71, 83.07], abs=0.01)
    difference = np.concatenate([v_r - V_R, v_c - V_C, piercing - PIERCING])
    assert np.abs(difference).max() < 0.9
    assert np.sqrt(np.mean(difference**2)) == pytest.approx(0.43, abs=0.01)
    assert np.abs(piercing - PRINTED_PIERCING).min() > 30


def test_equation_5_depends_on_the_pixels_it_is_fitted_on():
    v_r, v_c, piercing = refit(grid(9, 7))
    assert v_r == pytest.approx([481.7, -3.4, -92.6], abs=0.1)
    assert v_c == pytest.approx([-4.5, -479.4, -31.6], abs=0.1)
    assert piercing == pytest.approx([108.9, 111.1], abs=0.1)


def test_37_reprojects_36_to_4_pixels_with_the_piercing_point_swapped_and_to_43_as_printed(paper):
    pixels = grid(33, 25)
    misses = []
    for points in paper.back_project(pixels):
        swapped = paper.project(points) - pixels
        misses.append((swapped, swapped - PIERCING + PRINTED_PIERCING))
    swapped, printed = (np.vstack(rows) for rows in zip(*misses, strict=True))
    assert rms(swapped) == pytest.approx(4.07, abs=0.05)
    assert rms(printed) == pytest.approx(43.1, abs=0.2)


def test_the_pinhole_of_36_reprojects_it_within_the_rounding(paper):
    pixels = grid(33, 25)
    for points in paper.back_project(pixels):
        assert rms(paper.project(points, exact=True) - pixels) < 1


def test_focal_lengths_of_36_agree_between_the_planes(paper):
    lengths = np.array(
        [[(F[2] - z) / np.hypot(*h[row, :2]) for row in (0, 1)] for h, z in ((H1, 1), (H2, 6))]
    )
    assert lengths == pytest.approx(np.array([[457.7, 455.4], [457.5, 455.6]]), abs=0.5)
    assert np.diag(paper.pinhole[0])[:2] == pytest.approx(lengths.mean(axis=0), abs=0.5)
    shorter = 100 * (1 - np.diag(K)[:2] / lengths.mean(axis=0))
    assert shorter == pytest.approx([6.4, 4.0], abs=0.5)


def test_rays_of_36_are_in_camera_axes(paper):
    k, r = paper.pinhole
    # The rows of the picture lie 0.4 degrees off the board's x axis, as the second column of (36) says.
    assert np.degrees(np.arctan2(r[0, 1], r[0, 0])) == pytest.approx(-0.43, abs=0.1)
    assert r == pytest.approx(np.diag([1, -1, -1]), abs=0.01)
    centre, right, below = paper.rays([k[:2, 2], k[:2, 2] + [100, 0], k[:2, 2] + [0, 100]])
    assert centre == pytest.approx([0, 0, 1], abs=1e-12)
    assert right[1] == pytest.approx(0, abs=1e-12)
    assert right[0] / right[2] == pytest.approx(100 / 457.6, rel=1e-3)
    assert below[1] / below[2] == pytest.approx(100 / 455.5, rel=1e-3)


def test_rays_of_36_meet_both_planes_where_the_maps_say(paper):
    pixels = grid(9, 7)
    turned = paper.rays(pixels) @ paper.pinhole[1]
    for points in paper.back_project(pixels):
        expected = two_planes.unit(points - F)
        angle = np.degrees(np.arccos(np.clip(np.sum(turned * expected, axis=1), -1, 1)))
        assert angle.max() < 0.05


def test_k_of_38_is_a_plausible_webcam_of_352_by_288():
    assert np.degrees(np.arctan2(K[1, 1], K[0, 1])) == pytest.approx(89.73, abs=0.01)
    assert K[1, 1] / K[0, 0] == pytest.approx(1.0186, abs=1e-4)
    assert np.degrees(2 * np.arctan(176 / K[0, 0])) == pytest.approx(44.5, abs=0.1)
    assert (K[:2, 2] - [176, 144]).tolist() == [50, 17]
    assert (K[:2, 2] - [320, 240]).tolist() == [-94, -79]


def test_the_default_camera_is_38():
    assert np.array_equal(CameraCalibration.load(CALIBRATIONS / "camera.yaml").matrix, K)
