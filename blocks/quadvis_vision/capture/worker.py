"""The worker of a camera: takes pictures as fast as they come, and leaves the newest whole one.

Two threads: one takes, so that no picture waits in a buffer and grows old; the other decodes the newest. A
camera that is lost is opened again, by the same lasting name, until it is there.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any

from quadvis.machine.capture import GOOD, OPENING, REFUSED, REFUSING, UNLIKE, Post
from quadvis_vision.capture.pixels import HEADER, packed
from quadvis_vision.capture.request import CameraRequest
from quadvis_vision.capture.settings import apply, settings_of, unlike
from quadvis_vision.capture.source import CameraSource, NoPicture, TakenPicture, Unusable, WrongSize, decoded

AGAIN = 0.1  # s before a camera that is lost is tried again
SETTLED = 0.001  # s without a newer picture, after which the newest one is not in the middle of a burst
SURELY = 3  # pictures of another size in a row, after which a start need not wait for a right one
LOOK = 0.5  # s between two looks at the settings
GIVEN_UP = 2.0  # s that the other thread has to end

Opener = Callable[[CameraRequest, Callable[[float], None]], Any]


class Newest:
    """The newest picture, on its way from the thread that takes to the one that decodes."""

    def __init__(self) -> None:
        self._condition = threading.Condition()
        self._held: tuple[int, TakenPicture] | None = None
        self.ended = False

    def put(self, count: int, taken: TakenPicture) -> None:
        """Put a picture, so many having been taken with it, in the place of the one before."""
        with self._condition:
            self._held = count, taken
            self._condition.notify()

    def end(self) -> None:
        """Let the other thread end."""
        with self._condition:
            self.ended = True
            self._condition.notify()

    def get(self) -> tuple[int, TakenPicture] | None:
        """Wait for a picture that no other one follows at once; None at the end."""
        with self._condition:
            while self._held is None and not self.ended:
                self._condition.wait()
            while self._condition.wait(SETTLED) and not self.ended:
                pass
            held, self._held = self._held, None
            return held


class CameraWorker:
    """One camera, its settings, and the pictures that were taken of it."""

    def __init__(self, post: Post, request: CameraRequest, opener: Opener = CameraSource) -> None:
        self._post, self._request, self._opener = post, request, opener
        self._unlike = ""
        self._wrong = 0  # pictures of another size in a row

    def serve(self) -> None:
        """Open the camera and take its pictures until it gives none; then return, to be called again."""
        try:
            camera = self._opener(self._request, self._post.calling)
        except NoPicture as error:
            self._post.say(OPENING, str(error))
            return
        wanted = [*settings_of(self._request, camera.by_driver)]
        self._post.calling(camera.read_limit)
        refusal = apply(camera.capture, camera.back_end, wanted)
        if refusal:
            self._post.say(UNLIKE, refusal, hopeless=True)
            camera.close()
            return
        newest = Newest()
        thread = threading.Thread(target=self._leave, args=(camera, newest), daemon=True)
        thread.start()
        try:
            self._take(camera, newest, wanted)
        except NoPicture as error:
            self._post.say(OPENING, str(error))
        finally:
            newest.end()
            thread.join(GIVEN_UP)
            camera.close()

    def _take(self, camera: Any, newest: Newest, wanted: Any) -> None:
        look = time.monotonic() + LOOK
        while True:
            taken = camera.take()
            newest.put(self._post.take(), taken)
            if wanted and time.monotonic() >= look:
                look = time.monotonic() + LOOK
                self._unlike = unlike(camera.capture, camera.back_end, wanted)

    def _leave(self, camera: Any, newest: Newest) -> None:
        """Decode the newest pictures, and leave those that are whole and as they must be."""
        post = self._post
        while (held := newest.get()) is not None:
            count, taken = held
            try:
                pixels = self._pixels(taken, camera.raw)
            except Unusable as fault:
                self._wrong += isinstance(fault, WrongSize)
                post.refuse()
                post.say(REFUSING, str(fault), hopeless=self._wrong >= SURELY)
                continue
            self._wrong = 0
            post.put(taken.instant, count - post.words[REFUSED], packed(pixels))
            post.say(UNLIKE if self._unlike else GOOD, self._unlike or camera.note)

    def _pixels(self, taken: TakenPicture, jpeg: bool) -> Any:
        """Return the pixels of a picture; Unusable if it is refused."""
        pixels = decoded(taken.raw, self._request.size, jpeg)
        if pixels.nbytes + HEADER > self._post.room:
            height, width = pixels.shape[:2]
            raise WrongSize(f"pictures of {width} x {height} px have no room; state their size")
        return pixels


def work(post: Post, request: CameraRequest) -> None:
    """Be the worker: the whole life of its process."""
    worker = CameraWorker(post, request)
    while True:
        worker.serve()
        post.calling(AGAIN + 1.0)
        time.sleep(AGAIN)
