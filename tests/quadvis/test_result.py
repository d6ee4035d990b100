"""The result of a run in Python: signals by every name of a diagram, from memory or from the log."""

from __future__ import annotations

import gc
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from quadvis.api import Diagram, load, load_text
from quadvis.errors import QuadvisError
from quadvis.output.log_reader import read_log
from tests.stages import mostly_slow

INNER = """\
quadvis: 1
name: inner
ports: {in: [u], out: {position: stack.y, first: "stack.y[0]", twice: gain.y, raw: in.u}}
blocks:
  gain: {block: signal.gain, with: {factor: 2}, in: {u: in.u}}
  stack: {block: signal.concatenate, in: {u: [in.u, gain.y, in.u]}}
"""
OUTER = """\
quadvis: 1
name: outer
ports: {in: [u], out: {speed: inner.position, one: inner.first}}
blocks:
  inner: {part: inner.yaml, in: {u: in.u}}
"""
MAIN = """\
quadvis: 1
name: parts
rates: {fast: 10 Hz}
stop_time: 1 s
blocks:
  ramp: {block: sources.ramp, rate: fast, with: {slope: 1 m/s}}
  x: {part: outer.yaml, rate: fast, in: {u: ramp.y}}
  all: {block: signal.concatenate, rate: fast, in: {u: [ramp.y, ramp.y, x.one]}}
"""
NAMES = ("ramp.y", "x/inner/gain.y", "x/inner/stack.y", "all.y")


@pytest.fixture
def diagram(tmp_path: Path) -> Diagram:
    for name, text in (("inner", INNER), ("outer", OUTER), ("main", MAIN)):
        (tmp_path / f"{name}.yaml").write_text(text)
    return load(tmp_path / "main.yaml")


@pytest.fixture(params=["memory", "kept", "log", "file"])
def signals(request: pytest.FixtureRequest, diagram: Diagram, tmp_path: Path) -> Any:
    """Return the signals of one run: in memory, in memory beside a log, read back by the result, as a log."""
    log = tmp_path / "run.mcap"
    if request.param == "memory":
        return diagram.run()
    if request.param == "kept":
        return diagram.run(log=log, keep=["*"])
    result = diagram.run(log=log)
    return result if request.param == "log" else read_log(log)


@pytest.mark.parametrize(
    ("name", "same"),
    [
        ("x/inner/gain.y", lambda s: s["x/inner/gain.y"]),
        ("all.y[2]", lambda s: s["all.y"][:, 2]),
        ("all.y[0:2]", lambda s: s["all.y"][:, 0:2]),
        ("all.y[1:]", lambda s: s["all.y"][:, 1:]),
        ("all.y[:]", lambda s: s["all.y"]),
        ("x.speed", lambda s: s["x/inner/stack.y"]),
        ("x.speed[1]", lambda s: s["x/inner/stack.y"][:, 1]),
        ("x.speed[0:2]", lambda s: s["x/inner/stack.y"][:, 0:2]),
        ("x.one", lambda s: s["x/inner/stack.y"][:, 0]),
        ("x/inner.position", lambda s: s["x/inner/stack.y"]),
        ("x/inner.first", lambda s: s["x/inner/stack.y"][:, 0]),
        ("x/inner.twice", lambda s: s["x/inner/gain.y"]),
        ("x/inner.raw", lambda s: s["ramp.y"]),
    ],
)
def test_signals_have_the_names_that_they_have_in_a_diagram(signals: Any, name: str, same: Any) -> None:
    np.testing.assert_array_equal(signals[name], same(signals))
    assert len(signals[name]) == len(signals.times(name)) == 11
    assert name in signals


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("ramp.x", r"there is no signal 'ramp.x'; did you mean 'ramp.y'\?"),
        ("x.sped", r"there is no signal 'x.sped'; did you mean 'x.speed'\?"),
        ("x.speed[3]", r"there is no 'x.speed\[3\]': 'x/inner/stack.y' has the shape \[3\], count from 0"),
        ("all.y[3]", r"there is no 'all.y\[3\]': 'all.y' has the shape \[3\], count from 0"),
        ("all.y[0:4]", r"there is no 'all.y\[0:4\]': 'all.y' has the shape \[3\], count from 0"),
        ("all.y[0,0]", r"there is no 'all.y\[0,0\]': 'all.y' has the shape \[3\], count from 0"),
        ("ramp.y[0]", r"there is no 'ramp.y\[0\]': 'ramp.y' has one element only"),
        ("x.one[0]", r"'x.one' is 'x/inner/stack.y\[0\]' already, it cannot take a second index"),
        ("all.y[-1]", r"there is no signal 'all.y\[-1\]'; did you mean 'all.y'\?"),
        ("nothing", "there is no signal 'nothing'"),
        ("", "there is no signal ''"),
    ],
)
def test_what_is_no_signal_is_one_sentence(signals: Any, name: str, sentence: str) -> None:
    assert name not in signals
    for find in (signals.__getitem__, signals.times):
        with pytest.raises(QuadvisError, match=sentence) as found:
            find(name)
        assert "\n" not in str(found.value)


def test_signals_are_listed_counted_and_told_shortly(signals: Any) -> None:
    assert tuple(signals) == NAMES
    assert len(signals) == len(NAMES)
    assert 3 not in signals
    assert len(repr(signals)) < 80


def test_a_port_of_a_part_that_is_not_recorded_says_what_it_is(diagram: Diagram, tmp_path: Path) -> None:
    main = tmp_path / "main.yaml"
    main.write_text(f"{MAIN}log: {{signals: [ramp, all]}}\n")
    result = load(main).run()
    with pytest.raises(QuadvisError, match=r"^'x.speed' is 'x/inner/stack.y', which was not recorded$"):
        result["x.speed"]


@pytest.mark.parametrize(
    ("keep", "kept"),
    [
        ([], ()),
        (["*"], NAMES),
        (["ramp.y"], NAMES[:1]),
        (["ramp"], NAMES[:1]),
        (["x/*"], NAMES[1:3]),
        (["x.speed", "ramp.y"], (NAMES[0], NAMES[2])),
        (["all.y[1]"], NAMES[3:]),
    ],
)
def test_only_what_is_asked_for_is_kept_where_there_is_no_log(
    diagram: Diagram, keep: list[str], kept: tuple[str, ...]
) -> None:
    whole, result = diagram.run(), diagram.run(keep=keep)
    for name in NAMES:
        if name in kept:
            np.testing.assert_array_equal(result[name], whole[name])
        else:
            with pytest.raises(QuadvisError, match=r"were not kept; name it, as in keep=\['"):
                result[name]


def test_a_signal_to_keep_that_is_not_there_is_refused_before_the_run(diagram: Diagram) -> None:
    with pytest.raises(QuadvisError, match=r"there is no signal 'ramp.z'; did you mean 'ramp.y'\?"):
        diagram.run(keep=["ramp.z"])


def test_a_result_does_not_take_the_log_of_another_run_for_its_own(diagram: Diagram, tmp_path: Path) -> None:
    first = diagram.run(log=tmp_path / "run.mcap")
    second = diagram.run(log=tmp_path / "run.mcap")
    assert len(second["ramp.y"]) == 11
    with pytest.raises(QuadvisError, match=r"the log '.*run.mcap' of this run is not what it was; keep the"):
        first["ramp.y"]


def test_arrays_stay_what_they_were_and_cannot_be_written(signals: Any) -> None:
    with pytest.raises(ValueError, match="read-only"):
        signals["all.y"][0, 0] = 1.0


LONG = """\
quadvis: 1
name: long
rates: {fast: 1 kHz}
stop_time: STOP s
blocks:
  wave: {block: sources.sine, rate: fast, with: {frequency: 1 Hz, amplitude: 2 m}}
  all: {block: signal.concatenate, rate: fast, in: {u: [wave.y, wave.y, wave.y]}}
"""
JUDGED = """\
expect:
  - {signal: wave.y, rms: 3 m}
  - {signal: wave.y, within: 3 m}
  - {signal: "all.y[0:2]", after: 1 s, rms: 3 m}
summary:
  all: {signal: all.y, show: [rms, mean, final]}
"""
MEASURE = """
import sys
from quadvis.api import load_text
text, log, seconds = sys.argv[1], sys.argv[2] or None, sys.argv[3]

def resident():
    with open("/proc/self/status") as file:
        return next(int(line.split()[1]) for line in file if line.startswith("VmRSS:")) / 1024

load_text(text.replace("STOP", "2")).run(log=log, keep=())
before = most = resident()

def watch(time, wall):
    global most
    most = max(most, resident())

result = load_text(text.replace("STOP", seconds)).run(log=log, keep=(), progress=watch)
print(max(most, resident()) - before)
assert result.passed
"""


def growth(text: str, log: str, seconds: int) -> float:
    """Return by how many MB a fresh process grows at most while it runs."""
    arguments = [sys.executable, "-c", MEASURE, text, log, str(seconds)]
    return float(subprocess.run(arguments, capture_output=True, text=True, check=True).stdout)


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="this system has no /proc")
@pytest.mark.parametrize(
    ("logged", "judged"), mostly_slow([(True, True), (False, True), (True, False), (False, False)])
)
def test_memory_does_not_grow_with_a_run(judged: bool, logged: bool, tmp_path: Path) -> None:
    log = str(tmp_path / "run.mcap") if logged else ""
    # 40,000 ticks; as lists of rows they took 18 MB.
    assert growth(LONG + JUDGED * judged, log, 40) < 4


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="this system has no /proc")
def test_a_million_ticks_take_less_than_sixty_megabytes(tmp_path: Path) -> None:
    assert growth(LONG + JUDGED, str(tmp_path / "run.mcap"), 1000) < 60


def test_rows_in_memory_are_packed(tmp_path: Path) -> None:
    import tracemalloc

    diagram = load_text(LONG.replace("STOP", "20"))
    gc.collect()
    tracemalloc.start()
    try:
        result = diagram.run()
        kept, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    # Each of 20,001 ticks has two rows, of 1 and 3 numbers, and two stamps.
    assert len(result["all.y"]) == 20_001
    assert kept < 1.3 * 20_001 * 8 * (1 + 3 + 2) + 1e6


def test_a_diagram_is_told_shortly_and_shown_as_its_picture(diagram: Diagram) -> None:
    assert re.fullmatch(r"<Diagram [^:]+: \d+ blocks>", repr(diagram))
    assert diagram._repr_svg_() == diagram.draw(depth=1)
