"""The files of file scopes: logs that are read as those of a run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from quadvis.api import load_text
from quadvis.diagram.sections.figures import read_figures
from quadvis.errors import QuadvisError
from quadvis.output.log_reader import read_log
from quadvis.output.plot import plot_logs
from quadvis.run.session import metadata
from quadvis.scopes.board import ScopeBoard
from quadvis.scopes.file_names import FileNames
from quadvis.scopes.settings import ScopeSettings
from quadvis.scopes.source import ScopeSource
from tests.quadvis.scopes.model import source

ROWS = np.random.default_rng(3).standard_normal((400, 3))


def board(folder: Path, **settings: Any) -> ScopeBoard:
    made = ScopeBoard(source(), lambda package: None, folder, {"name": "test"})
    given_ = {
        "Type": "file",
        "Signals": ["fast.v", "slow.z", "fast.x"],
        "NumSamples": 50,
        "AutoRestart": True,
    }
    made.add(ScopeSettings.read({**given_, **settings}))
    return made


def feed(made: ScopeBoard, stop: int, missing: tuple[int, ...] = ()) -> None:
    while made.settled < stop:
        ticks = np.array([t for t in range(made.settled, made.settled + 20) if t not in missing])
        made.feed("fast", ticks, ROWS[ticks].view(np.int64))
        slow = ticks[ticks % 3 == 0]
        made.feed("slow", slow, ROWS[slow][:, :2].view(np.int64))
        made.settle(made.settled + 20)


def test_package_after_package_is_appended_and_read_back(tmp_path: Path) -> None:
    made = board(tmp_path)
    made.start(1)
    feed(made, 400, missing=(7, 8, 200))
    assert made[1].status == "Acquiring"
    made.stop(1)
    file = made.file(1)
    assert file is not None and (file.lost, file.loss) == (3, "")
    log = read_log(tmp_path / "SC1DATA.mcap")
    there = [tick for tick in range(400) if tick not in (7, 8, 200)]
    assert log.complete
    assert sorted(log.names) == ["fast.v", "fast.x", "slow.z"]
    assert log["fast.v"].tolist() == ROWS[there][:, 1:3].tolist()
    assert log["slow.z"].tolist() == ROWS[[tick // 3 * 3 for tick in there]][:, 1].tolist()
    assert log.stamps("fast.x").tolist() == [tick * 1_000_000 for tick in there]
    assert log.units["fast.v"] == "m"
    assert (log.metadata["scope"], log.summary["left out"]) == ("1", "3")


def test_without_autorestart_the_file_has_one_package_and_can_be_read_at_once(tmp_path: Path) -> None:
    made = board(tmp_path, AutoRestart=False, Filename="one", TriggerMode="Software", NumPrePostSamples=-5)
    made.start(1)
    feed(made, 20)
    made.trigger(1)
    feed(made, 100)
    assert made[1].status == "Finished"
    assert read_log(tmp_path / "one.mcap")["fast.x"].tolist() == ROWS[15:65, 0].tolist()
    made.start(1)  # replaces the file, as in xPC Target
    feed(made, 120)
    made.stop(1)
    assert len(read_log(tmp_path / "one.mcap")["fast.x"]) == 0


def test_a_name_with_a_number_lets_files_follow_each_other(tmp_path: Path) -> None:
    made = board(tmp_path, Filename="part_<%%>.mcap", MaxFileSize=12_000, WriteMode="Commit")
    made.start(1)
    feed(made, 400)
    made.stop(1)
    paths = sorted(tmp_path.iterdir())
    assert [path.name for path in paths] == [f"part_{number:02d}.mcap" for number in range(1, len(paths) + 1)]
    assert len(paths) > 2
    values = np.concatenate([read_log(path)["fast.x"] for path in paths])
    assert values.tolist() == ROWS[:, 0].tolist()
    file = made.file(1)
    assert file is not None and file.lost == 0


def test_a_full_file_without_a_number_ends_its_scope(tmp_path: Path) -> None:
    made = board(tmp_path, MaxFileSize=12_000)
    made.start(1)
    feed(made, 400)
    assert made[1].status == "Finished"
    found = read_log(tmp_path / "SC1DATA.mcap")["fast.x"]
    assert 50 < len(found) < 200
    assert found.tolist() == ROWS[: len(found), 0].tolist()


def test_a_file_that_cannot_be_written_is_refused_at_the_start(tmp_path: Path) -> None:
    made = board(tmp_path)
    made.add(ScopeSettings(Type="file", Signals=("fast.x",), Filename="SC1DATA"))
    made.add(ScopeSettings(Type="file", Signals=("fast.x",), Filename="small", MaxFileSize=100))
    (tmp_path / "notes.mcap").write_text("notes")
    made.add(ScopeSettings(Type="file", Signals=("fast.x",), Filename="notes"))
    made.start(1)
    reasons = []
    for number in (2, 3, 4):
        with pytest.raises(QuadvisError) as found:
            made.start(number)
        reasons.append(str(found.value).replace(str(tmp_path), "folder"))
        assert made[number].status == "Interrupted"
    made.end()
    assert reasons == [
        "cannot write the log 'folder/SC1DATA.mcap': another run is writing it; choose another name",
        "the MaxFileSize of 100 bytes leaves no room for samples; make it larger",
        "cannot write the log 'folder/notes.mcap': a file of another kind is there; "
        "choose another name, or remove it",
    ]


def test_a_file_that_cannot_follow_ends_its_scope_and_counts_what_is_lost(tmp_path: Path) -> None:
    made = board(tmp_path, Filename="part_%.mcap", MaxFileSize=12_000)
    (tmp_path / "part_2.mcap").write_text("notes")
    made.start(1)
    feed(made, 400)
    file = made.file(1)
    assert file is not None and made[1].status == "Finished"
    assert "a file of another kind is there" in file.loss
    assert len(read_log(tmp_path / "part_1.mcap")["fast.x"]) + file.lost == 100


def test_the_figures_of_a_diagram_are_drawn_from_the_file(tmp_path: Path) -> None:
    diagram = load_text("""\
quadvis: 1
name: drawn
rates: {fast: 100 Hz}
stop_time: 1 s
blocks:
  wave: {block: sources.sine, rate: fast}
""")
    made = ScopeBoard(ScopeSource.of(diagram.graph), print, tmp_path, metadata(diagram))
    made.start(made.add(ScopeSettings(Type="file", Signals=("wave.y",), NumSamples=20)))
    made.feed("wave", np.arange(30), ROWS[:30, :1].copy().view(np.int64))
    made.settle(30)
    log = read_log(tmp_path / "SC1DATA.mcap")
    assert log.complete and log.diagram == diagram.resolved
    (picture,) = plot_logs([log], read_figures(log.diagram, "log"), tmp_path)
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_the_numbers_in_names() -> None:
    assert FileNames("", 3).name(0) == "SC3DATA.mcap"
    names = FileNames("a%", 1)
    assert [names.name(number) for number in (0, 8, 9)] == ["a1.mcap", "a9.mcap", "a1.mcap"]
    assert FileNames("a<%%%>b.mcap", 1).name(11) == "a012b.mcap"


@pytest.mark.parametrize(
    "name", ["../a", "/tmp/a", "a/b", "a%b%", ".hidden", "a\0b", "ä", "x" * 200, "%" * 200, "a..b"]
)
def test_names_that_leave_the_folder_are_refused(name: str) -> None:
    with pytest.raises(QuadvisError, match=r"the Filename .*; (use up to|write % in one place)"):
        FileNames(name, 1)
