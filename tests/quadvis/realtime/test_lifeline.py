"""The lifeline of a thread: held as long as it lives, or until it lets go."""

from __future__ import annotations

import multiprocessing
import os
import select
import signal
import sys
import threading
from typing import Any

import pytest

from quadvis.realtime import lifeline
from quadvis.realtime.lifeline import Lifeline, Vigil
from tests.processes import wait_for

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="robust locks are Linux's")


def hold(words: Any, ready: Any) -> None:
    Lifeline(words).hold()
    ready.send(None)
    signal.pause()


def test_it_is_let_go_when_its_holder_is_killed() -> None:
    context = multiprocessing.get_context("spawn")
    words = context.RawArray("q", lifeline.SIZE)
    Lifeline(words).make()
    mine, theirs = context.Pipe()
    holder = context.Process(target=hold, args=(words, theirs))
    holder.start()
    mine.recv()
    vigil = Vigil(words)
    assert select.select(vigil.descriptors, [], [], 0.05)[0] == [] and not vigil.has_ended()
    assert holder.pid is not None
    os.kill(holder.pid, signal.SIGKILL)
    assert wait_for(lambda: select.select(vigil.descriptors, [], [], 0)[0])
    assert select.select(vigil.descriptors, [], [], 0)[0] and vigil.has_ended() and vigil.has_ended()
    assert vigil.descriptors == []
    holder.join()


@pytest.mark.parametrize("release", [False, True])
def test_the_end_of_its_thread_is_told_from_a_release(release: bool) -> None:
    words = multiprocessing.RawArray("q", lifeline.SIZE)
    line = Lifeline(words)
    line.make()

    def live() -> None:
        line.hold()
        if release:
            line.release()

    thread = threading.Thread(target=live)
    thread.start()
    thread.join()
    assert Lifeline(words).wait() is not release


def test_who_holds_none_lets_go_of_none() -> None:
    words = multiprocessing.RawArray("q", lifeline.SIZE)
    line = Lifeline(words)
    line.make()
    line.release()
    line.hold()
    other = threading.Thread(target=line.release)
    other.start()
    other.join()
    waiting = threading.Thread(target=Lifeline(words).wait, daemon=True)
    waiting.start()
    waiting.join(0.05)
    assert waiting.is_alive()
    line.release()
    waiting.join(60)
    assert not waiting.is_alive()
