"""The camera calibration against OpenCV, closed forms and its own file."""

import re
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.errors import DiagramError
from quadvis_vision.camera.calibration import CameraCalibration
from quadvis_vision.camera.provenance import CalibrationError, Evidence

PAPER = Path(__file__).parents[3] / "diagrams" / "calib" / "camera.yaml"
PAPER_K = np.array([[430.0, 2.0, 226.0], [0.0, 438.0, 161.0], [0.0, 0.0, 1.0]])

# OpenCV's calibration of its own chessboard photographs (samples/data/left_intrinsics.yml).
OPENCV_K = np.array([[536.073, 0.0, 342.371], [0.0, 536.016, 235.537], [0.0, 0.0, 1.0]])
OPENCV_LENS = np.array([-0.265090, -0.046741, 0.0018330, -0.00031475, 0.252312])


def points(count: int, seed: int = 0) -> np.ndarray:
    """Return points in front of the camera, well inside both cameras' view."""
    random = np.random.default_rng(seed)
    depth = random.uniform(1.0, 5.0, count)
    return np.column_stack((random.uniform(-0.45, 0.45, (count, 2)) * depth[:, None], depth))


def test_the_default_camera_is_equation_38() -> None:
    camera = CameraCalibration.load(PAPER)
    assert camera.size == (452, 322)
    assert np.array_equal(camera.matrix, PAPER_K)
    assert not camera.distortion.any()


def test_projection_agrees_with_opencv_when_there_is_no_skew() -> None:
    cloud = points(500)
    camera = CameraCalibration((640, 480), OPENCV_K, OPENCV_LENS)
    expected, _ = cv2.projectPoints(cloud, np.zeros(3), np.zeros(3), OPENCV_K, OPENCV_LENS)
    assert np.allclose(camera.project(cloud), np.reshape(expected, (-1, 2)), atol=1e-9)


def test_skew_moves_a_point_sideways_by_skew_times_its_distorted_height() -> None:
    cloud = points(100)
    plain = CameraCalibration((640, 480), OPENCV_K, OPENCV_LENS)
    skewed = CameraCalibration((640, 480), OPENCV_K + np.diag([5.0, 0.0], 1), OPENCV_LENS)
    pixels = plain.project(cloud)
    pixels[:, 0] += 5.0 * (pixels[:, 1] - OPENCV_K[1, 2]) / OPENCV_K[1, 1]
    assert np.allclose(skewed.project(cloud), pixels, atol=1e-9)


def test_normalising_without_a_lens_is_the_inverse_of_k() -> None:
    camera = CameraCalibration.load(PAPER)
    pixels = np.array([[0.0, 0.0], [451.0, 321.0], [226.0, 161.0], [10.5, 300.25]])
    rays = np.column_stack((pixels, np.ones(4))) @ np.linalg.inv(PAPER_K).T
    assert np.allclose(camera.normalise(pixels), rays[:, :2], atol=1e-15)


def test_normalising_agrees_with_opencv() -> None:
    # OpenCV stops after five rounds: near the middle of the picture that is enough for seven digits.
    pixels = np.random.default_rng(1).uniform([200, 140], [440, 340], (300, 2))
    camera = CameraCalibration((640, 480), OPENCV_K, OPENCV_LENS)
    expected = np.reshape(cv2.undistortPoints(pixels[:, None], OPENCV_K, OPENCV_LENS), (-1, 2))
    assert np.allclose(camera.normalise(pixels), expected, atol=1e-7)


@given(
    focal=st.floats(200, 1500),
    aspect=st.floats(0.8, 1.25),
    skew=st.floats(-20, 20),
    lens=st.tuples(
        st.floats(-0.3, 0.4),
        st.floats(-0.1, 0.2),
        st.floats(-0.005, 0.005),
        st.floats(-0.005, 0.005),
        st.floats(-0.05, 0.1),
    ),
    ray=st.tuples(st.floats(-0.4, 0.4), st.floats(-0.3, 0.3)),
)
def test_a_ray_comes_back_from_its_pixel(
    focal: float, aspect: float, skew: float, lens: tuple[float, ...], ray: tuple[float, float]
) -> None:
    matrix = np.array(
        [[focal, skew, 0.37 * focal], [0.0, focal * aspect, 0.29 * focal * aspect], [0.0, 0.0, 1.0]]
    )
    camera = CameraCalibration((int(0.75 * focal), int(0.55 * focal * aspect)), matrix, np.array(lens))
    pixel = camera.project([[*ray, 1.0]])
    assert np.allclose(camera.normalise(pixel), [ray], atol=1e-10)


def test_missing_points_stay_missing() -> None:
    camera = CameraCalibration((640, 480), OPENCV_K, OPENCV_LENS)
    rays = camera.normalise([[100.0, 50.0], [np.nan, np.nan], [320.0, 240.0]])
    assert np.isnan(rays[1]).all()
    assert np.isfinite(rays[[0, 2]]).all()


def test_points_beside_or_behind_the_camera_have_no_pixel() -> None:
    camera = CameraCalibration.load(PAPER)
    assert np.isnan(camera.project([[0.1, 0.1, 0.0], [0.1, 0.1, -2.0]])).all()


def test_a_pixel_beyond_the_lens_fold_has_no_ray() -> None:
    # r (1 - 0.3 r^2) never exceeds 0.7027: at the fold, r = 1 / sqrt(0.9).
    matrix = np.array([[500.0, 0, 250], [0, 500, 200], [0, 0, 1]])
    camera = CameraCalibration((500, 400), matrix, np.array([-0.3, 0, 0, 0, 0]))
    rays = camera.normalise([[250 + 500 * 0.702, 200.0], [250 + 500 * 0.7035, 200.0]])
    assert 1.0 < rays[0, 0] < 1 / np.sqrt(0.9)
    assert np.isnan(rays[1]).all()


def found_with(camera: CameraCalibration, noise: float, views: int = 3, count: int = 30) -> CameraCalibration:
    """Return the camera with the evidence of noisy pixels of points in its view."""
    random = np.random.default_rng(2)
    clouds = [points(count, seed) for seed in range(views)]
    seen = [camera.project(cloud) + random.normal(0, noise, (count, 2)) for cloud in clouds]
    evidence = Evidence.of(clouds, seen, [camera.project(cloud) for cloud in clouds])
    return replace(camera, evidence=replace(evidence, date="2026-11-22"))


def test_what_is_saved_is_what_is_loaded(tmp_path: Path) -> None:
    matrix = np.array([[1 / 3 * 1600, 1e-7, 342.371], [0, 536.016, 235.537], [0, 0, 1]])
    camera = found_with(CameraCalibration((640, 480), matrix, OPENCV_LENS), noise=0.4)
    path = tmp_path / "camera.yaml"
    camera.save(path, comment="left camera\nof the bench")
    again = CameraCalibration.load(path)
    assert np.array_equal(again.matrix, camera.matrix)
    assert np.array_equal(again.distortion, camera.distortion)
    assert again.size == camera.size
    for name in ("rms", "errors", "date", "points"):
        assert np.array_equal(getattr(again.evidence, name), getattr(camera.evidence, name)), name
    assert path.read_text().startswith("# left camera\n# of the bench\n")


def test_a_calibration_of_which_nothing_is_known_is_saved_too(tmp_path: Path) -> None:
    CameraCalibration((452, 322), PAPER_K, np.zeros(5)).save(tmp_path / "camera.yaml")
    assert CameraCalibration.load(tmp_path / "camera.yaml").evidence.rms is None


@given(noise=st.floats(0.01, 1.0), views=st.integers(1, 5), count=st.integers(8, 60))
def test_the_evidence_of_noise_is_its_size_and_some_typical_points(
    noise: float, views: int, count: int
) -> None:
    camera = CameraCalibration((640, 480), OPENCV_K, OPENCV_LENS)
    evidence = found_with(camera, noise, views, count).evidence
    assert evidence.rms is not None and evidence.errors is not None and evidence.points is not None
    assert evidence.rms == pytest.approx(noise * np.sqrt(2), rel=0.6)
    assert evidence.rms == pytest.approx(np.sqrt(np.mean(evidence.errors**2)))
    assert len(evidence.errors) == views
    assert len(evidence.points) == min(40, views * count)
    kept = camera.project(evidence.points[:, :3]) - evidence.points[:, 3:]
    assert np.sqrt(np.mean(np.sum(kept**2, axis=1))) == pytest.approx(evidence.rms, rel=0.1)


@pytest.mark.parametrize("noise", [0.0, 0.4])
@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("536.073", "563.073"),  # fx
        ("536.016", "506.016"),  # fy
        ("342.371", "324.371"),  # cx
        ("235.537", "335.537"),  # cy
        ("-0.26509", "0.26509"),  # k1
    ],
)
def test_a_number_that_was_changed_after_the_calibration_is_noticed(
    tmp_path: Path, noise: float, old: str, new: str
) -> None:
    path = tmp_path / "camera.yaml"
    found_with(CameraCalibration((640, 480), OPENCV_K, OPENCV_LENS), noise).save(path)
    text = path.read_text()
    assert text.count(old) == 1
    path.write_text(text.replace(old, new))
    with pytest.raises(DiagramError, match="misses the stored points") as caught:
        CameraCalibration.load(path)
    line = next(number for number, line in enumerate(text.splitlines(), 1) if line.startswith("points:"))
    assert str(caught.value).startswith(f"{path}:{line + 1}:")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (r"rms: .*", "rms: -0.4", "not negative"),
        (r"rms: .*", "rms: 3.0", "rms must be there, and lie between them"),
        (r"rms: .*\n", "", "rms must be there"),
        (r"errors: .*", "errors: [0.5, -0.1, 0.2]", "not negative"),
        (r"errors: .*", "errors: 0.5", "list"),
        (r"date: .*", "date: yesterday", "2026-11-22"),
        (r"size: .*", "size: [320, 240]", "outside a picture of 320 x 240 px"),
        (r"points:\n- \[", "points:\n- [1.0, ", "5"),
        (r"points:\n- \[[^,]*,", "points:\n- [1 mm,", "unit"),
    ],
)
def test_evidence_that_cannot_be_is_refused(tmp_path: Path, old: str, new: str, words: str) -> None:
    path = tmp_path / "camera.yaml"
    found_with(CameraCalibration((640, 480), OPENCV_K, OPENCV_LENS), 0.4).save(path)
    text, count = re.subn(old, new, path.read_text(), count=1)
    assert count == 1
    path.write_text(text)
    with pytest.raises(DiagramError, match=re.escape(words)) as caught:
        CameraCalibration.load(path)
    assert str(caught.value).startswith(f"{path}:")


GOOD = "size: [452, 322]\nmatrix: [[430, 2, 226], [0, 438, 161], [0, 0, 1]]\ndistortion: [0, 0, 0, 0, 0]\n"


@pytest.mark.parametrize(
    ("good", "bad", "place", "words"),
    [
        ("[452, 322]", "[452, 0]", ":1:7", "at least 2"),
        ("[452, 322]", "[452, 322.5]", ":1:13", "whole number"),
        ("[452, 322]", "[452]", ":1:7", "width and height"),
        ("[452, 322]", "[60000, 60000]", ":1:7", "size is 60000 x 60000 px; at most 64 million pixels"),
        ("[452, 322]", "[8001, 8000]", ":1:7", "at most 64 million pixels are taken"),
        ("430", "-430", ":2:9", "fx = -430"),
        ("438", "0", ":2:9", "fy = 0"),
        ("[0, 438", "[3, 438", ":2:9", "[[fx, s, cx], [0, fy, cy], [0, 0, 1]]"),
        ("0, 0, 1]", "0, 0, 2]", ":2:9", "[[fx, s, cx], [0, fy, cy], [0, 0, 1]]"),
        ("[0, 0, 1]]", "[0, 0, 1], [0, 0, 1]]", ":2:9", "3 x 3"),
        ("[0, 0, 0, 0, 0]", "[0, 0, 0, 0]", ":3:13", "5 numbers"),
        ("[0, 0, 0, 0, 0]", "[-2, 0, 0, 0, 0]", ":3:13", "folds the picture"),
        ("distortion", "distorsion", ":3:1", "did you mean 'distortion'?"),
        ("430", "wide", ":2:11", "number"),
    ],
)
def test_a_wrong_file_is_refused_at_the_place_that_is_wrong(
    tmp_path: Path, good: str, bad: str, place: str, words: str
) -> None:
    path = tmp_path / "camera.yaml"
    path.write_text(GOOD.replace(good, bad, 1))
    with pytest.raises(DiagramError) as caught:
        CameraCalibration.load(path)
    assert str(caught.value).startswith(f"{path}{place}: ")
    assert words in str(caught.value)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(DiagramError, match="no such file"):
        CameraCalibration.load(tmp_path / "nothing.yaml")


def test_a_calibration_made_in_code_is_checked_too() -> None:
    with pytest.raises(CalibrationError, match="distortion has 4 numbers"):
        CameraCalibration((452, 322), PAPER_K, np.zeros(4))


def test_a_calibration_cannot_be_changed_by_accident() -> None:
    camera = CameraCalibration.load(PAPER)
    assert not camera.matrix.flags.writeable
    with pytest.raises(ValueError):
        camera.matrix[0, 0] = 1.0
