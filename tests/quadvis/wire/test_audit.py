from __future__ import annotations

import json
import os
import stat
from pathlib import Path

import pytest

from quadvis.errors import QuadvisError
from quadvis.wire.audit import REFUSED_AT_ONCE, Audit
from quadvis.wire.refusals import RefusedError
from quadvis.wire.who import Who

ANNA = Who("anna", 3, b"a" * 32, (0, b"1"))


def lines(path: Path) -> list[dict[str, object]]:
    return [json.loads(line) for line in path.read_text().splitlines()]


def test_a_flood_of_refusals_is_counted_and_not_written(tmp_path: Path) -> None:
    now = [0.0]
    audit = Audit(tmp_path / "a" / "audit.jsonl", clock=lambda: now[0])
    for _ in range(10_000):
        audit.refused(ANNA, "setparam", RefusedError("no"))
    assert len(lines(audit.path)) == REFUSED_AT_ONCE
    audit.accepted(ANNA, "start", {})
    now[0] += 1
    audit.refused(ANNA, "setparam", RefusedError("no"))
    assert lines(audit.path)[-1]["unwritten"] == 10_000 - REFUSED_AT_ONCE
    assert lines(audit.path)[-2]["verb"] == "start"
    audit.close()


def test_the_files_are_bounded_closed_to_others_and_only_grow(tmp_path: Path) -> None:
    path = tmp_path / "a" / "audit.jsonl"
    audit = Audit(path, longest=2000, files=3)
    for number in range(200):
        audit.accepted(ANNA, "setparam", {"values": {"n": number}})
    audit.close()
    files = sorted(path.parent.iterdir())
    assert [each.name for each in files] == ["audit.1.jsonl", "audit.2.jsonl", "audit.3.jsonl", "audit.jsonl"]
    assert all(each.stat().st_size <= 2000 and stat.S_IMODE(each.stat().st_mode) == 0o600 for each in files)
    order = [files[2], files[1], files[0], files[3]]
    numbers = [line["args"]["values"]["n"] for each in order for line in lines(each)]  # type: ignore[index]
    assert numbers == list(range(numbers[0], 200)) and len(numbers) > 20


def test_it_goes_on_at_the_end_of_an_old_file(tmp_path: Path) -> None:
    for _ in range(2):
        audit = Audit(tmp_path / "a" / "audit.jsonl")
        audit.note("here")
        audit.close()
    assert [line["note"] for line in lines(audit.path)] == ["here", "here"]


def test_bytes_and_long_values_are_short_in_the_file(tmp_path: Path) -> None:
    audit = Audit(tmp_path / "a" / "audit.jsonl")
    audit.accepted(ANNA, "put", {"data": b"x" * 1_000_000, "file": "0"}, old=list(range(10_000)))
    audit.close()
    (line,) = lines(audit.path)
    assert "1000000 bytes, SHA-256 " in line["args"]["data"] and "SHA-256" in line["old"]  # type: ignore[index,operator]
    assert audit.path.stat().st_size < 2000


def test_text_of_a_host_cannot_begin_a_line(tmp_path: Path) -> None:
    audit = Audit(tmp_path / "a" / "audit.jsonl")
    audit.refused(ANNA, 'x"}\n{"host": "bob', RefusedError("no"))
    audit.close()
    assert len(lines(audit.path)) == 1


def test_a_file_that_cannot_be_written_is_refused_at_the_start(tmp_path: Path) -> None:
    folder = tmp_path / "a"
    folder.mkdir(mode=0o700)
    (folder / "audit.jsonl").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(QuadvisError, match="cannot write the audit file"):
        Audit(folder / "audit.jsonl")
    assert not (tmp_path / "elsewhere").exists()


def test_a_full_disk_is_counted(tmp_path: Path) -> None:
    audit = Audit(tmp_path / "a" / "audit.jsonl")
    os.close(audit._descriptor)
    audit._descriptor = os.open("/dev/full", os.O_WRONLY)
    audit.note("here")
    assert audit.lost == 1
    audit.close()


def test_a_new_file_that_cannot_be_made_costs_neither_older_ones_nor_files_of_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a" / "audit.jsonl"
    audit = Audit(path, longest=200, files=3)
    for number in range(4):
        audit.note(f"{number} {100 * '-'}")
    before = {each.read_text() for each in path.parent.iterdir()}

    def refuse(*_: object) -> int:
        raise OSError(24, "Too many open files")

    with monkeypatch.context() as patched:
        patched.setattr("quadvis.wire.audit.os.open", refuse)
        for _ in range(5):
            audit.note(100 * "x")
    assert audit.lost == 5
    other = (tmp_path / "other").open("w+")
    audit.note("goes on")
    assert [line["note"] for line in lines(path)] == ["goes on"]
    assert {each.read_text() for each in path.parent.iterdir() if each != path} <= before
    assert len(list(path.parent.iterdir())) == 4
    audit.close()
    assert other.read() == ""
    other.close()
