"""The pose with a measured tilt against poses that are known, projected here with OpenCV's rotations."""

import itertools
import math
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.vision.circle_detector import CircleDetector
from quadvis_blocks.vision.pose_imu import PoseImu
from quadvis_blocks.vision.pose_n_points import PoseNPoints
from quadvis_blocks.vision.pose_plane import PosePlane
from quadvis_blocks.vision.rendered_camera import RenderedCamera
from quadvis_vision.camera.calibration import CameraCalibration
from quadvis_vision.camera.two_planes import TwoPlanesCalibration

CALIB = Path(__file__).parents[3] / "diagrams/calib"
CAMERA = str(CALIB / "camera.yaml")
MATRIX = np.array([[430.0, 2, 226], [0, 438, 161], [0, 0, 1]])
CORNERS = np.array([[-0.5, 0.5], [0.5, 0.5], [0.5, -0.5], [-0.5, -0.5]])
RADIUS = 0.12
SUBSETS = [rows for count in (2, 3, 4) for rows in itertools.combinations(range(4), count)]
MODES = ("level", "map")
EMPTY = ("position", "yaw", "rotation", "roll", "pitch", "residual", "covariance")

poses = st.tuples(
    *(st.floats(-1.5, 1.5),) * 2,  # x, y
    st.floats(1.6, 12.0),  # z
    *(st.floats(-0.4, 0.4),) * 2,  # roll, pitch
    st.floats(-math.pi, math.pi),  # yaw
)


def homography(pose):
    """From the target's plane, forward and right, to normalised points; target axes to camera axes too."""
    *position, roll, pitch, yaw = pose
    rx, ry, rz = (cv2.Rodrigues(turn)[0] for turn in np.diag(np.array([roll, pitch, yaw], float)))
    turn = np.diag([1.0, -1.0, -1.0]) @ (rz @ ry @ rx).T
    return np.column_stack((turn[:, 0], turn[:, 1], -turn @ position)), turn


def centres(pose, radius=RADIUS, matrix=MATRIX):
    """The centres (4, 2) in px of the ellipses that the circles become, from their dual conics."""
    h = matrix @ homography(pose)[0]
    found = []
    for x, y in CORNERS:
        dual = h @ np.linalg.inv([[1, 0, -x], [0, 1, -y], [-x, -y, x * x + y * y - radius * radius]]) @ h.T
        found.append(dual[:2, 2] / dual[2, 2])
    return np.array(found)


def depth(pose):
    return (np.column_stack((CORNERS, np.ones(4))) @ homography(pose)[0][2]).min()


def only(image, rows):
    left = np.full((4, 2), np.nan)
    left[list(rows)] = image[list(rows)]
    return left


def solve(image, roll, pitch, sigma=(math.nan,) * 4, **parameters):
    block = PoseImu(**{"calibration": CAMERA, **parameters})
    circles = {"centres": np.array(image)[None], "sigma": np.array(sigma)[None]}
    return drive(block, **circles, imu_roll=[roll], imu_pitch=[pitch], rate="10 Hz")


def check_pose(seen, pose, tolerance):
    assert seen.valid[0]
    assert seen.position[0] == pytest.approx(pose[:3], abs=tolerance)
    assert (seen.roll[0], seen.pitch[0]) == pytest.approx(pose[3:5], abs=tolerance)
    assert abs(math.remainder(seen.yaw[0] - pose[5], 2 * math.pi)) < tolerance
    assert seen.rotation[0] == pytest.approx(homography(pose)[1], abs=tolerance)
    assert -math.pi < seen.yaw[0] <= math.pi


def check_nothing(seen, status):
    assert not seen.valid[0] and seen.status[0] == status
    for name in EMPTY:
        assert np.isnan(seen.signals[name][0]).all()


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("rows", SUBSETS)
@given(pose=poses)
@example(pose=(0.0, 0.0, 3.0, 0.0, 0.0, -math.pi))
def test_exact_circles_and_tilt_give_the_pose_back_from_every_two_circles_or_more(rows, mode, pose):
    assume(depth(pose) > 0.5)
    seen = solve(only(centres(pose), rows), *pose[3:5], mode=mode)
    check_pose(seen, pose, 1e-5)
    assert seen.residual[0] < 1e-3
    assert seen.status[0] == 4 - len(rows)
    assert (np.linalg.eigvalsh(seen.covariance[0]) > 0).all()


@pytest.mark.parametrize("mode", MODES)
def test_points_instead_of_circles_give_the_pose_back(mode):
    pose = (0.4, -0.3, 2.0, 0.15, -0.2, 1.0)
    check_pose(solve(centres(pose, 1e-4), *pose[3:5], mode=mode, radius=0.0), pose, 1e-7)


@pytest.mark.parametrize("mode", MODES)
def test_ellipses_that_are_taken_for_points_move_the_pose(mode):
    pose = (0.4, -0.3, 1.6, 0.2, -0.3, 1.0)
    off = solve(centres(pose), *pose[3:5], mode=mode, radius=0.0).position[0] - pose[:3]
    assert 1e-3 < np.abs(off).max() < 0.05


@pytest.mark.parametrize("mode", MODES)
def test_a_lens_is_taken_into_account(mode, tmp_path):
    lens = np.array([-0.2, 0.05, 1e-3, -5e-4, 0.01])
    CameraCalibration((452, 322), MATRIX, lens).save(tmp_path / "lens.yaml")
    pose = (0.3, -0.4, 2.5, 0.1, -0.05, 0.7)
    rays = np.column_stack((centres(pose, matrix=np.eye(3)), np.ones(4)))
    # OpenCV ignores skew: the lens by OpenCV, the intrinsic matrix by hand.
    bent, _ = cv2.projectPoints(rays, np.zeros(3), np.zeros(3), np.eye(3), lens)
    image = np.reshape(bent, (4, 2)) @ MATRIX[:2, :2].T + MATRIX[:2, 2]
    seen = solve(image, *pose[3:5], mode=mode, calibration=str(tmp_path / "lens.yaml"))
    check_pose(seen, pose, 1e-7)
    assert np.abs(solve(image, *pose[3:5], mode=mode).position[0] - pose[:3]).max() > 0.02


@pytest.mark.parametrize("mode", MODES)
def test_rays_of_a_two_planes_calibration_give_the_pose_too(mode, tmp_path):
    focus = np.array([1.5, -0.8, 27.3])
    turn = np.diag([1.0, -1.0, -1.0]) @ cv2.Rodrigues(np.array([0.04, -0.06, 0.02]))[0]
    x, y = np.meshgrid(np.linspace(-6, 6, 7), np.linspace(-5, 5, 6))
    grid = np.column_stack((x.ravel(), y.ravel()))
    points = np.vstack([np.column_stack((grid, np.full(len(grid), z))) for z in (1.0, 6.0)])
    image = (points - focus) @ (MATRIX @ turn).T
    planes = TwoPlanesCalibration.fit(points, image[:, :2] / image[:, 2:], projective=True)
    planes.save(tmp_path / "planes.yaml")
    pose = (0.3, -0.2, 3.0, 0.1, 0.05, -2.0)
    file = str(tmp_path / "planes.yaml")
    for rows in SUBSETS:
        seen = solve(only(centres(pose), rows), *pose[3:5], mode=mode, calibration=file, rays="two_planes")
        check_pose(seen, pose, 1e-5)


def test_side_and_radius_scale_the_position_alone():
    pose = (0.3, -0.2, 3.0, 0.1, 0.05, -2.0)
    for mode in MODES:
        large = solve(centres(pose), *pose[3:5], mode=mode, side=2.5, radius=2.5 * RADIUS)
        check_pose(large, (*2.5 * np.array(pose[:3]), *pose[3:]), 1e-6)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("rows", [(), (0,), (2,)])
def test_fewer_than_two_circles_give_no_pose(rows, mode):
    check_nothing(solve(only(centres((0, 0, 3.0, 0, 0, 0)), rows), 0.0, 0.0, mode=mode), 3)


def test_half_a_circle_is_a_missing_one():
    image = centres((0, 0, 3.0, 0, 0, 0))
    image[0, 0], image[1, 1], image[2, 0] = np.nan, np.nan, np.inf
    check_nothing(solve(image, 0.0, 0.0), 3)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("tilt", [(math.nan, 0.0), (0.0, math.nan), (math.inf, 0.0)])
def test_without_a_tilt_there_is_no_pose(tilt, mode):
    check_nothing(solve(centres((0, 0, 3.0, 0, 0, 0)), *tilt, mode=mode), 8)


IMAGE = centres((0.1, 0.2, 3.0, 0.05, 0.02, 0.3))
NO_SQUARE = {
    "seen in a mirror": IMAGE[[0, 3, 2, 1]],
    "crossed over": IMAGE[[0, 2, 1, 3]],
    "one point": np.tile(IMAGE[:1], (4, 1)),
    "two in one place": np.vstack((IMAGE[[0, 0]], np.full((2, 2), np.nan))),
    "three, mirrored": np.vstack((IMAGE[[0, 3, 2]], np.full((1, 2), np.nan))),
    "one far away": IMAGE + np.array([[0, 0], [80, 60], [0, 0], [0, 0]]),
    "on a line": np.column_stack((np.linspace(100, 300, 4), np.linspace(50, 200, 4))),
    "enormous": IMAGE * np.array([[1e200], [1], [1e200], [1]]),
    "all enormous": IMAGE * 1e160,
}


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("kind", NO_SQUARE)
def test_points_that_are_no_square_give_no_pose(kind, mode):
    check_nothing(solve(NO_SQUARE[kind], 0.05, 0.02, mode=mode), 4)


def torn(pose, shift):
    """The circles of a picture whose lower half has moved to the side."""
    image = centres(pose)
    image[image[:, 1] > image[:, 1].mean(), 0] += shift
    return image


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("rows", [rows for rows in SUBSETS if len(rows) > 2])
def test_circles_of_a_torn_picture_give_no_pose(rows, mode):
    pose = (0.2, -0.1, 3.0, 0.05, -0.03, 0.1)
    assert solve(only(torn(pose, 0.0), rows), *pose[3:5], mode=mode).valid[0]
    for shift in (-150.0, -40.0, -15.0, 15.0, 20.0, 60.0):
        assert not solve(only(torn(pose, shift), rows), *pose[3:5], mode=mode).valid[0], shift


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize(("rows", "wrong"), [((0, 1, 2, 3), 13.0), ((0, 1, 3), 5.0)])
def test_a_level_that_is_wrong_is_no_torn_picture(rows, wrong, mode):
    rng = np.random.default_rng(5)
    for z in (1.6, 3.0, 6.0):
        for way in np.linspace(0.0, 2 * math.pi, 8):
            pose = (*rng.uniform(-0.1, 0.1, 2) * z, z, 0.02, -0.03, rng.uniform(-3.0, 3.0))
            image = centres(pose) + rng.normal(0.0, 0.2, (4, 2))
            roll, pitch = np.array(pose[3:5]) + math.radians(wrong) * np.array([math.cos(way), math.sin(way)])
            assert solve(only(image, rows), roll, pitch, mode=mode).valid[0], (z, way)


@pytest.mark.parametrize("mode", MODES)
def test_a_target_below_the_craft_gives_no_pose(mode):
    check_nothing(solve(IMAGE, 3.0, 0.0, mode=mode), 4)


@given(
    image=arrays(np.float64, (4, 2), elements=st.floats(width=64)),
    tilt=st.tuples(st.floats(), st.floats()),
    mode=st.sampled_from(MODES),
)
def test_nothing_raises_an_error_and_every_pose_is_whole(image, tilt, mode):
    block = PoseImu(calibration=CAMERA, mode=mode)
    block.open()
    *numbers, residual, valid, covariance, status = block.output(image, *tilt, np.full(4, math.nan))
    assert valid == (status < 3)
    for number in (*numbers, residual, covariance):
        assert np.isfinite(number).all() if valid else np.isnan(number).all()
    if valid:
        assert numbers[0][2] > 0


def test_with_two_circles_the_modes_are_one():
    rng = np.random.default_rng(1)
    for rows in itertools.combinations(range(4), 2):
        pose = (*rng.uniform(-0.5, 0.5, 2), rng.uniform(2, 5), *rng.uniform(-0.2, 0.2, 2), rng.uniform(-3, 3))
        image = only(centres(pose) + rng.normal(0, 0.5, (4, 2)), rows)
        tilt = np.array(pose[3:5]) + rng.normal(0, 0.01, 2)
        level, most_probable = (solve(image, *tilt, mode=mode) for mode in MODES)
        for name in ("position", "yaw", "roll", "pitch"):
            assert level.signals[name] == pytest.approx(most_probable.signals[name], abs=1e-4)
        assert level.covariance == pytest.approx(most_probable.covariance, rel=1e-3, abs=1e-8)


def test_level_keeps_the_measured_tilt_and_map_weighs_it():
    pose, tilt = (0.3, -0.2, 1.6, 0.1, 0.05, -2.0), (0.11, 0.04)
    level = solve(centres(pose), *tilt, mode="level")
    assert (level.roll[0], level.pitch[0]) == pytest.approx(tilt, abs=1e-12)
    for sigma, nearer in ((1e-5, tilt), (10.0, pose[3:5])):
        found = solve(centres(pose), *tilt, mode="map", tilt_sigma=sigma)
        assert (found.roll[0], found.pitch[0]) == pytest.approx(nearer, abs=1e-4)
    # Near by the picture knows better, and from far away the inertial unit does.
    errors = {}
    for distance in (1.6, 12.0):
        pose = (0.1, 0.1, distance, 0.1, 0.05, -2.0)
        image = centres(pose) + np.random.default_rng(3).normal(0, 0.1, (4, 2))
        for mode in MODES:
            found = solve(image, *tilt, mode=mode, pixel_sigma=0.1).position[0]
            errors[mode, distance] = np.hypot(*(found - pose[:3])[:2])
    assert errors["map", 1.6] < 0.5 * errors["level", 1.6]
    assert errors["map", 12.0] < 1.2 * errors["level", 12.0]


def test_a_tilt_that_says_nothing_leaves_what_the_refined_methods_of_the_paper_find():
    rng = np.random.default_rng(4)
    for _ in range(10):
        pose = (
            *rng.uniform(-0.5, 0.5, 2),
            rng.uniform(1.6, 3),
            *rng.uniform(-0.2, 0.2, 2),
            rng.uniform(-3, 3),
        )
        image = centres(pose) + rng.normal(0, 0.1, (4, 2))
        found = solve(image, *pose[3:5], tilt_sigma=100.0)
        for method in (PoseNPoints, PosePlane):
            block = method(calibration=CAMERA, refine="gauss_newton", radius=RADIUS)
            alone = drive(block, centres=image[None], rate="10 Hz")
            assert alone.position == pytest.approx(found.position, abs=2e-4)
            assert alone.rotation == pytest.approx(found.rotation, abs=2e-4)
            assert alone.residual == pytest.approx(found.residual, abs=1e-4)


@pytest.mark.parametrize("mode", MODES)
def test_the_covariance_grows_with_both_sigmas(mode):
    pose = (0.3, -0.2, 4.0, 0.1, 0.05, -2.0)
    base = solve(centres(pose), *pose[3:5], mode=mode).covariance[0]
    for name, value in (("pixel_sigma", 0.4), ("tilt_sigma", math.radians(1))):
        larger = solve(centres(pose), *pose[3:5], mode=mode, **{name: value}).covariance[0]
        assert (np.linalg.eigvalsh(larger - base) > -1e-12).all()
        assert np.trace(larger) > 1.02 * np.trace(base)
    both = {"pixel_sigma": 0.4, "tilt_sigma": math.radians(1)}
    assert solve(centres(pose), *pose[3:5], mode=mode, **both).covariance[0] == pytest.approx(
        4 * base, rel=1e-6
    )


@pytest.mark.parametrize("mode", MODES)
def test_circles_may_each_have_a_sigma_of_their_own(mode):
    pose = (0.3, -0.2, 4.0, 0.1, 0.05, -2.0)
    image = centres(pose) + np.random.default_rng(6).normal(0, 0.3, (4, 2))
    one = solve(image, *pose[3:5], mode=mode, pixel_sigma=0.4)
    same = solve(image, *pose[3:5], mode=mode, sigma=(0.4, 0.4, math.nan, 0.4), pixel_sigma=0.4)
    assert (same.position == one.position).all() and (same.covariance == one.covariance).all()
    missing = solve(only(image, (0, 1, 3)), *pose[3:5], mode=mode).covariance[0]
    worse = solve(image, *pose[3:5], mode=mode, sigma=(0.2, 0.2, math.inf, 0.2))
    if mode == "map":  # level takes all circles alike
        assert worse.covariance[0] == pytest.approx(missing, rel=0.02)
        three = solve(only(image, (0, 1, 3)), *pose[3:5], mode=mode)
        assert worse.position == pytest.approx(three.position, abs=1e-4)
    else:
        assert np.trace(worse.covariance[0]) > np.trace(missing)


def test_the_residual_is_the_rms_distance_of_the_circles_that_are_seen():
    pose = (0.2, 0.1, 3.0, 0.05, -0.1, 0.4)
    image = only(centres(pose) + np.random.default_rng(5).normal(0, 0.7, (4, 2)), (0, 1, 3))
    for mode in MODES:
        seen = solve(image, *pose[3:5], mode=mode)
        found = (*seen.position[0], seen.roll[0], seen.pitch[0], seen.yaw[0])
        distances = np.linalg.norm((centres(found) - image)[[0, 1, 3]], axis=1)
        assert seen.residual[0] == pytest.approx(math.sqrt((distances**2).mean()), abs=1e-6)
        assert seen.residual[0] > 0.1


def test_a_calibration_that_cannot_be_read_is_named(tmp_path):
    with pytest.raises(ParameterError) as error:
        PoseImu(calibration=str(tmp_path / "none.yaml"))
    assert error.value.parameter == "calibration"


def test_it_has_the_outputs_of_the_methods_of_the_paper():
    paper, own = PosePlane.interface.outputs, PoseImu.interface.outputs
    assert {name: (port.type, port.unit) for name, port in paper.items()}.items() <= {
        name: (port.type, port.unit) for name, port in own.items()
    }.items()


def test_from_pictures_and_the_true_tilt_it_finds_the_craft_better_than_the_paper():
    ceiling, k = 4.5, np.arange(20)
    position = np.column_stack((0.2 * np.sin(0.3 * k), 0.1 * np.cos(0.2 * k), 1.2 + 0.01 * k))
    attitude = np.column_stack((0.05 * np.sin(0.4 * k), 0.04 * np.cos(0.5 * k), 0.3 * k - 2))
    camera = RenderedCamera(calibration=CAMERA, ceiling=ceiling)
    pictures = drive(camera, position=position, attitude=attitude, rate="10 Hz").frame
    image = drive(CircleDetector(colours=str(CALIB / "colours.yaml")), frame=pictures, rate="10 Hz").centres
    inputs = {"centres": image, "imu_roll": attitude[:, 0], "imu_pitch": attitude[:, 1]}
    truth = position * (1, 1, -1) + (0, 0, ceiling)

    def error(block):
        wanted = {name: inputs[name] for name in block.interface.inputs if name in inputs}
        found = drive(block, rate="10 Hz", **wanted)
        assert found.valid.all()
        return np.sqrt(((found.position - truth)[:, :2] ** 2).sum(axis=1).mean())

    paper = error(PosePlane(calibration=CAMERA))
    for mode in MODES:
        assert error(PoseImu(calibration=CAMERA, mode=mode)) < 0.5 * paper
