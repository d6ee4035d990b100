"""What a calibration leaves unexplained: its size, and a picture of it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]
    Picture = NDArray[np.uint8]

_SHIFT = 4  # OpenCV draws at fractions of a pixel when coordinates are given in sixteenths


def rms(residuals: Floats) -> Floats:
    """Return the root mean square length of residuals (..., n, 2) over n."""
    return np.asarray(np.sqrt(np.mean(np.sum(residuals**2, axis=-1), axis=-1)))


def draw_residuals(
    picture: Picture, measured: Floats, predicted: Floats, magnification: float = 30.0
) -> Picture:
    """Return the picture, faded and enlarged if small, with arrows from measured to predicted pixels.

    measured and predicted are (m, n, 2); each view has a colour of its own. Arrows are `magnification` times
    too long.
    """
    import cv2

    zoom = 2 if max(picture.shape) < 1000 else 1
    grey = cv2.resize(picture, None, fx=zoom, fy=zoom, interpolation=cv2.INTER_CUBIC)
    canvas: Any = cv2.cvtColor((160 + 0.35 * grey).clip(0, 255).astype(np.uint8), cv2.COLOR_GRAY2BGR)
    # As many hues as views, at full saturation; OpenCV counts hues to 180.
    wheel: Any = [[(180 * view // len(measured), 255, 170) for view in range(len(measured))]]
    colours = cv2.cvtColor(np.array(wheel, dtype=np.uint8), cv2.COLOR_HSV2BGR)[0].tolist()
    for colour, starts, ends in zip(colours, measured, predicted, strict=True):
        tips = starts + magnification * (ends - starts)
        lengths = zoom * np.linalg.norm(tips - starts, axis=1)
        heads = np.minimum(0.3, 8 / np.maximum(np.nan_to_num(lengths), 1))
        for start, tip, head in zip(_fixed(starts, zoom), _fixed(tips, zoom), heads, strict=True):
            cv2.arrowedLine(canvas, start, tip, colour, 1, cv2.LINE_AA, _SHIFT, float(head))
    overall = float(rms((predicted - measured).reshape(-1, 2)))
    label = f"measured -> predicted, x {magnification:g}; rms {overall:.3f} px; {len(measured)} views"
    cv2.putText(
        canvas, label, (12, canvas.shape[0] - 14), cv2.FONT_HERSHEY_SIMPLEX, 0.6, (0, 0, 0), 1, cv2.LINE_AA
    )
    return np.asarray(canvas, dtype=np.uint8)


def _fixed(pixels: Floats, zoom: int) -> list[tuple[int, int]]:
    bounded = np.nan_to_num(pixels, nan=-1e4).clip(-1e4, 1e4)
    # The centre of pixel 0 lies half a pixel inside the picture, at any size.
    enlarged = (bounded + 0.5) * zoom - 0.5
    return [(int(x), int(y)) for x, y in np.rint(enlarged * 2**_SHIFT)]
