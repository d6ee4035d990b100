"""Windows of expectations and summary in exact time, in runs of every length, and the same from a log."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import pytest

from quadvis.api import Diagram, load, load_text
from quadvis.diagram.sections.figures import read_figures
from quadvis.output.log_reader import read_log
from quadvis.run.report import summary_lines
from quadvis.run.verdict import Outcome

ONES = """\
quadvis: 1
name: ones
rates: {{a: {rate}}}
stop_time: {stop}
log: {{every: {{a: {every}}}}}
blocks:
  one: {{block: sources.constant, rate: a, with: {{value: 1}}}}
"""


def ones(rate: str = "10 Hz", stop: str = "1 s", every: int = 1, more: str = "") -> Diagram:
    """Return a diagram whose signal is 1 at every sample."""
    return load_text(ONES.format(rate=rate, stop=stop, every=every) + more)


def outcomes(diagram: Diagram, folder: Path) -> list[Outcome]:
    """Judge a run while it goes on, from memory, and from its log, alone and with the diagram of the log."""
    log = folder / "run.mcap"
    result = diagram.run(log=log, keep=["*"])
    read = read_log(log)
    found = [result.outcome, diagram.judge(result.signals), diagram.judge(read)]
    return [*found, load_text(read.diagram).judge(read)]


@pytest.mark.parametrize(
    ("rate", "window", "count"),
    [
        ("30 Hz", "after: 1/3 s", 21),
        ("30 Hz", "before: 1/3 s", 11),
        ("30 Hz", "after: 1/3 s, before: 1/3 s", 1),
        ("30 Hz", "after: 0.33333333334 s", 20),  # in the same nanosecond as a tick, and behind it
        ("30 Hz", "before: 0.33333333334 s", 11),
        ("30 Hz", "before: 0.33333333333 s", 10),
        ("30 Hz", "after: 0.33333333333 s", 21),
        ("30 Hz", "after: 0.34 s", 20),
        ("3 Hz", "after: 2/3 s", 2),
        ("3 Hz", "after: 333.333333333333 ms", 3),
        ("7 Hz", "after: 3/7 s, before: 5/7 s", 3),
        ("10 Hz", "after: 0.3 s, before: 0.7 s", 5),
        ("10 Hz", "before: 0 s", 1),
        ("10 Hz", "after: 1 s", 1),
        ("1/30 s", "after: 29/30 s", 2),
        ("44100 Hz", "before: 1/44100 s", 2),
        ("1 kHz", "after: 0.1 s, before: 0.3 s", 201),
        ("{rate: 10 Hz, offset: 70 ms}", "after: 0.17 s", 9),
        ("{rate: 3 Hz, offset: 1/9 s}", "after: 4/9 s, before: 7/9 s", 2),
        ("30 Hz", "", 31),
    ],
)
def test_a_window_includes_the_ticks_at_its_ends(rate: str, window: str, count: int, tmp_path: Path) -> None:
    start = f"signal: one.y{', ' if window else ''}{window}"
    more = f"expect: [{{{start}, count: {count}}}, {{{start}, at_least: {count}}}]\n"
    more += f"summary: {{n: {{{start}, show: [count]}}}}"
    for outcome in outcomes(ones(rate, more=more), tmp_path):
        assert outcome.summary["n"]["count"] == count
        assert outcome.passed


@pytest.mark.parametrize(
    ("rate", "every", "window", "count"),
    [("30 Hz", 7, "after: 7/30 s", 4), ("30 Hz", 7, "after: 8/30 s", 3), ("10 Hz", 3, "before: 0.6 s", 3)],
)
def test_a_window_looks_at_the_rows_that_are_logged(
    rate: str, every: int, window: str, count: int, tmp_path: Path
) -> None:
    more = f"expect: [{{signal: one.y, {window}, at_least: {count}}}]\n"
    more += f"summary: {{n: {{signal: one.y, {window}, show: [count]}}}}"
    for outcome in outcomes(ones(rate, every=every, more=more), tmp_path):
        assert outcome.summary["n"]["count"] == count
        assert outcome.passed


KINDS = ("within: 1", "rms: 1", "below: 2", "above: 0", "count: 1000", "at_least: 0")


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("rate", "stop", "window", "lack"),
    [
        ("10 Hz", "3 s", "after: 5 s", "the run ends at 3 s, the window begins at 5 s"),
        ("10 Hz", "6 s", "before: 10 s", "the run ends at 6 s, the window at 10 s"),
        ("10 Hz", "6 s", "after: 5 s, before: 10 s", "the run ends at 6 s, the window at 10 s"),
        ("10 Hz", "6 s", "after: 7 s, before: 10 s", "the run ends at 6 s, the window begins at 7 s"),
        ("30 Hz", "1 s", "before: 1.0000000001 s", "the run ends at 1 s, the window at 1.0000000001 s"),
        ("30 Hz", "1/3 s", "after: 0.34 s", "the run ends at 1/3 s, the window begins at 0.34 s"),
        ("10 Hz", "1 s", "after: 0.31 s, before: 0.39 s", "no sample lies in the window"),
        ("10 Hz", "1 s", "after: 0.5 s, before: 0.4 s", "no sample lies in the window"),
        ("{rate: 1 Hz, offset: 0.5 s}", "0.4 s", "after: 0 s", "no sample lies in the window"),
        ("{rate: 1 Hz, offset: 0.5 s}", "1 s", "before: 0.4 s", "no sample lies in the window"),
        ("10 s", "9 s", "after: 1 s", "no sample lies in the window"),
    ],
)
def test_a_run_that_has_not_all_of_a_window_does_not_pass(
    rate: str, stop: str, window: str, lack: str, kind: str, tmp_path: Path
) -> None:
    diagram = ones(rate, stop, more=f"expect: [{{signal: one.y, {window}, {kind}}}]")
    for outcome in outcomes(diagram, tmp_path):
        (verdict,) = outcome.verdicts
        assert not verdict.met
        assert verdict.lack == lack
        assert str(verdict).endswith(lack)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("stop", "window"), [("6 s", "before: 10 s"), ("3 s", "after: 5 s")])
def test_a_stop_time_from_outside_that_cuts_a_window_does_not_pass(
    stop: str, window: str, kind: str, tmp_path: Path
) -> None:
    path = tmp_path / "ones.yaml"
    more = f"expect: [{{signal: one.y, {window}, {kind}}}]"
    path.write_text(ONES.format(rate="10 Hz", stop="20 s", every=1) + more)
    assert load(path).run().passed
    assert not load(path, stop_time=stop).run().passed


def test_a_window_to_the_end_of_a_shortened_run_says_how_far_it_was_judged(tmp_path: Path) -> None:
    path = tmp_path / "ones.yaml"
    more = "expect: [{signal: one.y, after: 5 s, within: 1}]\nsummary: {n: {signal: one.y, show: [count]}}"
    path.write_text(ONES.format(rate="10 Hz", stop="20 s", every=1) + more)
    whole, cut, long = (load(path, stop_time=stop).run() for stop in (None, "6 s", "30 s"))
    assert [result.passed for result in (whole, cut, long)] == [True, True, True]
    assert str(whole.outcome.verdicts[0]) == "met: one.y within 1 after 5 s: 1"
    assert str(cut.outcome.verdicts[0]) == "met: one.y within 1 after 5 s: 1 up to 6 s"
    assert str(long.outcome.verdicts[0]) == "met: one.y within 1 after 5 s: 1"
    assert summary_lines(cut)[1:3] == [
        "  n  count 61  up to 6 s",
        "  met  one.y within 1 after 5 s  1 up to 6 s",
    ]


@pytest.mark.parametrize("end", ["3 s", "9.9 s", "10 s"])
def test_a_log_of_a_run_that_stopped_early_does_not_pass(end: str, tmp_path: Path) -> None:
    diagram = ones(stop="10 s", more="expect: [{signal: one.y, within: 1}]")
    stop = float(end.split()[0])

    def interrupt(time: float, wall: float) -> None:
        if time > stop:
            raise KeyboardInterrupt

    with pytest.MonkeyPatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr("quadvis.run.loops.SLICE", 0.0)  # after every tick
        diagram.run(log=tmp_path / "run.mcap", progress=interrupt)
    log = read_log(tmp_path / "run.mcap")
    (verdict,) = diagram.judge(log).verdicts
    rows = len(log["one.y"])
    assert rows == min(int(stop * 10) + 1, 101)
    assert verdict.met is (rows == 101)
    assert verdict.lack == ("" if rows == 101 else f"{rows} of its 101 samples are there")


def test_a_figure_includes_the_rows_at_its_ends(tmp_path: Path) -> None:
    result = ones("30 Hz").run()
    text = "figures: [{title: a, from: 1/3 s, to: 2/3 s, signals: one.y}]"
    (figure,) = read_figures(text, "figures")
    times = result.times("one.y")
    part = times[(times >= figure.start) & (times <= figure.stop)]
    assert part.tolist() == [float(Fraction(k, 30) * 10**9 // 1) / 1e9 for k in range(10, 21)]
