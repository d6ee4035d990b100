"""A camera of this computer or of its network."""

from __future__ import annotations

from typing import Any

from quadvis.block import CapturedInput, CaptureRequest, Frame, Out, Param, ParameterError, SourceRecord
from quadvis_vision.camera.calibration import CameraCalibration
from quadvis_vision.capture.devices import lasting_name, missing
from quadvis_vision.capture.pixels import unpacked
from quadvis_vision.capture.request import CameraRequest

AUTOMATIC = 0.0


class Camera(CapturedInput):
    """The pictures of a camera: the newest whole one at each step.

    A process of its own takes the pictures by OpenCV, as fast as they come. A step takes the newest one and
    never waits. ``stamp`` is the middle of the exposure in run time. It follows from the driver's stamp if
    there is one on the monotonic clock (V4L2), else it is the instant of the read, less half the exposure and
    less ``delay``; a run says at its start which of the two it is. Pictures from before the start of the run
    are not shown.

    A picture of another size than that of ``calibration`` or ``size``, half a JPEG and garbage are refused
    and counted. Other codings than JPEG do not show that half of a picture is missing. At the start the
    camera must be there, with all settings that the diagram asks for; each is read back then, and twice a
    second. A camera that is lost lets ``age`` grow. Calls of the driver have time limits, and one that hangs
    is ended with its process; within 2 s after the camera is back, its pictures come again. Only the same
    camera is taken again: name it by its path in /dev/v4l/by-id or by-path. A number is taken only if there
    is one camera.

    A FIFO carries pictures as HTTP does, each with a head that gives its length. A video file in the place of
    a camera comes at its own rate, again and again.
    """

    port_example = "/dev/v4l/by-id/NAME"

    frame = Out("frame", doc="the newest picture")
    stamp = Out(unit="s", nan=True, doc="middle of the exposure of the newest picture; NaN before the first")

    device = Param(type="port", doc="path such as /dev/v4l/by-id/NAME, number, URL, or path of a file")
    calibration = Param("", type="file", doc="camera calibration file (YAML): pictures must have its size")
    size = Param((0, 0), type="int64[2]", min=0, doc="width and height in px; 0: as calibrated, or any")
    fps = Param(0.0, unit="Hz", min=0.0, max=1000.0, doc="pictures a second; 0: as the camera gives them")
    exposure = Param(AUTOMATIC, unit="s", min=0.0, max=1.0, doc="exposure time; 0: the camera's automatic")
    gain = Param(-1.0, min=-1.0, doc="gain in the driver's numbers; -1: the camera's own")
    white_balance = Param(AUTOMATIC, unit="K", min=0.0, doc="colour temperature; 0: the camera's automatic")
    delay = Param(
        0.0,
        unit="s",
        min=0.0,
        max=10.0,
        doc="from the end of the exposure to the read, without driver's stamps",
    )

    example = """
        camera:
          block: vision.camera
          rate: slow
          with:
            device: /dev/v4l/by-id/usb-camera-video-index0
            calibration: "quadvis:calib/camera.yaml"
            exposure: 8 ms
    """

    def check(self) -> None:
        """Read the calibration; refuse a size that contradicts it, and an exposure that has no time."""
        calibrated, given = self._calibrated(), tuple(self.size.tolist())
        if (given[0] == 0) != (given[1] == 0):
            raise ParameterError("size", "size must have a width and a height, or be 0 0")
        if calibrated and given[0] and given != calibrated:
            problem = f"size is {given[0]} x {given[1]} px, and the calibration is for"
            raise ParameterError("size", f"{problem} {calibrated[0]} x {calibrated[1]} px")
        if self.fps and self.exposure > 1 / self.fps:
            raise ParameterError(
                "exposure", f"exposure must be at most the period of fps, {1 / self.fps:.3g} s"
            )

    def _calibrated(self) -> tuple[int, int] | None:
        if not self.calibration:
            return None
        return self.read_file("calibration", CameraCalibration.load).size

    def missing(self) -> str:
        """Return a sentence if the camera is surely not there, else ""."""
        return missing(self.device)

    def capture(self) -> CaptureRequest:
        """Return what is to be captured."""
        given = (int(self.size[0]), int(self.size[1])) if self.size[0] else None
        return CameraRequest(
            lasting_name(self.device),
            self._calibrated() or given,
            rate=self.fps,
            exposure=self.exposure or None,
            gain=None if self.gain < 0 else self.gain,
            white_balance=self.white_balance or None,
            delay=self.delay,
        ).capture()

    def open(self) -> None:
        """Begin without a picture."""
        super().open()
        self._before = 0  # pictures that were taken before the first one that is shown

    def nothing(self) -> tuple[Any, ...]:
        """Return no picture."""
        return Frame.none(), Frame.none().stamp

    def values(self, record: SourceRecord) -> tuple[Any, ...]:
        """Return the picture and its stamp."""
        self._before = self._before or record.number - 1
        frame = Frame(unpacked(record.payload), record.stamp, record.number - self._before)
        return frame, record.stamp
