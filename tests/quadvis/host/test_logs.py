from pathlib import Path
from typing import Any

import pytest

from quadvis.errors import QuadvisError
from quadvis.host.logs import TargetLogs

HEAD = b"\x89MCAP0\r\n"
WHOLE = HEAD + bytes(range(256)) * 40


def answer(verb: str, *, name: str, offset: int, count: int) -> dict[str, Any]:
    """Answer as a target does that has one log, and gives 1000 bytes of it at a time."""
    assert verb == "getlog"
    if name != "loop-1":
        raise QuadvisError(f"there is no log '{name}'")
    return {"data": WHOLE[offset : offset + min(count, 1000)], "size": len(WHOLE)}


@pytest.fixture
def logs() -> TargetLogs:
    return TargetLogs("lab", answer)


def test_a_log_is_copied_over_an_older_one(logs: TargetLogs, tmp_path: Path) -> None:
    place = tmp_path / "loop.mcap"
    place.write_bytes(WHOLE + WHOLE)
    assert logs.copy("loop-1", place) == place
    assert place.read_bytes() == WHOLE


def test_a_log_is_not_copied_over_a_file_of_another_kind(logs: TargetLogs, tmp_path: Path) -> None:
    diagram = tmp_path / "loop.yaml"
    diagram.write_text("quadvis: 1\n")
    with pytest.raises(QuadvisError, match=r"cannot write the log '.*loop.yaml': a file of another kind"):
        logs.copy("loop-1", diagram)
    assert diagram.read_text() == "quadvis: 1\n"
    with pytest.raises(QuadvisError, match=r"cannot write the log '.*': there is no folder"):
        logs.copy("loop-1", tmp_path / "missing" / "loop.mcap")


def test_of_a_log_that_is_not_there_nothing_is_left(logs: TargetLogs, tmp_path: Path) -> None:
    with pytest.raises(QuadvisError, match="there is no log 'lop'"):
        logs.copy("lop", tmp_path / "lop.mcap")
    assert not list(tmp_path.iterdir())
