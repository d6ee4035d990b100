"""A camera from views of a chessboard and its report, for tools/calibrate and `quadvis camera`."""

from __future__ import annotations

import datetime
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from quadvis_vision.calibrate import chessboard
from quadvis_vision.calibrate.report import Report
from quadvis_vision.trials import opencv

if TYPE_CHECKING:
    from quadvis_vision.calibrate.chessboard import Board, ChessboardCalibration, Views

TILT_MORE = "tilt the board more ways, by 20 deg and more"


def calibrate_photographs(
    board: Board, views: Views, *, skew: bool = False
) -> tuple[Report, ChessboardCalibration]:
    """Return the report and the calibration of a board's views, beside OpenCV's.

    `QuadvisError` for too few views, or views that do not determine a camera.
    """
    ours = chessboard.calibrate_views(board, views.corners, views.size, skew=skew)
    theirs = opencv.calibrate_views(board.points, views.corners, views.size)
    report = Report(
        cameras=[
            ("equations (7)-(10)", ours.camera.matrix, ours.rms),
            ("bundle adjustment", ours.bundle.matrix, ours.bundle_rms),
            ("OpenCV", theirs.matrix, theirs.rms),
        ],
        lenses={"ours": ours.bundle.distortion, "OpenCV": theirs.distortion},
        views=list(zip(views.names, ours.errors.tolist(), theirs.errors.tolist(), strict=True)),
        warnings=remarks(views, ours.omitted),
    )
    weigh(report, ours.deviations, "these views", TILT_MORE)
    return report, ours


def weigh(report: Report, deviations: Any, given: str, remedy: str) -> None:
    """Add the standard deviations to the report, and a caution if they are large."""
    report.deviations = deviations.facts()
    report.cautions += filter(None, [deviations.warning(given, remedy)])


def remarks(views: Views, omitted: tuple[str, ...] = ()) -> list[str]:
    """Return remarks for the user about the photographs."""
    notes, total = [*views.notes], len(views.names) + len(views.missed)
    if views.missed:
        notes.append(f"the board was not found in {len(views.missed)} of {total}: {', '.join(views.missed)}")
    if views.crowded:
        where = f"in {len(views.crowded)} of {total} ({', '.join(views.crowded)})"
        notes.append(f"{where} neighbouring corners pull at those found; --window auto keeps clear of them")
    if omitted:
        without = f"the lens is without {', '.join(omitted)}, which would fold the picture"
        notes.append(f"{without}; show the board out to the corners of the picture")
    return notes


def dated(calibration: Any) -> Any:
    """Return the calibration with today's date."""
    today = datetime.date.today().isoformat()
    return replace(calibration, evidence=replace(calibration.evidence, date=today))
