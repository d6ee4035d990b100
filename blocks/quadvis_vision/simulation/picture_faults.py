"""The faults of pictures, by name: functions of the picture, the picture before, and a random generator."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

Pixels = Any  # mostly NDArray[np.uint8] (height, width, 3); some faults return values that are no pictures
Fault = Callable[[Pixels, Pixels, np.random.Generator], Pixels]


def _half_before(now: Pixels, before: Pixels, _: np.random.Generator) -> Pixels:
    if before.shape != now.shape:
        return now
    return np.concatenate((now[: len(now) // 2], before[len(now) // 2 :]))


def _half_black(now: Pixels, _: Pixels, __: np.random.Generator) -> Pixels:
    half = now.copy()
    half[len(now) // 2 :] = 0
    return half


def _tear(now: Pixels, _: Pixels, chance: np.random.Generator) -> Pixels:
    torn = now.copy()
    row = int(chance.integers(len(now) // 4, 3 * len(now) // 4))
    torn[row:] = np.roll(now[row:], int(chance.integers(20, now.shape[1] // 2)), axis=1)
    return torn


def _stripes(now: Pixels, _: Pixels, chance: np.random.Generator) -> Pixels:
    striped = now.copy()
    for row in chance.integers(0, len(now), 12):
        striped[row : row + 8] = chance.integers(0, 256, 3)
    return striped


def _blur(now: Pixels, _: Pixels, __: np.random.Generator) -> Pixels:
    import cv2

    return cv2.blur(now, (61, 61))


def _grey(now: Pixels, _: Pixels, __: np.random.Generator) -> Pixels:
    return np.repeat(now.mean(axis=2, keepdims=True), 3, axis=2).astype(np.uint8)


def _gain(factor: float) -> Fault:
    return lambda now, _, __: np.clip(now * factor, 0, 255).astype(np.uint8)


def _nan(now: Pixels, _: Pixels, __: np.random.Generator) -> Pixels:
    return np.full(now.shape, np.nan)


PICTURES: dict[str, Fault] = {
    "black": lambda now, _, __: np.zeros_like(now),
    "white": lambda now, _, __: np.full_like(now, 255),
    "noise": lambda now, _, chance: chance.integers(0, 256, now.shape, np.uint8),
    "tear": _tear,
    "stripes": _stripes,
    "blur": _blur,
    "dark": _gain(0.1),
    "bright": _gain(3.0),
    "grey": _grey,
    "inverted": lambda now, _, __: 255 - now,
    "other_colours": lambda now, _, __: np.ascontiguousarray(now[:, :, [1, 2, 0]]),
    "turned": lambda now, _, __: np.ascontiguousarray(now[::-1, ::-1]),
    "mirrored": lambda now, _, __: np.ascontiguousarray(now[:, ::-1]),
    "shifted": lambda now, _, __: np.roll(now, 60, axis=1),
    "half_black": _half_black,
    "half_before": _half_before,
    "wrong_shape": lambda now, _, __: np.ascontiguousarray(now[::2, ::2]),
    "one_channel": lambda now, _, __: now[:, :, 0],
    "wrong_type": lambda now, _, __: now.astype(np.float64),
    "nan_pixels": _nan,
    "no_pixels": lambda now, _, __: np.zeros((0, 0, 3), np.uint8),
}
