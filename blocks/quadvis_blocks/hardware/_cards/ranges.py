"""The ranges of analog channels, and how commands lie in them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from quadvis.block import ParameterError
from quadvis_blocks.hardware._cards.frames import MOST


class Range(NamedTuple):
    """What a channel can put out or measure: from ``lowest`` to ``highest``, in V, or in A."""

    lowest: float
    highest: float
    is_current: bool = False

    def __str__(self) -> str:
        """Return words such as "0 to 5 V"."""
        factor, unit = (1e3, "mA") if self.is_current else (1.0, "V")
        return f"{self.lowest * factor:g} to {self.highest * factor:g} {unit}"


# By code, as xPC Target's block of the PCL-726 and the driver pcl726 of Linux have them.
OUTPUT_RANGES = (Range(0, 5), Range(0, 10), Range(-5, 5), Range(-10, 10), Range(4e-3, 20e-3, is_current=True))


def input_range(code: float) -> Range:
    """Return the range of xPC Target's code: 10 is 0 to 10 V, -10 is -10 to 10 V."""
    return Range(min(code, 0.0), abs(code))


def check_channels(channels: Any) -> None:
    """Refuse channels that are named twice or have no number in a frame."""
    if len(np.unique(channels)) < len(channels):
        raise ParameterError("channels", "channels must be different from each other")
    if (channels > MOST).any():
        raise ParameterError("channels", f"channels must be at most {MOST}, got {channels.max()}")


def check_between(name: str, value: Any, one: Any, other: Any, ends: str) -> None:
    """Refuse values that do not lie between two ends, element by element."""
    if ((value < np.minimum(one, other)) | (value > np.maximum(one, other))).any():
        raise ParameterError(name, f"{name} must lie between {ends}, element by element")
