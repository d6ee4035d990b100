"""The lifeline of a loop: held as long as its thread lives."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
from typing import Any

import pytest

from quadvis.realtime import lifeline
from quadvis.realtime.lifeline import Lifeline

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
    waiting = threading.Thread(target=Lifeline(words).wait, daemon=True)
    waiting.start()
    waiting.join(0.05)
    assert waiting.is_alive()
    assert holder.pid is not None
    os.kill(holder.pid, signal.SIGKILL)
    waiting.join(60)
    assert not waiting.is_alive()
    holder.join()


def test_it_is_let_go_when_its_thread_ends() -> None:
    words = multiprocessing.RawArray("q", lifeline.SIZE)
    Lifeline(words).make()
    threading.Thread(target=Lifeline(words).hold).start()
    waiting = threading.Thread(target=Lifeline(words).wait, daemon=True)
    waiting.start()
    waiting.join(60)
    assert not waiting.is_alive()
