"""Draws the results of detector and pose into a picture."""

from __future__ import annotations

import math
from typing import Any

from quadvis.block import Block, Frame, In, Out, Param
from quadvis_vision.camera.calibration import CameraCalibration
from quadvis_vision.camera.projection import RADIUS, SIDE
from quadvis_vision.pictures.overlay import Finding, Overlay

UNKNOWN = (math.nan, math.nan, math.nan)


class Annotator(Block, numeric=False):
    """The picture with the results of detector and pose, for people: write it to a video or to a folder.

    The circles are marked by their numbers, a partly hidden circle also by its quality. If there is a pose,
    the square, its axes (x red, y green, z blue) and the outlines of the circles are drawn at their places by
    the pose; outlines of missing circles are orange. Beside each missing circle, where the pose or the other
    circles let one expect it, stands why it is missing: hidden (in part, with its quality), cut (by the edge
    of the picture) or not seen. A caption below the picture shows the time, the detector's status in words,
    and the pose in cm and degrees.

    The picture and its results must come at the same tick, as they do from a detector at the same rate. All
    inputs except the picture and the circles may stay open. A frame that is not a picture becomes grey, so
    that a video shows when the camera failed. Before the first picture there is no output picture.

    Source: for watching the experiments of section 6; pinhole camera of equations (10) and (38).
    """

    frame = In("frame", doc="the picture")
    centres = In("float64[4,2]", unit="px", doc="u, v of circles 1 to 4; a row with NaN is missing")
    quality = In("float64[4]", default=(1.0,) * 4, doc="radius of each circle over its expected radius")
    status = In("int64", default=-1, doc="of the detector; -1 if not known")
    position = In("float64[3]", unit="m", default=UNKNOWN, doc="of the camera in target axes, z below it")
    rotation = In("float64[3,3]", default=(UNKNOWN,) * 3, doc="from target axes to camera axes")
    yaw = In(unit="rad", default=math.nan, doc="heading relative to the target")
    valid = In("bool", default=True, doc="whether there is a pose")
    annotated = Out("frame", doc="the picture with its marks; stamp and number are those of the picture")

    calibration = Param(type="file", doc="camera calibration file (YAML)")
    side = Param(SIDE, unit="m", above=0.0, doc="distance between the centres of neighbouring circles")
    radius = Param(RADIUS, unit="m", above=0.0, doc="radius of the circles")
    zoom = Param(2, type="int64", min=1, max=8, doc="size of the output relative to the picture")

    example = """
        camera:
          block: vision.rendered_camera
          rate: slow
          with: {calibration: "quadvis:calib/camera.yaml"}
          in: {position: {value: [0, 0, 1.5], unit: m}, attitude: {value: [0, 0, 0.1], unit: rad}}
        detector:
          block: vision.circle_detector
          rate: slow
          with: {colours: "quadvis:calib/colours.yaml"}
          in: {frame: camera.frame}
        notes:
          block: vision.annotator
          rate: slow
          with: {calibration: "quadvis:calib/camera.yaml"}
          in:
            frame: camera.frame
            centres: detector.centres
            quality: detector.quality
            status: detector.status
    """

    def check(self) -> None:
        """Read the calibration."""
        self._load()

    def _load(self) -> CameraCalibration:
        return self.read_file("calibration", CameraCalibration.load)

    def open(self) -> None:
        """Read the calibration."""
        self._overlay = Overlay(self._load(), self.side, self.radius, self.zoom)

    def output(
        self,
        frame: Frame,
        centres: Any,
        quality: Any,
        status: int,
        position: Any,
        rotation: Any,
        yaw: float,
        valid: bool,
    ) -> Frame:
        """Return the picture with the results drawn into it."""
        if frame.sequence == 0:
            return frame
        found = Finding(centres, quality, int(status), position, rotation, float(yaw), bool(valid))
        title = f"t {frame.stamp:.2f} s   picture {frame.sequence}"
        return Frame(self._overlay.draw(frame.pixels, found, title), frame.stamp, frame.sequence)
