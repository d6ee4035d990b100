"""The residuals of a calibration: their size and a picture of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from quadvis_vision.pictures.drawing import SHIFT, Picture, sixteenths, write_on_plate

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Floats = NDArray[np.float64]


def rms(residuals: Floats) -> Floats:
    """Return the root mean square length of residuals (..., n, 2) over n."""
    return np.asarray(np.sqrt(np.mean(np.sum(residuals**2, axis=-1), axis=-1)))


def draw_residuals(
    picture: Picture,
    measured: Sequence[Floats] | Floats,
    predicted: Sequence[Floats] | Floats,
    title: str = "residuals",
    magnification: float = 30.0,
) -> Picture:
    """Return the picture in pale grey, enlarged if small, with arrows from measured to predicted pixels.

    measured and predicted are m views of pixels (n, 2); each view has its own colour. Arrows are drawn
    `magnification` times too long. The title and the rms are written below.
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
        heads = np.minimum(0.3, 8 / np.maximum(np.nan_to_num(lengths), 1)).tolist()
        places = zip(sixteenths(starts, zoom).tolist(), sixteenths(tips, zoom).tolist(), heads, strict=True)
        for start, tip, head in places:
            cv2.arrowedLine(canvas, start, tip, colour, 1, cv2.LINE_AA, SHIFT, head)
    overall = float(rms(np.concatenate(list(predicted)) - np.concatenate(list(measured))))
    label = (
        f"{title}: measured -> predicted, x {magnification:g}; rms {overall:.3g} px; {len(measured)} views"
    )
    write_on_plate(canvas, label, (12, canvas.shape[0] - 14), (235, 235, 235), 0.5)
    return np.asarray(canvas, dtype=np.uint8)
