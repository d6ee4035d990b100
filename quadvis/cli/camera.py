"""`quadvis camera`: the cameras of this computer; what one of them sees; its calibration in one sitting.

Of all rooms this module alone imports `quadvis_vision`, inside its functions: no engine stands on it.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import shutil
import sys
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from quadvis.errors import QuadvisError, counted, sentence
from quadvis.machine.capture import CapturedRecord
from quadvis.machine.capture_process import CaptureProcess
from quadvis.machine.files import PNG, check_output, write_output
from quadvis.machine.status_line import StatusLine

MEASURED = 1.0  # s over which the rate is measured
PATIENCE = 5.0  # s without a picture, after which a camera is lost
TEXT_ROWS = 24
SECOND = 1e9


class Seen(NamedTuple):
    """A picture: its record, and its pixels (height, width, 3)."""

    record: CapturedRecord
    pixels: Any


def camera(options: argparse.Namespace) -> int:
    """List the cameras, show what one sees, or calibrate it."""
    if options.device is None:
        return _list()
    if options.calibrate is not None:
        return _calibrate(options)
    return _show(options)


def _list() -> int:
    from quadvis_vision.capture.devices import cameras

    found = cameras()
    for each in found:
        print(f"{each.lasting}  {each.title}, {each.node}, driver {each.driver}")
    if not found:
        print("this computer has no camera; plug one in, or name a URL or a video file instead")
    return 0


@contextmanager
def _pictures(options: argparse.Namespace) -> Iterator[tuple[CaptureProcess, Iterator[Seen]]]:
    """Open a camera; yield its capture and its pictures, the newest each time, until it is lost."""
    from quadvis_vision.capture.devices import lasting_name, missing
    from quadvis_vision.capture.request import CameraRequest

    if words := missing(options.device):
        raise QuadvisError(words)
    request = CameraRequest(lasting_name(options.device), options.size)
    with closing(CaptureProcess(multiprocessing.get_context("spawn"), request.capture())) as capture:
        capture.start()
        capture.wait()
        yield capture, _newest(capture)


def _newest(capture: CaptureProcess) -> Iterator[Seen]:
    from quadvis_vision.capture.pixels import unpacked

    last, until = -1, time.monotonic() + PATIENCE
    while time.monotonic() < until:
        record = capture.newest(after=last)
        if record is None:
            time.sleep(0.002)
            continue
        last, until = record.instant, time.monotonic() + PATIENCE
        yield Seen(record, unpacked(record.payload))
    raise QuadvisError(f"no picture has come for {PATIENCE:g} s: {capture.text}")


def _show(options: argparse.Namespace) -> int:
    """Show one picture, or write several; print size, rate, stamps and sharpness."""
    from quadvis_vision.capture.sharpness import grey, sharpness

    if options.output:
        Path(options.output).mkdir(parents=True, exist_ok=True)
    with _pictures(options) as (capture, pictures):
        first = last = next(pictures)
        ages, sharp, written = [_age(first)], [sharpness(grey(first.pixels))], _write(options, first, 0)
        while written < options.count * bool(options.output) or _since(first, last) < MEASURED:
            last = next(pictures)
            ages.append(_age(last))
            sharp.append(sharpness(grey(last.pixels)))
            written = _write(options, last, written)
        if not options.output:
            _print_picture(last.pixels)
        height, width = last.pixels.shape[:2]
        taken = last.record.number - first.record.number
        print(capture.text)
        seconds = _since(first, last)
        rate = f"{taken / seconds:.3g} pictures a second, measured over {seconds:.2g} s"
        print(f"{width} x {height} px, {rate}; {capture.refused} refused")
        print(f"stamps: {min(ages) * 1e3:.3g} to {max(ages) * 1e3:.3g} ms old when a picture is here")
        print(f"sharpness: {min(sharp):.3g} to {max(sharp):.3g} (variance of the Laplacian)")
    if options.output:
        print(f"{written} pictures in {options.output}")
    return 0


def _since(first: Seen, last: Seen) -> float:
    return (last.record.instant - first.record.instant) / SECOND


def _age(seen: Seen) -> float:
    return (time.monotonic_ns() - seen.record.instant) / SECOND


def _write(options: argparse.Namespace, seen: Seen, written: int) -> int:
    """Write a picture, if more are wanted; return how many there are."""
    if not options.output or written == options.count:
        return written
    import cv2

    path = Path(options.output) / f"{written:06}.png"
    write_output(path, PNG, cv2.imencode(".png", seen.pixels)[1].tobytes())
    return written + 1


def _print_picture(pixels: Any) -> None:
    """Print a picture where there is a terminal: in colour if it has 24 bits of it, else in dots."""
    from quadvis_vision.capture.text_picture import in_colour, in_dots

    if not sys.stdout.isatty():
        return
    columns, rows = shutil.get_terminal_size((80, TEXT_ROWS))
    has_colour = os.environ.get("COLORTERM") in ("truecolor", "24bit") and "NO_COLOR" not in os.environ
    print((in_colour if has_colour else in_dots)(pixels, columns, rows - 6))


def _calibrate(options: argparse.Namespace) -> int:
    """Take views of a board until all places and tilts are there, and calibrate."""
    from quadvis.units import Unit, read_quantity
    from quadvis_vision.calibrate.chessboard import Board
    from quadvis_vision.camera.calibration import CAMERA
    from quadvis_vision.trials.photographs import calibrate_photographs, dated

    for name in ("square", "output"):
        if getattr(options, name) is None:
            such = {"square": "25mm", "output": "camera.yaml"}[name]
            raise QuadvisError(sentence(f"--calibrate needs --{name}", f"add such as --{name} {such}"))
    check_output(options.output, CAMERA)
    columns, rows = options.calibrate
    board = Board(columns, rows, read_quantity(options.square, Unit.parse("m"), bare=False))
    sitting = _sit(options, board)
    report, found = calibrate_photographs(board, sitting.views())
    dated(found.camera).save(options.output, comment=report.header())
    print(report.text())
    if words := sitting.coverage.words():
        report.warnings.append(words)
    for warning in (*report.warnings, *report.cautions):
        print(f"warning: {warning}", file=sys.stderr)
    print(f"camera: {options.output}")
    return 0


def _sit(options: argparse.Namespace, board: Any) -> Any:
    """Return the views; Ctrl-C ends them, as does a while without a new one."""
    from quadvis_vision.calibrate.sitting import Answer, Sitting
    from quadvis_vision.capture.sharpness import grey, sharpness

    with _pictures(options) as (_, pictures), StatusLine() as line:
        seen = next(pictures)
        sitting = Sitting(board, (seen.pixels.shape[1], seen.pixels.shape[0]))
        until = time.monotonic() + options.idle
        try:
            while not sitting.is_complete and time.monotonic() < until:
                picture = grey(seen.pixels)
                answer = sitting.show(picture, sharpness(picture))
                missing = sitting.coverage.words()
                if answer is Answer.TAKEN:
                    until = time.monotonic() + options.idle
                    line.say(
                        f"{counted(sitting.count, 'view')}; {missing or 'all places and tilts are there'}"
                    )
                elif line.shown:
                    line.show(f"{_views(sitting)}; {answer.value}; {missing}")
                seen = next(pictures)
        except KeyboardInterrupt:
            if sitting.count < 3:
                raise
    if sitting.count < 3:
        columns, rows = options.calibrate
        problem = (
            f"a board of {columns}x{rows} inner corners was held still in {counted(sitting.count, 'view')}"
        )
        raise QuadvisError(sentence(problem, "it takes 3 or more; count the inner corners of your board"))
    return sitting


def _views(sitting: Any) -> str:
    return counted(sitting.count, "view")
