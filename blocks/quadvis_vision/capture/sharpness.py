"""How sharp a picture is."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def grey(pixels: NDArray[np.uint8]) -> Any:
    """Return a picture (height, width, 3) in grey (height, width)."""
    import cv2

    return cv2.cvtColor(pixels, cv2.COLOR_BGR2GRAY)


def sharpness(picture: Any) -> float:
    """Return the variance of the Laplacian of a grey picture: it falls as edges blur, for one scene.

    Source: Pertuz, Puig and Garcia, Analysis of focus measure operators for shape-from-focus, Pattern
    Recognition 46(5), 2013, operator LAP4.
    """
    import cv2

    return float(cv2.Laplacian(picture, cv2.CV_64F).var())
