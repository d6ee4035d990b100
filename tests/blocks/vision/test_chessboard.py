from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from quadvis.errors import QuadvisError
from quadvis_vision.calibrate import chessboard
from quadvis_vision.calibrate.bundle import adjust
from quadvis_vision.calibrate.residuals import draw_residuals
from quadvis_vision.camera import lens as lens_model
from quadvis_vision.camera.calibration import CameraCalibration
from quadvis_vision.camera.homogeneous import calibrate
from quadvis_vision.pictures.reader import read_coded
from quadvis_vision.trials import opencv

BOARD = chessboard.Board(9, 6, 0.025)
SIZE = (640, 480)
K = np.array([[536.0, 0, 342], [0, 530, 236], [0, 0, 1]])
LENS = np.array([-0.27, 0.05, 0.0018, -0.0003, 0.02])
PHOTOGRAPHS = Path(__file__).parents[4] / "shared" / "data" / "chessboard"
PLACES = [(-0.09, -0.05), (0.04, -0.05), (0.07, 0.05), (-0.09, 0.05), (0.0, 0.0), (0.02, 0.03)]
TURNS = [
    (0.4, 0.1, 0.1),
    (-0.4, 0.3, 0.0),
    (0.1, -0.5, 0.4),
    (0.5, 0.5, -0.2),
    (-0.3, -0.4, 1.2),
    (0.0, 0.6, -0.5),
]


def poses(turns=TURNS):
    """Return turn vectors and translations that put the middle of the board at PLACES, 0.38 m away."""
    middle = np.array([0.1, 0.0625, 0])
    return [
        (np.array(turn), np.array([*place, 0.38]) - cv2.Rodrigues(np.array(turn))[0] @ middle)
        for turn, place in zip(turns, PLACES, strict=True)
    ]


def views(k=K, lens=LENS, turns=TURNS):
    """Return the corners by OpenCV's projection; a skew is added by hand, since OpenCV has none."""
    points = np.column_stack([BOARD.points, np.zeros(54)])
    ideal = [
        cv2.projectPoints(points, turn, shift, np.eye(3), lens)[0].reshape(-1, 2)
        for turn, shift in poses(turns)
    ]
    return [pixels @ k[:2, :2].T + k[:2, 2] for pixels in ideal]


def photograph(turn, shift, k=K, scale=4):
    """Return a picture of the board without a lens, each pixel a mean of scale x scale samples."""
    square, margin = 40, 2
    checks = np.indices((BOARD.rows + 1, BOARD.columns + 1)).sum(axis=0) % 2
    texture = np.pad(np.kron(checks, np.ones((square, square))), margin * square, constant_values=1)
    texture = (40 + 180 * texture).astype(np.uint8)
    r = cv2.Rodrigues(np.array(turn))[0]
    onto_board = np.array(  # texture pixel -> metres; the first inner corner is one square inside the pattern
        [
            [1, 0, 0.5 - (margin + 1) * square],
            [0, 1, 0.5 - (margin + 1) * square],
            [0, 0, square / BOARD.square],
        ]
    )
    onto_samples = np.array([[scale, 0, (scale - 1) / 2], [0, scale, (scale - 1) / 2], [0, 0, 1]])
    h = onto_samples @ k @ np.column_stack([r[:, :2], shift]) @ onto_board
    fine = cv2.warpPerspective(texture, h, (SIZE[0] * scale, SIZE[1] * scale), borderValue=150)
    return cv2.resize(fine, SIZE, interpolation=cv2.INTER_AREA)


def test_exact_corners_give_back_the_camera_the_lens_and_the_poses():
    bundle = adjust(BOARD.points, views(), SIZE)
    assert bundle.matrix == pytest.approx(K, abs=1e-5)
    assert bundle.distortion == pytest.approx(LENS, abs=1e-5)
    for (turn, shift), r, t in zip(poses(), bundle.rotations, bundle.translations, strict=True):
        assert r == pytest.approx(cv2.Rodrigues(turn)[0], abs=1e-7)
        assert t == pytest.approx(shift, abs=1e-7)


def test_equations_7_to_10_return_the_camera_in_its_own_frame():
    found = chessboard.calibrate_views(BOARD, views(), SIZE)
    assert found.camera.matrix == pytest.approx(K, abs=1e-4)
    assert found.camera.distortion == pytest.approx(LENS, abs=1e-5)
    assert found.homogeneous.rotation == pytest.approx(np.eye(3), abs=1e-6)
    assert found.homogeneous.centre == pytest.approx([0, 0, 0], abs=1e-7)
    assert found.errors.max() < 1e-4


def test_a_camera_with_skew_is_found_when_it_is_asked_for():
    skewed = K + np.array([[0, 2.0, 0], [0, 0, 0], [0, 0, 0]])
    found = chessboard.calibrate_views(BOARD, views(skewed), SIZE, skew=True)
    assert found.camera.matrix == pytest.approx(skewed, abs=1e-4)
    without = chessboard.calibrate_views(BOARD, views(skewed), SIZE)
    assert without.bundle.matrix[0, 1] == 0
    assert without.bundle_rms > 100 * found.bundle_rms


def test_the_bundle_adjustment_reaches_what_calibrate_camera_reaches():
    rng = np.random.default_rng(5)
    noisy = [view + rng.normal(0, 0.3, view.shape) for view in views()]
    noisy = [view.astype(np.float32).astype(float) for view in noisy]
    ours = chessboard.calibrate_views(BOARD, noisy, SIZE)
    theirs = opencv.calibrate_views(BOARD.points, noisy, SIZE)
    assert ours.bundle.matrix == pytest.approx(theirs.matrix, abs=1e-2)
    assert ours.bundle.distortion == pytest.approx(theirs.distortion, abs=1e-3)
    assert ours.bundle_rms == pytest.approx(theirs.rms, abs=1e-6)
    assert ours.camera.evidence.rms == pytest.approx(theirs.rms, rel=0.01)
    assert ours.errors == pytest.approx(theirs.errors, rel=0.1)


def test_terms_that_would_fold_the_picture_are_left_out_of_the_lens():
    # Where the boards are this lens is harmless; in the corners of the picture it folds.
    folding = np.array([-0.2, 0, 0, 0, -0.5])
    found = chessboard.calibrate_views(BOARD, views(lens=folding), SIZE)
    assert "k3" in found.omitted
    assert all(found.camera.distortion[chessboard.LENS.index(name)] == 0 for name in found.omitted)
    assert found.camera.matrix == pytest.approx(K, abs=10)


def test_rendered_boards_give_the_camera_that_rendered_them():
    pictures = [photograph(turn, shift) for turn, shift in poses()]
    found = [chessboard.find_corners(picture, BOARD, None) for picture in pictures]
    assert all(corners is not None for corners in found)
    exact = views(lens=np.zeros(5))
    for corners, true in zip(found, exact, strict=True):
        # A board may be read from either end.
        error = min(np.abs(order - true).max() for order in (corners.pixels, corners.pixels[::-1]))
        assert error < 0.15
    camera = chessboard.calibrate_views(BOARD, [corners.pixels for corners in found], SIZE).camera
    assert camera.matrix == pytest.approx(K, abs=1.5)
    assert camera.evidence.rms < 0.1


def test_a_picture_without_a_board_has_no_corners():
    assert chessboard.find_corners(np.full((480, 640), 128, np.uint8), BOARD) is None


def test_a_window_that_reaches_the_neighbouring_corners_is_told():
    turn, shift = poses()[0]
    far = photograph(turn, shift + np.array([0, 0, 0.3]))
    assert chessboard.find_corners(far, BOARD).crowded
    assert not chessboard.find_corners(far, BOARD, None).crowded
    assert not chessboard.find_corners(photograph(turn, shift), BOARD).crowded


def test_two_views_are_refused():
    with pytest.raises(QuadvisError, match="2 views"):
        chessboard.calibrate_views(BOARD, views()[:2], SIZE)


def test_boards_parallel_to_the_image_are_refused():
    flat = views(lens=np.zeros(5), turns=[(0, 0, 0.1 * i) for i in range(6)])
    with pytest.raises(QuadvisError, match="tilted"):
        chessboard.calibrate_views(BOARD, flat, SIZE)


@pytest.mark.parametrize(
    ("columns", "rows", "square"), [(2, 6, 0.025), (9, 6, 0.0), (9, 6, -1.0), (9, 6, float("nan"))]
)
def test_a_board_that_cannot_be_is_refused(columns, rows, square):
    with pytest.raises(QuadvisError):
        chessboard.Board(columns, rows, square)


def test_a_file_that_is_no_picture_is_named(tmp_path):
    file = tmp_path / "note.jpg"
    for content in (b"", b"not a picture"):
        file.write_bytes(content)
        with pytest.raises(QuadvisError, match=r"note\.jpg is not a picture"):
            read_coded(file)
    with pytest.raises(QuadvisError, match=r"absent\.jpg"):
        read_coded(tmp_path / "absent.jpg")


def test_points_in_space_go_through_opencv_too():
    rng = np.random.default_rng(2)
    local = np.column_stack([rng.uniform(-1, 1, (30, 2)), rng.uniform(3, 6, 30)])
    e = local @ K.T
    found = opencv.calibrate_points(
        local + np.array([5, -3, 2]), e[:, :2] / e[:, 2:], K + np.diag([5.0, -5, 0])
    )
    assert found.matrix == pytest.approx(K, abs=0.05)
    off = K - np.array([[0, 0, 400.0], [0, 0, 0], [0, 0, 0]])
    assert opencv.calibrate_points(local, e[:, :2] / e[:, 2:], off) is None


def test_residuals_are_drawn_as_arrows_over_the_picture():
    grey = np.full((48, 64), 128, np.uint8)
    measured = np.array([[[20.0, 20.0], [40.0, 20.0]]])
    plain = draw_residuals(grey, measured, measured)
    drawn = draw_residuals(grey, measured, measured + np.array([0, 0.5]), magnification=20)
    assert drawn.shape == (96, 128, 3)
    changed = np.argwhere((drawn != plain).any(axis=2)[:72])  # above the caption
    assert changed[:, 0].min() < 44 and changed[:, 0].max() > 56
    assert np.array_equal(draw_residuals(grey, measured, measured * np.nan).shape, drawn.shape)


def test_the_lens_is_that_of_opencv():
    rng = np.random.default_rng(4)
    normalised = rng.uniform(-0.6, 0.6, (50, 2))
    lens = rng.uniform(-0.1, 0.1, 5)
    points = np.column_stack([normalised, np.ones(50)])
    theirs = cv2.projectPoints(points, np.zeros(3), np.zeros(3), np.eye(3), lens)[0].reshape(-1, 2)
    assert lens_model.distort(normalised, lens) == pytest.approx(theirs, abs=1e-12)


def test_derivatives_of_the_lens_are_those_of_small_steps():
    rng = np.random.default_rng(4)
    normalised, lens, step = rng.uniform(-0.6, 0.6, (50, 2)), rng.uniform(-0.1, 0.1, 5), 1e-6

    def slope(change_point, change_lens):
        ends = [
            lens_model.distort(normalised + s * change_point, lens + s * change_lens) for s in (step, -step)
        ]
        return (ends[0] - ends[1]) / (2 * step)

    by_point = np.stack([slope(row, np.zeros(5)) for row in np.eye(2)], axis=-1)
    by_lens = np.stack([slope(np.zeros(2), row) for row in np.eye(5)], axis=-1)
    assert lens_model.by_point(normalised, lens) == pytest.approx(by_point, abs=1e-8)
    assert lens_model.by_lens(normalised) == pytest.approx(by_lens, abs=1e-8)


needs_photographs = pytest.mark.skipif(
    not PHOTOGRAPHS.is_dir(),
    reason="the chessboard photographs are not beside the repository (../shared/data)",
)


def photographed(side, window):
    files = sorted(PHOTOGRAPHS.glob(f"{side}??.jpg"))
    assert len(files) == 13
    found = [chessboard.find_corners(read_coded(file).decode(grey=True), BOARD, window) for file in files]
    assert all(corners is not None for corners in found)
    return [corners.pixels for corners in found]


@needs_photographs
@pytest.mark.parametrize("side", ["left", "right"])
def test_photographs_give_the_reference_camera_within_half_a_pixel(side):
    reference = json.loads((PHOTOGRAPHS / "reference_calibration.json").read_text())[side]
    found = chessboard.calibrate_views(BOARD, photographed(side, chessboard.USUAL_WINDOW), SIZE)
    assert found.camera.matrix == pytest.approx(np.array(reference["K"]), abs=0.5)
    assert found.bundle.matrix == pytest.approx(np.array(reference["K"]), abs=0.05)
    assert found.bundle.distortion == pytest.approx(reference["dist"], abs=2e-3)
    assert found.bundle_rms == pytest.approx(reference["rms"], abs=2e-3)
    assert found.camera.evidence.rms < 1.01 * reference["rms"]


@needs_photographs
@pytest.mark.parametrize("side", ["left", "right"])
def test_a_window_clear_of_the_neighbours_halves_the_residuals_of_the_photographs(side):
    wide = chessboard.calibrate_views(BOARD, photographed(side, chessboard.USUAL_WINDOW), SIZE)
    clear = chessboard.calibrate_views(BOARD, photographed(side, None), SIZE)
    assert clear.camera.evidence.rms < 0.5 * wide.camera.evidence.rms


@needs_photographs
@pytest.mark.parametrize(("side", "other"), [("left", "right"), ("right", "left")])
def test_boards_placed_by_the_other_camera_of_the_pair_give_the_same_k(side, other):
    """The poses then know nothing of the K that eq. (7)-(10) finds: the pictures were taken in pairs."""
    own = chessboard.calibrate_views(BOARD, photographed(side, None), SIZE)
    foreign = chessboard.calibrate_views(BOARD, photographed(other, None), SIZE)
    camera = CameraCalibration(SIZE, own.bundle.matrix, own.bundle.distortion)
    straight = CameraCalibration(SIZE, own.bundle.matrix, np.zeros(5))
    pixels = straight.to_pixels(camera.normalise(own.measured.reshape(-1, 2)))
    found = calibrate(foreign.bundle.place(BOARD.points).reshape(-1, 3), pixels)
    assert found.matrix == pytest.approx(own.bundle.matrix, abs=2.0)
    # The cameras stood 83 mm apart, as OpenCV's own stereo calibration of the set says.
    assert np.linalg.norm(found.centre) == pytest.approx(0.0833, abs=0.001)


@pytest.mark.parametrize(("columns", "rows"), [(9, 6), (7, 7)])
@pytest.mark.parametrize("order", ["as it is", "turned by 180 deg", "turned by 90 deg", "mirrored"])
def test_corners_at_two_heights_are_those_of_one_board_in_whatever_order_they_come(columns, rows, order):
    board = chessboard.Board(columns, rows, 0.025)
    flat = np.column_stack([board.points, np.zeros(columns * rows)])
    turn = np.array([0.02, -0.03, 0.2])
    heights = [0.0, 0.1]
    normal = cv2.Rodrigues(turn)[0][:, 2]
    seen = [
        cv2.projectPoints(flat, turn, np.array([-0.1, -0.06, 0.5]) - height * normal, K, np.zeros(5))[0]
        for height in heights
    ]
    views = [pixels.reshape(rows, columns, 2) for pixels in seen]
    changes = {
        "as it is": lambda grid: grid,
        "turned by 180 deg": lambda grid: grid[::-1, ::-1],
        "turned by 90 deg": lambda grid: np.rot90(grid) if columns == rows else grid,
        "mirrored": lambda grid: grid[:, ::-1],
    }
    views[1] = changes[order](views[1])
    points, pixels = chessboard.at_heights(board, [view.reshape(-1, 2) for view in views], heights)
    assert [set(view[:, 2]) for view in points] == [{0.0}, {0.1}]
    found = calibrate(np.vstack(points), np.vstack(pixels))
    assert found.rms < 1e-6
    assert found.matrix == pytest.approx(K, abs=1e-3)
    # x goes to the right in the picture, y up, and z toward the camera.
    assert np.diag(found.rotation) @ [1, -1, -1] > 2.9
