from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.errors import QuadvisError
from quadvis_vision.camera import two_planes
from quadvis_vision.camera.two_planes import TwoPlanesCalibration

SEEDS = st.integers(0, 2**32 - 1)
AXES = np.diag([1.0, -1.0, -1.0])  # calibration frame: x right, y up, z toward the camera


def turn(axis, degrees):
    a = np.radians(degrees)
    c, s = np.cos(a), np.sin(a)
    i, j = [(1, 2), (2, 0), (0, 1)][axis]
    r = np.eye(3)
    r[i, i] = r[j, j] = c
    r[i, j], r[j, i] = -s, s
    return r


def camera(rng):
    f = rng.uniform(300, 900)
    matrix = [
        [f, rng.uniform(-4, 4), rng.uniform(100, 400)],
        [0, f * rng.uniform(0.9, 1.1), rng.uniform(80, 300)],
    ]
    return np.array([*matrix, [0, 0, 1]])


def pictures(k, r, centre, heights=(1.0, 6.0)):
    """Return points (n, 3) on two planes and their pixels for a camera turned by r at a centre."""
    x, y = np.meshgrid(np.linspace(-5, 5, 6), np.linspace(-4, 4, 5))
    points = np.vstack([np.column_stack([x.ravel(), y.ravel(), np.full(x.size, z)]) for z in heights])
    e = (points - centre) @ (k @ r).T
    assert (e[:, 2] > 0).all()
    return points, e[:, :2] / e[:, 2:]


def truth(k, pixels):
    rays = np.column_stack([pixels, np.ones(len(pixels))]) @ np.linalg.inv(k).T
    return rays / np.linalg.norm(rays, axis=1, keepdims=True)


@given(SEEDS, st.booleans())
def test_a_board_parallel_to_the_image_gives_back_the_camera(seed, projective):
    rng = np.random.default_rng(seed)
    k, r = camera(rng), turn(2, rng.uniform(-180, 180)) @ AXES
    centre = np.array([*rng.uniform(-3, 3, 2), rng.uniform(15, 40)])
    points, pixels = pictures(k, r, centre)
    found = TwoPlanesCalibration.fit(points, pixels, projective=projective)
    assert found.z1 == 1 and found.z2 == 6
    assert pytest.approx(centre, abs=1e-6) == found.F
    assert found.residuals(points, pixels) == pytest.approx(0, abs=1e-8)
    assert found.pinhole[0] == pytest.approx(k, rel=1e-6, abs=1e-6 * k[0, 0])
    assert found.pinhole[1] == pytest.approx(r, abs=1e-7)
    assert found.rays(pixels) == pytest.approx(truth(k, pixels), abs=1e-8)
    assert found.project(points, exact=True) == pytest.approx(pixels, abs=1e-5)


@given(SEEDS)
def test_projective_maps_give_back_the_camera_over_a_tilted_board(seed):
    rng = np.random.default_rng(seed)
    k = camera(rng)
    r = turn(0, rng.uniform(-15, 15)) @ turn(1, rng.uniform(-15, 15)) @ turn(2, rng.uniform(-180, 180)) @ AXES
    # The camera looks at the middle of the planes, whatever its tilt.
    centre = np.array([0, 0, 3.5]) - 25 * r[2]
    points, pixels = pictures(k, r, centre, heights=(0.0, 6.0))
    found = TwoPlanesCalibration.fit(points, pixels, projective=True)
    assert pytest.approx(centre, abs=1e-5) == found.F
    assert found.pinhole[1] == pytest.approx(r, abs=1e-6)
    assert found.rays(pixels) == pytest.approx(truth(k, pixels), abs=1e-7)


@pytest.mark.parametrize("tilt", [1.0, 3.0, 5.0])
def test_affine_maps_turn_every_ray_by_the_tilt_of_the_board(tilt):
    k = np.array([[457.0, 0, 176], [0, 457, 144], [0, 0, 1]])
    r = turn(0, tilt) @ AXES
    points, pixels = pictures(k, r, np.array([0, 0, 3.5]) - 25 * r[2])
    middle = np.array([[176.0, 144.0]])
    affine = TwoPlanesCalibration.fit(points, pixels)
    # The line is right in the calibration frame; what (1) takes for the camera's axes is not.
    turned = np.degrees(np.arccos(affine.rays(middle) @ [0, 0, 1])).item()
    assert turned == pytest.approx(tilt, rel=0.05)
    assert np.linalg.norm(affine.residuals(points, pixels), axis=1).max() > 1e-3 * tilt
    exact = TwoPlanesCalibration.fit(points, pixels, projective=True).rays(middle)
    assert exact == pytest.approx(np.array([[0, 0, 1]]), abs=1e-7)


def test_a_camera_that_looks_along_z_from_below_is_understood_too():
    k = np.array([[457.0, 0, 176], [0, 457, 144], [0, 0, 1]])
    points, pixels = pictures(k, np.eye(3), np.array([0, 0, -20.0]))
    found = TwoPlanesCalibration.fit(points, pixels)
    assert found.pinhole[1] == pytest.approx(np.eye(3), abs=1e-8)
    assert found.rays(pixels) == pytest.approx(truth(k, pixels), abs=1e-8)


def test_an_image_to_the_right_and_below_has_a_ray_to_the_right_and_below():
    k = np.array([[457.0, 0, 176], [0, 457, 144], [0, 0, 1]])
    found = TwoPlanesCalibration.fit(*pictures(k, AXES, np.array([1.0, 2, 27])))
    x, y, z = found.rays([[276.0, 244.0]])[0]
    assert x > 0.2 and y > 0.2 and z > 0.9


def test_rows_that_were_not_seen_stay_nan():
    k = np.array([[457.0, 0, 176], [0, 457, 144], [0, 0, 1]])
    found = TwoPlanesCalibration.fit(*pictures(k, AXES, np.array([0.0, 0, 27])))
    rays = found.rays([[10.0, 20.0], [np.nan, np.nan]])
    assert np.isfinite(rays[0]).all() and np.isnan(rays[1]).all()


def test_unit_vectors_in_equation_5_are_not_the_pinhole():
    k = np.array([[457.0, 0, 160], [0, 457, 120], [0, 0, 1]])
    points, pixels = pictures(k, AXES, np.array([0.0, 0, 27]))
    found = TwoPlanesCalibration.fit(points, pixels)
    paper = np.sqrt(np.mean(np.sum((found.project(points) - pixels) ** 2, axis=1)))
    assert 0.05 < paper < 3
    assert found.project(points, exact=True) == pytest.approx(pixels, abs=1e-6)


def test_the_affine_map_is_the_normal_equation_of_3():
    rng = np.random.default_rng(3)
    pixels = rng.uniform(0, 300, (20, 2))
    points = np.column_stack([rng.uniform(-5, 5, (20, 2)), np.full(20, 6.0)])
    q = np.column_stack([pixels, np.ones(20)])
    assert two_planes.affine_map(pixels, points) == pytest.approx(
        np.linalg.inv(q.T @ q) @ q.T @ points, abs=1e-9
    )


@given(SEEDS)
def test_the_focal_point_is_nearer_to_all_lines_than_its_surroundings(seed):
    rng = np.random.default_rng(seed)
    g1, g2 = rng.uniform(-5, 5, (8, 3)), rng.uniform(-5, 5, (8, 3)) + np.array([0, 0, 20])

    def cost(point):
        u = (g2 - g1) / np.linalg.norm(g2 - g1, axis=1, keepdims=True)
        return np.sum(np.cross(u, point - g1) ** 2)

    found = two_planes.focal_point(g1, g2)
    around = found + 1e-3 * np.vstack([np.eye(3), -np.eye(3)])
    assert all(cost(found) < cost(point) for point in around)


def example(projective=False):
    k = np.array([[457.0, 1, 176], [0, 455, 144], [0, 0, 1]])
    return TwoPlanesCalibration.fit(
        *pictures(k, turn(2, 3) @ AXES, np.array([1.0, 2, 27])), projective=projective
    )


@pytest.mark.parametrize("projective", [False, True])
def test_a_file_gives_back_the_same_numbers(tmp_path, projective):
    found = example(projective)
    saved = replace(found, unit="cm", evidence=replace(found.evidence, date="2026-11-22"))
    saved.save(tmp_path / "planes.yaml", comment="two\nlines")
    loaded = TwoPlanesCalibration.load(tmp_path / "planes.yaml")
    for name in ("z1", "z2", "H1", "H2", "F", "V_R", "V_C", "rho_p", "gamma_p", "projective"):
        assert np.array_equal(getattr(loaded, name), getattr(saved, name)), name
    for name in ("rms", "errors", "date", "points"):
        assert np.array_equal(getattr(loaded.evidence, name), getattr(saved.evidence, name)), name
    assert loaded.unit == "cm"


def test_the_evidence_is_the_error_of_each_plane_in_pixels():
    points, pixels = good()
    random = np.random.default_rng(1)
    pixels[:30] += random.normal(0, 0.05, (30, 2))
    pixels[30:] += random.normal(0, 0.5, (30, 2))
    evidence = TwoPlanesCalibration.fit(points, pixels, projective=True).evidence
    assert evidence.errors[1] > 5 * evidence.errors[0] > 0
    assert evidence.rms == pytest.approx(np.sqrt(np.mean(evidence.errors**2)))
    assert len(evidence.points) == 40


NUMBERS = [("H1", 0), ("H1", 4), ("H1", 6), ("H2", 0), ("H2", 4), ("H2", 7), ("F", 0), ("F", 2)]
NUMBERS += [("V_R", 0), ("V_C", 1), ("rho_p", 0), ("gamma_p", 0)]


@pytest.mark.parametrize("noise", [0.0, 0.3])
@pytest.mark.parametrize(("key", "index"), NUMBERS)
def test_a_number_that_was_changed_after_the_calibration_is_noticed(tmp_path, key, index, noise):
    points, pixels = good()
    pixels += np.random.default_rng(1).normal(0, noise, pixels.shape)
    file = tmp_path / "planes.yaml"
    TwoPlanesCalibration.fit(points, pixels).save(file)
    before, after = file.read_text().split(f"{key}:", 1)
    numbers = list(re.finditer(r"-?[0-9.]+(?:e-?[0-9]+)?", after))
    place = numbers[index]
    changed = f"{1.1 * float(place[0]) + 0.2 * (key == 'F')!r}"
    file.write_text(f"{before}{key}:{after[: place.start()]}{changed}{after[place.end() :]}")
    with pytest.raises(QuadvisError, match="misses the stored points") as caught:
        TwoPlanesCalibration.load(file)
    assert f"{file}:" in str(caught.value)


@pytest.mark.parametrize(("old", "new"), [("z1: 1.0", "z1: 1.5"), ("z2: 6.0", "z2: 5.0")])
def test_a_height_that_was_changed_after_the_calibration_is_noticed(tmp_path, old, new):
    file = tmp_path / "planes.yaml"
    example(projective=True).save(file)
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))
    with pytest.raises(QuadvisError, match="misses the stored points"):
        TwoPlanesCalibration.load(file)


def test_a_piercing_point_in_the_printed_order_is_noticed(tmp_path):
    file = tmp_path / "planes.yaml"
    example().save(file)
    text = file.read_text()
    file.write_text(text.replace("rho_p", "x").replace("gamma_p", "rho_p").replace("x:", "gamma_p:"))
    with pytest.raises(QuadvisError, match=r"equation \(5\) misses the stored points"):
        TwoPlanesCalibration.load(file)


@pytest.mark.parametrize("degrees", [0.5, 1.0, 3.0])
def test_the_tilt_of_the_board_is_seen_through_the_noise(degrees):
    k = np.array([[457.0, 0, 176], [0, 457, 144], [0, 0, 1]])
    r = turn(0, degrees) @ AXES
    points, pixels = pictures(k, r, np.array([0, 0, 3.5]) - 25 * r[2])
    pixels += np.random.default_rng(2).normal(0, 0.05, pixels.shape)
    assert np.degrees(two_planes.board_tilt(points, pixels)) == pytest.approx(degrees, rel=0.3)


@pytest.mark.parametrize("noise", [0.0, 0.05, 1.0])
def test_noise_is_not_taken_for_a_tilt(noise):
    points, pixels = good()
    for seed in range(20):
        seen = pixels + np.random.default_rng(seed).normal(0, noise, pixels.shape)
        assert two_planes.board_tilt(points, seen) == 0


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("convention: row", "convention: column", "row"),
        ("z2: 6.0", "z2: 1.0", "apart"),
        ("projective: false", "projective: 7", "projective"),
        ("F: [", "F: [1, ", "F"),
        ("z1: 1.0", "z1: 2.0", "H1"),
        ("rho_p: ", "rho: ", "rho_p"),
        ("points:", "unit: kg\npoints:", "not a unit of length"),
        ("points:", "unit: cmm\npoints:", "cmm"),
    ],
)
def test_a_file_that_is_wrong_is_refused_with_its_place(tmp_path, old, new, said):
    file = tmp_path / "planes.yaml"
    example().save(file)
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))
    with pytest.raises(QuadvisError, match=said) as caught:
        TwoPlanesCalibration.load(file)
    assert f"{file}:" in str(caught.value)


def test_a_file_whose_points_do_not_fit_is_refused(tmp_path):
    file = tmp_path / "planes.yaml"
    example().save(file)
    # Rounding decides which points of the exact example are stored; each is at its place or half a metre off.
    text, count = re.subn(r"(?m)^(- \[\S+, \S+), 1\.0,", r"\1, 1.5,", file.read_text(), count=1)
    assert count == 1
    file.write_text(text)
    with pytest.raises(QuadvisError, match="misses the stored points"):
        TwoPlanesCalibration.load(file)


def refusal(points, pixels, **options):
    with pytest.raises(QuadvisError) as caught:
        TwoPlanesCalibration.fit(points, pixels, **options)
    return str(caught.value)


def good():
    k = np.array([[457.0, 0, 176], [0, 457, 144], [0, 0, 1]])
    return pictures(k, AXES, np.array([0.0, 0, 27]))


def test_points_at_three_heights_are_refused():
    points, pixels = good()
    points[0, 2] = 3
    assert "two heights" in refusal(points, pixels)


def test_points_at_one_height_are_refused():
    points, pixels = good()
    assert "two heights" in refusal(points[:30], pixels[:30])


@pytest.mark.parametrize("projective", [False, True])
def test_pixels_on_a_line_are_refused(projective):
    points, pixels = good()
    pixels[:, 1] = pixels[:, 0]
    refusal(points, pixels, projective=projective)


def test_a_mirrored_picture_is_refused():
    points, pixels = good()
    assert "mirrors" in refusal(points, pixels * [-1, 1] + [352, 0])


def test_planes_that_look_alike_are_refused():
    points, pixels = good()
    pixels[30:] = pixels[:30]
    assert "parallel" in refusal(points, pixels)


def test_a_pixel_that_is_not_finite_is_refused():
    points, pixels = good()
    pixels[4] = np.nan
    assert "not finite" in refusal(points, pixels)
