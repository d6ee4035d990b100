"""Cameras that stall, hang up, change or send rubbish: real ones to OpenCV, on loopback."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from quadvis.machine.capture import GOOD, OPENING, REFUSING
from quadvis.machine.capture_process import CaptureProcess
from quadvis.machine.ports import PortError
from quadvis_vision.capture.pixels import unpacked
from quadvis_vision.capture.request import CameraRequest
from tests.camera_server import SIZE, CameraServer, jpeg, part, shown

PATIENCE = 30.0  # s; whoever waits longer hangs


class Seen:
    """What comes of a capture: the numbers that the pictures show, and those that they are given."""

    def __init__(self, capture: CaptureProcess) -> None:
        self.capture = capture
        self.shown: list[int] = []
        self.numbers: list[int] = []
        self._last = -1

    def until(self, condition: Callable[[], bool]) -> None:
        """Take all pictures until something holds."""
        end = time.monotonic() + PATIENCE
        while not condition():
            assert time.monotonic() < end, f"{self.capture.status}: {self.capture.text}"
            found = self.capture.newest(after=self._last)
            if found is None:
                time.sleep(0.002)
                continue
            assert found.instant > self._last
            self._last = found.instant
            self.numbers.append(found.number)
            self.shown.append(shown(unpacked(found.payload)))

    def more(self, count: int) -> None:
        """Take so many more pictures."""
        wanted = len(self.shown) + count
        self.until(lambda: len(self.shown) >= wanted)


@contextmanager
def capturing(device: str, **wanted: Any) -> Iterator[Seen]:
    """CaptureProcess from a device of which the first picture has come."""
    request = CameraRequest(device, **{"size": SIZE, **wanted})
    capture = CaptureProcess(multiprocessing.get_context("spawn"), request.capture())
    capture.start()
    try:
        capture.wait()
        yield Seen(capture)
    finally:
        capture.close()
        assert capture.process.exitcode is not None


def rising(numbers: list[int]) -> bool:
    return all(before < after for before, after in pairwise(numbers))


def test_pictures_come_whole_and_in_order_and_those_between_are_counted() -> None:
    with CameraServer() as server, capturing(server.url) as seen:
        seen.more(10)
        assert rising(seen.shown) and rising(seen.numbers)
        # What has a number was taken: the numbers pass over as many pictures as the camera has sent between.
        first, last = seen.shown[0], seen.shown[-1]
        assert seen.numbers[-1] - seen.numbers[0] == last - first
        assert seen.capture.status == GOOD and seen.capture.refused == 0
        assert "by the read" in seen.capture.text


@pytest.mark.slow
def test_a_camera_that_stalls_is_lost_and_comes_again() -> None:
    with CameraServer() as server, capturing(server.url) as seen:
        seen.more(3)
        server.stalled = True
        seen.until(lambda: seen.capture.status == OPENING)
        known = len(seen.shown)
        server.stalled = False
        seen.more(5)
        assert rising(seen.shown) and seen.capture.status == GOOD
        assert len(seen.shown) >= known + 5 and server.calls >= 2


@pytest.mark.slow
def test_a_camera_that_hangs_up_and_is_away_is_found_again() -> None:
    with CameraServer() as server, capturing(server.url) as seen:
        for _ in range(3):
            server.gone = True
            server.hang_up()
            seen.until(lambda: seen.capture.status == OPENING)
            server.gone = False
            seen.more(3)
        assert rising(seen.shown) and seen.capture.status == GOOD


@pytest.mark.slow
def test_a_camera_that_takes_calls_and_never_answers_is_called_again() -> None:
    with CameraServer() as server, capturing(server.url) as seen:
        seen.more(2)
        server.deaf = True
        server.hang_up()
        calls = server.calls
        seen.until(lambda: server.calls >= calls + 2)  # one call does not wait for ever
        assert seen.capture.status == OPENING
        server.deaf = False
        server.hang_up()
        seen.more(3)
        assert rising(seen.shown)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["half", "garbage", "size", "nothing"])
def test_what_is_no_whole_picture_of_the_right_size_is_refused_and_counted(kind: str) -> None:
    spoil = {
        "half": lambda good: good[: len(good) // 2],
        "garbage": lambda good: np.random.default_rng(len(good)).bytes(len(good)),
        "size": lambda good: jpeg(7, (SIZE[0], SIZE[1] // 2)),
        "nothing": lambda good: b"\xff\xd8",
    }[kind]

    def make(number: int) -> bytes:
        return spoil(jpeg(number)) if number % 3 == 2 else jpeg(number)

    with CameraServer(make) as server, capturing(server.url) as seen:
        seen.until(lambda: seen.capture.refused >= 5 and len(seen.shown) >= 10)
        assert rising(seen.shown) and min(seen.shown) >= 0
        assert all(number % 3 != 2 for number in seen.shown)


@pytest.mark.slow
def test_a_size_that_changes_for_good_is_refused_from_then_on() -> None:
    sizes = [SIZE]
    with CameraServer(lambda number: jpeg(number, sizes[-1])) as server, capturing(server.url) as seen:
        seen.more(3)
        sizes.append((48, 32))
        refused = seen.capture.refused
        seen.until(lambda: seen.capture.refused >= refused + 5)
        assert seen.capture.status == REFUSING and "48 x 32 px, not 96 x 64 px" in seen.capture.text
        sizes.append(SIZE)
        seen.more(3)
        assert rising(seen.shown)


@pytest.mark.slow
def test_a_camera_of_another_size_is_refused_at_the_start() -> None:
    with (
        CameraServer() as server,
        pytest.raises(PortError, match="96 x 64 px, not 640 x 480 px; "),
        capturing(server.url, size=(640, 480)),
    ):
        pass


@pytest.mark.slow
def test_a_call_that_hangs_is_ended_with_its_process(tmp_path: Path) -> None:
    """A FIFO without a writer holds up whoever opens it, and no time limit of a library helps."""
    path = tmp_path / "camera"
    os.mkfifo(path)
    writing = threading.Event()
    with feeding(path, writing):
        writing.set()
        with capturing(str(path)) as seen:
            seen.more(3)
            writing.clear()
            restarts = seen.capture.restarts
            seen.until(lambda: seen.capture.restarts >= restarts + 2)
            assert seen.capture.status == OPENING
            writing.set()
            seen.more(3)
            assert rising(seen.shown)


@contextmanager
def feeding(path: Path, writing: threading.Event) -> Iterator[None]:
    """Write numbered pictures into a FIFO while an event is set; it has no writer while it is not."""
    ended = threading.Event()

    def feed() -> None:
        number, fifo = 0, None
        while not ended.is_set():
            if not writing.is_set():
                if fifo is not None:
                    os.close(fifo)
                fifo = None
                time.sleep(0.02)
                continue
            try:
                fifo = os.open(path, os.O_WRONLY | os.O_NONBLOCK) if fifo is None else fifo
                os.write(fifo, part(jpeg(number)))
                number += 1
            except OSError:  # nobody reads now, or the reader is late
                pass
            time.sleep(0.03)

    thread = threading.Thread(target=feed, daemon=True)
    thread.start()
    yield
    ended.set()
    thread.join()


@pytest.mark.slow
def test_after_a_loss_only_the_camera_of_the_same_name_is_taken(tmp_path: Path) -> None:
    """A and B are links, as in /dev/v4l/by-id; when A is away, B has its number."""
    made = {name: threading.Event() for name in "ab"}
    name = tmp_path / "camera-a"
    for each in made:
        os.mkfifo(tmp_path / each)
    name.symlink_to(tmp_path / "a")
    with feeding(tmp_path / "a", made["a"]), feeding(tmp_path / "b", made["b"]):
        made["a"].set()
        with capturing(str(name)) as seen:
            seen.more(2)
            name.unlink()
            made["a"].clear()
            made["b"].set()
            seen.until(lambda: "is missing" in seen.capture.text)
            known = list(seen.shown)
            time.sleep(1.0)  # B is there
            seen.until(lambda: True)
            assert seen.shown == known
            (tmp_path / "a").rename(tmp_path / "c")  # a new number
            name.symlink_to(tmp_path / "c")
            with feeding(tmp_path / "c", made["a"]):
                made["a"].set()
                seen.more(2)


READER = """
import multiprocessing, sys, time
from quadvis.machine.capture_process import CaptureProcess
from quadvis_vision.capture.request import CameraRequest

capture = CaptureProcess(multiprocessing.get_context("spawn"), CameraRequest(sys.argv[1]).capture())
capture.start()
capture.wait()
print(capture.process.pid, flush=True)
time.sleep(1000)
"""


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT, signal.SIGTERM])
def test_no_process_outlives_its_reader(number: signal.Signals) -> None:
    with CameraServer() as server:
        reader = subprocess.Popen(
            [sys.executable, "-c", READER, server.url], stdout=subprocess.PIPE, text=True
        )
        assert reader.stdout is not None
        keeper = int(reader.stdout.readline())
        workers = children(keeper)
        assert len(workers) == 1
        reader.send_signal(number)
        reader.wait(PATIENCE)
        reader.stdout.close()
        end = time.monotonic() + PATIENCE
        while any(lives(process) for process in (keeper, *workers)):
            assert time.monotonic() < end
            time.sleep(0.02)


@pytest.mark.slow
def test_a_worker_that_is_killed_is_begun_anew_and_one_of_a_killed_keeper_ends() -> None:
    with CameraServer() as server, capturing(server.url) as seen:
        keeper = seen.capture.process.pid or 0
        (worker,) = children(keeper)
        os.kill(worker, signal.SIGKILL)
        seen.until(lambda: seen.capture.restarts == 1)
        seen.more(3)
        assert rising(seen.shown) and rising(seen.numbers)
        (worker,) = children(keeper)
        os.kill(keeper, signal.SIGKILL)
        end = time.monotonic() + PATIENCE
        while lives(worker):
            assert time.monotonic() < end
            time.sleep(0.02)
        seen.capture.process.join(PATIENCE)
        assert seen.capture.status not in (GOOD, OPENING)


def children(process: int) -> list[int]:
    return [int(child) for child in Path(f"/proc/{process}/task/{process}/children").read_text().split()]


def lives(process: int) -> bool:
    try:
        state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
    except (FileNotFoundError, ProcessLookupError):
        return False
    return state != "Z"
