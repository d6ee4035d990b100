"""The rendered camera against projected conics, a slow independent rendering, and its promises about time."""

import math
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from quadvis.block import Frame, ParameterError
from quadvis.engine.engine import Engine
from quadvis.errors import QuadvisError
from quadvis.testing import Driven, drive
from quadvis_blocks.vision.rendered_camera import RenderedCamera
from tests.stages import mostly_slow

PAPER = str(Path(__file__).parents[3] / "diagrams" / "calib" / "camera.yaml")
PAPER_K = np.array([[430.0, 2.0, 226.0], [0.0, 438.0, 161.0], [0.0, 0.0, 1.0]])
BODY_TO_CAMERA = np.diag([1.0, -1.0, -1.0])
CORNERS = np.array([[-0.5, 0.5, 0], [0.5, 0.5, 0], [0.5, -0.5, 0], [-0.5, -0.5, 0]])

# Black discs on white, no noise: grey levels are coverages.
EXACT: dict[str, Any] = {
    "calibration": PAPER,
    "colours": np.zeros((4, 3)),
    "background": (255.0,) * 3,
    "noise": 0.0,
}


def pose_of(position: Any, attitude: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return R, t with X_c = R X_t + t, built from OpenCV's rotations."""
    phi, theta, psi = attitude
    axes = ([0, 0, psi], [0, theta, 0], [phi, 0, 0])
    yaw, pitch, roll = (cv2.Rodrigues(np.array(axis, dtype=float))[0] for axis in axes)
    turn = BODY_TO_CAMERA @ (yaw @ pitch @ roll).T
    return turn, -turn @ np.array([position[0], position[1], 4.5 - position[2]])


def conic_of(
    position: Any, attitude: Any, corner: np.ndarray, radius: float = 0.12
) -> tuple[np.ndarray, float]:
    """Return centre (px) and area (px^2) of the ellipse that a disc's edge becomes, from its conic."""
    turn, shift = pose_of(position, attitude)
    back = np.linalg.inv(PAPER_K @ np.column_stack((turn[:, :2], shift)))
    x, y, _ = corner
    circle = np.array([[1, 0, -x], [0, 1, -y], [-x, -y, x * x + y * y - radius**2]])
    conic = back.T @ circle @ back
    inner = np.linalg.det(conic[:2, :2])
    return -np.linalg.solve(conic[:2, :2], conic[:2, 2]), math.pi * abs(np.linalg.det(conic)) / inner**1.5


def moments_of(ink: np.ndarray, near: np.ndarray, reach: float) -> tuple[np.ndarray, float, np.ndarray]:
    """Return centroid, sum and covariance of the ink within a square around a point."""
    v, u = np.mgrid[: ink.shape[0], : ink.shape[1]]
    weight = ink * ((abs(u - near[0]) < reach) & (abs(v - near[1]) < reach))
    total = weight.sum()
    centre = np.array([(weight * u).sum(), (weight * v).sum()]) / total
    du, dv = u - centre[0], v - centre[1]
    spread = np.array([[(weight * a * b).sum() / total for a in (du, dv)] for b in (du, dv)])
    return centre, total, spread


def take(position: Any, attitude: Any = (0.0, 0.0, 0.0), **parameters: Any) -> np.ndarray:
    """Return one picture from a craft at rest."""
    block = RenderedCamera(**(EXACT | parameters))
    pixels: np.ndarray = (
        drive(block, position=position, attitude=attitude, rate="10 Hz", steps=1).frame[0].pixels
    )
    return pixels


def ink_of(pixels: np.ndarray) -> np.ndarray:
    """Return the coverage of black discs on white."""
    return 1 - pixels[..., 0] / 255.0


def poses(count: int, seed: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return hover poses with tilt up to some 15 degrees and any heading."""
    random = np.random.default_rng(seed)
    return [
        (
            np.array([*random.normal(0, 0.15, 2), random.uniform(-0.5, 1.8)]),
            np.array([*random.normal(0, 0.1, 2), random.uniform(-3, 3)]),
        )
        for _ in range(count)
    ]


def test_discs_have_the_centre_and_the_area_of_their_exact_ellipses() -> None:
    compared = 0
    for position, attitude in poses(12, seed=1):
        ink = ink_of(take(position, attitude))
        for corner in CORNERS:
            centre, area = conic_of(position, attitude, corner)
            reach = 1.3 * math.sqrt(area / math.pi) + 2
            if not (reach < centre[0] < 451 - reach and reach < centre[1] < 321 - reach):
                continue
            found, total, _ = moments_of(ink, centre, reach)
            assert found == pytest.approx(centre, abs=0.004)
            assert total == pytest.approx(area, rel=5e-4)
            compared += 1
    assert compared > 25


def slow_coverage(outline: np.ndarray, size: tuple[int, int], lines: int = 64) -> np.ndarray:
    """Return how much of every pixel a convex outline (n, 2) covers, line by line, exactly along a line."""
    width, height = size
    coverage = np.zeros((height, width))
    u = np.arange(width)
    after = np.roll(outline, -1, axis=0)
    for row in range(
        max(0, math.floor(outline[:, 1].min())), min(height, math.ceil(outline[:, 1].max()) + 1)
    ):
        for v in row - 0.5 + (np.arange(lines) + 0.5) / lines:
            crossing = (outline[:, 1] <= v) != (after[:, 1] <= v)
            if not crossing.any():
                continue
            start, end = outline[crossing], after[crossing]
            ends = start[:, 0] + (v - start[:, 1]) / (end[:, 1] - start[:, 1]) * (end[:, 0] - start[:, 0])
            inside = np.minimum(ends.max(), u + 0.5) - np.maximum(ends.min(), u - 0.5)
            coverage[row] += np.clip(inside, 0, 1) / lines
    return coverage


def test_a_disc_that_ends_in_the_outer_half_of_the_outermost_pixels_is_drawn() -> None:
    across = 161 + 438 * 0.12 / 3 + 0.2  # px from the principal point to the disc, whose edge is at v = -0.2
    ink = ink_of(take((0.0, 0.5 - 3 * across / 438, 1.5)))
    assert ink[0].max() == pytest.approx(0.3, abs=0.01)


LENS = (-0.22, 0.06, 0.002, -0.0015, 0.01)


@pytest.mark.parametrize(
    ("lens", "radius", "heading"),
    mostly_slow([(LENS, 0.12, 0.4), ((0.0,) * 5, 0.12, 0.4), (LENS, 0.45, 0.8), (LENS, 0.01, 0.4)]),
)
def test_the_picture_is_that_of_a_slow_rendering_by_opencv_outlines(
    tmp_path: Path, lens: tuple[float, ...], radius: float, heading: float
) -> None:
    path = tmp_path / "camera.yaml"
    path.write_text(Path(PAPER).read_text().replace("[0, 0, 0, 0, 0]", str(list(lens))))
    position, attitude = (0.35, -0.1, 1.7), (0.06, -0.08, heading)
    turn, shift = pose_of(position, attitude)
    colours = np.array([[45.0, 40, 190], [165, 75, 30], [65, 135, 40], [35, 35, 35]])
    background = np.array([200.0, 207, 210])
    expected = np.tile(background, (322, 452, 1))
    plain = PAPER_K * [[1, 0, 1], [1, 1, 1], [1, 1, 1]]  # OpenCV ignores skew: it is added below
    angle = 2 * np.pi * np.arange(1500) / 1500
    for corner, colour in zip(CORNERS, colours, strict=True):
        circle = corner + radius * np.column_stack((np.cos(angle), np.sin(angle), 0 * angle))
        outline, _ = cv2.projectPoints(circle, cv2.Rodrigues(turn)[0], shift, plain, np.array(lens))
        outline = np.reshape(outline, (-1, 2))
        outline[:, 0] += 2.0 * (outline[:, 1] - 161) / 438
        cover = slow_coverage(outline, (452, 322))[..., None]
        expected += cover * (colour - background)
    pixels = take(
        position, attitude, calibration=str(path), radius=radius, colours=colours, background=background
    )
    difference = pixels - expected
    bend = 3.0 if radius > 0.1 else 5.0  # of up to 175 grey levels: the edge is not straight inside a pixel
    assert np.abs(difference).max() < bend
    assert np.sqrt((difference**2).mean()) < 0.35  # rounding to whole grey levels alone gives 0.29
    assert len({tuple(pixels[round(v), round(u)]) for u, v in _centres(turn, shift, plain, lens)}) >= 3


def _centres(turn: np.ndarray, shift: np.ndarray, matrix: np.ndarray, lens: Any) -> np.ndarray:
    pixels, _ = cv2.projectPoints(CORNERS, cv2.Rodrigues(turn)[0], shift, matrix, np.array(lens))
    pixels = np.reshape(pixels, (-1, 2))
    return pixels[((pixels > 0) & (pixels < [451, 321])).all(axis=1)]


def test_colours_stand_clockwise_from_upper_left_in_blue_green_red() -> None:
    pixels = (
        drive(RenderedCamera(calibration=PAPER, noise=0.0), position=[0, 0, 1.5], attitude=[0, 0, 0], steps=1)
        .frame[0]
        .pixels
    )
    red, blue, green, black = (
        pixels[161 + dv, 226 + du].astype(int) for du, dv in [(-72, -73), (72, -73), (72, 73), (-72, 73)]
    )
    assert red.argmax() == 2 and blue.argmax() == 0 and green.argmax() == 1
    assert black.max() < 60 < 150 < pixels[161, 226].min()


@pytest.mark.parametrize("angle", [0.1, -0.1])
def test_nose_up_moves_the_discs_right_and_right_side_down_moves_them_down(angle: float) -> None:
    # A disc that stands atan(0.5 / 3) off the axis to one side is then seen at that angle plus the tilt.
    ahead, behind = math.tan(math.atan(0.5 / 3) + angle), math.tan(math.atan(-0.5 / 3) + angle)
    pitched, rolled = ink_of(take((0, 0, 1.5), (0, angle, 0))), ink_of(take((0, 0, 1.5), (angle, 0, 0)))
    for offset, above in ((ahead, 1), (behind, 0)):
        near = np.array([226 + 430 * offset, 161 - 73])
        assert moments_of(pitched, near, 26)[0][0] == pytest.approx(near[0], abs=0.6)  # skew is 2 * 0.167 px
        near = np.array([226 + 72, 161 + 438 * (ahead if above else behind)])
        assert moments_of(rolled, near, 26)[0][1] == pytest.approx(near[1], abs=0.1)


def test_discs_leave_the_picture_at_its_border() -> None:
    full = ink_of(take((0, 0, 1.5))).sum()
    # 438 (0.5 + 0.5993) / 3 = 160.5 px below the middle: the border cuts discs 3 and 4 in halves.
    moved = ink_of(take((0, 0.5993, 1.5)))
    assert moved.sum() == pytest.approx(0.75 * full, rel=0.01)
    assert moved[-1].sum() > 60
    assert ink_of(take((0, 2.5, 1.5))).sum() == 0
    assert ink_of(take((0, 0, 1.5), (math.pi, 0, 0))).sum() == 0  # upside down: it looks at the floor


@pytest.mark.parametrize("height", [4.4, 4.4999, 4.5, 5.0])
def test_at_and_above_the_ceiling_there_is_still_a_picture(height: float) -> None:
    ink = ink_of(take((0.5, 0.5, height), (0.3, 0.2, 1.0)))
    assert ink.shape == (322, 452)
    assert (ink.sum() > 0) == (height < 4.5)


def test_exposure_and_white_balance_scale_and_the_vignette_darkens_the_corners() -> None:
    plain = take((0, 2.5, 1.5), background=(200.0, 200.0, 200.0))
    assert (plain == 200).all()
    dark = take((0, 2.5, 1.5), background=(200.0,) * 3, exposure=0.3, white_balance=(0.5, 1.0, 1.5))
    assert dark[100, 100].tolist() == [30, 60, 90]
    shaded = take((0, 2.5, 1.5), background=(200.0,) * 3, vignette=0.4)
    assert shaded[[0, 0, -1, -1], [0, -1, 0, -1]] == pytest.approx(120)
    assert shaded[161, 226] == pytest.approx(200)


def test_light_beyond_the_sensor_is_cut_at_white() -> None:
    pixels = take((0, 0, 1.5), exposure=2.0, background=(200.0,) * 3, colours=np.full((4, 3), 100.0))
    assert pixels[161, 226].tolist() == [255, 255, 255]
    assert pixels[161 - 73, 226 - 72].tolist() == [200, 200, 200]


def many(steps: int, **parameters: Any) -> Driven:
    """Return some steps of a craft at rest, with the noise of the parameters."""
    seed = parameters.pop("seed", 0)
    block = RenderedCamera(**({"calibration": PAPER} | parameters))
    return drive(block, position=[0, 0, 1.5], attitude=[0, 0, 0], rate="10 Hz", steps=steps, seed=seed)


def test_noise_has_its_standard_deviation_and_is_new_in_each_frame() -> None:
    clean = many(1, noise=0.0).frame[0].pixels.astype(float)
    first, second, third = (frame.pixels - clean for frame in many(3, noise=3.0).frame)
    for noise in (first, second, third):
        assert noise.std() == pytest.approx(math.sqrt(9 + 1 / 12), rel=0.02)  # whole grey levels
        assert abs(noise.mean()) < 0.05
    for one, other in ((first, second), (second, third), (first, third)):
        assert abs(np.corrcoef(one.ravel(), other.ravel())[0, 1]) < 0.01


def test_noise_leaves_centroids_unbiased() -> None:
    centre, area = conic_of((0, 0, 1.5), (0, 0, 0), CORNERS[0])
    frames = many(
        60, **(EXACT | {"noise": 6.0, "background": (200.0,) * 3, "colours": np.full((4, 3), 50.0)})
    ).frame
    found = np.array(
        [moments_of((200 - f.pixels[..., 0].astype(float)) / 150, centre, 24)[0] for f in frames]
    )
    # 6 / 150 per pixel over the square of 47 x 47 gives the error of one centroid.
    sigma = 6 / 150 * math.sqrt(47**2 * 47**2 / 12) / area
    assert np.abs(found.mean(axis=0) - centre).max() < 4 * sigma / math.sqrt(60)
    assert found.std(axis=0) == pytest.approx([sigma, sigma], rel=0.4)


def test_the_same_seed_gives_the_same_bits_and_another_seed_another_noise() -> None:
    one, again, other = (many(3, seed=seed, drop_rate=0.3).frame for seed in (5, 5, 6))
    assert all(
        (a.pixels == b.pixels).all() and a.stamp == b.stamp for a, b in zip(one[1:], again[1:], strict=True)
    )
    assert not np.array_equal(many(1, seed=5).frame[0].pixels, many(1, seed=6).frame[0].pixels)
    assert len(other) == 3


def test_without_latency_each_frame_arrives_at_its_own_tick() -> None:
    driven = many(4)
    assert [frame.sequence for frame in driven.frame] == [1, 2, 3, 4]
    assert [frame.stamp for frame in driven.frame] == pytest.approx(driven.time)


@pytest.mark.parametrize(
    ("latency", "exposure_time", "ticks"),
    [
        (0.1, 0.0, 1),
        (0.05, 0.0, 1),
        (0.3, 0.0, 3),
        (0.301, 0.0, 4),
        (0.1, 0.02, 1),
        (0.11, 0.02, 1),
        (0.12, 0.02, 2),
        (1.6, 0.0, 16),
    ],
)
def test_a_frame_arrives_at_the_first_tick_after_its_latency(
    latency: float, exposure_time: float, ticks: int
) -> None:
    driven = many(ticks + 3, latency=latency, exposure_time=exposure_time)
    assert [frame.sequence for frame in driven.frame] == [0] * ticks + [1, 2, 3]
    assert all(frame is Frame.none() for frame in driven.frame[:ticks])
    assert [frame.stamp for frame in driven.frame[ticks:]] == pytest.approx(
        driven.time[:3] - exposure_time / 2, abs=1e-12
    )


def test_a_late_frame_shows_the_pose_of_its_capture() -> None:
    way = np.column_stack((np.linspace(0, 0.5, 6), np.zeros(6), np.full(6, 1.5)))
    block = {"calibration": PAPER, "exposure_time": 0.02}
    prompt, late = (
        drive(RenderedCamera(**block, latency=latency), position=way, attitude=[0, 0, 0], rate="10 Hz").frame
        for latency in (0.0, 0.2)
    )
    for before, after in zip(prompt[:4], late[2:], strict=True):
        assert before.sequence == after.sequence
        assert np.array_equal(before.pixels, after.pixels)


def test_lost_frames_leave_gaps_and_the_last_frame_stays() -> None:
    frames = many(300, drop_rate=0.3, noise=0.0).frame
    sequences = [frame.sequence for frame in frames]
    fresh = [number == tick + 1 for tick, number in enumerate(sequences)]
    assert 0.6 < np.mean(fresh) < 0.8
    for tick in range(1, 300):
        if not fresh[tick]:
            assert frames[tick] is frames[tick - 1]
    assert many(5, drop_rate=1.0).frame == [Frame.none()] * 5


def test_motion_blur_has_the_length_and_the_middle_of_the_motion() -> None:
    speed, exposure_time = 1.4, 0.04
    positions = np.array([[-0.14, 0, 1.5], [0, 0, 1.5]])
    block = RenderedCamera(**EXACT, exposure_time=exposure_time)
    frame = drive(block, position=positions, attitude=[0, 0, 0], rate="10 Hz").frame[1]
    assert frame.stamp == pytest.approx(0.1 - exposure_time / 2)
    middle = (-speed * exposure_time / 2, 0, 1.5)
    sharp = ink_of(take(middle))
    centre, _ = conic_of(middle, (0, 0, 0), CORNERS[1])
    blurred_centre, total, spread = moments_of(ink_of(frame.pixels), centre, 30)
    sharp_centre, sharp_total, sharp_spread = moments_of(sharp, centre, 30)
    assert blurred_centre == pytest.approx(sharp_centre, abs=0.005)
    assert total == pytest.approx(sharp_total, rel=1e-3)
    length = 430 * speed * exposure_time / 3  # px
    assert length > 8
    # A uniform motion over L adds L^2 / 12 to the variance; n steps of it a share 1 / n^2 less.
    assert spread[0, 0] - sharp_spread[0, 0] == pytest.approx(length**2 / 12, rel=0.03)
    assert spread[1, 1] == pytest.approx(sharp_spread[1, 1], rel=1e-3)


def test_blur_takes_the_short_way_through_the_heading_of_half_a_turn() -> None:
    attitudes = np.array([[0, 0, math.pi - 0.01], [0, 0, -math.pi + 0.01]])
    block = RenderedCamera(**EXACT, exposure_time=0.1)
    frame = drive(block, position=[0, 0, 1.5], attitude=attitudes, rate="10 Hz").frame[1]
    sharp = ink_of(take((0, 0, 1.5), (0, 0, math.pi)))
    assert np.abs(ink_of(frame.pixels) - sharp).mean() < 0.01


def test_a_restored_run_repeats_to_the_bit() -> None:
    driven = many(1, latency=0.25, drop_rate=0.3, exposure_time=0.02)
    with Engine(driven.engine.graph, seed=3) as engine:
        engine.run(7)
        snapshot = engine.snapshot()
        first = [_run_one(engine) for _ in range(8)]
        engine.restore(snapshot)
        again = [_run_one(engine) for _ in range(8)]
    with Engine(driven.engine.graph, seed=3) as engine:  # a new process has none of the caches
        engine.restore(snapshot)
        fresh = [_run_one(engine) for _ in range(8)]
    for one, two, three in zip(first, again, fresh, strict=True):
        assert one.sequence == two.sequence == three.sequence
        assert np.array_equal(one.pixels, two.pixels) and np.array_equal(one.pixels, three.pixels)


def _run_one(engine: Engine) -> Frame:
    engine.run(1)
    frame: Frame = engine.read("block", "frame")
    return frame


def test_impossible_targets_and_calibrations_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match=r"radius must be below half of side \(0.2 m\)"):
        RenderedCamera(calibration=PAPER, side=0.4, radius=0.2)
    with pytest.raises(ParameterError, match=r"calibration is not usable: .*no such file"):
        RenderedCamera(calibration=str(tmp_path / "none.yaml"))


def test_a_latency_that_does_not_fit_and_a_long_exposure_are_refused() -> None:
    with pytest.raises(QuadvisError, match=r"latency must be at most 16 frames, 1.6 s, got 1.7 s"):
        many(1, latency=1.7)
    with pytest.raises(QuadvisError, match=r"exposure_time must be at most the period, 0.1 s, got 0.2 s"):
        many(1, exposure_time=0.2)
