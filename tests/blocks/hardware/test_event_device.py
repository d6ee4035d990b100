"""Events of joysticks, read as Linux gives them."""

from __future__ import annotations

import errno
import os
import re
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.machine.ports import PortError
from quadvis_blocks.hardware._event_codes import CODES, EV_ABS, EV_KEY, EV_SYN, SYN_DROPPED, event_code
from quadvis_blocks.hardware._event_device import EventDevice, Lacking
from tests.blocks.hardware.events import Driver, Fifo, code, event, report

HEADER = Path("/usr/include/linux/input-event-codes.h")
PAIR = (code("ABS_Y"), code("BTN_TL"))


@pytest.fixture
def fifo(tmp_path: Path) -> Iterator[Fifo]:
    yield Fifo(tmp_path / "stick")


def plugged(fifo: Fifo, codes: tuple[object, ...] = PAIR, driver: Driver | None = None) -> EventDevice:
    device = EventDevice(fifo.path, codes, driver)  # type: ignore[arg-type]
    fifo.plug()
    return device


@pytest.mark.skipif(not HEADER.exists(), reason="the kernel's headers are not installed")
def test_the_names_are_those_of_the_kernel() -> None:
    theirs: dict[str, int] = {}
    for name, value in re.findall(r"^#define\s+((?:ABS|BTN)_\w+)\s+(\w+)", HEADER.read_text(), re.MULTILINE):
        theirs[name] = theirs[value] if value in theirs else int(value, 0)
    assert {name: each.code for name, each in CODES.items()} == {name: theirs[name] for name in CODES}
    assert all(each.kind == (EV_ABS if name.startswith("ABS") else EV_KEY) for name, each in CODES.items())


def test_a_code_can_be_a_number_and_has_its_name() -> None:
    assert event_code("ABS_1") == code("ABS_Y") and event_code("KEY_310") == code("BTN_TL")
    assert str(event_code("ABS_1")) == "ABS_Y" and str(event_code("ABS_41")) == "ABS_41"
    assert [event_code(word) for word in ("ABS_64", "KEY_768", "ABS_", "BTN_1000", "X", "REL_1")] == [
        None
    ] * 6


def test_a_fifo_in_the_place_of_a_device_gives_reports(fifo: Fifo) -> None:
    device = plugged(fifo, (*PAIR, code("ABS_HAT0X")))
    assert device.stands_in and list(device.read()) == []
    before = time.monotonic_ns()
    fifo.send(report(ABS_Y=-32767, BTN_TL=1) + report(ABS_Y=0) + report(ABS_HAT0X=1)[:-1])
    found = list(device.read())
    assert [each.shares for each in found] == [(0.0, 1.0, 0.5), (0.5, 1.0, 0.5)]
    assert all(before <= each.instant <= time.monotonic_ns() for each in found)
    fifo.send(report()[-1:])
    assert [each.shares for each in device.read()] == [(0.5, 1.0, 1.0)]
    fifo.send(event(EV_SYN, SYN_DROPPED, 0) + report(ABS_Y=32767) + report(ABS_Y=99999))
    assert [(each.shares[0], each.dropped) for each in device.read()] == [(0.5, True), (1.0, False)]
    fifo.unplug()
    with pytest.raises(PortError, match="is gone: it has been unplugged"):
        list(device.read())
    device.close()


def test_a_device_says_its_ranges_and_its_state(fifo: Fifo) -> None:
    driver = Driver({"ABS_Y": (20, 0, 80), "ABS_X": (0, -1, 1)}, {"BTN_TL": 1, "BTN_TR": 0})
    device = plugged(fifo, (*PAIR, code("BTN_TR")), driver)
    assert device.state(5) == (5, (0.25, 1.0, 0.0), False)
    now = time.monotonic_ns()
    fifo.send(report(now - 10**9, ABS_Y=40) + report(now + 10**12, ABS_Y=60))
    old, ahead = device.read()
    assert (old.shares[0], ahead.shares[0]) == (0.5, 0.75)
    assert abs(old.instant - now + 10**9) < 1000 and ahead.instant <= time.monotonic_ns()
    # What was dropped is asked for again.
    driver.axes[code("ABS_Y").code], driver.buttons[code("BTN_TL").code] = (80, 0, 80), 0
    fifo.send(event(EV_SYN, SYN_DROPPED, 0) + event(EV_KEY, code("BTN_TR").code, 1) + report())
    (after,) = device.read()
    assert after.shares == (1.0, 0.0, 0.0) and after.dropped
    device.close()


def test_stamps_that_are_not_by_the_monotonic_clock_do_not_count(fifo: Fifo) -> None:
    device = plugged(fifo, PAIR, Driver({"ABS_Y": (0, 0, 1)}, {"BTN_TL": 0}, clock=False))
    before = time.monotonic_ns()
    fifo.send(report(77, BTN_TL=1))
    (only,) = device.read()
    assert only.instant >= before and not device.clocked
    device.close()


def test_what_a_device_has_not_is_named(fifo: Fifo) -> None:
    driver = Driver({"ABS_X": (0, 0, 1), "ABS_41": (0, 0, 1), "ABS_Z": (5, 5, 5)}, {"BTN_TL": 0})
    with pytest.raises(Lacking, match=r"has no axis ABS_Y; it has ABS_X, ABS_Z, ABS_41$"):
        EventDevice(fifo.path, PAIR, driver)
    with pytest.raises(Lacking, match=r"has no button BTN_TR; it has BTN_TL$"):
        EventDevice(fifo.path, [code("BTN_TR")], driver)
    with pytest.raises(Lacking, match="gives no range for its axis ABS_Z"):
        EventDevice(fifo.path, [code("ABS_Z")], driver)
    driver.failure = errno.ENOTTY
    with pytest.raises(Lacking, match="is no event device"):
        EventDevice(fifo.path, PAIR, driver)
    driver.failure = errno.ENODEV
    with pytest.raises(PortError, match="is gone") as caught:
        EventDevice(fifo.path, PAIR, driver)
    assert not isinstance(caught.value, Lacking)
    with pytest.raises(PortError, match="cannot be opened: there is no such file"):
        EventDevice(fifo.path + "x", PAIR)
    with pytest.raises(Lacking, match="is no event device"):
        EventDevice(os.devnull, PAIR)


@given(st.lists(st.binary(max_size=200), max_size=6))
def test_any_bytes_do_no_harm(pieces: list[bytes]) -> None:
    reader, writer = os.pipe()
    os.set_blocking(reader, False)
    device = EventDevice(f"/proc/self/fd/{reader}", PAIR)
    os.close(reader)
    for piece in [*pieces, bytes(-len(b"".join(pieces)) % 24), report(ABS_Y=32767, BTN_TL=0)]:
        if piece:
            os.write(writer, piece)
        found = list(device.read())
    # Any dropped report before would end with the next one.
    assert found[-1].shares == (1.0, 0.0) or found[-1].dropped
    os.close(writer)
    device.close()
