"""The noise of a camera's sensor, made once: each picture takes it from another position on."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Picture = NDArray[np.uint8]
NOISE_STARTS = 1 << 20  # positions in the bank at which a frame's noise can begin


class NoiseBank(NamedTuple):
    """Noise in whole grey levels: what to add, what to subtract (one of them is zero), and both modulo 256.

    `largest` is the largest of all.
    """

    more: Picture
    less: Picture
    both: Picture
    largest: int


@lru_cache(maxsize=2)
def noise_bank(sigma: float, size: int) -> NoiseBank:
    """Return the noise of a camera; all cameras of one size and noise share it, so nobody can write to it."""
    # numpy promises never to change the numbers of RandomState, so a run repeats on other versions too.
    noise = sigma * np.random.RandomState(0).standard_normal(size + NOISE_STARTS)
    levels = np.rint(noise, out=noise).clip(-255, 255, out=noise).astype(np.int16)
    more, less = levels.clip(min=0).astype(np.uint8), (-levels).clip(min=0).astype(np.uint8)
    both = levels.astype(np.uint8)
    for bank in (more, less, both):
        bank.flags.writeable = False
    return NoiseBank(more, less, both, max(int(more.max()), int(less.max())))
