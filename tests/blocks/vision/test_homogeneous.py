from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.errors import QuadvisError
from quadvis_vision.camera import homogeneous

SEEDS = st.integers(0, 2**32 - 1)


def rotation(rng):
    q, _ = np.linalg.qr(rng.standard_normal((3, 3)))
    return q * np.sign(np.linalg.det(q))


def camera(rng):
    f, aspect = rng.uniform(200, 2000), rng.uniform(0.8, 1.25)
    k = np.array(
        [[f, rng.uniform(-5, 5), rng.uniform(0, 640)], [0, f * aspect, rng.uniform(0, 480)], [0, 0, 1]]
    )
    return k, rotation(rng), rng.uniform(-5, 5, 3)


def seen(rng, k, r, c, n=12):
    """Return n points in front of the camera, at 2 to 6 lengths, and their pixels."""
    depth = rng.uniform(2, 6, n)
    local = np.column_stack([rng.uniform(-0.4, 0.4, (n, 2)) * depth[:, None], depth])
    e = local @ k.T
    return local @ r + c, e[:, :2] / e[:, 2:]


@given(SEEDS)
def test_any_camera_is_recovered_from_its_own_pictures_of_points(seed):
    rng = np.random.default_rng(seed)
    k, r, c = camera(rng)
    found = homogeneous.calibrate(*seen(rng, k, r, c))
    assert found.matrix == pytest.approx(k, rel=1e-6, abs=1e-6 * k[0, 0])
    assert found.rotation == pytest.approx(r, abs=1e-6)
    assert found.centre == pytest.approx(c, abs=1e-5)
    assert found.rms < 1e-6


@given(SEEDS)
def test_six_points_are_enough(seed):
    rng = np.random.default_rng(seed)
    k, r, c = camera(rng)
    points, pixels = seen(rng, k, r, c, n=6)
    found = homogeneous.calibrate(points, pixels)
    assert found.project(points) == pytest.approx(pixels, abs=1e-4)


@given(SEEDS)
def test_the_unit_of_length_does_not_change_the_camera(seed):
    rng = np.random.default_rng(seed)
    k, r, c = camera(rng)
    points, pixels = seen(rng, k, r, c)
    far = homogeneous.calibrate(points * 1000 + 4000, pixels)
    assert far.matrix == pytest.approx(k, rel=1e-5, abs=1e-5 * k[0, 0])
    assert far.centre == pytest.approx(c * 1000 + 4000, abs=1e-2)


@given(SEEDS)
def test_rq_gives_back_the_matrix_with_a_positive_diagonal(seed):
    matrix = np.random.default_rng(seed).standard_normal((3, 3))
    k, r = homogeneous.rq(matrix)
    assert k @ r == pytest.approx(matrix, abs=1e-12)
    assert np.array_equal(k, np.triu(k))
    assert (np.diag(k) > 0).all()
    assert r @ r.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.sign(np.linalg.det(r)) == np.sign(np.linalg.det(matrix))


@given(SEEDS, st.floats(1e-3, 1e3), st.sampled_from([-1, 1]))
def test_decomposition_does_not_depend_on_scale_or_sign_of_t(seed, scale, sign):
    rng = np.random.default_rng(seed)
    k, r, c = camera(rng)
    t = sign * scale * k @ r @ np.column_stack([np.eye(3), -c])
    found_k, found_r, found_c = homogeneous.decompose(t)
    assert found_k == pytest.approx(k, rel=1e-9, abs=1e-9 * k[0, 0])
    assert found_r == pytest.approx(r, abs=1e-9)
    assert found_c == pytest.approx(c, abs=1e-9)


def test_the_printed_sign_in_equation_9_does_not_reproject():
    rng = np.random.default_rng(9)
    k, r, c = camera(rng)
    points, pixels = seen(rng, k, r, c)
    d = np.column_stack([points, np.ones(len(points))])
    none = np.zeros_like(d)

    def worst(sign):
        rows = [np.hstack([none, -d, pixels[:, 1:] * d]), np.hstack([d, none, sign * pixels[:, :1] * d])]
        t = np.linalg.svd(np.vstack(rows))[2][-1].reshape(3, 4)
        e = d @ t.T
        return np.abs(e[:, :2] / e[:, 2:] - pixels).max()

    assert worst(-1) < 1e-4
    assert worst(+1) > 10
    assert homogeneous.calibrate(points, pixels).project(points) == pytest.approx(pixels, abs=1e-6)


def test_pixel_noise_averages_out_over_many_points():
    rng = np.random.default_rng(7)
    k = np.array([[430.0, 2, 226], [0, 438, 161], [0, 0, 1]])
    points, pixels = seen(rng, k, rotation(rng), np.zeros(3), n=4000)
    found = homogeneous.calibrate(points, pixels + rng.normal(0, 0.5, pixels.shape))
    assert found.matrix == pytest.approx(k, abs=1.0)
    assert found.rms == pytest.approx(0.5 * np.sqrt(2), rel=0.05)


def test_points_behind_the_camera_have_no_picture():
    t = np.column_stack([np.eye(3), np.zeros(3)])
    assert homogeneous.project(t, [[1, 2, 4]]) == pytest.approx(np.array([[0.25, 0.5]]))
    assert np.isnan(homogeneous.project(t, [[1, 2, -4], [1, 2, 0]])).all()


def test_four_corners_determine_a_homography():
    square = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    picture = np.array([[10.0, 20], [110, 25], [100, 130], [5, 90]])
    h = homogeneous.homography(square, picture)
    e = np.column_stack([square, np.ones(4)]) @ h.T
    assert e[:, :2] / e[:, 2:] == pytest.approx(picture, abs=1e-9)
    assert (e[:, 2] > 0).all()


def refusal(call, *arguments):
    with pytest.raises(QuadvisError) as caught:
        call(*arguments)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def good():
    rng = np.random.default_rng(1)
    return seen(rng, *camera(rng))


def test_five_points_are_refused():
    points, pixels = good()
    assert "5 points" in refusal(homogeneous.calibrate, points[:5], pixels[:5])


def test_a_flat_board_is_refused():
    points, pixels = good()
    points = points - np.outer(points @ [1, 2, 3], [1, 2, 3]) / 14
    assert "one plane" in refusal(homogeneous.calibrate, points, pixels)


def test_points_that_are_all_the_same_are_refused():
    assert "one plane" in refusal(homogeneous.calibrate, np.ones((8, 3)), np.ones((8, 2)))


def test_points_on_a_twisted_cubic_through_the_camera_are_refused():
    # The classical critical set of resection: Hartley and Zisserman, chapter 22.
    t = np.linspace(1, 2, 20)
    points = np.column_stack([t, t**2, t**3])
    local = points + np.array([1, -1, 1])  # the camera stands at t = -1
    pixels = local[:, :2] / local[:, 2:]
    assert "more than one camera" in refusal(homogeneous.calibrate, points, pixels)


def test_a_point_that_is_not_finite_is_named():
    points, pixels = good()
    pixels[3, 1] = np.nan
    assert "point 4 in the picture" in refusal(homogeneous.calibrate, points, pixels)


def test_unequal_numbers_of_points_are_refused():
    points, pixels = good()
    assert "12 points in space but 11" in refusal(homogeneous.calibrate, points, pixels[:-1])


def test_points_in_columns_are_refused_with_their_shape():
    points, pixels = good()
    assert "(3, 12)" in refusal(homogeneous.calibrate, points.T, pixels)


def test_a_mirrored_picture_is_refused():
    points, pixels = good()
    assert "mirrored" in refusal(homogeneous.calibrate, points, pixels * [-1, 1])


def test_a_camera_at_infinity_is_refused():
    assert "infinity" in refusal(homogeneous.decompose, [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]])


def test_corners_on_a_line_give_no_homography():
    line = np.column_stack([np.arange(5), np.arange(5)])
    assert "homography" in refusal(homogeneous.homography, line, line)


def test_a_points_file_is_read_by_the_names_of_its_columns(tmp_path):
    file = tmp_path / "points.csv"
    file.write_text("v, u, name, z, y, x\n20,10,a,3,2,1\n\n40,30,b,6,5,4\n")
    points, pixels = homogeneous.read_correspondences(file)
    assert points.tolist() == [[1, 2, 3], [4, 5, 6]]
    assert pixels.tolist() == [[10, 20], [30, 40]]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("x,y,z,rho\n", ":1: no column gamma"),
        ("", ":1: no column x, y, z, rho, gamma"),
        ("x,y,z,rho,gamma\n1,2,3,4,5\n1,2,3,4,five\n", ":3: gamma is 'five'"),
        ("x,y,z,rho,gamma\n1,2,3,4\n", ":2: gamma is ''"),
        ("x,y,z,rho,gamma\n1,2,nan,4,5\n", ":2: z is 'nan'"),
    ],
)
def test_a_points_file_that_is_wrong_is_refused_with_its_line(tmp_path, text, said):
    file = tmp_path / "points.csv"
    file.write_text(text)
    assert said in refusal(homogeneous.read_correspondences, file)


def test_a_points_file_that_is_not_there_is_named(tmp_path):
    assert "absent.csv" in refusal(homogeneous.read_correspondences, tmp_path / "absent.csv")


@given(st.binary(max_size=200))
def test_no_points_file_makes_the_reader_fail_otherwise(tmp_path_factory, content):
    file = tmp_path_factory.mktemp("fuzz") / "points.csv"
    file.write_bytes(content)
    try:
        points, pixels = homogeneous.read_correspondences(file)
    except QuadvisError:
        return
    assert len(points) == len(pixels)
