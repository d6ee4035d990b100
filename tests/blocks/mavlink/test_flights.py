"""Real-time runs against an autopilot made of pymavlink, over datagrams and over a line."""

from __future__ import annotations

import multiprocessing
import os
import random
import signal
import socket
import subprocess
import sys
import time
import tty
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import quadvis
from quadvis.diagram.sections.on_host_loss import SAFE
from quadvis.errors import RunError
from quadvis.realtime.guard import Guard
from quadvis.realtime.guardian import Standing, words_for
from quadvis.realtime.outlet import OutputPort
from quadvis_blocks.mavlink.attitude_target import AttitudeTarget
from quadvis_blocks.mavlink.rate_target import RateTarget
from tests.blocks.mavlink.fake_autopilot import ARDUPILOT, FakeAutopilot, MavPty, Running, over_udp
from tests.blocks.mavlink.pymavlink_peer import KEY
from tests.processes import wait_for

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform != "linux", reason="real time is Linux's"),
]

TEXT = """\
quadvis: 1
name: flight
rates: {fast: 50 Hz, vision: 10 Hz}
stop_time: STOP
overload: {max: 100000, action: warn}
blocks:
  wish: {block: sources.step, rate: fast, with: {at: 0.7 s, before: 0, after: WISH}}
  autopilot:
    block: mavlink.autopilot
    rate: fast
    with: {port: "PORT", attitude_rate: 40 Hz, timeouts: COM_OF_LOSS_T RC_OVERRIDE_TIME KEY}
    in: {arm: truth.y}
  truth: {block: own.truth, rate: fast, in: {u: wish.y}}
  command:
    block: sources.constant
    rate: fast
    with: {value: {value: [0.1, 0.2, 0.3, 0.5], unit: rad rad rad 1}}
  target:
    block: mavlink.attitude_target
    rate: fast
    with:
      port: "PORT"
      initial: {value: [0, 0, 0, 0], unit: rad rad rad 1}
      safe: {value: [0, 0, 0, 0.25], unit: rad rad rad 1}
      safe_time: HOLD
      KEYS
    in: {command: command.y}
  clock: {block: sources.ramp, rate: vision}
  vision:
    block: mavlink.vision_position
    rate: vision
    with: {port: "PORT" KEY}
    in:
      position: {value: [1, 2, 3], unit: m}
      roll: 0.1 rad
      pitch: 0.2 rad
      yaw: 0.3 rad
      stamp: clock.y
"""
OWN = '''
"""A number as true or false; writes the number of its process into the file 'process'."""

import os
from pathlib import Path

from quadvis.block import Block, In, Out


class Truth(Block, numeric=False):
    """Whether a number is not 0."""

    u = In()
    y = Out("bool")

    def open(self):
        Path("process").write_text(str(os.getpid()))

    def output(self, u):
        return u != 0
'''


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("QUADVIS_HOME", str(tmp_path / "home"))
    yield tmp_path


def write(port: str, stop: str = "2 s", wish: int = 1, hold: str = "0.3 s", key: str = "") -> None:
    text = TEXT.replace("PORT", port).replace("STOP", stop).replace("WISH", str(wish)).replace("HOLD", hold)
    text = text.replace(" KEYS", f" key: {key}" if key else "").replace(
        " KEY", f", key: {key}" if key else ""
    )
    Path("flight.yaml").write_text(text)
    Path("blocks/own").mkdir(parents=True, exist_ok=True)
    Path("blocks/own/truth.py").write_text(OWN)


def free() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as made:
        made.bind(("127.0.0.1", 0))
        return int(made.getsockname()[1])


def autopilot(link: Any, **given: Any) -> Running:
    parameters = {"COM_OF_LOSS_T": 0.5, "RC_OVERRIDE_TIME": 1.0, **given.pop("parameters", {})}
    return Running(FakeAutopilot(link, parameters=parameters, **given))


def run() -> Any:
    return quadvis.load("flight.yaml").run(real_time=quadvis.RealTime(priority=0, poll="0 s"))


def check(fake: FakeAutopilot, result: Any) -> None:
    """Check what a whole run has sent and heard."""
    assert result["autopilot.valid"][-1] and result["autopilot.armed"][-1] and fake.armed
    assert result["autopilot.roll"][-1] == pytest.approx(0.1)
    assert result["autopilot.refused"][-1] == result["autopilot.foreign"][-1] == 0
    commands = [(round(each.thrust, 3), each.type_mask) for _, each in fake.of("SET_ATTITUDE_TARGET")]
    first, going, safe, release = (0.0, 7), (0.5, 7), (0.25, 7), (0.0, 199)
    assert commands[0] == first and commands[-1] == release and commands.count(release) == 1
    assert {*commands} == {first, going, safe, release}
    end = len(commands) - commands[::-1].index(going)
    assert {*commands[end:-1]} == {safe} and len(commands[end:-1]) >= 3  # fewer where the machine is busy
    assert commands.count(going) >= 20
    poses = [each.usec for _, each in fake.of("VISION_POSITION_ESTIMATE")]
    assert poses == sorted({*poses}) and len(poses) >= 5
    assert len(fake.of("HEARTBEAT")) >= 2
    numbers = [each.get_seq() for _, each in fake.heard if each.get_type() != "BAD_DATA"]
    assert numbers == [number % 256 for number in range(len(numbers))]
    assert {(each.get_srcSystem(), each.get_srcComponent()) for _, each in fake.heard} == {(1, 191)}


def test_over_datagrams_one_row_of_packets_carries_set_points_poses_and_requests() -> None:
    port = free()
    write(f"udp:127.0.0.1:{port}")
    with autopilot(over_udp(port)) as fake:
        result = run()
        time.sleep(0.1)
    check(fake, result)


def test_over_a_line_as_well() -> None:
    peer, slave = os.openpty()
    tty.setraw(slave)  # before it is opened it would echo what comes
    write(os.ttyname(slave))
    with autopilot(MavPty(peer, 1, 1)) as fake:
        result = run()
        time.sleep(0.1)
    check(fake, result)
    os.close(peer)
    os.close(slave)


def test_an_autopilot_without_set_points_hears_requests_and_heartbeats_all_the_same() -> None:
    port = free()
    text = TEXT[: TEXT.index("  wish:")] + TEXT[TEXT.index("  autopilot:") : TEXT.index("    in: {arm")]
    Path("flight.yaml").write_text(
        text.replace("PORT", f"udp:127.0.0.1:{port}").replace("STOP", "3 s").replace(" KEY", "")
    )
    with autopilot(over_udp(port)) as fake:
        result = run()
    assert result["autopilot.valid"][-1] and 2 <= len(fake.of("HEARTBEAT")) <= 6
    assert fake.rates and {each.get_type() for _, each in fake.heard} == {
        "HEARTBEAT",
        "COMMAND_LONG",
        "PARAM_REQUEST_READ",
    }


def store(folder: Path) -> None:
    """Keep the key of the other side as 'lab'."""
    keys = folder / "home" / "mavlink"
    keys.mkdir(parents=True)
    for each in (keys.parent, keys):
        each.chmod(0o700)
    (keys / "lab.key").write_text(KEY.hex())
    (keys / "lab.key").chmod(0o600)


def test_signed_both_ways(folder: Path) -> None:
    store(folder)
    port = free()
    write(f"udp:127.0.0.1:{port}", key="lab")
    for _ in range(2):  # the second run goes on with the times of the first
        link = over_udp(port)
        link.setup_signing(KEY, sign_outgoing=True)
        with autopilot(link) as fake:
            result = run()
            time.sleep(0.1)
        assert result["autopilot.armed"][-1] and result["autopilot.rejected"][-1] == 0
        assert all(each.get_signed() for _, each in fake.heard)
        assert len(fake.of("SET_ATTITUDE_TARGET")) > 60
        assert fake.of("SET_ATTITUDE_TARGET")[-1][1].type_mask == 199
        assert not fake.of("BAD_DATA")


@pytest.mark.parametrize("value", [-1.0, 0.0, 3.0])
def test_time_outs_refuse_arming_and_the_run_ends_released(value: float) -> None:
    port = free()
    write(f"udp:127.0.0.1:{port}", stop="20 s")
    with autopilot(over_udp(port), firmware=ARDUPILOT, parameters={"RC_OVERRIDE_TIME": value}) as fake:
        words = (
            f"block 'autopilot'.*the autopilot is not armed: RC_OVERRIDE_TIME of the autopilot is {value:g} s"
        )
        with pytest.raises(RunError, match=words):
            run()
        time.sleep(0.1)
    assert not fake.armed and fake.of("SET_ATTITUDE_TARGET")[-1][1].type_mask == 199


def test_if_the_guardian_is_lost_the_supervisor_sends_signed_safe_set_points_in_its_place(
    folder: Path,
) -> None:
    """Both processes use one key, one after the other; the receiver refuses what is older than the newest."""
    store(folder)
    port, context = free(), multiprocessing.get_context("spawn")
    given = {"port": f"udp:127.0.0.1:{port}", "key": "lab"}
    attitude = AttitudeTarget(initial=[0.0] * 4, safe=[0.0, 0.0, 0.0, 0.25], **given)
    rates = RateTarget(initial=[0.0] * 4, safe=[0.0, 0.0, 0.0, 0.75], **given)
    ports = [
        OutputPort.of(each, name, given["port"], shared=True)
        for name, each in (("a", attitude), ("r", rates))
    ]
    link = over_udp(port)
    link.setup_signing(KEY, sign_outgoing=True)
    with autopilot(link) as fake:
        guard = Guard(context, context.RawArray("q", words_for(2)), [], SAFE, Standing())
        guard.start()
        try:
            guard.open(ports, lambda _: None)
            wait_for(lambda: len(fake.of("SET_ATTITUDE_TARGET")) >= 10)
            guard.process.kill()
            guard.process.join()
            assert guard.alarm() is not None
        finally:
            unsafe = guard.close()
        assert unsafe == []
        wait_for(lambda: fake.of("SET_ATTITUDE_TARGET")[-1][1].thrust == 0.0 and fake.heard)
        time.sleep(0.1)
    last = [(each.type_mask, each.thrust) for _, each in fake.of("SET_ATTITUDE_TARGET")][-4:]
    assert last == [(7, 0.25), (128, 0.75), (199, 0.0), (199, 0.0)]
    assert all(each.get_signed() for _, each in fake.heard) and not fake.of("BAD_DATA")


class Killed:
    """A run in a process of its own, of which the application is killed at a random moment."""

    def __init__(self, fake: FakeAutopilot, moment: float) -> None:
        command = [sys.executable, "-m", "quadvis", "run", "flight.yaml", "--real-time", "--priority", "0"]
        process = subprocess.Popen(
            [*command, "--poll", "0", "--log", ""], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        try:
            wait_for(lambda: Path("process").exists() or process.poll() is not None)
            wait_for(lambda: self.going(fake) or process.poll() is not None)
            assert process.poll() is None, process.communicate()
            time.sleep(moment)
            self.killed = time.monotonic()
            os.kill(int(Path("process").read_text()), signal.SIGKILL)
            _, self.told = process.communicate(timeout=60)
        finally:
            process.kill()
            process.communicate()

    @staticmethod
    def going(fake: FakeAutopilot) -> bool:
        return any(each.thrust == 0.5 for _, each in fake.of("SET_ATTITUDE_TARGET"))


KILLS = int(os.environ.get("QUADVIS_KILLS", "6"))


def test_after_a_kill_come_safe_set_points_at_the_same_rate_and_then_the_release() -> None:
    """D9; with 100 kills on a quiet machine the delays that it prints are at most 50 ms."""
    delays = []
    for number in range(KILLS):
        port = free()
        write(f"udp:127.0.0.1:{port}", stop="100 s")
        Path("process").unlink(missing_ok=True)
        with autopilot(over_udp(port)) as fake:
            killed = Killed(fake, random.Random(number).uniform(0.0, 0.3))
            wait_for(lambda fake=fake: fake.of("SET_ATTITUDE_TARGET")[-1][1].type_mask == 199)
        after = [(at, each) for at, each in fake.of("SET_ATTITUDE_TARGET") if at > killed.killed]
        thrusts = [each.thrust for _, each in after[:-1]]
        first = thrusts.index(0.25)
        assert (
            thrusts[:first] == [0.5] * first and first <= 5
        )  # on their way, or not seen yet on a busy machine
        assert thrusts[first:] == [0.25] * (len(thrusts) - first)
        assert 3 <= len(thrusts) - first <= 18  # 0.3 s at 50 Hz
        assert after[-1][1].type_mask == 199
        assert "was killed by SIGKILL" in killed.told
        delays.append(after[first][0] - killed.killed)
    print(f"delays: {[round(1e3 * each, 1) for each in sorted(delays)]} ms")
