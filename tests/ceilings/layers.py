"""What real ceilings have: joints, cables, vents, lamps, shadows, banding light, grain, dust and glare."""

from __future__ import annotations

import math

import cv2
import numpy as np

from quadvis_vision.trials.scenes import CORNERS, PAINT
from tests.ceilings.stage import Layer, Stage

JOINT = (0.004, 0.03)  # m, width
DARK = (0.35, 0.95)  # of the ceiling's brightness


def _random_angle(stage: Stage) -> float:
    return stage.spread(0, math.pi)


def tiles(
    across: float,
    along: float,
    joint: tuple[float, float] = JOINT,
    dark: tuple[float, float] = DARK,
    uneven: float = 0.0,
) -> Layer:
    """Return tiles or planks (m); every second row is shifted by half a tile. `uneven` tiles differ."""

    def layer(stage: Stage) -> None:
        angle, width, shade = _random_angle(stage), stage.spread(*joint), stage.spread(*dark)
        at = np.array([stage.spread(0, 1), stage.spread(0, 1)])
        p, q = stage.line(at, angle) / across, stage.line(at, angle + math.pi / 2) / along
        row = np.floor(p)
        if across != along:
            q = q + 0.5 * (row % 2)
        first, second = (
            stage.band((part - np.rint(part)) * edge, width) for part, edge in ((p, across), (q, along))
        )
        stage.albedo *= (1 - (1 - shade) * np.maximum(first, second))[..., None]
        if uneven:
            tone = np.sin(127.1 * row + 311.7 * np.floor(q)) * 43758.5
            stage.albedo *= (1 - uneven * (tone - np.floor(tone)))[..., None]

    return layer


def joint(offset: tuple[float, float], shade: float, width: float, over: bool = False) -> Layer:
    """Return a straight line at a distance from the middle of one circle, in radii of the circle.

    `over` the circle it darkens circle and ceiling alike.
    """

    def layer(stage: Stage) -> None:
        corner, angle = int(stage.rng.integers(4)), _random_angle(stage)
        away = stage.line(stage.side * CORNERS[corner], angle) - stage.spread(*offset) * stage.radius
        stage.albedo *= (1 - (1 - shade) * stage.band(away, width))[..., None]
        if over:
            stage.clear[_crossed(stage, away, width)] = False

    return layer


def _crossed(stage: Stage, away: np.ndarray, width: float) -> np.ndarray:
    """Return which discs (4,) a line touches."""
    crossed = np.zeros(4, bool)
    for k, corner in enumerate(stage.side * CORNERS):
        near = np.hypot(stage.x - corner[0], stage.y - corner[1]) < stage.radius
        crossed[k] = bool((np.abs(away[near]) < width / 2 + stage.step).any())
    return crossed


def cables(count: int, bright: tuple[float, float], over: bool) -> Layer:
    """Return bent cables of 5 to 15 mm, `bright` in grey levels, under or over the circles."""

    def layer(stage: Stage) -> None:
        for _ in range(count):
            angle, at = _random_angle(stage), np.array([stage.spread(-0.8, 0.8), stage.spread(-0.8, 0.8)])
            along = stage.line(at, angle + math.pi / 2)
            bend = stage.spread(0, 0.06) * np.sin(along * stage.spread(1, 5) + stage.spread(0, 6))
            away, width = stage.line(at, angle) + bend, stage.spread(0.005, 0.015)
            cover = stage.band(away, width)[..., None]
            stage.albedo += cover * (stage.spread(*bright) - stage.albedo)
            if over:
                stage.clear[_crossed(stage, away, width)] = False

    return layer


def lines_beside(stage: Stage) -> None:
    """Draw, beside each circle, a dark line that touches or nearly touches it."""
    for corner in stage.side * CORNERS:
        angle, width = stage.spread(0, 2 * math.pi), stage.spread(*(0.004, 0.03))
        away = stage.line(corner, angle) - (stage.radius * stage.spread(1.0, 1.25) + width / 2)
        along = stage.line(corner, angle + math.pi / 2)
        cover = stage.band(away, width) * stage.band(along, 4 * stage.radius)
        stage.albedo *= (1 - (1 - stage.spread(*DARK)) * cover)[..., None]


def vents(stage: Stage) -> None:
    """Draw two grilles with dark slits, clear of the circles."""
    for _ in range(2):
        place = _free(stage, 0.3)
        angle = _random_angle(stage)
        p, q = stage.line(place, angle), stage.line(place, angle + math.pi / 2)
        inside = stage.band(p, 0.36) * stage.band(q, 0.36)
        slits = stage.band((p / 0.03 - np.rint(p / 0.03)) * 0.03, 0.014)
        stage.albedo *= (1 - inside * (0.1 + 0.75 * slits))[..., None]


def _free(stage: Stage, reach: float) -> np.ndarray:
    """Return a place (2,) m that is clear of the circles."""
    span = 2.5 * stage.side
    while True:
        place = stage.rng.uniform(-span / 2, span / 2, 2)
        if np.hypot(*(stage.side * CORNERS - place).T).min() > stage.radius + reach:
            return place


def lamp_grid(stage: Stage) -> None:
    """Draw bright square lamps in a grid, each with a frame, clear of the circles."""
    angle, pitch = _random_angle(stage), 1.2
    for i in range(-3, 4):
        for j in range(-3, 4):
            way = np.array([math.cos(angle), math.sin(angle)])
            place = pitch * (i * way + j * np.array([-way[1], way[0]])) + 0.15
            if np.hypot(*(stage.side * CORNERS - place).T).min() < stage.radius + 0.28:
                continue
            p, q = stage.line(place, angle), stage.line(place, angle + math.pi / 2)
            frame, glow = (stage.band(p, edge) * stage.band(q, edge) for edge in (0.34, 0.30))
            stage.albedo *= (1 - 0.5 * frame)[..., None]
            stage.albedo += glow[..., None] * (330 - stage.albedo)


def things(count: int, paint: bool = False, extent: float = 3.0) -> Layer:
    """Return discs of random colour, or of the target's, clear of the circles where there are any."""

    def layer(stage: Stage) -> None:
        places = stage.rng.uniform(-extent / 2, extent / 2, (count, 2)) * stage.side
        for place in places:
            radius = stage.radius * math.exp(stage.spread(math.log(0.4), math.log(2.2)))
            colour = PAINT[int(stage.rng.integers(4))] if paint else stage.rng.uniform(10, 230, 3)
            if (
                stage.kind.shown
                and np.hypot(*(stage.side * CORNERS - place).T).min() < stage.radius * 1.4 + radius
            ):
                continue
            stage.discs([colour], radius, place[None])

    return layer


def wood(stage: Stage) -> None:
    """Draw planks of wood with grain."""
    angle = _random_angle(stage)
    p, q = stage.line(np.zeros(2), angle), stage.line(np.zeros(2), angle + math.pi / 2)
    rings = p + 0.02 * np.sin(3 * q + stage.spread(0, 6)) + 0.006 * np.sin(11 * q)
    grain = 0.5 + 0.3 * np.sin(2 * math.pi * rings / 0.045) + 0.2 * np.sin(2 * math.pi * rings / 0.017 + 1)
    brown = np.array((120.0, 165.0, 200.0), np.float32) / 208
    stage.albedo *= brown * (1 - 0.3 * grain)[..., None]
    tiles(0.12, 2.0, joint=(0.003, 0.006), dark=(0.4, 0.7), uneven=0.15)(stage)


def concrete(stage: Stage) -> None:
    """Draw concrete: blotches of all sizes, pores and a few cracks."""
    shade = np.zeros_like(stage.x)
    for cells in (6, 14, 40, 110):
        coarse = stage.rng.standard_normal((cells * 3 // 4, cells)).astype(np.float32)
        shade += cv2.resize(coarse, shade.shape[::-1], interpolation=cv2.INTER_CUBIC) * 0.045
    stage.albedo *= (0.75 + shade).clip(0.3, 1.1)[..., None]
    for _ in range(60):
        place = stage.rng.uniform(-1.5, 1.5, 2)
        pore = np.hypot(stage.x - place[0], stage.y - place[1]) < stage.spread(0.003, 0.012)
        stage.albedo[pore] *= 0.5


def board(margin: float, around: tuple[float, float, float]) -> Layer:
    """Return a white board with the target on it, on a ceiling of another colour."""

    def layer(stage: Stage) -> None:
        half = stage.side / 2 + stage.radius + margin
        inside = np.maximum(np.abs(stage.x), np.abs(stage.y)) < half
        stage.albedo[~inside] = around

    return layer


def sheets(stage: Stage) -> None:
    """Draw four sheets of white paper, one below each circle, on a darker ceiling."""
    tone = np.array((95.0, 105.0, 112.0), np.float32) * stage.spread(0.5, 1.3)
    white = np.zeros(stage.x.shape, bool)
    for corner in stage.side * CORNERS:
        angle, half = stage.spread(-0.1, 0.1), stage.radius * stage.spread(1.25, 1.5)
        p, q = stage.line(corner, angle), stage.line(corner, angle + math.pi / 2)
        white |= (np.abs(p) < half) & (np.abs(q) < half)
    stage.albedo[~white] = tone


def shadow(depth: tuple[float, float], soft: tuple[float, float], near: bool = False) -> Layer:
    """Return the straight edge of a shadow, `soft` m wide; `near`: through one of the circles."""

    def layer(stage: Stage) -> None:
        at = stage.rng.uniform(-0.5, 0.5, 2) * stage.side
        if near:
            turn, out = stage.spread(0, 2 * math.pi), stage.radius * stage.spread(0, 1.2)
            at = stage.side * CORNERS[int(stage.rng.integers(4))] + out * np.array(
                [math.cos(turn), math.sin(turn)]
            )
        away = stage.line(at, stage.spread(0, 2 * math.pi)) / max(stage.spread(*soft), stage.step)
        share = np.clip(0.5 + away, 0, 1)
        stage.light *= 1 - stage.spread(*depth) * share * share * (3 - 2 * share)

    return layer


def blades(stage: Stage) -> None:
    """Throw the shadow of a spinning two-bladed propeller over the target, blurred by its motion."""
    at, turn = stage.rng.uniform(-0.5, 0.5, 2) * stage.side, stage.spread(0, math.pi)
    far = np.hypot(stage.x - at[0], stage.y - at[1])
    angle = np.arctan2(stage.y - at[1], stage.x - at[0]) - turn
    blade = np.clip(1.3 - np.abs(np.sin(angle)) / 0.25, 0, 1) * np.clip((0.55 - far) / 0.05, 0, 1)
    stage.light *= 1 - stage.spread(0.2, 0.5) * blade


def banding(depth: float) -> Layer:
    """Return bands across the rows: mains light under a rolling shutter, `depth` from bright to dark."""

    def layer(stage: Stage) -> None:
        period, phase = stage.spread(0.2, 0.6) * stage.size[1], stage.spread(0, 6.3)
        stage.light *= 1 - depth * (0.5 + 0.5 * np.sin(2 * math.pi * stage.v / period + phase))

    return layer


def glare(stage: Stage) -> None:
    """Reflect a lamp in one circle."""
    corner = int(stage.rng.integers(4))
    at = stage.side * CORNERS[corner] + stage.rng.uniform(-1, 1, 2) * stage.radius
    far = np.hypot(stage.x - at[0], stage.y - at[1]) / (stage.radius * stage.spread(0.3, 0.9))
    stage.albedo += (stage.spread(80, 300) * np.exp(-far * far / 2))[..., None]
    stage.clear[corner] = False


def dust(stage: Stage) -> None:
    """Put soft dark spots on the lens, of a fifth of the light at most."""
    height, width = stage.picture.shape[:2]
    v, u = np.mgrid[:height, :width].astype(np.float32)
    for _ in range(8):
        far = np.hypot(u - stage.spread(0, width), v - stage.spread(0, height)) / stage.spread(1.5, 5)
        stage.picture *= (1 - stage.spread(0.05, 0.2) * np.exp(-(far**4)))[..., None]


def hot_pixels(stage: Stage) -> None:
    """Let 40 pixels be stuck, each in one channel or in all."""
    height, width = stage.picture.shape[:2]
    for _ in range(40):
        place = int(stage.rng.integers(height)), int(stage.rng.integers(width))
        stage.picture[place] = stage.rng.choice([0, 255], 3)


def darkened(gain: tuple[float, float, float]) -> Layer:
    """Return light of another colour."""

    def layer(stage: Stage) -> None:
        stage.picture *= np.array(gain, np.float32)

    return layer


def smeared(length: float) -> Layer:
    """Return motion blur (px) in a random direction."""

    def layer(stage: Stage) -> None:
        angle, reach = _random_angle(stage), math.ceil(length / 2) + 1
        kernel = np.zeros((2 * reach + 1, 2 * reach + 1), np.float32)
        for along in np.linspace(-length / 2, length / 2, 65):
            x, y = reach + along * math.cos(angle), reach + along * math.sin(angle)
            i, j = int(x), int(y)
            a, b = x - i, y - j
            kernel[j : j + 2, i : i + 2] += np.outer((1 - b, b), (1 - a, a)).astype(np.float32)
        stage.picture = cv2.filter2D(stage.picture, -1, kernel / kernel.sum())

    return layer


def jpeg(quality: int) -> Layer:
    """Return compression."""

    def layer(stage: Stage) -> None:
        pixels = np.clip(np.rint(stage.picture), 0, 255).astype(np.uint8)
        coded = cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
        stage.picture = cv2.imdecode(coded, cv2.IMREAD_COLOR).astype(np.float32)

    return layer
