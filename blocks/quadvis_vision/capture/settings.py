"""The settings of a camera: set, read back, and compared with what was wanted.

Drivers answer a wish in four ways: they do it, refuse it, do it in another unit, or do it and fall back to
their automatic a second later. So each setting is read back at once and again and again.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

from quadvis.units import Unit, format_quantity
from quadvis_vision.capture.request import CameraRequest

CLOSE = 0.1  # share of a value that a driver may round it by
UNIT_OF_EXPOSURE = 1e-4  # s: V4L2_CID_EXPOSURE_ABSOLUTE counts in these
MANUAL = 1.0  # V4L2_EXPOSURE_MANUAL; 0 and 3 are automatic


class CameraSetting(NamedTuple):
    """One setting: the property of OpenCV, the number wanted there, and what a message shows.

    ``scale`` is one count of the driver in ``unit``; a setting with ``exact`` allows no rounding.
    """

    name: str
    property: int
    wanted: float
    scale: float = 1.0
    unit: str = "1"
    exact: bool = False

    def holds(self, got: float) -> bool:
        """Return whether what was read back is what was wanted, within the steps of a driver."""
        if self.exact:
            return got == self.wanted
        return abs(got - self.wanted) <= max(CLOSE * abs(self.wanted), 0.5)

    def words(self, value: float) -> str:
        """Return a value for a message."""
        return format_quantity(value * self.scale, Unit.parse(self.unit), 3)


def settings_of(request: CameraRequest, by_driver: bool) -> Iterator[CameraSetting]:
    """Yield the settings that are wanted, in the order in which they are set.

    The rate is set ``by_driver`` alone: a stream or a file has its own.
    """
    import cv2

    if request.rate and by_driver:
        yield CameraSetting("fps", cv2.CAP_PROP_FPS, request.rate, 1.0, "Hz")
    if request.exposure is not None:
        yield CameraSetting("manual exposure", cv2.CAP_PROP_AUTO_EXPOSURE, MANUAL, exact=True)
        counts = request.exposure / UNIT_OF_EXPOSURE
        yield CameraSetting("exposure", cv2.CAP_PROP_EXPOSURE, counts, UNIT_OF_EXPOSURE, "s")
    if request.gain is not None:
        yield CameraSetting("gain", cv2.CAP_PROP_GAIN, request.gain)
    if request.white_balance is not None:
        yield CameraSetting("fixed white balance", cv2.CAP_PROP_AUTO_WB, 0.0, exact=True)
        yield CameraSetting("white_balance", cv2.CAP_PROP_WB_TEMPERATURE, request.white_balance, 1.0, "K")


def apply(camera: Any, back_end: str, wanted: list[CameraSetting]) -> str:
    """Set a camera up; return a sentence on the first setting that it does not take, or ""."""
    for setting in wanted:
        if not camera.set(setting.property, setting.wanted):
            return (
                f"{setting.name} cannot be set to {setting.words(setting.wanted)} by {back_end}; leave it out"
            )
    return unlike(camera, back_end, wanted)


def unlike(camera: Any, back_end: str, wanted: list[CameraSetting]) -> str:
    """Return a sentence on the first setting that does not hold, or ""."""
    for setting in wanted:
        got = camera.get(setting.property)
        if not setting.holds(got):
            asked, found = setting.words(setting.wanted), setting.words(got)
            return f"{setting.name} was set to {asked} and is {found}, says {back_end}; give a value it takes"
    return ""
