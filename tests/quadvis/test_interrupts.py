"""Signals that are held back do their work afterwards, whichever thread has taken them."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterator

import pytest

from quadvis.machine.interrupts import held_back, put_off
from tests.processes import wait_for

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals of a Unix")
NUMBERS = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP]


class Came(Exception):
    """A signal has had its effect."""


@pytest.fixture(autouse=True)
def handlers() -> Iterator[list[int]]:
    """Let the signals raise, and note themselves."""
    came: list[int] = []

    def take(number: int, _: object) -> None:
        came.append(number)
        raise Came

    before = {number: signal.signal(number, take) for number in NUMBERS}
    yield came
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.fixture
def other_thread() -> Iterator[None]:
    """Have a thread that takes what the main thread blocks."""
    ended = threading.Event()
    thread = threading.Thread(target=ended.wait)
    thread.start()
    yield
    ended.set()
    thread.join()


@pytest.mark.parametrize("number", NUMBERS)
def test_a_signal_waits_for_the_end_though_another_thread_takes_it(
    number: signal.Signals, handlers: list[int], other_thread: None
) -> None:
    reached = False
    with pytest.raises(Came), held_back():
        os.kill(os.getpid(), number)
        for _ in range(1000):
            wait_for(lambda: True)
        reached = True
    assert reached and handlers == [number]


def test_without_another_thread_it_waits_too_and_comes_once(handlers: list[int]) -> None:
    done = []
    with pytest.raises(Came):
        with held_back():
            with held_back():
                os.kill(os.getpid(), signal.SIGINT)
                os.kill(os.getpid(), signal.SIGINT)
                done.append("inner")
            done.append("outer")
        done.append("after")
    assert done == ["inner", "outer"] and handlers == [signal.SIGINT]
    with pytest.raises(Came):  # the handler is the one that was there
        os.kill(os.getpid(), signal.SIGINT)


def test_an_error_inside_is_no_longer_the_news_once_a_signal_was_held_back() -> None:
    with pytest.raises(Came) as caught, held_back():
        os.kill(os.getpid(), signal.SIGTERM)
        raise ValueError
    assert isinstance(caught.value.__context__, ValueError)


def test_an_ignored_signal_stays_ignored() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with held_back():
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
        os.kill(os.getpid(), signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN


def test_who_is_called_at_once_is_called_before_the_end(handlers: list[int]) -> None:
    order: list[str] = []
    with pytest.raises(Came), put_off(lambda: order.append("at once")):
        os.kill(os.getpid(), signal.SIGINT)
        order.append("inside")
    assert order == ["at once", "inside"] and handlers == [signal.SIGINT]
