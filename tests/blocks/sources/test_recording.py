"""sources.recording"""

from pathlib import Path

import numpy as np
import pytest

import quadvis
from quadvis.block import ParameterError
from quadvis.errors import DiagramError
from quadvis.output.log import LogWriter
from quadvis.output.recording import RecordedBlock, RecordedPort
from quadvis.testing import drive
from quadvis_blocks.sources.recording import Recording

PORTS = (
    RecordedPort("pose", shape=(4,), unit="m m m rad"),
    RecordedPort("count", "int64"),
    RecordedPort("valid", "bool"),
)
MS = 10**6


@pytest.fixture
def log(tmp_path):
    """Rows at 100, 200, 200 and 400 ms: pose (n, 10 n, 100 n, -n), count n, valid if n is odd, n from 1."""
    return written(tmp_path / "run.mcap", [100 * MS, 200 * MS, 200 * MS, 400 * MS])


def written(path, stamps):
    with LogWriter(path, [RecordedBlock("/eyes", PORTS)], {}) as writer:
        for number, stamp in enumerate(stamps, 1):
            pose = np.array([number, 10 * number, 100 * number, -number], float)
            row = [*pose.view(np.int64).tolist(), number, number % 2]
            writer.write(0, stamp, np.array(row).tobytes())
    return str(path)


def test_hold_gives_the_last_row_up_to_now(log):
    y = drive(Recording(file=log, signal="eyes.pose"), rate="20 Hz", steps=10).y
    assert y.shape == (10, 4)
    assert y[:, 1].tolist() == [10, 10, 10, 10, 30, 30, 30, 30, 40, 40]  # of two rows at 200 ms the last


def test_linear_moves_between_the_rows(log):
    y = drive(Recording(file=log, signal="eyes.pose[1]", between="linear"), rate="20 Hz", steps=10).y
    expected = np.interp(np.arange(10) / 20, [0.1, 0.2 - 1e-9, 0.2, 0.4], [10, 20, 30, 40])
    expected[3], expected[4] = 15, 30
    assert y == pytest.approx(expected, rel=1e-12)


def test_the_ends_may_be_missing(log):
    block = Recording(file=log, signal="eyes.pose[0]", before="missing", after="missing")
    y = drive(block, rate="20 Hz", steps=10).y
    assert np.isnan(y).tolist() == [True, True, *[False] * 7, True]


def test_a_recording_may_repeat(log):
    block = Recording(file=log, signal="eyes.count", after="repeat", begin=0.1)
    # from 100 ms on: 1 1 3 3 3 3 4 4 4 4, and again
    assert drive(block, rate="20 Hz", steps=14).y.tolist() == [1, 1, 3, 3, 3, 3, 4, 4, 4, 4, 1, 1, 3, 3]
    block = Recording(file=log, signal="eyes.pose[0]", after="repeat", begin=0.4, between="linear")
    assert drive(block, rate="20 Hz", steps=5).y == pytest.approx([4, 3.25, 2.5, 1.75, 1])


def test_shape_type_and_unit_are_those_of_the_signal(log):
    output = Recording(file=log, signal="eyes.pose[2:4]").interface.outputs["y"]
    assert (str(output.signal), output.unit, output.nan) == ("float64[2]", "m rad", False)
    assert Recording(file=log, signal="eyes.pose[0:2]").interface.outputs["y"].unit == "m"
    output = Recording(file=log, signal="eyes.valid").interface.outputs["y"]
    assert str(output.signal) == "bool"
    assert drive(Recording(file=log, signal="eyes.valid", begin=0.1), steps=2).y.tolist() == [True, False]
    assert Recording(file=log, signal="eyes.pose", after="missing").interface.outputs["y"].nan


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"signal": "eyes.poes"}, "there is no signal 'eyes.poes'; did you mean 'eyes.pose'"),
        ({"signal": "eyes.pose[7]"}, r"there is no 'eyes.pose\[7\]'"),
        ({"signal": "eyes.count", "between": "linear"}, "has whole numbers, so between must be hold"),
        ({"signal": "eyes.valid", "after": "missing"}, "has truth values, so after must be last or repeat"),
    ],
)
def test_what_cannot_be_played_is_refused(log, changed, words):
    with pytest.raises(ParameterError, match=words):
        Recording(**{"file": log, "signal": "eyes.pose", **changed})


def test_times_that_go_back_and_a_log_without_rows_are_refused(tmp_path):
    back = written(tmp_path / "back.mcap", [200 * MS, 300 * MS, 100 * MS])
    with pytest.raises(ParameterError, match=r"go back in '.*back.mcap': 0.1 s comes after 0.3 s"):
        Recording(file=back, signal="eyes.pose")
    with LogWriter(tmp_path / "empty.mcap", [RecordedBlock("/eyes", PORTS)], {}):
        pass
    with pytest.raises(ParameterError, match=r"there is no signal|has no rows"):
        Recording(file=str(tmp_path / "empty.mcap"), signal="eyes.pose")


def test_a_diagram_plays_what_another_one_has_logged_to_the_bit(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    head = "quadvis: 1\nname: a\nrates: {fast: 30 Hz}\nstop_time: 2 s\nseed: 3\nblocks:\n"
    Path("a.yaml").write_text(head + "  noise: {block: sources.noise, rate: fast, with: {sigma: 1 m}}\n")
    first = quadvis.load("a.yaml").run(log="a.mcap")
    played = "{block: sources.recording, rate: fast, with: {file: a.mcap, signal: noise.y}}"
    gain = "{block: signal.gain, rate: fast, in: {u: played.y}}"
    Path("b.yaml").write_text(f"{head}  played: {played}\n  gain: {gain}\n")
    result = quadvis.load("b.yaml").run(log="b.mcap")
    assert result["gain.y"].tobytes() == first["noise.y"].tobytes()
    assert result.units["gain.y"] == "m"
    assert quadvis.replay("b.mcap").same  # a file is no world: it is read again
    quadvis.load("a.yaml", seed=4).run(log="a.mcap")
    with pytest.raises(DiagramError, match=r"file 'a.mcap' is not what it was: its SHA-256 differs"):
        quadvis.replay("b.mcap")
    Path("b.yaml").write_text(f"{head}  played: {played.replace('noise.y', 'nosie.y')}\n")
    with pytest.raises(DiagramError, match=r"b.yaml:7:\d+: .*there is no signal 'nosie.y'"):
        quadvis.load("b.yaml")


def test_the_damage_of_a_log_is_a_warning(tmp_path, log):
    data = Path(log).read_bytes()
    (tmp_path / "cut.mcap").write_bytes(data[:-20])
    (doubt,) = Recording(file=str(tmp_path / "cut.mcap"), signal="eyes.pose").doubts()
    assert "cut" in str(doubt) or "damaged" in str(doubt)
