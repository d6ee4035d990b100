"""What the system grants, and the reason for what it refuses."""

from __future__ import annotations

import errno
import gc
import os
import resource
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from quadvis.errors import QuadvisError
from quadvis.realtime import system
from quadvis.realtime.options import RealTime
from quadvis.realtime.system import CAP_SYS_NICE, Grants, ask_all

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="asks Linux")


@pytest.fixture(autouse=True)
def collected() -> Iterator[None]:
    """Leave the garbage collector as it was."""
    yield
    gc.unfreeze()
    gc.enable()


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Let the system grant everything, and keep what it was asked for."""
    found: list[Any] = []
    monkeypatch.setattr(gc, "collect", lambda: 0)  # it would look through thousands of tests
    monkeypatch.setattr(os, "sched_setscheduler", lambda *given: found.append(given))
    monkeypatch.setattr(os, "sched_setaffinity", lambda *given: found.append(given))
    monkeypatch.setattr(system, "_libc", lambda *given: found.append(given) or 0)
    monkeypatch.setattr(resource, "getrlimit", lambda which: (resource.RLIM_INFINITY,) * 2)
    return found


def capabilities(monkeypatch: pytest.MonkeyPatch, *numbers: int) -> None:
    status = system._status
    mask = f"{sum(1 << number for number in numbers):016x}"
    monkeypatch.setattr(system, "_status", lambda key: mask if key == "CapEff" else status(key))


def refuse(monkeypatch: pytest.MonkeyPatch, name: str, number: int) -> None:
    def refused(*_: Any) -> None:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(os, name, refused)


def test_all_that_is_granted(asked: list[Any]) -> None:
    grants = ask_all(RealTime(cpu=1, priority=70))
    assert str(grants) == "SCHED_FIFO 70, cpu 1, memory locked, timers exact, gc off"
    assert not gc.isenabled()
    policy = asked[0][1]
    assert policy & os.SCHED_RESET_ON_FORK
    assert asked[0][2].sched_priority == 70
    assert asked[1:] == [(0, {1}), ("mlockall", 3), ("prctl", 29, 1, 0, 0, 0)]


def test_what_is_not_wished_is_not_asked_for(asked: list[Any]) -> None:
    assert str(ask_all(RealTime(priority=0))) == "memory locked, timers exact, gc off"
    assert [name for name, *_ in asked] == ["mlockall", "prctl"]


@pytest.mark.parametrize(
    ("number", "held", "why"),
    [
        (errno.EPERM, (), "needs CAP_SYS_NICE, or a limit rtprio of 80; it is -1"),
        (errno.EPERM, (CAP_SYS_NICE,), "the control group has no time for it: cpu.rt_runtime_us is 0"),
        (errno.EINVAL, (), "invalid argument"),
    ],
)
def test_why_there_is_no_priority(
    number: int, held: tuple[int, ...], why: str, asked: list[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    refuse(monkeypatch, "sched_setscheduler", number)
    capabilities(monkeypatch, *held)
    assert ask_all(RealTime().on(None)).refused == [f"SCHED_FIFO 80 ({why})"]


def test_why_a_processor_is_not_the_loops(asked: list[Any], monkeypatch: pytest.MonkeyPatch) -> None:
    refuse(monkeypatch, "sched_setaffinity", errno.EINVAL)
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {2, 0})
    assert ask_all(RealTime(cpu=9)).refused == ["cpu 9 (this process may use 0, 2)"]


@pytest.mark.parametrize(("times", "locked"), [(1, False), (3.9, False), (4.1, True)])
def test_memory_is_locked_only_if_the_limit_leaves_room_for_more(
    times: float, locked: bool, asked: list[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    capabilities(monkeypatch)
    monkeypatch.setattr(system, "_memory_in_use", lambda: 100 << 20)
    monkeypatch.setattr(resource, "getrlimit", lambda which: (int(times * (100 << 20)), 1 << 40))
    grants = ask_all(RealTime().on(None))
    assert (("mlockall", 3) in asked) == locked
    size = f"it is {times * 100:.0f} MB, and 100 MB are in use"
    why = f"needs CAP_IPC_LOCK, or a limit memlock of 4 times what is in use; {size}"
    assert grants.refused == ([] if locked else [f"memory locked ({why})"])


def test_the_memory_in_use_is_more_than_what_is_resident() -> None:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    assert system._memory_in_use() >= pages * resource.getpagesize()


def test_a_call_that_the_system_refuses_is_named() -> None:
    grants = Grants()
    grants.ask("a wish", lambda: os.strerror(system._libc("mlockall", 1 << 20)).lower())
    assert str(grants) == "nothing granted; not granted: a wish (invalid argument)"


# Options


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"priority": 100}, "priority must be from 1 to 99, or 0 for none, not 100"),
        ({"priority": -1}, "priority must be from 1 to 99, or 0 for none, not -1"),
        ({"cpu": -1}, "cpu must be the number of a processor, 0 or more"),
        ({"poll": "60"}, "poll: '60' has no unit; did you mean '60 s'?"),
        ({"poll": "soon"}, "poll: 'soon' does not begin with a number; write it as in '50 ms'"),
    ],
)
def test_options_that_cannot_be(given: dict[str, Any], words: str) -> None:
    with pytest.raises(QuadvisError) as caught:
        RealTime(**given)
    assert str(caught.value).endswith(words)
