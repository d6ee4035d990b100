"""Method 1 against poses that are known, projected here with OpenCV's rotations and lens."""

import math
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.vision.pose_n_points import PoseNPoints
from quadvis_blocks.vision.pose_plane import PosePlane
from quadvis_vision.camera.calibration import CameraCalibration
from quadvis_vision.camera.two_planes import TwoPlanesCalibration
from quadvis_vision.pose.pose import pose_from_n_points, pose_from_plane
from tests.blocks.vision.plain import pose_by

REPO = Path(__file__).parents[3]
CAMERA = str(REPO / "diagrams/calib/camera.yaml")
MATRIX = np.array([[430.0, 2, 226], [0, 438, 161], [0, 0, 1]])
SIDE = 1.0

poses = st.tuples(
    *(st.floats(-1.5, 1.5),) * 2,  # x, y
    st.floats(1.6, 12.0),  # z
    *(st.floats(-0.5, 0.5),) * 2,  # roll, pitch
    st.floats(-math.pi, math.pi),  # yaw
)


def camera_points(pose, side=SIDE):
    """Corners 1..4 in camera axes of a camera at (x, y, z) below the ceiling with roll, pitch and yaw."""
    x, y, z, roll, pitch, yaw = pose
    rx, _ = cv2.Rodrigues(np.array([roll, 0.0, 0.0]))
    ry, _ = cv2.Rodrigues(np.array([0.0, pitch, 0.0]))
    rz, _ = cv2.Rodrigues(np.array([0.0, 0.0, yaw]))
    # North-east-down body axes; the camera's y and z are the body's with the other sign.
    body = (rz @ ry @ rx).T
    corners = np.array([[-1, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]]) * side / 2
    return (corners - (x, y, z)) @ (np.diag([1, -1, -1]) @ body).T


def pixels(points, matrix=MATRIX):
    image = points @ matrix.T
    return image[:, :2] / image[:, 2:]


def solve(block, centres):
    return drive(block, centres=np.array(centres)[None], rate="10 Hz")


def turned(angle, other):
    return math.remainder(angle - other, 2 * math.pi)


def check_pose(seen, pose, tolerance):
    assert seen.valid[0]
    assert seen.position[0] == pytest.approx(pose[:3], abs=tolerance)
    assert seen.roll[0] == pytest.approx(pose[3], abs=tolerance)
    assert seen.pitch[0] == pytest.approx(pose[4], abs=tolerance)
    assert abs(turned(seen.yaw[0], pose[5])) < tolerance


def check_nothing(seen):
    assert not seen.valid[0]
    for name in ("position", "yaw", "rotation", "roll", "pitch", "residual"):
        assert np.isnan(seen.signals[name][0]).all()


@pytest.mark.parametrize("method", [PoseNPoints, PosePlane])
@settings(deadline=None)
@given(pose=poses)
@example(pose=(0.0, 0.0, 3.0, 0.0, 0.0, -math.pi))
def test_exact_pixels_give_the_pose_back(method, pose):
    points = camera_points(pose)
    assume(points[:, 2].min() > 0.3)
    seen = solve(method(calibration=CAMERA), pixels(points))
    check_pose(seen, pose, 1e-7)
    assert seen.residual[0] < 1e-7
    assert -math.pi < seen.yaw[0] <= math.pi
    x_camera = (np.array([[-0.5, 0.5, 0]]) - seen.position[0]) @ seen.rotation[0].T
    assert x_camera[0] == pytest.approx(points[0], abs=1e-7)


@pytest.mark.parametrize("method", [PoseNPoints, PosePlane])
@pytest.mark.parametrize(
    ("pose", "first", "second"),
    [
        # What a pilot would say, against signs wrong twice: where circles 1 and 2 are in the picture.
        ((0, 0, 4.0, 0, 0, 0), ("left", "up"), ("right", "up")),
        ((0, 0, 4.0, 0, 0, math.pi / 2), ("right", "up"), ("right", "down")),
        ((1.0, 0, 2.0, 0, 0, 0), ("left", "up"), ("left", "up")),  # forward of the target: it is behind
        (
            (0, 1.0, 2.0, 0, 0, 0),
            ("left", "down"),
            ("right", "down"),
        ),  # right of it: it is to the left
        (
            (0, 0, 2.0, 0.4, 0, 0),
            ("left", "down"),
            ("right", "down"),
        ),  # right side down: it moves to the left
        ((0, 0, 2.0, 0, 0.4, 0), ("right", "up"), ("right", "up")),  # nose up: what is overhead moves forward
    ],
)
def test_signs_are_those_of_the_conventions(method, pose, first, second):
    image = pixels(camera_points(pose))
    for (u, v), (across, along) in zip(image[:2], (first, second), strict=True):
        assert across == ("left" if u < 226 else "right")
        assert along == ("up" if v < 161 else "down")
    check_pose(solve(method(calibration=CAMERA), image), pose, 1e-9)


@pytest.mark.parametrize("method", [PoseNPoints, PosePlane])
def test_a_lens_is_taken_into_account(method, tmp_path):
    lens = np.array([-0.2, 0.05, 1e-3, -5e-4, 0.01])
    CameraCalibration((452, 322), MATRIX, lens).save(tmp_path / "lens.yaml")
    pose = (0.3, -0.4, 2.5, 0.1, -0.05, 0.7)
    # OpenCV ignores skew: the lens by OpenCV, the intrinsic matrix by hand.
    bent, _ = cv2.projectPoints(camera_points(pose), np.zeros(3), np.zeros(3), np.eye(3), lens)
    image = pixels(np.column_stack((bent[:, 0], np.ones(4))))
    check_pose(solve(method(calibration=str(tmp_path / "lens.yaml")), image), pose, 1e-9)
    plain = solve(method(calibration=CAMERA), image)
    assert np.abs(plain.position[0] - pose[:3]).max() > 0.02


@pytest.mark.parametrize("method", [PoseNPoints, PosePlane])
def test_side_scales_the_position_alone(method):
    pose = (0.3, -0.2, 3.0, 0.1, 0.05, -2.0)
    image = pixels(camera_points(pose))
    small, large = (
        solve(method(calibration=CAMERA), image),
        solve(method(calibration=CAMERA, side=2.5), image),
    )
    assert large.position[0] == pytest.approx(2.5 * small.position[0], rel=1e-12)
    assert large.rotation[0] == pytest.approx(small.rotation[0], abs=1e-12)


@pytest.mark.parametrize("method", [PoseNPoints, PosePlane])
def test_rays_of_a_two_planes_calibration_give_the_pose_too(method, tmp_path):
    # The camera above the calibration planes z = 1 and z = 6, as in (36), with x right, y up and z toward it.
    focus, turn = (
        np.array([1.5, -0.8, 27.3]),
        np.diag([1.0, -1.0, -1.0]) @ cv2.Rodrigues(np.array([0.04, -0.06, 0.02]))[0],
    )
    x, y = np.meshgrid(np.linspace(-6, 6, 7), np.linspace(-5, 5, 6))
    grid = np.column_stack((x.ravel(), y.ravel()))
    points = np.vstack([np.column_stack((grid, np.full(len(grid), z))) for z in (1.0, 6.0)])
    planes = TwoPlanesCalibration.fit(points, pixels((points - focus) @ turn.T), projective=True)
    planes.save(tmp_path / "planes.yaml")
    block = method(calibration=str(tmp_path / "planes.yaml"), rays="two_planes")
    pose = (0.3, -0.2, 3.0, 0.1, 0.05, -2.0)
    seen = solve(block, pixels(camera_points(pose)))
    check_pose(seen, pose, 1e-6)
    assert seen.residual[0] < 1e-5


@pytest.mark.parametrize("method", [PoseNPoints, PosePlane])
@pytest.mark.parametrize("missing", [(0,), (1,), (2, 3), (0, 1, 2, 3)])
def test_a_missing_circle_gives_no_pose(method, missing):
    image = pixels(camera_points((0, 0, 3.0, 0, 0, 0)))
    image[list(missing), 0] = np.nan
    check_nothing(solve(method(calibration=CAMERA), image))


IMAGE = pixels(camera_points((0.1, 0.2, 3.0, 0.05, 0.02, 0.3)))
NO_SQUARE = {
    "seen in a mirror": IMAGE[[0, 3, 2, 1]],
    "crossed over": IMAGE[[0, 2, 1, 3]],
    "one point": np.tile(IMAGE[:1], (4, 1)),
    "two points": IMAGE[[0, 0, 2, 2]],
    "on a line": np.column_stack((np.linspace(100, 300, 4), np.linspace(50, 200, 4))),
    "one inside": np.array([[100.0, 100], [300, 100], [170, 130], [100, 300]]),
    "infinite": np.full((4, 2), np.inf),
    "enormous": IMAGE * np.array([[1e200], [1], [1e200], [1]]),
}


@pytest.mark.parametrize("method", [PoseNPoints, PosePlane])
@pytest.mark.parametrize("kind", NO_SQUARE)
def test_points_that_are_no_square_from_below_give_no_pose(method, kind):
    check_nothing(solve(method(calibration=CAMERA), NO_SQUARE[kind]))


@given(pose=poses, noise=arrays(np.float64, (4, 2), elements=st.floats(-2, 2)))
def test_both_methods_give_the_same_rotation_also_from_noisy_pixels(pose, noise):
    points = camera_points(pose)
    assume(points[:, 2].min() > 0.3)
    rays = np.column_stack((pixels(points, np.eye(3)) + noise / 430, np.ones(4)))
    first, second = pose_by(pose_from_n_points, rays, SIDE), pose_by(pose_from_plane, rays, SIDE)
    assert (first is None) == (second is None)
    if first is not None and second is not None:
        # Nearly edge on, the two edges that are made orthogonal lose digits.
        size = np.linalg.svd(pixels(points, np.eye(3)) - pixels(points, np.eye(3)).mean(0), compute_uv=False)
        assert first.rotation == pytest.approx(second.rotation, abs=1e-12 * (size[0] / size[1]) ** 2)
        assert first.rotation.T @ first.rotation == pytest.approx(np.eye(3), abs=1e-12)
        assert np.linalg.det(first.rotation) == pytest.approx(1)


@given(
    rays=arrays(np.float64, (4, 3), elements=st.floats(allow_nan=True, allow_infinity=True, width=64)),
    side=st.floats(1e-3, 1e3),
)
def test_no_rays_raise_an_error_and_every_pose_is_in_front(rays, side):
    for method in (pose_from_n_points, pose_from_plane):
        pose = pose_by(method, rays, side)
        assert pose is None or pose.position[2] > 0


@given(pose=poses, lengths=arrays(np.float64, 4, elements=st.floats(0.1, 10)))
def test_the_lengths_of_the_rays_do_not_matter(pose, lengths):
    points = camera_points(pose)
    assume(points[:, 2].min() > 0.3)
    for method in (pose_from_n_points, pose_from_plane):
        assert pose_by(method, points, SIDE).position == pytest.approx(
            pose_by(method, points * lengths[:, None], SIDE).position, rel=1e-9, abs=1e-9
        )


def test_the_residual_is_the_rms_distance_in_pixels():
    pose = (0.2, 0.1, 3.0, 0.05, -0.1, 0.4)
    centres = pixels(camera_points(pose)) + np.random.default_rng(5).normal(0, 0.7, (4, 2))
    for method in (PoseNPoints, PosePlane):
        seen = solve(method(calibration=CAMERA), centres)
        found = (*seen.position[0], seen.roll[0], seen.pitch[0], seen.yaw[0])
        distances = np.linalg.norm(pixels(camera_points(found)) - centres, axis=1)
        assert seen.residual[0] == pytest.approx(math.sqrt((distances**2).mean()), rel=1e-9)
        assert seen.residual[0] > 0.1


@pytest.mark.parametrize("method", [PoseNPoints, PosePlane])
def test_a_calibration_that_cannot_be_read_is_named(method, tmp_path):
    for path, kind in ((tmp_path / "none.yaml", "pinhole"), (CAMERA, "two_planes")):
        with pytest.raises(ParameterError) as error:
            method(calibration=str(path), rays=kind)
        assert error.value.parameter == "calibration"


def test_the_two_methods_can_take_each_others_place():
    for kind in ("inputs", "outputs", "params"):
        first, second = getattr(PoseNPoints.interface, kind), getattr(PosePlane.interface, kind)
        assert [(p.name, p.type, p.unit) for p in first.values()] == [
            (p.name, p.type, p.unit) for p in second.values()
        ]


def seen_circles(pose, radius):
    """The centres (4, 2) in px of the ellipses that circles become, from their dual conics."""
    corners = camera_points(pose)
    forward, right = (corners[1] - corners[0]) / SIDE, (corners[0] - corners[3]) / SIDE
    h = MATRIX @ np.column_stack((forward, right, corners.mean(axis=0)))
    found = []
    for x, y in np.array([[-1, 1], [1, 1], [1, -1], [-1, -1]]) * SIDE / 2:
        dual = h @ np.linalg.inv([[1, 0, -x], [0, 1, -y], [-x, -y, x * x + y * y - radius * radius]]) @ h.T
        found.append(dual[:2, 2] / dual[2, 2])
    return np.array(found)


@pytest.mark.parametrize("method", [PoseNPoints, PosePlane])
def test_unless_told_otherwise_a_block_is_the_method_of_the_paper_alone(method):
    function = pose_from_n_points if method is PoseNPoints else pose_from_plane
    image = pixels(camera_points((0.2, 0.1, 3.0, 0.05, -0.1, 0.4)))
    image += np.random.default_rng(6).normal(0, 0.7, (4, 2))
    rays = np.column_stack((CameraCalibration.load(CAMERA).normalise(image), np.ones(4)))
    seen, expected = solve(method(calibration=CAMERA), image), pose_by(function, rays, SIDE)
    assert (seen.position[0] == expected.position).all()
    assert (seen.rotation[0] == expected.rotation).all()


@pytest.mark.parametrize("method", [PoseNPoints, PosePlane])
@pytest.mark.parametrize("refine", ["none", "gauss_newton"])
@given(pose=poses)
def test_exact_ellipses_give_the_pose_back_if_their_radius_is_known(method, refine, pose):
    assume(camera_points(pose)[:, 2].min() > 0.5)
    image, radius = seen_circles(pose, 0.12), 0.12
    seen = solve(method(calibration=CAMERA, refine=refine, radius=radius), image)
    # Two corrections of the closed form leave what a third would take away: more px far from the lens' axis.
    check_pose(seen, pose, 1e-3 if refine == "none" else 1e-5)
    far = np.abs(image - MATRIX[:2, 2]).max()
    assert seen.residual[0] < (1e-3 * far if refine == "none" else 1e-3)


@pytest.mark.parametrize("method", [PoseNPoints, PosePlane])
def test_correcting_for_the_radius_takes_most_of_the_error_away(method):
    pose = (0.5, -0.4, 1.8, 0.3, -0.2, 0.7)
    image = seen_circles(pose, 0.12)
    off = [
        np.linalg.norm(solve(method(calibration=CAMERA, radius=radius), image).position[0] - pose[:3])
        for radius in (0.0, 0.12)
    ]
    assert off[1] < 0.02 * off[0]


@pytest.mark.parametrize("method", [PoseNPoints, PosePlane])
def test_gauss_newton_brings_the_circles_nearer_and_both_methods_to_one_pose(method):
    rng = np.random.default_rng(7)
    for _ in range(20):
        pose = (*rng.uniform(-0.5, 0.5, 2), rng.uniform(2, 4), *rng.uniform(-0.2, 0.2, 2), rng.uniform(-3, 3))
        image = pixels(camera_points(pose)) + rng.normal(0, 0.2, (4, 2))
        plain = solve(method(calibration=CAMERA), image)
        refined = solve(method(calibration=CAMERA, refine="gauss_newton"), image)
        other = solve(PosePlane(calibration=CAMERA, refine="gauss_newton"), image)
        assert refined.residual[0] <= plain.residual[0]
        assert refined.position == pytest.approx(other.position, abs=1e-4)
        assert refined.rotation == pytest.approx(other.rotation, abs=1e-4)
