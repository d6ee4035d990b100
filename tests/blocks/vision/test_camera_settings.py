"""A camera keeps the settings that it is given, or it is refused: four kinds of drivers."""

from __future__ import annotations

import time
from array import array
from typing import Any

import cv2
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.machine.capture import GOOD, HOPELESS, STATUS, UNLIKE, Post
from quadvis_vision.capture import worker
from quadvis_vision.capture.request import CameraRequest
from quadvis_vision.capture.settings import apply, settings_of, unlike
from quadvis_vision.capture.source import NoPicture, TakenPicture, Unusable, decoded
from quadvis_vision.capture.worker import CameraWorker
from tests.camera_server import SIZE, jpeg, painted, shown

WANTED = CameraRequest("fake", SIZE, exposure=8e-3, gain=20.0, white_balance=4600.0)
TAKES = 300


class Driver:
    """OpenCV's capture over a driver that obeys."""

    def __init__(self) -> None:
        self.values: dict[int, float] = {}

    def set(self, what: int, value: float) -> bool:
        self.values[what] = float(round(value))
        return True

    def get(self, what: int) -> float:
        return self.values.get(what, 0.0)


class Refusing(Driver):
    def set(self, what: int, value: float) -> bool:
        return what != cv2.CAP_PROP_EXPOSURE and super().set(what, value)


class OtherUnits(Driver):
    """Exposure as a power of 2, as some back ends have it."""

    def get(self, what: int) -> float:
        return -7.0 if what == cv2.CAP_PROP_EXPOSURE else super().get(what)


class StaysAutomatic(Driver):
    def get(self, what: int) -> float:
        return 3.0 if what == cv2.CAP_PROP_AUTO_EXPOSURE else super().get(what)


class FallsBack(Driver):
    """Obeys, and is automatic a while later."""

    looks = 0

    def get(self, what: int) -> float:
        self.looks += what == cv2.CAP_PROP_AUTO_EXPOSURE
        return 3.0 if what == cv2.CAP_PROP_AUTO_EXPOSURE and self.looks > 3 else super().get(what)


class FakeCamera:
    """An open camera over a driver."""

    back_end, read_limit, raw, note, by_driver = "V4L2", 1.0, False, "a fake", True

    def __init__(self, driver: Driver, post: Post) -> None:
        self.capture, self._post, self.closed = driver, post, False
        self.seen: list[int] = []

    def take(self) -> TakenPicture:
        if len(self.seen) == TAKES:
            raise NoPicture("it ends")
        self.seen.append(int(self._post.words[STATUS]))
        time.sleep(0.002)
        return TakenPicture(painted(len(self.seen)), len(self.seen))

    def close(self) -> None:
        self.closed = True


def serve(driver: Driver) -> tuple[Post, FakeCamera]:
    room = SIZE[0] * SIZE[1] * 3 + 8
    post = Post(array("q", bytes(8 * Post.size(room))), room)
    camera = FakeCamera(driver, post)
    CameraWorker(post, WANTED, lambda *_: camera).serve()
    assert camera.closed
    return post, camera


def test_a_driver_that_obeys_gives_pictures() -> None:
    driver = Driver()
    _, camera = serve(driver)
    assert driver.get(cv2.CAP_PROP_EXPOSURE) == 80  # in 100 us
    assert driver.get(cv2.CAP_PROP_AUTO_EXPOSURE) == 1 and driver.get(cv2.CAP_PROP_AUTO_WB) == 0
    assert GOOD in camera.seen[1:] and UNLIKE not in camera.seen


@pytest.mark.parametrize(
    ("driver", "words"),
    [
        (Refusing(), "exposure cannot be set to 8 ms by V4L2; leave it out"),
        (OtherUnits(), "exposure was set to 8 ms and is -700 us, says V4L2; give a value it takes"),
        (StaysAutomatic(), "manual exposure was set to 1 and is 3, says V4L2; give a value it takes"),
    ],
)
def test_a_driver_that_does_not_obey_is_refused_at_the_start(driver: Driver, words: str) -> None:
    post, camera = serve(driver)
    assert (post.words[STATUS], post.words[HOPELESS], post.text) == (UNLIKE, 1, words)
    assert camera.seen == []


def test_a_driver_that_falls_back_later_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(worker, "LOOK", 0.0)
    _, camera = serve(FallsBack())
    assert camera.seen[-1] == UNLIKE and GOOD in camera.seen[1:]


@given(st.floats(1e-4, 1.0), st.floats(-0.09, 0.09))
def test_a_driver_may_round(exposure: float, share: float) -> None:
    driver = Driver()
    wanted = [*settings_of(CameraRequest("fake", exposure=exposure), by_driver=True)]
    assert apply(driver, "V4L2", wanted) == ""
    driver.values[cv2.CAP_PROP_EXPOSURE] = exposure * 1e4 * (1 + share)
    assert unlike(driver, "V4L2", wanted) == ""
    driver.values[cv2.CAP_PROP_EXPOSURE] = exposure * 2e4 + 1
    assert "exposure was set to" in unlike(driver, "V4L2", wanted)


def test_a_rate_that_a_driver_does_not_keep_is_refused_and_that_of_a_stream_is_its_own() -> None:
    class Slow(Driver):
        def get(self, what: int) -> float:
            return 15.0 if what == cv2.CAP_PROP_FPS else super().get(what)

    request = CameraRequest("fake", rate=30.0)
    wanted = [*settings_of(request, by_driver=True)]
    assert (
        apply(Slow(), "V4L2", wanted) == "fps was set to 30 Hz and is 15 Hz, says V4L2; give a value it takes"
    )
    assert [*settings_of(request, by_driver=False)] == []


def array_of(data: bytes) -> Any:
    import numpy as np

    return np.frombuffer(data, np.uint8)[None]


def test_a_whole_jpeg_is_a_picture() -> None:
    assert shown(decoded(array_of(jpeg(1234)), SIZE, jpeg=True)) == 1234


@given(st.data())
def test_no_part_of_a_jpeg_is_a_picture(data: st.DataObject) -> None:
    whole = jpeg(77)
    length = data.draw(st.integers(0, len(whole) - 1))
    with pytest.raises(Unusable):
        decoded(array_of(whole[:length]), SIZE, jpeg=True)


@given(st.binary(max_size=300), st.booleans())
def test_bytes_are_no_picture(data: bytes, begins: bool) -> None:
    with pytest.raises(Unusable):
        decoded(array_of(b"\xff\xd8" * begins + data), SIZE, jpeg=True)
