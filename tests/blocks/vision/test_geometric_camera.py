"""vision.geometric_camera"""

from pathlib import Path

import cv2
import numpy as np
import pytest

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.vision.circle_detector import CircleDetector
from quadvis_blocks.vision.geometric_camera import GeometricCamera
from quadvis_blocks.vision.rendered_camera import RenderedCamera

CALIBRATION = str(Path(__file__).parents[3] / "diagrams" / "calib" / "camera.yaml")
K = np.array([[430.0, 2.0, 226.0], [0.0, 438.0, 161.0], [0.0, 0.0, 1.0]])
HOVER = [0.1, -0.2, 1.4]


def camera(**parameters):
    return GeometricCamera(calibration=CALIBRATION, **{"noise": 0.0, "latency": 0.0, **parameters})


def projected(position, attitude, ceiling=4.5, side=1.0, radius=0.12):
    """The centres of the ellipses, fitted to outlines that OpenCV turned and projected, skew by hand."""
    roll, pitch, yaw = attitude
    turns = [
        cv2.Rodrigues(np.array(axis))[0] for axis in ([roll, 0.0, 0.0], [0.0, pitch, 0.0], [0.0, 0.0, yaw])
    ]
    body = turns[2] @ turns[1] @ turns[0]
    rotation = np.diag([1.0, -1.0, -1.0]) @ body.T
    place = np.array([position[0], position[1], ceiling - position[2]])
    half = side / 2
    corners = np.array([[-half, half, 0.0], [half, half, 0.0], [half, -half, 0.0], [-half, -half, 0.0]])
    angles = np.linspace(0.0, 2 * np.pi, 90, endpoint=False)
    circle = radius * np.column_stack((np.cos(angles), np.sin(angles), np.zeros(90)))
    points = (corners[:, None] + circle).reshape(-1, 3)
    rays, _ = cv2.projectPoints(points, cv2.Rodrigues(rotation)[0], -rotation @ place, np.eye(3), None)
    homogeneous = np.column_stack((np.asarray(rays).reshape(-1, 2), np.ones(len(points))))
    return np.array([ellipse_centre(outline) for outline in (homogeneous @ K.T)[:, :2].reshape(4, 90, 2)])


def ellipse_centre(outline):
    """The centre of the conic a u^2 + b u v + c v^2 + d u + e v = 1 through the points, about their mean."""
    middle = outline.mean(axis=0)
    u, v = (outline - middle).T / 10
    a, b, c, d, e = np.linalg.lstsq(np.column_stack((u * u, u * v, v * v, u, v)), np.ones(len(u)))[0]
    return middle + 10 * np.linalg.solve([[2 * a, b], [b, 2 * c]], [-d, -e])


@pytest.mark.parametrize("attitude", [[0.0, 0.0, 0.0], [0.05, -0.03, 0.4]])
def test_without_noise_the_centres_are_those_of_the_projected_outlines(attitude):
    seen = drive(camera(), position=HOVER, attitude=attitude, rate="10 Hz", steps=1)
    assert seen.centres[0] == pytest.approx(projected(HOVER, attitude), abs=1e-6)
    assert (seen.status[0], seen.found[0], seen.lost[0]) == (0, True, False)


def test_noise_has_the_stated_deviation_and_follows_the_seed():
    blocks = [drive(camera(noise=0.3), position=HOVER, attitude=[0.0] * 3, rate="10 Hz", steps=800, seed=seed)
              for seed in (1, 1, 2)]  # fmt: skip
    error = blocks[0].centres - projected(HOVER, [0.0] * 3)
    assert error.std() == pytest.approx(0.3, rel=0.05)
    assert abs(error.mean()) < 0.02
    assert np.array_equal(blocks[0].centres, blocks[1].centres)
    assert not np.array_equal(blocks[0].centres, blocks[2].centres)


def test_a_measurement_arrives_after_the_latency_with_the_stamp_of_its_capture():
    seen = drive(camera(latency=0.2), position=HOVER, attitude=[0.0] * 3, rate="10 Hz", steps=6)
    assert seen.status.tolist()[:3] == [5, 5, 0]
    assert seen.sequence.tolist() == [0, 0, 1, 2, 3, 4]
    assert seen.stamp[2:] == pytest.approx([0.0, 0.1, 0.2, 0.3])


def test_between_two_measurements_the_last_one_stays_and_is_not_fresh():
    seen = drive(camera(drop_rate=0.5), position=HOVER, attitude=[0.0] * 3, rate="10 Hz", steps=200, seed=3)
    fresh = np.diff(seen.sequence, prepend=0) != 0
    assert np.array_equal(seen.fresh, fresh)
    assert 70 < fresh.sum() < 130
    assert not seen.lost.any()


def test_circles_whose_outline_leaves_the_picture_are_missing():
    # Flying forward, the camera leaves the target behind: its rear side (corners 1 and 4) goes first.
    seen = drive(
        camera(), position=[[x, 0.0, 1.5] for x in (0.0, 1.0, 2.5)], attitude=[0.0] * 3, rate="10 Hz"
    )
    assert seen.status.tolist() == [0, 2, 3]
    assert np.isnan(seen.centres[1]).all(axis=1).tolist() == [True, False, False, True]
    assert seen.lost.tolist() == [False, False, True]


def test_without_a_bounded_picture_circles_are_seen_beyond_its_edges():
    places = [[x, 0.0, 1.5] for x in (1.0, 2.5, 6.0)]
    seen = drive(camera(field_of_view="unbounded"), position=places, attitude=[0.0] * 3, rate="10 Hz")
    assert seen.status.tolist() == [0, 0, 0]
    for place, centres in zip(places, seen.centres, strict=True):
        assert centres == pytest.approx(projected(place, [0.0] * 3), abs=1e-6)


def test_even_without_a_bounded_picture_nothing_is_seen_behind_the_camera():
    seen = drive(camera(field_of_view="unbounded"), position=[0.0, 0.0, 5.0], attitude=[0.0] * 3, steps=1)
    assert seen.status[0] == 3


def test_a_calibration_that_is_not_there_is_refused():
    with pytest.raises(ParameterError, match="calibration is not usable"):
        GeometricCamera(calibration="missing.yaml")


def test_its_centres_are_those_that_the_detector_finds_in_rendered_pictures():
    draw = np.random.default_rng(1).normal
    places = {
        "position": np.add([0.0, 0.0, 1.5], draw(0.0, 0.1, (20, 3))),
        "attitude": draw(0.0, 0.03, (20, 3)),
    }
    frames = drive(RenderedCamera(calibration=CALIBRATION), rate="10 Hz", **places).frame
    colours = str(Path(CALIBRATION).with_name("colours.yaml"))
    detected = drive(CircleDetector(colours=colours), frame=frames, rate="10 Hz").centres
    error = detected - drive(camera(), rate="10 Hz", **places).centres
    assert np.isfinite(error).all()
    assert np.sqrt(np.mean(error**2)) < 0.03


def test_it_can_stand_in_for_camera_and_detector():
    outputs = [
        {name: (port.signal, port.units) for name, port in block.interface.outputs.items()}
        for block in (GeometricCamera, CircleDetector)
    ]
    assert outputs[0] == outputs[1]
