"""One diagram on several targets: at one instant, at one pace, and with the verdicts of one run."""

import os
import shutil
import subprocess
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import cast

import numpy as np
import pytest

import quadvis
from quadvis.errors import QuadvisError
from quadvis.host.several import Several, read_places
from quadvis.host.target import Target
from quadvis.wire.hosts import allow
from quadvis.wire.keys import new_key
from tests.processes import linux, wait_for
from tests.punctual import LATE, MISSED
from tests.quadvis.host.targets import running_target

pytestmark = linux

LOOP = """\
quadvis: 1
name: two
rates: {fast: 100 Hz}
stop_time: 3 s
overload: {max: 1000000, consecutive: 1000000, action: warn}
computers: {a: {}, b: {}}
links:
  there: {from: a, to: b, via: udp, address: "ADDRESS_B:5911"}
  back: {from: b, to: a, via: udp, address: "ADDRESS_A:5912"}
blocks:
  wave: {block: sources.sine, rate: fast, at: a, with: {amplitude: 1 m, frequency: 1 Hz}}
  law:
    block: signal.gain
    rate: fast
    at: b
    in: {u: {from: wave.y, over: there, initial: 0 m}}
    with: {factor: 3}
  echo:
    block: signal.gain
    rate: fast
    at: a
    in: {u: {from: law.y, over: back, initial: 0 m}}
    with: {factor: 1}
expect:
  - {signal: echo.y, within: 4 m}
  - {signal: there.age, after: 1 s, within: 500 ms}
"""


def written(folder: Path, a: str = "127.0.0.1", b: str = "127.0.0.1") -> Path:
    path = folder / "two.yaml"
    path.write_text(LOOP.replace("ADDRESS_A", a).replace("ADDRESS_B", b))
    return path


def check_flight(several: Several, folder: Path) -> None:
    """Fly, and find that the ages of messages are as long as the ticks say: both have one time.

    A machine that is late loses ticks, and messages wait; then neither is judged.
    """
    several.load()
    several.start()
    several.wait()
    logs = several.logs(folder)
    outcome = several.judge(logs)
    found = {name: quadvis.read_log(path) for name, path in logs.items()}
    assert len(outcome.verdicts) == 2
    late = max(log[f"_times/{name}/fast.lateness"].max() for name, log in found.items())
    unmet = [str(verdict) for verdict in outcome.verdicts if not verdict.met]
    assert all("samples are there" in each for each in unmet) or late > LATE, unmet
    ages = found["b"]["there.age"][100:]
    assert (ages > 0).all()  # nothing has come from the future
    assert np.median(ages) <= 0.05 or late > LATE
    law, wave = found["b"]["law.y"][100:], found["a"]
    sent = np.interp(found["b"].times("law.y")[100:] - ages, wave.times("wave.y"), wave["wave.y"])
    np.testing.assert_allclose(law, 3 * sent, atol=1e-6)
    for path in logs.values():
        assert quadvis.replay(path).same


@pytest.mark.slow
def test_two_targets_fly_one_diagram(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with ExitStack() as stack:
        targets = {}
        for name in ("a", "b"):
            lab = stack.enter_context(running_target(name=name))
            for key in ("QUADVIS_HOME", "XDG_RUNTIME_DIR"):
                monkeypatch.setenv(key, lab.environment[key])
            targets[name] = stack.enter_context(Target(name))
        several = stack.enter_context(Several(quadvis.load(written(tmp_path)), targets))
        check_flight(several, tmp_path)


@pytest.mark.slow
def test_the_flight_goes_on_without_a_machine_that_it_can_do_without(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = written(tmp_path)
    path.write_text(path.read_text().replace("b: {}", "b: {on_loss: continue}"))
    with ExitStack() as stack:
        labs = {name: stack.enter_context(running_target(name=name)) for name in ("a", "b")}
        targets = {}
        for name, lab in labs.items():
            for key in ("QUADVIS_HOME", "XDG_RUNTIME_DIR"):
                monkeypatch.setenv(key, lab.environment[key])
            targets[name] = stack.enter_context(Target(name))
        several = stack.enter_context(Several(quadvis.load(path), targets))
        several.load()
        several.start()
        wait_for(lambda: targets["b"].ExecTime > 0.2)
        labs["b"].process.kill()
        said: list[str] = []
        several.wait(announce=said.append)
        logs = several.logs(tmp_path)
        outcome = several.judge(logs)
    assert list(several.lost.values()) == said == several.complaints and said[0].startswith("b: ")
    assert list(logs) == ["a"] and list(several.lost) == ["b"] and several.those_left == [targets["a"]]
    assert quadvis.read_log(logs["a"]).times("wave.y")[-1] > 2.5
    echo, age = outcome.verdicts
    assert not np.isnan(echo.found) and str(age).startswith("NOT MET") and "nothing to judge" in str(age)


class Scripted:
    """A target with statuses that are given; one that is none does not answer."""

    def __init__(self, *statuses: tuple[str, float, str] | None) -> None:
        self.statuses, self.stops, self.asked = list(statuses), 0, 0

    def status(self) -> dict[str, object]:
        self.asked += 1
        assert self.asked < 100, "it waits without end"
        found = self.statuses.pop(0) if len(self.statuses) > 1 else self.statuses[0]
        if found is None:
            raise QuadvisError("lab has not answered 'status' in 3 s")
        state, time, problem = found
        return {
            "Status": state, "ExecTime": time, "Problem": problem, "StopTime": 3.0, "SampleTime": 0.01,
        }  # fmt: skip

    @property
    def Status(self) -> str:
        return str(self.status()["Status"])

    def stop(self) -> None:
        self.stops += 1


RUNS, ENDS = ("running", 1.0, ""), ("stopped", 2.99, "")
FAILS, LATE_FAILURE = ("stopped", 1.2, "the camera is gone"), ("stopped", 2.99, "the camera is gone")


@pytest.mark.parametrize("spare", [False, True])
@pytest.mark.parametrize("end", [FAILS, None])
def test_what_the_loss_of_a_target_means_is_what_the_diagram_says(
    tmp_path: Path, spare: bool, end: tuple[str, float, str] | None
) -> None:
    path = written(tmp_path)
    if spare:
        path.write_text(path.read_text().replace("b: {}", "b: {on_loss: continue}"))
    a, b = Scripted(RUNS, RUNS, RUNS, ENDS if spare else RUNS), Scripted(RUNS, end)
    several = Several(quadvis.load(path), {"a": cast(Target, a), "b": cast(Target, b)})
    why = "b: the camera is gone" if end else "b: lab has not answered 'status' in 3 s"
    if spare:
        several.wait()
        assert several.complaints == [why] and several.lost == {"b": why} and a.stops == 0
    else:
        with pytest.raises(QuadvisError, match=why):
            several.wait()
        assert a.stops == 1


def test_what_fails_at_the_end_fails_the_flight_and_loses_nobody(tmp_path: Path) -> None:
    a, b = Scripted(RUNS, ENDS), Scripted(RUNS, LATE_FAILURE)
    several = Several(quadvis.load(written(tmp_path)), {"a": cast(Target, a), "b": cast(Target, b)})
    several.wait()
    assert several.complaints == ["b: the camera is gone"] and not several.lost


def test_without_anybody_left_the_flight_ends(tmp_path: Path) -> None:
    path = written(tmp_path)
    path.write_text(
        path.read_text().replace("a: {}, b: {}", "a: {on_loss: continue}, b: {on_loss: continue}")
    )
    a, b = Scripted(RUNS, None), Scripted(RUNS, RUNS, FAILS)
    several = Several(quadvis.load(path), {"a": cast(Target, a), "b": cast(Target, b)})
    with pytest.raises(QuadvisError, match=r"a: lab has not answered .*; b: the camera is gone"):
        several.wait()


ADDRESSES = {"host": "10.77.61.1", "a": "10.77.61.2", "b": "10.77.61.3"}
AHEAD = 5000  # s by which the clock of the second machine is ahead
# What it starts ends with it: whoever ends the target ends this.
OWN_TIME = ("unshare", "--time", "--monotonic", str(AHEAD), "--fork", "--kill-child=SIGTERM")


def ip(*words: str) -> None:
    subprocess.run(["ip", *words], check=True, capture_output=True)


class NotGrantedError(Exception):
    """The system grants no namespaces."""


@contextmanager
def machines() -> Iterator[Mapping[str, str]]:
    """Make two machines on one network, as namespaces; NotGrantedError says why there are none."""
    if shutil.which("ip") is None or os.geteuid() != 0:
        raise NotGrantedError("namespaces need iproute2 and root")
    names = {name: f"quadvis-{os.getpid()}-{name}" for name in ("a", "b")}
    bridge = f"qv{os.getpid() % 10**6}"
    try:
        try:
            ip("link", "add", bridge, "type", "bridge")
            ip("addr", "add", f"{ADDRESSES['host']}/24", "dev", bridge)
            ip("link", "set", bridge, "up")
            for name, space in names.items():
                ip("netns", "add", space)
                ip("link", "add", f"{bridge}{name}", "type", "veth", "peer", "name", "eth0", "netns", space)
                ip("link", "set", f"{bridge}{name}", "master", bridge, "up")
                ip("-n", space, "addr", "add", f"{ADDRESSES[name]}/24", "dev", "eth0")
                for device in ("eth0", "lo"):
                    ip("-n", space, "link", "set", device, "up")
        except subprocess.CalledProcessError as error:
            raise NotGrantedError(f"namespaces are not granted: {error.stderr.decode().strip()}") from None
        yield names
    finally:
        for space in names.values():
            subprocess.run(["ip", "netns", "del", space], check=False, capture_output=True)
        subprocess.run(["ip", "link", "del", bridge], check=False, capture_output=True)


@pytest.mark.slow
def test_two_machines_with_clocks_of_their_own_fly_one_diagram(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each is in a network namespace; the monotonic clock of the second one is 5000 s ahead."""
    monkeypatch.setenv("QUADVIS_HOME", str(tmp_path / "bench"))
    bench, _ = new_key("bench")
    with ExitStack() as stack:
        try:
            spaces = stack.enter_context(machines())
        except NotGrantedError as error:
            pytest.skip(str(error))
        targets = {}
        for name, space in spaces.items():
            home = tmp_path / name
            new_key(name, home)
            allow("bench", bench.public.hex(), 0, folder=home)
            before = ["ip", "netns", "exec", space, *(OWN_TIME if name == "b" else ())]
            stack.enter_context(
                running_target("--listen", ADDRESSES[name], name=name, home=home, before=before)
            )
            targets[name] = stack.enter_context(Target(ADDRESSES[name]))
        several = stack.enter_context(
            Several(quadvis.load(written(tmp_path, ADDRESSES["a"], ADDRESSES["b"])), targets)
        )
        check_flight(several, tmp_path)
        offsets = several.offsets
        assert abs(offsets["b"].offset - offsets["a"].offset - AHEAD * 10**9) < 10**9


BENCH = """\
quadvis: 1
name: bench
base: {file: FLIGHT, variant: hil}
overload: {max: 1000000, consecutive: 1000000, action: warn}
expect:
  - {signal: "craft.position[0:2]", after: 5 s, within: 60 cm}
  - {signal: "craft.position[2]", of: "$target[2]", after: 5 s, within: 40 cm}
  - {signal: detector.lost, count: 0}
"""
FLIGHT = Path(__file__).resolve().parents[3] / "diagrams" / "flight.yaml"
LASTING = 12.0  # s of the flight


@contextmanager
def two_labs(folder: Path) -> Iterator[Mapping[str, str]]:
    """Have two targets that listen, each on a machine of its own if that is granted; give their addresses."""
    bench, _ = new_key("bench", folder / "bench")
    with ExitStack() as stack:
        try:
            spaces = dict(zip(("lab1", "lab2"), stack.enter_context(machines()).items(), strict=True))
        except NotGrantedError:
            spaces = {}
        found = {}
        for name in ("lab1", "lab2"):
            new_key(name, folder / name)
            allow("bench", bench.public.hex(), 0, folder=folder / name)
            place, space = spaces.get(name, ("", ""))
            found[name] = ADDRESSES[place] if place else f"127.0.0.1:{free_ports(3)}"
            before = ["ip", "netns", "exec", space] if place else []
            stack.enter_context(
                running_target("--listen", found[name], name=name, home=folder / name, before=before)
            )
        yield found


def free_ports(count: int) -> int:
    """Return the first of neighbouring ports of the loopback that are free."""
    from quadvis.wire.ports import listeners

    ports = listeners("127.0.0.1", 0)
    assert len(ports) == count
    first = int(ports[0].getsockname()[1])
    for port in ports:
        port.close()
    return first


@contextmanager
def wires() -> Iterator[Mapping[str, str]]:
    """Lay the serial lines of the bench between the two machines; give the parameters with their ports."""
    from multiprocessing import get_context

    from quadvis.machine.serial_port import Line
    from quadvis.realtime.cables import Cable, Cables
    from quadvis_blocks.hardware._sbus import LINE

    lines = {"rc": LINE, "circles": Line(115_200), "imu": Line(230_400)}
    cables = Cables(get_context("spawn"), [Cable(name, line) for name, line in lines.items()], 0)
    cables.start()
    try:
        cables.make()
        ends = cables.ends
        yield {
            "rc": ends["rc"].a, "rc_in": ends["rc"].b, "circles_out": ends["circles"].a,
            "circles_in": ends["circles"].b, "imu_out": ends["imu"].a, "imu_in": ends["imu"].b,
        }  # fmt: skip
    finally:
        cables.close()


@pytest.mark.slow
def test_the_bench_flies_with_world_and_vision_on_one_machine_and_control_on_another(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    from quadvis.cli import main

    monkeypatch.setenv("QUADVIS_HOME", str(tmp_path / "bench"))
    diagram = tmp_path / "bench.yaml"
    diagram.write_text(BENCH.replace("FLIGHT", os.path.relpath(FLIGHT, tmp_path)))
    with two_labs(tmp_path) as labs, wires() as ports:
        words = ["run", str(diagram), "--stop-time", f"{LASTING} s", "--log", str(tmp_path / "home.mcap")]
        for computer, lab in (("world", "lab1"), ("vision_pc", "lab1"), ("target", "lab2")):
            words += ["--on", f"{computer}={labs[lab]}"]
        for name, port in ports.items():
            words += ["--set", f"{name}={port}"]
        code = main(words)
    said = capfd.readouterr()
    assert code in (0, 1), said.err
    places = [tmp_path / "home" / name for name in ("vision_pc+world.mcap", "target.mcap")]
    assert sorted(places) == sorted((tmp_path / "home").iterdir())
    lab1, lab2 = map(quadvis.read_log, places)
    assert "detector.centres" in lab1 and "detector.centres" not in lab2 and "outputs.sent" in lab2
    times = [log.times(f"_times/{name}.tet") for log, name in ((lab1, "world/imu"), (lab2, "target/imu"))]
    assert all(each[-1] > LASTING / 2 for each in times)
    lateness = max(
        log[f"_times/{name}.lateness"].max() for log, name in ((lab1, "world/imu"), (lab2, "target/imu"))
    )
    missed = 1 - min(map(len, times)) / (LASTING / 0.01)
    print(f"late by {lateness:.3f} s at most, {missed:.1%} of ticks missed")
    print(said.out)
    assert lab1["detector.found"].sum() > LASTING
    assert lab2["circle_line.age"][20:].min() > 0
    if lateness < LATE and missed < MISSED:
        # A verdict wants all samples, and some ticks may have been lost.
        unmet = [line for line in said.out.splitlines() if "NOT MET" in line]
        assert all("samples are there" in line for line in unmet), said.out
        assert code == (1 if unmet else 0)
    for place in places:
        assert quadvis.replay(place).same


def test_a_link_that_cannot_leave_a_machine_is_reported(tmp_path: Path) -> None:
    from dataclasses import replace

    from quadvis.realtime.lines import check_reach

    text = written(tmp_path).read_text()
    for new, words in (
        ("via: memory", "memory is not shared between machines"),
        ("via: udp", "it has no address"),
        ("via: serial, baud: 115200", "it has no ports"),
    ):
        path = tmp_path / "one.yaml"
        path.write_text(text.replace('via: udp, address: "127.0.0.1:5911"', new))
        diagram = replace(quadvis.load(path), here=("a",))
        with pytest.raises(QuadvisError, match=f"link 'there' joins 'a' and 'b'.*{words}"):
            check_reach(diagram.links_here, diagram.computers)
        check_reach(diagram.links, diagram.graph.computers)


def test_a_cable_that_cannot_leave_a_machine_is_reported() -> None:
    from quadvis.realtime.lines import check_cables

    graph = quadvis.load(FLIGHT, variant="hil").graph
    check_cables(graph, graph.computers)
    check_cables(graph, ("vision_pc",))
    words = "the cable 'pty:rc' joins .outputs. and .receiver/receiver., which are on two machines; give each"
    with pytest.raises(QuadvisError, match=words):
        check_cables(graph, ("target",))
    ports = {"rc": "/dev/ttyUSB0", "rc_in": "/dev/ttyUSB1"}
    check_cables(quadvis.load(FLIGHT, variant="hil", settings=ports).graph, ("target",))


def test_a_target_may_be_several_computers(tmp_path: Path) -> None:
    diagram = quadvis.load(written(tmp_path))
    lab1, lab2 = (cast(Target, object()) for _ in range(2))
    one = Several(diagram, {"a": lab1, "b": lab1})
    assert (one.computers, list(one.targets.values())) == ({"a+b": ("a", "b")}, [lab1])
    two = Several(diagram, {"b": lab1, "a": lab2})
    assert two.computers == {"b": ("b",), "a": ("a",)}


def test_each_computer_needs_one_target(tmp_path: Path) -> None:
    diagram = quadvis.load(written(tmp_path))
    with pytest.raises(QuadvisError, match="a computer of the diagram has no target: a, b"):
        Several(diagram, {})
    assert read_places(["a=lab1", "b = 10.0.0.2"]) == {"a": "lab1", "b": "10.0.0.2"}
    for text, words in ((["a"], "write COMPUTER=TARGET"), (["a=x", "a=y"], "given twice")):
        with pytest.raises(QuadvisError, match=words):
            read_places(text)
