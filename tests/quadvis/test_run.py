"""A run as a whole: its recording, its log, its report, and its remains when it stops early."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from quadvis.api import Diagram, load_text
from quadvis.errors import RunError
from quadvis.machine.status_line import ProgressLine
from quadvis.output.log_reader import read_log
from quadvis.run.report import summary_lines

RAMP = """\
quadvis: 1
name: ramp
rates: {fast: 10 Hz, slow: 2 Hz}
stop_time: 2 s
seed: 5
blocks:
  ramp: {block: sources.ramp, rate: fast, with: {slope: 0.5 m/s}}
  slow: {block: signal.gain, rate: slow, with: {factor: 2}, in: {u: {from: ramp.y, across: sample}}}
  noise: {block: sources.noise, rate: fast, with: {sigma: 1 rad}}
"""
JUDGED = """\
expect:
  - {signal: ramp.y, within: 100 cm}
  - {signal: ramp.y, after: 1 s, above: 0.6 m}
  - {signal: noise.y, before: 0 s, rms: 1000 deg}
summary:
  way: {signal: ramp.y, after: 1 s, show: [lowest, highest, final], unit: cm}
  angle: noise.y
  never: {signal: ramp.y, after: 3 s}
"""


def ramp(more: str = "", **replaced: str) -> Diagram:
    text = RAMP + more
    for old, new in replaced.items():
        text = text.replace(old, new)
    return load_text(text)


def test_signals_are_arrays_by_name_with_their_times() -> None:
    result = ramp().run()
    assert list(result) == ["ramp.y", "slow.y", "noise.y"]
    np.testing.assert_allclose(result.times("ramp.y"), np.arange(21) / 10)
    np.testing.assert_allclose(result["ramp.y"], np.arange(21) / 20)
    np.testing.assert_allclose(result.times("slow.y"), np.arange(5) / 2)
    np.testing.assert_allclose(result["slow.y"], np.arange(5) / 2)
    assert result.units == {"ramp.y": "m", "slow.y": "m", "noise.y": "rad"}


def test_the_same_seed_gives_the_same_bits_and_another_does_not() -> None:
    first, second = (ramp().run()["noise.y"] for _ in range(2))
    np.testing.assert_array_equal(first, second)
    assert not np.array_equal(first, load_text(RAMP.replace("seed: 5", "seed: 6")).run()["noise.y"])


@pytest.mark.parametrize(
    ("log", "rows"),
    [
        ("", {"ramp": 21, "slow": 5, "noise": 21}),
        ("log: {every: {fast: 4}}", {"ramp": 6, "slow": 5, "noise": 6}),
        ("log: {signals: [r*, slow.y], every: {fast: 30, slow: 1}}", {"ramp": 1, "slow": 5}),
        ("log: {signals: []}", {}),
    ],
)
def test_what_is_logged_and_how_often(log: str, rows: dict[str, int], tmp_path: Path) -> None:
    result = ramp(log).run(log=tmp_path / "run.mcap")
    assert {name.partition(".")[0]: len(result[name]) for name in result} == rows
    written = read_log(tmp_path / "run.mcap")
    assert written.complete
    assert list(written.names) == list(result)
    for name in result:
        np.testing.assert_array_equal(written[name], result[name])
        np.testing.assert_array_equal(written.times(name), result.times(name))


def test_the_first_row_is_always_kept() -> None:
    assert ramp("log: {every: {fast: 7}}").run().times("ramp.y")[:2].tolist() == [0.0, 0.7]


def test_the_log_tells_what_was_run_and_how_it_ended(tmp_path: Path) -> None:
    diagram = ramp(JUDGED)
    result = diagram.run(log=tmp_path / "run.mcap")
    log = read_log(tmp_path / "run.mcap")
    assert log.diagram == diagram.resolved
    assert {key: log.metadata[key] for key in ("name", "seed", "hash")} == {
        "name": "ramp", "seed": "5", "hash": diagram.hash,
    }  # fmt: skip
    assert log.summary["passed"] == "false"
    assert log.summary["expect 2"] == str(result.outcome.verdicts[1])


def test_the_outcome_is_judged_by_hand() -> None:
    result = ramp(JUDGED).run()
    first, second, third = result.outcome.verdicts
    assert (first.found, first.met) == (pytest.approx(1.0), True)
    assert (second.found, second.met) == (pytest.approx(0.5), False)
    assert third.found == abs(result["noise.y"][0])
    assert result.outcome.summary["way"] == pytest.approx({"lowest": 0.5, "highest": 1.0, "final": 1.0})
    assert result.outcome.summary["angle"]["max"] == np.abs(result["noise.y"]).max()
    assert all(math.isnan(value) for value in result.outcome.summary["never"].values())
    assert not result.passed


def test_the_facts_are_plain_json_with_null_for_what_is_not_there() -> None:
    result = ramp(JUDGED).run()
    facts = json.loads(json.dumps(result.facts(), allow_nan=False))
    assert set(facts) == {
        "diagram", "variant", "params", "hash", "seed", "passed", "duration_s", "wall_s", "cpu_s", "engine",
        "real_time_factor", "real_time", "summary", "expect", "margins",
    }  # fmt: skip
    assert (facts["diagram"], facts["variant"], facts["seed"], facts["passed"]) == ("ramp", None, 5, False)
    assert facts["duration_s"] == 2.0
    assert facts["summary"]["never"] == {"signal": "ramp.y", "unit": "m", "rms": None, "max": None}
    assert facts["summary"]["way"]["final"] == pytest.approx(1.0)
    assert facts["expect"][1] == {
        "expectation": "ramp.y always above 0.6 m after 1 s", "signal": "ramp.y", "kind": "above",
        "unit": "m",
        "limit": 0.6, "found": pytest.approx(0.5), "met": False, "lack": None, "shown": "0.5 m",
    }  # fmt: skip
    for key in facts:
        assert key in (type(result).facts.__doc__ or "")


def test_the_summary_lines_up_and_shows_the_units_that_people_read() -> None:
    result = ramp(JUDGED).run()
    lines = summary_lines(result)
    angle = math.degrees(math.sqrt(np.mean(result["noise.y"] ** 2)))
    largest = math.degrees(np.abs(result["noise.y"]).max())
    first = math.degrees(abs(result["noise.y"][0]))
    way = "lowest 50 cm, highest 100 cm, final 100 cm"
    assert lines[:4] == [
        "ramp: 2 s, seed 5",
        f"  way    {way}  after 1 s",
        f"  angle  rms {angle:.4g} deg, max {largest:.4g} deg",
        f"  never  {'rms none, max none':<{len(way)}}  after 3 s",
    ]
    width = len("noise.y rms at most 1000 deg before 0 s")
    assert lines[4:7] == [
        f"  met      {'ramp.y within 100 cm':<{width}}  100 cm",
        f"  NOT MET  {'ramp.y always above 0.6 m after 1 s':<{width}}  0.5 m",
        f"  met      noise.y rms at most 1000 deg before 0 s  {first:.4g} deg",
    ]
    assert "s of wall time, " in lines[7]
    assert lines[8] == "FAILED: 2 of 3 expectations met"


def test_a_run_without_expectations_passes_without_a_word_about_it() -> None:
    lines = summary_lines(ramp().run())
    assert len(lines) == 2
    assert ramp().run().passed


def test_progress_tells_the_time_reached(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("quadvis.run.loops.SLICE", 0.0)
    seen: list[tuple[float, float]] = []
    ramp().run(progress=lambda time, wall: seen.append((time, wall)))
    times = [time for time, _ in seen]
    assert times == sorted(times)
    assert times[-1] > 2.0 - 1e-9
    assert len(times) == 21


class Terminal:
    """A stream that looks like a terminal, or not."""

    def __init__(self, shown: bool) -> None:
        self.shown, self.text = shown, ""

    def isatty(self) -> bool:
        return self.shown

    def write(self, text: str) -> None:
        self.text += text

    def flush(self) -> None:
        pass


def test_the_progress_line_is_rewritten_and_wiped() -> None:
    terminal: Any = Terminal(True)
    with ProgressLine(20.0, terminal) as progress:
        progress(5.0, 1.0)
        assert "5.0 / 20 s" in terminal.text
        assert "5 x real time" in terminal.text
        assert "######...." in terminal.text
    assert terminal.text.endswith("\r\x1b[K")
    assert "\n" not in terminal.text


def test_there_is_no_progress_line_where_nobody_watches() -> None:
    pipe: Any = Terminal(False)
    with ProgressLine(20.0, pipe) as progress:
        progress(5.0, 1.0)
    assert pipe.text == ""


FAILING = """\
quadvis: 1
name: failing
rates: {fast: 10 Hz}
stop_time: 2 s
blocks:
  ramp: {block: sources.ramp, rate: fast, with: {slope: 0.5, initial: -0.5}}
  root: {block: own.root, rate: fast, in: {u: ramp.y}}
"""
ROOT = '''\
"""A square root."""

import math

from quadvis.block import Block, In, Out


class Root(Block):
    """The square root of a signal."""

    u = In(unit="a")
    y = Out(unit="a^0.5")

    def output(self, u):
        """Return the root."""
        return ACTION
'''

NO_VALUE = "a function was asked for a value that it does not have, such as the root of a negative number"
FAULTS_OF_ARITHMETIC = {
    "u / 0.0": "a division by zero (u = 0.25)",
    "1 % (u - 0.25)": "a division by zero (u = 0.25)",
    "0.0 ** -u": "a division by zero (u = 0.25)",
    "math.sqrt(-u)": f"{NO_VALUE} (u = 0.25)",
    "math.log(0.0 * u)": f"{NO_VALUE} (u = 0.25)",
    "math.acos(4.1 + u)": f"{NO_VALUE} (u = 0.25)",
    "math.sin(u * math.inf)": f"{NO_VALUE} (u = 0.25)",
    "int(u * math.nan)": f"{NO_VALUE} (u = 0.25)",
    "math.exp(1e4 * u)": "a number grew too large (u = 0.25)",
    "(1e200 * u) ** 2": "a number grew too large (u = 0.25)",
    "int(u / 1e-320)": "a number grew too large (u = 0.25)",
    "math.cosh(1e5 * u)": "a number grew too large (u = 0.25)",
    "np.linalg.inv(np.zeros((2, 2)))[0, 0]": "a matrix has no inverse or factors (u = 0.25)",
    "np.linalg.cholesky(-np.eye(2))[0, 0]": "a matrix has no inverse or factors (u = 0.25)",
    "strict(np.float64(u))": "a calculation gave no finite number (u = 0.25)",
    "u * math.inf": "the output became inf",
    "np.float64(u) / 0.0": "the output became inf",
}
PREPARED = """
import math

import numpy as np


def strict(u):
    with np.errstate(all="raise"):
        return u / np.float64(0.0)
"""
DIVERGING = """\
quadvis: 1
name: diverging
rates: {fast: 10 Hz}
solver: {method: ode1, step: 100 ms}
stop_time: 1000 s
blocks:
  stiff: {block: own.stiff, rate: continuous, in: {u: root.y}}
  root: {block: own.root, rate: continuous, in: {u: stiff.y}}
"""
STIFF = '''\
"""A decay that is too fast for its solver."""

from quadvis.block import Block, In, Out, State


class Stiff(Block):
    """Decays."""

    u = In(unit="a")
    x = State(init=1.0, continuous=True)
    y = Out(unit="a")

    def output(self):
        """Return the state."""
        return self.x

    def deriv(self, u):
        """Decay."""
        return FALL
'''


@pytest.mark.parametrize(("action", "reason"), FAULTS_OF_ARITHMETIC.items(), ids=FAULTS_OF_ARITHMETIC)
def test_a_calculation_without_a_result_is_told_in_plain_words(
    action: str, reason: str, tmp_path: Path
) -> None:
    (tmp_path / "blocks" / "own").mkdir(parents=True)
    text = ROOT.replace("ACTION", f"{action} if u > 0.2 else u").replace("import math\n", PREPARED)
    (tmp_path / "blocks" / "own" / "root.py").write_text(text)
    with pytest.raises(RunError) as caught:
        load_text(FAILING, tmp_path).run()
    told = str(caught.value)
    place = re.search(r" in \S+/blocks/own/root\.py:(\d+)", told)
    assert (place is None) == reason.startswith("the output became")
    if place is not None:
        assert text.splitlines()[int(place[1]) - 1].strip().startswith("return")
        told = told.replace(place[0], "")
    assert told == f"block 'root', port 'y', t = 1.5 s: {reason}"


@pytest.mark.parametrize(
    ("fall", "action", "block", "reason"),
    [
        ("-50.0 * self.x**3", "u", "stiff", "a number grew too large"),
        ("-50.0 * self.x", "math.sqrt(u)", "root", NO_VALUE),
        ("-50.0 * self.x", "math.exp(u)", "root", "a number grew too large"),
        ("-50.0 * self.x", "1.0 / max(0.0, u)", "root", "a division by zero"),
        ("-50.0 * self.x", "u * 1e290", "root", "the output became"),
        ("-50.0 * self.x", "0.0", "stiff", "state 'x' left the finite numbers"),
    ],
)
def test_where_the_solver_has_its_share_a_smaller_step_is_the_remedy(
    fall: str, action: str, block: str, reason: str, tmp_path: Path
) -> None:
    (tmp_path / "blocks" / "own").mkdir(parents=True)
    (tmp_path / "blocks" / "own" / "root.py").write_text(ROOT.replace("ACTION", action).replace("^0.5", ""))
    (tmp_path / "blocks" / "own" / "stiff.py").write_text(STIFF.replace("FALL", fall))
    with pytest.raises(RunError) as caught:
        load_text(DIVERGING, tmp_path).run()
    assert str(caught.value).startswith(f"block '{block}'")
    assert reason in str(caught.value)
    cause = (
        r", as the solver's step of 100 ms is too large for 'stiff', whose fastest pole is at -\d+ 1/s \(ode1"
    )
    assert re.search(cause, str(caught.value))
    assert str(caught.value).endswith("; make the step smaller, or use 'method: Radau'")


@pytest.mark.parametrize(
    ("action", "message"),
    [
        ("math.nan if u > 0.2 else u", r"^block 'root', port 'y', t = 1.5 s: the output became nan$"),
        (
            "1.0 / 0.0 if u > 0.2 else u",
            r"^block 'root', port 'y', t = 1.5 s: a division by zero in .*root.py:16 \(u = 0.25\)$",
        ),
    ],
)
def test_a_block_that_fails_stops_the_run_and_leaves_a_readable_log(
    action: str, message: str, tmp_path: Path
) -> None:
    (tmp_path / "blocks" / "own").mkdir(parents=True)
    (tmp_path / "blocks" / "own" / "root.py").write_text(ROOT.replace("ACTION", action))
    diagram = load_text(FAILING, tmp_path)
    with pytest.raises(RunError, match=message):
        diagram.run(log=tmp_path / "run.mcap")
    log = read_log(tmp_path / "run.mcap")
    assert len(log["ramp.y"]) == 15
    assert "block 'root'" in log.summary["stopped"]


def test_an_interrupted_run_leaves_a_readable_log(tmp_path: Path) -> None:
    def interrupt(time: float, wall: float) -> None:
        if time > 1.0:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        ramp().run(log=tmp_path / "run.mcap", progress=interrupt)
    log = read_log(tmp_path / "run.mcap")
    assert log.complete
    assert len(log["ramp.y"]) > 10
    assert log.summary == {"stopped": "KeyboardInterrupt"}
