"""The mailbox: the newest whole record, whenever its writer stops, and without waiting."""

from __future__ import annotations

import mmap
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from quadvis.links.mailbox import SLOT, Mailbox

NEVER = 2**62


def box(room: int = 40, count: int = 4) -> Mailbox:
    return Mailbox(bytearray(SLOT * Mailbox.size(room, count)), room, count)


def test_the_newest_record_is_read_again_and_again() -> None:
    made = box()
    assert made.newest(NEVER, -1) is None
    for stamp in range(10):
        made.put(stamp, b"x" * stamp)
        for _ in range(2):
            found = made.newest(NEVER, -1)
            assert found is not None and (found.stamp, found.payload) == (stamp, b"x" * stamp)


def test_a_reader_asks_for_records_of_a_time() -> None:
    made = box()
    for stamp in (10, 20, 30):
        made.put(stamp, b"%d" % stamp)
    assert [made.newest(before, -1) for before in (10, 11, 20, 21, 99)] == [
        None, (10, b"10"), (10, b"10"), (20, b"20"), (30, b"30"),
    ]  # fmt: skip
    assert made.newest(99, 30) is None and made.newest(99, 29) == (30, b"30")


def test_a_record_that_is_too_long_is_refused_and_nothing_is_touched() -> None:
    made = box(room=8)
    made.put(1, b"12345678")
    with pytest.raises(ValueError, match="a record of 9 bytes has no room in 8"):
        made.put(2, b"123456789")
    assert made.newest(NEVER, -1) == (1, b"12345678")


class Dying:
    """Memory whose user dies at the n-th writing."""

    def __init__(self, memory: memoryview, left: list[int]) -> None:
        self.memory, self.left = memory, left

    def __getitem__(self, key: Any) -> Any:
        return self.memory[key]

    def __setitem__(self, key: Any, value: Any) -> None:
        if self.left[0] == 0:
            raise KeyboardInterrupt
        self.left[0] -= 1
        self.memory[key] = value


@pytest.mark.parametrize("steps", range(7))
@pytest.mark.parametrize("before", [1, 3, 4, 9])
def test_a_writer_that_dies_anywhere_leaves_the_last_whole_record(steps: int, before: int) -> None:
    memory = bytearray(SLOT * Mailbox.size(40, 4))
    reader, writer = Mailbox(memory, 40, 4), Mailbox(memory, 40, 4)
    for stamp in range(before):
        writer.put(stamp, b"%03d" % stamp)
    left = [steps]
    writer._words, writer._bytes = Dying(writer._words, left), Dying(writer._bytes, left)
    died = False
    try:
        writer.put(before, b"%03d" % before)
    except KeyboardInterrupt:
        died = True
    whole = before - 1 if died else before
    assert reader.newest(NEVER, -1) == (whole, b"%03d" % whole)
    assert died == (steps < 6)
    heir = Mailbox(memory, 40, 4)
    for stamp in range(before + 1, before + 9):
        heir.put(stamp, b"%03d" % stamp)
        assert reader.newest(NEVER, -1) == (stamp, b"%03d" % stamp)


def test_a_reader_looks_at_every_record_at_most_once() -> None:
    made = box(count=4)
    for stamp in range(9):
        made.put(stamp, b"")
    looked = []

    class Watched(Dying):
        def __getitem__(self, key: Any) -> Any:
            looked.append(key)
            return super().__getitem__(key)

    made._words = Watched(made._words, [0])
    assert made.newest(0, -1) is None
    assert len(looked) <= 1 + 4 * 4


def test_a_record_that_is_written_over_while_it_is_read_is_not_taken() -> None:
    memory = bytearray(SLOT * Mailbox.size(8, 2))
    reader, writer = Mailbox(memory, 8, 2), Mailbox(memory, 8, 2)
    writer.put(1, b"11111111")
    writer.put(2, b"22222222")

    class Slow(Dying):
        def __getitem__(self, key: Any) -> Any:
            found = bytes(self.memory[key])
            writer.put(3, b"33333333")
            writer.put(4, b"44444444")
            return found

    real = reader._bytes
    reader._bytes = Slow(reader._bytes, [0])
    assert reader.newest(NEVER, -1) is None
    reader._bytes = real
    assert reader.newest(NEVER, -1) == (4, b"44444444")


ROOM, COUNT = 8000, 4


def started(path: Path) -> subprocess.Popen[bytes]:
    script = Path(__file__).with_name("endless_writer.py")
    return subprocess.Popen([sys.executable, str(script), str(path), str(ROOM), str(COUNT)])


@pytest.mark.slow
def test_killed_and_stopped_writers_never_leave_a_mixed_record(tmp_path: Path) -> None:
    path = tmp_path / "words"
    path.write_bytes(bytes(SLOT * Mailbox.size(ROOM, COUNT)))
    random = np.random.default_rng(4)
    with path.open("r+b") as file:
        reader = Mailbox(mmap.mmap(file.fileno(), 0), ROOM, COUNT)
        last = read = 0

        def check(times: int) -> None:
            nonlocal last, read
            for _ in range(times):
                found = reader.newest(NEVER, -1)
                if found is not None:
                    numbers = np.frombuffer(found.payload, np.int64)
                    assert numbers.size == ROOM // 8 and (numbers == found.stamp).all()
                    assert found.stamp >= last
                    read += found.stamp > last
                    last = found.stamp

        for _ in range(30):
            writer = started(path)
            try:
                before = last
                while last == before:  # the new writer is followed
                    check(1)
                for _ in range(20):
                    check(int(random.integers(1, 100)))
                    os.kill(writer.pid, signal.SIGSTOP)
                    check(20)
                    os.kill(writer.pid, signal.SIGCONT)
            finally:
                writer.kill()
                writer.wait()
            check(3)
            assert reader.newest(NEVER, -1) is not None
    assert read >= 30
