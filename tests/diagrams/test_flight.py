"""The hover on three computers: simulated with its links, and on the bench, a process for each computer."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from multiprocessing import active_children
from pathlib import Path

import numpy as np
import pytest

import quadvis
from quadvis.cli import main
from quadvis.diff.difference import diff
from quadvis.errors import QuadvisError
from quadvis.output.log_reader import read_log
from quadvis_blocks.hardware.imu_in import message_of
from quadvis_blocks.supervision.failsafe import COASTING, LANDING, LEVELLED
from tests.diagrams.golden import DIAGRAMS, on_devices
from tests.diagrams.stand_in_world import World
from tests.processes import children, gone
from tests.punctual import LATE, MISSED, punctual

FLIGHT = DIAGRAMS / "flight.yaml"
CALM = quadvis.RealTime(priority=0, poll="0 s")
BENCH = """
quadvis: 1
name: bench
base: {{file: {}, variant: hil}}
overload: {{action: warn}}
"""
AIRBORNE = """
quadvis: 1
name: airborne
base: {{file: {}, variant: {}}}
overload: {{max: 1000, consecutive: 100, action: warn}}
params: {{circles_out: "", circles_in: ""}}
"""
FLOWN, PATIENCE = 400, 120.0  # ticks of 10 ms; s
SLOTS = ("outputs", "receiver")
COMPUTERS = {"world", "vision_pc", "target"}


def test_devices_need_real_time_and_no_other_variant_does() -> None:
    assert on_devices() == (
        *(("flight.yaml", variant) for variant in ("hil", "flight", "text_imu")),
        ("mavlink.yaml", "flight"),
        *(("takeover.yaml", variant) for variant in ("crsf", "sbus", "joystick")),
    )
    for name, variant in on_devices():
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
        "  sim, hil, flight, text_imu differ in craft, eyes, outputs, receiver, computers, links, rates, "
        "solver; 47 blocks are the same to the bit\n" in capsys.readouterr().out
    )


@pytest.mark.slow
def test_a_bad_line_of_circles_fails_the_flight(tmp_path: Path) -> None:
    bad = tmp_path / "bad.yaml"
    line = "links: {circle_line: {from: vision_pc, to: target, via: serial, baud: 115200, flips: 0.001}}"
    bad.write_text(f"quadvis: 1\nname: bad\nbase: {FLIGHT}\n{line}\n")
    for path, met in ((FLIGHT, True), (bad, False)):
        verdicts = quadvis.load(path, stop_time="4 s").run().outcome.verdicts
        counters = [each for each in verdicts if "circle_line" in str(each)]
        assert len(counters) == 2 and all(each.met for each in counters) == met


def test_in_flight_nothing_is_left_of_the_world() -> None:
    flight = quadvis.load(FLIGHT, variant="flight")
    assert set(flight.graph.computers) == COMPUTERS - {"world"}
    assert [link.name for link in flight.links] == ["circle_line"]
    assert not any("craft/" in node.path or "receiver" in node.path for node in flight.graph.nodes)


def test_the_inertial_unit_of_the_flight_speaks_as_that_of_the_bench_does() -> None:
    bench = {link.name: link for link in quadvis.load(FLIGHT, variant="hil").links}["imu_line"]
    unit = quadvis.load(FLIGHT, variant="flight").graph["craft"].block
    assert message_of(unit.sender).layout == bench.message.layout
    assert unit.settings.baud == bench.baud


@pytest.mark.slow
def test_each_port_that_is_missing_is_reported_in_a_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", str(FLIGHT), "--variant", "flight", "--real-time", "--log", ""]) == 1
    lines = [line for line in capsys.readouterr().err.splitlines() if " is missing; " in line]
    assert [line.partition(":")[0] for line in lines] == [
        *("block 'craft'", "block 'eyes'", "block 'outputs'", "link 'circle_line'", "link 'circle_line'")
    ]


@pytest.mark.slow
def test_without_the_computer_that_sees_the_failsafe_lands_the_craft(tmp_path: Path) -> None:
    """The outputs are not made safe: the craft would fall from 1.5 m in 0.6 s."""
    log, bench = tmp_path / "hil.mcap", tmp_path / "bench.yaml"
    bench.write_text(BENCH.format(FLIGHT))
    killed: list[float] = []

    def kill(reached: float, _: float) -> None:
        if reached >= 4.0 and not killed:
            killed.append(reached)
            (eyes,) = [each for each in active_children() if each.name == "application vision_pc"]
            eyes.kill()

    said: list[str] = []
    result = quadvis.load(bench, stop_time="24 s").run(
        log=log, real_time=CALM, progress=kill, announce=said.append
    )
    words = "the application of 'vision_pc' was killed by SIGKILL"
    assert any(words in each and each.endswith("fly on without 'vision_pc'") for each in said), said
    assert result.flight is not None and not result.passed
    assert [words in each for each in result.flight.problems] == [True]
    assert not all(verdict.met for verdict in result.outcome.verdicts)
    held = read_log(log)
    mode, times = held["supervision/failsafe.mode"], held.times("supervision/failsafe.mode")
    mode, times = mode[times > killed[0]], times[times > killed[0]]
    order = mode[np.flatnonzero(np.diff(mode, prepend=-1))]
    assert order[-3:].tolist() == [COASTING, LEVELLED, LANDING]
    thrust, times = held["receiver/thrust.held"], held.times("receiver/thrust.held")
    flown = thrust[(times > killed[0] + 0.1) & (times < killed[0] + 4.0)]
    assert flown.mean() > 0.4  # N; hover is 1.2, and the safe value 0.2
    if punctual(held):
        assert flown.mean() > 0.8
        assert held["craft/body.position"][-1, 2] < 0.3


@pytest.mark.slow
def test_the_bench_flies_as_the_desk_does_and_is_replayed_to_the_bit(tmp_path: Path) -> None:
    """On a machine that others use ticks are lost, so the flight is judged coarsely, or not at all."""
    log, bench = tmp_path / "hil.mcap", tmp_path / "bench.yaml"
    bench.write_text(BENCH.format(FLIGHT))
    result = quadvis.load(bench, stop_time="8 s").run(log=log, real_time=CALM)
    assert result.flight is not None
    assert {share.computer for share in result.flight.shares} == COMPUTERS
    held = read_log(log)
    if punctual(held):
        assert np.abs(held["craft/body.position"] - [0, 0, 1.5]).max() < 1.0
        assert held["detector.found"].mean() > 0.8
    for counter in ("receiver/receiver.refused", "circle_line.refused", "imu_line.refused"):
        assert held[counter].max() <= 1  # the first frame may have begun before its reader listened
    assert json.loads(held.summary["real time"])["lost_rows"] == 0
    again = quadvis.replay(log)
    assert again.same and again.rows > 5_000


@pytest.mark.slow
@pytest.mark.parametrize("variant", ["flight", "text_imu"])
def test_the_flight_flies_with_stand_ins_for_its_devices(tmp_path: Path, variant: str) -> None:
    """The camera is one of the network, radio and inertial unit are ptys, and a simulated world is behind.

    It flies until it has flown for a while, however late everybody is, and is ended by Ctrl-C. Whether it
    holds its place is judged if the machine has kept the times.
    """
    log, airborne = tmp_path / "flight.mcap", tmp_path / "airborne.yaml"
    airborne.write_text(AIRBORNE.format(FLIGHT, variant))
    with World(tmp_path, text=variant == "text_imu") as world:
        ports = {"camera": world.camera, "imu": world.imu, "rc": world.rc, "eyes.exposure": "0 s"}
        settings = [text for name, value in ports.items() for text in ("--set", f"{name}={value}")]
        command = ["run", str(airborne), "--real-time", "--priority", "0", "--log", str(log), *settings]
        flight = subprocess.Popen([sys.executable, "-m", "quadvis", *command], stderr=subprocess.DEVNULL)
        end = time.monotonic() + PATIENCE
        while len(world.positions) < FLOWN and flight.poll() is None and time.monotonic() < end:
            time.sleep(0.05)
        flown = np.array(world.positions)
        members = children(flight)
        flight.send_signal(signal.SIGINT)
        assert flight.wait(PATIENCE) == 130
    assert len(flown) >= FLOWN and len(members) >= 4
    assert all(gone(member) for member in members)
    held = read_log(log)
    age = held.times("craft.age")
    missed = 1 - len(age) / (age[-1] / 20e-3)  # one row in two is logged
    if world.latest < LATE and missed < MISSED:
        assert np.abs(flown - [0, 0, 1.5]).max() < 1.0
        assert held["detector.lost"].sum() <= 2
    fresh = held["eyes.fresh"]
    assert fresh.sum() >= 20 and (np.diff(held["eyes.stamp"][fresh]) > 0).all()
    assert held["detector.fresh"].sum() >= 20 and held["detector.found"].sum() >= 10
    for counter in ("eyes.refused", "craft.refused", "circle_line.refused"):
        assert held[counter].max() <= 1
    assert held["craft.age"].size > FLOWN / 3 and world.commands > 100
    assert quadvis.replay(log).same
