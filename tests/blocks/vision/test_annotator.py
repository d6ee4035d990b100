"""vision.annotator"""

import math
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.block import Frame, ParameterError
from quadvis.testing import drive
from quadvis_blocks.vision.annotator import Annotator
from quadvis_vision.detection import detect
from quadvis_vision.pictures import overlay

CAMERA = str(Path(__file__).parents[3] / "diagrams/calib/camera.yaml")
MATRIX = np.array([[430.0, 2, 226], [0, 438, 161], [0, 0, 1]])  # (38)
CORNERS = np.array([[-0.5, 0.5, 0], [0.5, 0.5, 0], [0.5, -0.5, 0], [-0.5, -0.5, 0]])
TURN = np.diag([1.0, -1.0, -1.0]) @ cv2.Rodrigues(np.array([0.05, -0.1, 0.3]))[0]
POSITION = np.array([0.2, -0.1, 3.4])
GREY = 150


def to_pixels(points):
    e = (np.asarray(points) - POSITION) @ (MATRIX @ TURN).T
    return e[:, :2] / e[:, 2:]


def picture(shape=(322, 452, 3)):
    return Frame(np.full(shape, GREY, np.uint8), 12.3, 7)


def annotated(frame=None, zoom=1, **found):
    given = {"centres": np.full((4, 2), math.nan), **found}
    block = Annotator(calibration=CAMERA, zoom=zoom)
    return drive(block, frame=frame or picture(), steps=1, **given).annotated[0]


def marks(shown, zoom=1):
    """Return the places (n, 2), in pixels of the picture, at which something is drawn."""
    v, u = np.nonzero((shown.pixels[: 322 * zoom] != GREY).any(axis=2))
    return (np.column_stack((u, v)) + 0.5) / zoom - 0.5


def farthest(points, others):
    """Return the largest distance between two of the points."""
    return np.sqrt(((points[:, None] - others) ** 2).sum(axis=2).min(axis=1).max())


@pytest.mark.parametrize("zoom", [1, 3])
def test_every_circle_is_marked_where_it_is_and_nothing_else(zoom):
    centres = np.array([[100.0, 80], [300.25, 90.5], [310, 250], [math.nan, math.nan]])
    shown = annotated(centres=centres, zoom=zoom)
    assert shown.pixels.shape[1] == 452 * zoom and shown.pixels.shape[0] > 322 * zoom
    places = marks(shown, zoom)
    assert farthest(centres[:3], places) < 0.75
    # The fourth is named where the other three let one expect it.
    expected = centres[0] + centres[2] - centres[1]
    assert farthest(places, np.vstack((centres[:3], expected))) < 90
    assert farthest(expected[None], places) < 20


def test_the_square_stands_where_the_pose_puts_it():
    shown = annotated(position=POSITION, rotation=TURN)
    share = np.linspace(0, 1, 50)[:, None]
    edges = np.vstack([a + share * (b - a) for a, b in zip(CORNERS, np.roll(CORNERS, -1, 0), strict=True)])
    axes = np.vstack([0.4 * share * axis for axis in np.eye(3)])
    places = marks(shown)
    assert farthest(to_pixels(edges), places) < 1.5
    assert farthest(to_pixels(axes), places) < 1.5
    # The outlines of the circles too, 0.12 m about the corners; words are within 70 px of what they name.
    angle = np.linspace(0, 2 * math.pi, 100)
    ring = 0.12 * np.column_stack((np.cos(angle), np.sin(angle), np.zeros(100)))
    outlines = np.vstack([corner + ring for corner in CORNERS])
    assert farthest(to_pixels(outlines), places) < 1.5
    assert farthest(places, to_pixels(np.vstack((edges, axes, outlines)))) < 70


def test_a_pose_that_is_not_valid_is_not_drawn():
    assert not len(marks(annotated(position=POSITION, rotation=TURN, valid=False)))
    assert not len(marks(annotated(position=POSITION)))


def test_a_target_behind_the_camera_is_not_drawn():
    assert not len(marks(annotated(position=-POSITION, rotation=TURN)))


def test_missing_circles_are_marked_in_another_colour():
    centres = to_pixels(CORNERS)
    whole = annotated(position=POSITION, rotation=TURN, centres=centres)
    centres[1] = math.nan
    part = annotated(position=POSITION, rotation=TURN, centres=centres)
    u, v = np.rint(to_pixels(CORNERS[1:2] - np.array([0, 0.12, 0]))[0]).astype(int)
    green, orange = (shown.pixels[v - 1 : v + 2, u - 1 : u + 2].reshape(-1, 3) for shown in (whole, part))
    assert (green[:, 1].astype(int) - green[:, 2] > 60).any()
    assert (orange[:, 2].astype(int) - orange[:, 0] > 60).any()


def words(monkeypatch, centres, quality=(1.0, 1.0, 1.0, math.nan), **found):
    """Return what is written into a picture."""
    written = []
    monkeypatch.setattr(overlay, "write_on_plate", lambda canvas, text, *rest: written.append(text))
    annotated(centres=np.array(centres), quality=np.array(quality), **found)
    return written


def test_a_missing_circle_has_its_reason_beside_it(monkeypatch):
    lost = [math.nan, math.nan]
    square = [[150.0, 100], [250, 100], [250, 200], lost]
    assert "4 not seen" in words(monkeypatch, square)
    assert "4 hidden (0.71)" in words(monkeypatch, square, quality=(1.0, 1.0, 1.0, 0.71))
    assert "4 cut" in words(monkeypatch, [[5.0, 100], [105, 110], [95, 210], lost])
    known = {"position": POSITION, "rotation": TURN}
    seen = to_pixels(CORNERS)
    seen[1] = math.nan
    assert "2 not seen" in words(monkeypatch, seen, quality=(1.0, math.nan, 1.0, 1.0), **known)
    assert not [text for text in words(monkeypatch, [lost, lost, lost, [9.0, 9.0]]) if "seen" in text]


def test_stamp_and_number_are_those_of_the_picture_and_the_picture_is_left_alone():
    frame = picture()
    before = frame.pixels.copy()
    shown = annotated(frame, centres=to_pixels(CORNERS))
    assert (shown.stamp, shown.sequence) == (12.3, 7)
    assert np.array_equal(frame.pixels, before)


def test_before_the_first_picture_there_is_none():
    assert annotated(Frame.none()).sequence == 0


def test_the_pose_is_told_in_centimetres_and_degrees():
    known = {"centres": np.zeros((4, 2)), "quality": np.ones(4), "status": 0, "rotation": TURN}
    found = overlay.Finding(
        **known, position=np.array([0.1234, -0.05, 3.012]), yaw=math.radians(-3.25), has_pose=True
    )
    assert overlay.pose_text(found) == "x +12.3  y -5.0  z 301.2 cm   yaw -3.2 deg"
    found = overlay.Finding(**known, position=POSITION, yaw=math.nan, has_pose=True)
    assert overlay.pose_text(found) == "x +20.0  y -10.0  z 340.0 cm"
    found = overlay.Finding(**known, position=np.full(3, math.nan), yaw=0.0, has_pose=True)
    assert overlay.pose_text(found) == "no pose"


def test_the_words_are_those_of_the_detectors_statuses():
    words = {
        detect.FOUR_CIRCLES: "four circles",
        detect.THREE_CIRCLES: "three circles",
        detect.TWO_CIRCLES: "two circles",
        detect.NOT_FOUND: "no target",
        detect.INCONSISTENT: "four circles that are no square",
        detect.STALE: "no picture yet",
        detect.UNUSABLE: "not a picture",
    }
    assert {status: overlay.STATUS[status] for status in words} == words


def test_the_caption_changes_with_the_status():
    captions = {annotated(status=status).pixels[322:].tobytes() for status in range(-1, 8)}
    assert len(captions) == 9


@pytest.mark.parametrize("width", [16, 160, 320, 452])
def test_all_pictures_of_a_run_have_one_size_whatever_was_found(width):
    frame = picture((120, width, 3))
    poses = [{}, {"position": POSITION, "rotation": TURN, "yaw": 1.0}, {"position": 1e9 * POSITION}]
    shown = [annotated(frame, status=status, **pose) for status in range(-1, 8) for pose in poses]
    assert {found.pixels.shape for found in shown} == {shown[0].pixels.shape}


BROKEN = [
    np.zeros((0, 0, 3), np.uint8),
    np.zeros((5, 0, 3), np.uint8),
    np.zeros((240, 320), np.uint8),
    np.zeros((240, 320, 4), np.uint8),
    np.full((240, 320, 3), math.nan),
    np.zeros((240, 320, 3), np.int64),
]


@pytest.mark.parametrize("pixels", BROKEN, ids=lambda pixels: f"{pixels.dtype}{pixels.shape}")
def test_what_is_not_a_picture_becomes_grey_of_the_cameras_size(pixels):
    shown = annotated(Frame(pixels, 1.0, 3), status=detect.UNUSABLE)
    assert shown.pixels.shape == annotated().pixels.shape
    assert np.ptp(shown.pixels[:322]) == 0


TINY = [np.zeros((h, w, 3), np.uint8) for h, w in ((1, 1), (2, 300), (48, 64))]
ANYTHING = st.floats(allow_nan=True, allow_infinity=True)


def anything(*shape):
    count = math.prod(shape)
    return st.lists(ANYTHING, min_size=count, max_size=count).map(lambda x: np.reshape(x, shape))


@given(
    pixels=st.sampled_from([*BROKEN, *TINY]),
    centres=anything(4, 2),
    quality=anything(4),
    status=st.integers(-(2**62), 2**62),
    position=anything(3),
    rotation=anything(3, 3),
    yaw=ANYTHING,
    valid=st.booleans(),
)
def test_nothing_that_comes_in_can_stop_it(pixels, centres, quality, status, position, rotation, yaw, valid):
    shown = annotated(
        Frame(pixels, math.nan, 1),
        centres=centres,
        quality=quality,
        status=status,
        position=position,
        rotation=rotation,
        yaw=yaw,
        valid=valid,
    )
    assert shown.pixels.dtype == np.uint8 and shown.pixels.ndim == 3


def test_a_calibration_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(ParameterError, match="calibration is not usable"):
        Annotator(calibration=str(tmp_path / "absent.yaml"))
