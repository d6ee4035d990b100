"""The mailbox: the newest whole record, whenever its writer stops, in whatever order its writes are seen."""

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
from hypothesis import given
from hypothesis import strategies as st

from quadvis.machine.mailbox import SLOT, Mailbox


def box(room: int = 40, count: int = 4) -> Mailbox:
    return Mailbox(bytearray(SLOT * Mailbox.size(room, count)), room, count)


def test_the_newest_record_is_read_again_and_again() -> None:
    made = box()
    assert made.newest() is None
    for stamp in range(10):
        made.put(b"x" * stamp, stamp)
        for _ in range(2):
            found = made.newest()
            assert found is not None and (found.stamp, found.payload) == (stamp, b"x" * stamp)


def test_a_reader_asks_for_records_of_a_time() -> None:
    made = box()
    for stamp in (10, 20, 30):
        made.put(b"%d" % stamp, stamp)
    assert [made.newest(before, -1) for before in (10, 11, 20, 21, 99)] == [
        None, (10, b"10"), (10, b"10"), (20, b"20"), (30, b"30"),
    ]  # fmt: skip
    assert made.newest(99, 30) is None and made.newest(99, 29) == (30, b"30")


def test_a_record_that_is_too_long_is_refused_and_nothing_is_touched() -> None:
    made = box(room=8)
    made.put(b"12345678", 1)
    with pytest.raises(ValueError, match="a record of 9 bytes has no room in 8"):
        made.put(b"123456789", 2)
    assert made.newest() == (1, b"12345678")


@given(st.lists(st.binary(max_size=40), min_size=1, max_size=9))
def test_records_of_any_length_pass_whole(payloads: list[bytes]) -> None:
    memory = bytearray(SLOT * Mailbox.size(40, 3))
    reader, writer = Mailbox(memory, 40, 3), Mailbox(memory, 40, 3)
    for payload in payloads:
        writer.put(payload)
        assert reader.newest() == (0, payload)


class Dying:
    """Memory whose user dies at the n-th writing, half way through it if it is a piece."""

    def __init__(self, memory: memoryview, left: list[int]) -> None:
        self.memory, self.left = memory, left

    def __getitem__(self, key: Any) -> Any:
        return self.memory[key]

    def __setitem__(self, key: Any, value: Any) -> None:
        if self.left[0] == 0:
            if isinstance(key, slice):
                middle = (key.start + key.stop) // 2
                self.memory[key.start : middle] = value[: middle - key.start]
            raise KeyboardInterrupt
        self.left[0] -= 1
        self.memory[key] = value


@pytest.mark.parametrize("steps", range(8))
@pytest.mark.parametrize("before", [1, 3, 4, 9])
def test_a_writer_that_dies_anywhere_leaves_the_last_whole_record(steps: int, before: int) -> None:
    memory = bytearray(SLOT * Mailbox.size(40, 4))
    reader, writer = Mailbox(memory, 40, 4), Mailbox(memory, 40, 4)
    for stamp in range(before):
        writer.put(b"%03d" % stamp, stamp)
    left = [steps]
    writer._words, writer._bytes = Dying(writer._words, left), Dying(writer._bytes, left)
    died = False
    try:
        writer.put(b"%03d" % before, before)
    except KeyboardInterrupt:
        died = True
    whole = before - 1 if died else before
    assert reader.newest() == (whole, b"%03d" % whole)
    assert died == (steps < 7)
    heir = Mailbox(memory, 40, 4)
    for stamp in range(before + 1, before + 9):
        heir.put(b"%03d" % stamp, stamp)
        assert reader.newest() == (stamp, b"%03d" % stamp)


class Noting:
    """Memory that notes what is written to it."""

    def __init__(self, memory: memoryview, notes: list[tuple[str, Any, Any]]) -> None:
        self.memory, self.notes = memory, notes

    def __getitem__(self, key: Any) -> Any:
        return self.memory[key]

    def __setitem__(self, key: Any, value: Any) -> None:
        self.memory[key] = value
        if isinstance(key, slice):
            middle = (key.start + key.stop) // 2
            for start, stop in ((key.start, middle), (middle, key.stop)):
                self.notes.append(("B", slice(start, stop), value[start - key.start : stop - key.start]))
        else:
            self.notes.append(("q", key, value))


def writes_of_the_last(memory: bytearray, records: list[bytes]) -> list[tuple[str, Any, Any]]:
    """Leave records, and return what the last one has written, its bytes in two pieces."""
    writer = Mailbox(memory, 40, 3)
    for payload in records[:-1]:
        writer.put(payload)
    notes: list[tuple[str, Any, Any]] = []
    writer._words, writer._bytes = Noting(writer._words, notes), Noting(writer._bytes, notes)
    writer.put(records[-1])
    return notes


@given(st.permutations(range(8)), st.integers(2, 7))
def test_a_processor_that_shows_writes_in_another_order_shows_no_mixed_record(
    order: list[int], count: int
) -> None:
    records = [bytes([65 + number]) * (20 + number % 2) for number in range(count)]
    seen = bytearray(SLOT * Mailbox.size(40, 3))
    writes_of_the_last(seen, records[:-1])
    writes = writes_of_the_last(bytearray(len(seen)), records)
    assert [write[2] for write in writes if write[0] == "q"][::4] == [-count, count]  # the mark, twice
    if order.index(6) < order.index(0):  # the writes to one word are seen in their order
        order = [{0: 6, 6: 0}.get(number, number) for number in order]
    reader, memory = Mailbox(seen, 40, 3), memoryview(seen)
    for number in order:
        kind, key, value = writes[number]
        memory.cast(kind)[key] = value
        assert reader.newest() in ((0, records[-2]), (0, records[-1]))
    assert reader.newest() == (0, records[-1])


def test_a_reader_looks_at_every_record_at_most_once() -> None:
    made = box(count=4)
    for stamp in range(9):
        made.put(b"", stamp)
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
    writer.put(b"11111111", 1)
    writer.put(b"22222222", 2)

    class Slow(Dying):
        def __getitem__(self, key: Any) -> Any:
            found = bytes(self.memory[key])
            writer.put(b"33333333", 3)
            writer.put(b"44444444", 4)
            return found

    real = reader._bytes
    reader._bytes = Slow(reader._bytes, [0])
    assert reader.newest() is None
    reader._bytes = real
    assert reader.newest() == (4, b"44444444")


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
                found = reader.newest()
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
            assert reader.newest() is not None
    assert read >= 30
