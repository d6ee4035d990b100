"""The hover on three computers: simulated with its links, and on the bench, a process for each computer."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import quadvis
from quadvis.cli import main
from quadvis.diff.difference import diff
from quadvis.errors import QuadvisError
from quadvis.output.log_reader import read_log
from tests.diagrams.golden import DIAGRAMS, ON_DEVICES

FLIGHT = DIAGRAMS / "flight.yaml"
CALM = quadvis.RealTime(priority=0, poll="0 s")
BENCH = """
quadvis: 1
name: bench
base: {{file: {}, variant: hil}}
overload: {{action: warn}}
"""
SLOTS = ("outputs", "receiver")
COMPUTERS = {"world", "vision_pc", "target"}


def test_devices_need_real_time_and_no_other_variant_does() -> None:
    for name, variant in ON_DEVICES:
        with pytest.raises(QuadvisError, match="only a real-time run may do so"):
            quadvis.load(DIAGRAMS / name, variant=variant).run()


def test_desk_and_bench_differ_in_slots_and_links_alone() -> None:
    found = diff(FLIGHT, variants=("sim", "hil")).diagram
    others = [block for block in found.blocks if not block.path.startswith(SLOTS)]
    assert [block.path for block in others] == ["craft/radio"]
    (change,) = others[0].changes  # the craft reads the receiver, which is a part on the bench
    assert (change.old, change.new) == ("receiver.held (hold)", "receiver/thrust.held (hold)")
    assert list(found.sections) == ["log"]


def test_check_says_what_desk_and_bench_share(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(FLIGHT)]) == 0
    assert (
        "  sim, hil differ in outputs, receiver; 39 blocks are the same to the bit\n"
        in capsys.readouterr().out
    )


def test_a_bad_line_of_circles_fails_the_flight(tmp_path: Path) -> None:
    bad = tmp_path / "bad.yaml"
    line = "links: {circle_line: {from: vision_pc, to: target, via: serial, baud: 115200, flips: 0.001}}"
    bad.write_text(f"quadvis: 1\nname: bad\nbase: {FLIGHT}\n{line}\n")
    for path, met in ((FLIGHT, True), (bad, False)):
        verdicts = quadvis.load(path, stop_time="4 s").run().outcome.verdicts
        counters = [each for each in verdicts if "circle_line" in str(each)]
        assert len(counters) == 2 and all(each.met for each in counters) == met


@pytest.mark.slow
def test_the_bench_flies_as_the_desk_does_and_is_replayed_to_the_bit(tmp_path: Path) -> None:
    """On a machine that others use ticks are lost, so the flight is judged coarsely."""
    log, bench = tmp_path / "hil.mcap", tmp_path / "bench.yaml"
    bench.write_text(BENCH.format(FLIGHT))
    result = quadvis.load(bench, stop_time="8 s").run(log=log, real_time=CALM)
    assert result.flight is not None
    assert {share.computer for share in result.flight.shares} == COMPUTERS
    held = read_log(log)
    assert np.abs(held["craft/body.position"] - [0, 0, 1.5]).max() < 1.0
    for counter in ("receiver/receiver.refused", "circle_line.refused", "imu_line.refused"):
        assert held[counter].max() == 0
    assert held["detector.found"].mean() > 0.8
    assert json.loads(held.summary["real time"])["lost_rows"] == 0
    again = quadvis.replay(log)
    assert again.same and again.rows > 10_000
