"""The block mavlink.autopilot against an autopilot made of pymavlink: whom it hears, what it asks for."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pymavlink.dialects.v20 import common

from quadvis.block import ParameterError
from quadvis.errors import RunError
from quadvis_blocks.mavlink._arming import ARM, DONE, GIVEN_UP, IDLE, MODE
from quadvis_blocks.mavlink._dialect import dialect
from quadvis_blocks.mavlink._packets import LooseMessage, packet
from quadvis_blocks.mavlink._signing import signing_time
from quadvis_blocks.mavlink.autopilot import Autopilot
from tests.blocks.mavlink.bench import RATE, bench
from tests.blocks.mavlink.fake_autopilot import ARDUPILOT, ATTITUDE, GOOD, PX4
from tests.blocks.mavlink.pymavlink_peer import KEY, speaker

SECOND = RATE  # steps


def sent(mav: Any) -> bytes:
    """Return the packets that a speaker has sent."""
    data = b"".join(mav.file.packets)
    mav.file.packets.clear()
    return data


def test_what_an_autopilot_says_in_our_units_and_axes() -> None:
    with bench(imu_rate=100.0, position_rate=20.0) as run:
        run.fake.is_silent = True
        run.step()
        assert not run["valid"] and math.isnan(run["age"]) and run["system"] == 0
        run.fake.is_silent = False
        run.step(2 * SECOND)
        assert run["valid"] and run["system"] == 1
        assert [run["roll"], run["pitch"], run["yaw"]] == np.float32([0.1, -0.2, 0.3]).tolist()
        assert run["rates"].tolist() == np.float32([0.01, 0.02, 0.03]).tolist()
        assert run["gyro"].tolist() == np.float32([0.01, 0.02, 0.03]).tolist()
        assert run["specific_force"].tolist() == [0.5, -0.25, -9.75]
        assert run["position"].tolist() == [1.0, 2.0, 3.0]
        assert run["velocity"].tolist() == np.float32([0.1, 0.2, 0.3]).tolist()
        assert 0 <= run["age"] <= 0.03 and 0 <= run["imu_age"] <= 0.02 and run["position_age"] <= 0.06
        assert run["refused"] == run["foreign"] == run["rejected"] == 0
        run.fake.is_silent = True
        run.step(SECOND)
        assert not run["valid"] and run["age"] == pytest.approx(1.0, abs=0.03)


@pytest.mark.slow
def test_of_three_who_speak_one_is_the_autopilot_and_the_others_touch_no_signal() -> None:
    """D7: 6000 heartbeats in random order; mode and armed follow 1/1 alone."""
    random = np.random.default_rng(6)
    station, controller, pilot = speaker(255, 190), speaker(42, 250), speaker(1, 1)
    with bench() as run:
        run.fake.is_silent = True
        said = False, 0
        wrong = 0
        for number in range(6000):
            who = int(random.integers(3))
            armed, mode = bool(random.integers(2)), int(random.integers(1, 1000))
            flags = 128 * armed + 1
            if who == 0:
                station.heartbeat_send(common.MAV_TYPE_GCS, common.MAV_AUTOPILOT_INVALID, flags, mode, 4)
            elif who == 1:
                controller.heartbeat_send(common.MAV_TYPE_QUADROTOR, PX4, flags, mode, 4)
                controller.attitude_send(number, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0)
            if who == 2 or number == 0:
                pilot.heartbeat_send(common.MAV_TYPE_QUADROTOR, PX4, flags, mode, 4)
                said = armed, mode
            run.put((sent(pilot) if number == 0 else b"") + sent(station) + sent(controller) + sent(pilot))
            run.step()
            wrong += (run["armed"], run["mode"]) != said
        assert wrong == 0 and run["system"] == 1
        assert math.isnan(run["roll"])
        others = run.bound._who.others
        assert others.keys() == {(255, 190), (42, 250)} and sum(others.values()) == run["foreign"]
    assert any(f"{others[42, 250]} of 42/250" in each for each in run.reports)


def test_a_declared_system_is_waited_for_and_one_that_was_learned_never_changes() -> None:
    mine, other = speaker(7, 1), speaker(3, 1)
    with bench(target_system=7) as run:
        run.fake.is_silent = True
        other.heartbeat_send(common.MAV_TYPE_QUADROTOR, PX4, 129, 11, 4)
        run.put(sent(other))
        run.step(2)
        assert (run["mode"], run["armed"]) == (0, False)
        mine.heartbeat_send(common.MAV_TYPE_QUADROTOR, PX4, 129, 12, 4)
        run.put(sent(mine))
        run.step(2)
        assert (run["mode"], run["armed"], run["system"]) == (12, True, 7)
    with bench() as run:
        run.fake.is_silent = True
        for mav, mode in ((other, 1), (mine, 2)):
            mav.heartbeat_send(common.MAV_TYPE_QUADROTOR, PX4, 0, mode, 4)
            run.put(sent(mav))
            run.step(2)
        assert (run["mode"], run["system"]) == (1, 3)


def test_a_rate_that_falls_back_is_asked_for_again_and_reported_once() -> None:
    """D8: requests are obeyed for 3 s, then the rate drops to 4 Hz."""
    with bench({"obeys": 3.0}) as run:
        run.step(10)
        slow = [0]  # how long (steps) it was slow, each time
        for _ in range(30 * SECOND):
            run.step()
            slow.append(0) if run["age"] <= 0.03 else slow.append(slow.pop() + 1)
        assert sum(slow) > RATE and max(slow) < 3 * SECOND
        asked = [at for at, each in run.fake.of("COMMAND_LONG") if each.command == 511]
        assert all(later - earlier >= 1.0 - 1e-9 for earlier, later in pairwise(asked))
        assert 8 <= len(asked) <= 20 and len(asked) == run["requests"]
    warnings = [each for each in run.reports if "not at 50 Hz as asked" in each]
    assert len(warnings) == 1 and warnings[0].startswith("ATTITUDE comes at ")


def test_requests_that_are_ignored_let_the_age_limit_trip_and_the_run_goes_on() -> None:
    with bench({"obeys": 0.0, "default_rate": 0.5}) as run:
        valid = []
        for _ in range(1000):
            run.step()
            valid.append(bool(run["valid"]))
        share = sum(valid[200:]) / len(valid[200:])
        assert 0.1 < share < 0.4  # 0.5 s of every 2 s
        assert 5 <= run["requests"] <= 11


def test_the_rate_asked_for_is_the_rate_that_comes() -> None:
    with bench(attitude_rate=20.0) as run:
        run.step(5 * SECOND)
        assert run.fake.rates[ATTITUDE][0] == pytest.approx(20.0)
        assert run["requests"] == 1 and run.reports == []


@pytest.mark.parametrize(
    ("firmware", "mode", "number"),
    [(PX4, 6 << 16, 6 << 16), (PX4, 4 << 16 | 3 << 24, 0x3040000), (ARDUPILOT, 4, 4)],
)
def test_it_asks_for_the_mode_then_to_arm_and_to_disarm(firmware: int, mode: int, number: int) -> None:
    with bench({"firmware": firmware}, flight_mode=mode) as run:
        run.step(SECOND)
        assert run["arming"] == IDLE and not run["armed"]
        run.step(SECOND, arm=True)
        assert (run["armed"], run["mode"], run["arming"]) == (True, number, DONE)
        assert run["timeout"] == pytest.approx(1.0)
        run.step(SECOND)
        commands = [each.command for _, each in run.fake.of("COMMAND_LONG")]
        assert commands == [511, 176, 400]
        run.step(SECOND, arm=False)
        assert not run["armed"] and run["arming"] == IDLE


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (-1.0, "is -1 s, so the last set-point would hold for ever"),
        (0.0, "is 0 s, which turns it off"),
        (3.0, "is 3 s, longer than 1 s"),
        (math.inf, "is inf s, so the last set-point would hold for ever"),
    ],
)
@pytest.mark.parametrize(
    ("firmware", "name"),
    [(PX4, "COM_OF_LOSS_T"), (ARDUPILOT, "RC_OVERRIDE_TIME"), (ARDUPILOT, "GUID_TIMEOUT")],
)
def test_time_outs_that_are_off_endless_or_long_refuse_arming(
    firmware: int, name: str, value: float, words: str
) -> None:
    """D9, before arming."""
    parameters = {**GOOD[firmware], name: value}
    with (
        pytest.raises(RunError, match=f"the autopilot is not armed: {name} of the autopilot {words}"),
        bench({"firmware": firmware, "parameters": parameters}) as run,
    ):
        run.step(SECOND)
        run.step(SECOND, arm=True)
    assert not run.fake.armed


def test_time_outs_that_the_autopilot_does_not_tell_refuse_arming_and_named_ones_are_read() -> None:
    with (
        pytest.raises(RunError, match="the autopilot does not say what its COM_OF_LOSS_T is"),
        bench({"parameters": {}}) as run,
    ):
        run.step(10 * SECOND, arm=True)
    assert not run.fake.armed
    with bench({"parameters": {"MY_TIME": 0.25}}, timeouts="MY_TIME") as run:
        run.step(2 * SECOND, arm=True)
        assert run["armed"] and run["timeout"] == 0.25
    with bench({"parameters": {}}, timeouts="") as run:
        run.step(2 * SECOND, arm=True)
        assert run["armed"]


def test_many_time_outs_are_asked_for_in_several_frames() -> None:
    parameters = {f"TIME_{number}": 0.5 for number in range(70)}
    with bench({"parameters": parameters}, timeouts=" ".join(parameters)) as run:
        run.step(3 * SECOND, arm=True)
        assert run["armed"] and run["timeout"] == 0.5


def test_a_dialect_without_its_messages_is_refused() -> None:
    with pytest.raises(ParameterError, match="dialect 'minimal' has no message ATTITUDE"):
        Autopilot(port="udp::14540", dialect="minimal")


def test_whole_numbers_of_px4_are_read_from_their_bytes() -> None:
    kind = dialect("common").names["PARAM_VALUE"]
    value = np.frombuffer(np.int32(3).tobytes(), np.float32)[0]
    fields = {"param_value": value, "param_id": b"COM_OF_LOSS_T", "param_type": 6, "param_count": 1}
    given = LooseMessage(kind.number, kind.extra, kind.pack(**fields))
    with (
        pytest.raises(RunError, match="COM_OF_LOSS_T of the autopilot is 3 s, longer than 1 s"),
        bench({"parameters": {"COM_RC_LOSS_T": 0.5}}) as run,
    ):
        run.step(SECOND)
        run.put(packet(given, 0, 1, 1))
        run.step(SECOND, arm=True)


def test_an_autopilot_that_refuses_is_asked_five_times_and_its_reasons_are_reported() -> None:
    with bench({"arms": False}) as run:
        run.step(10 * SECOND, arm=True)
        assert not run["armed"] and run["arming"] == GIVEN_UP
        assert [each.command for _, each in run.fake.of("COMMAND_LONG")].count(400) == 5
        assert "the autopilot says: PreArm: Check firmware" in run.reports
        assert "the autopilot refuses to be armed or disarmed: denied" in run.reports
        assert "the autopilot does not do what it was asked to; it is asked no more" in run.reports
        run.fake.arms = True
        run.step(10)
        run.step(10, arm=False)
        run.step(2 * SECOND, arm=True)
        assert run["armed"]


def test_an_autopilot_that_is_armed_from_elsewhere_is_left_so() -> None:
    with bench({"parameters": {"COM_OF_LOSS_T": 60.0}}) as run:
        run.fake.armed = True
        run.step(3 * SECOND)
        assert run["armed"] and run["arming"] == IDLE
        assert [each.command for _, each in run.fake.of("COMMAND_LONG")] == [511]


def test_while_its_mode_is_not_what_was_asked_for_it_is_not_armed() -> None:
    with bench(flight_mode=6 << 16) as run:
        run.step(SECOND)
        run.fake._obey = lambda *_: None  # type: ignore[method-assign]
        run.step(SECOND, arm=True)
        assert run["arming"] == MODE
        assert ARM != MODE
        assert 400 not in [each.command for _, each in run.fake.of("COMMAND_LONG")]


def test_the_newest_of_many_counts_and_the_age_does_not_grow() -> None:
    """D2: 400 messages a second, for a task at 100 Hz that stands still for 2 s."""
    mav = speaker(1, 1)
    mav.heartbeat_send(common.MAV_TYPE_QUADROTOR, PX4, 0, 0, 4)
    with bench() as run:
        run.fake.pump = lambda _: None  # type: ignore[method-assign]  # its answers would be of the same sender
        run.put(sent(mav))
        number = 0
        for _ in range(200):
            for _ in range(4):
                number += 1
                mav.attitude_send(5 * number, number / 1e4, 0.0, 0.0, 0.0, 0.0, 0.0)
            run.put(sent(mav))
            run.step()
            assert run["age"] == 0.0 and run["roll"] == np.float32(number / 1e4)
        assert run["lost"] == 600
        before = number
        for _ in range(20):  # what finds room while nobody reads
            number += 1
            mav.attitude_send(5 * number, number / 1e4, 0.0, 0.0, 0.0, 0.0, 0.0)
        run.put(sent(mav))
        run.step()
        assert run["lost"] == 600 + number - before - 1 and run["age"] == 0.0


def test_another_definition_is_counted_by_number_and_reported() -> None:
    """D11: 10 messages with a changed list of fields."""
    kind = dialect("common").names["ATTITUDE"]
    with bench() as run:
        run.step(10)
        run.fake.is_silent = True
        before = int(run["refused"])
        run.fake.link.mav.seq = 0
        # a sender of its own, as good attitudes of the same one would prove that its definition is ours
        for number in range(10):
            run.put(packet(LooseMessage(kind.number, 7, kind.pack(time_boot_ms=number)), number, 1, 2))
            run.put(packet(LooseMessage(60_000, 7, b"hello"), number, 1, 1))
            run.step()
        assert (run["differs"], run["unknown"], run["refused"] - before) == (10, 10, 0)
        run.step(10)
    assert any("message 30 (ATTITUDE) comes with another definition" in each for each in run.reports)
    assert any("10 with the unknown number 60000" in each for each in run.reports)


def test_values_that_cannot_be_and_messages_that_came_late_do_not_count() -> None:
    mav = speaker(1, 1)
    with bench() as run:
        run.fake.is_silent = True
        mav.heartbeat_send(common.MAV_TYPE_QUADROTOR, PX4, 0, 0, 4)
        mav.attitude_send(5000, 0.1, 0.2, 0.3, 0.0, 0.0, 0.0)
        mav.attitude_send(4980, 9.0, 9.0, 9.0, 0.0, 0.0, 0.0)  # overtaken, and wrong
        mav.attitude_send(5020, math.nan, 0.0, 0.0, 0.0, 0.0, 0.0)
        mav.attitude_send(5040, 0.0, 0.0, 0.0, 1000.0, 0.0, 0.0)
        mav.highres_imu_send(5_000_000, math.inf, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xFFFF)
        run.put(sent(mav))
        run.step()
        assert run["roll"] == pytest.approx(0.1) and math.isnan(run["imu_age"])
        assert (run["lost"], run["refused"]) == (1, 3)
        mav.attitude_send(20, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0)  # it was started anew, or this is damage
        run.put(sent(mav))
        run.step()
        assert run["roll"] == pytest.approx(0.1) and run["refused"] == 4
        mav.attitude_send(40, 0.25, 0.0, 0.0, 0.0, 0.0, 0.0)
        run.put(sent(mav))
        run.step()
        assert run["roll"] == 0.25 and run["refused"] == 4
        mav.attitude_send(4_000_000_000, 0.75, 0.0, 0.0, 0.0, 0.0, 0.0)
        mav.attitude_send(60, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0)
        run.put(sent(mav))
        run.step()
        assert run["roll"] == 0.5 and run["refused"] == 5


@pytest.fixture
def key(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.setenv("QUADVIS_HOME", str(tmp_path / "home"))
    folder = tmp_path / "home" / "mavlink"
    folder.mkdir(parents=True, mode=0o700)
    folder.parent.chmod(0o700)
    folder.chmod(0o700)
    path = folder / "bench.key"
    path.write_text(KEY.hex())
    path.chmod(0o600)
    return "bench"


def test_signed_both_ways_and_what_is_not_signed_does_not_count(key: str) -> None:
    with bench(key=key) as run:
        run.fake.link.setup_signing(KEY, sign_outgoing=True, initial_timestamp=signing_time())
        run.step(SECOND)
        assert run["valid"] and run["rejected"] == 0
        assert all(each.get_signed() for _, each in run.fake.of("COMMAND_LONG"))
        assert run.fake.rates
        stranger = speaker(1, 1)
        stranger.heartbeat_send(common.MAV_TYPE_QUADROTOR, PX4, 128, 99, 4)
        run.put(sent(stranger))
        run.step()
        assert (run["armed"], run["mode"], run["rejected"]) == (False, 0, 1)


def test_if_nothing_signed_is_answered_the_report_names_keys_and_times(key: str) -> None:
    """D10: all is refused without a word."""
    with bench(key=key) as run:
        run.fake.link.setup_signing(bytes(32), sign_outgoing=True, initial_timestamp=signing_time())
        run.step(3 * SECOND)
        assert not run["valid"] and run["rejected"] > 0
    words = "for 2 s; the keys of the two sides, or their times, may not be the same"
    assert f"no message of the autopilot has come {words}" in run.reports


def test_an_autopilot_that_speaks_version_1_is_told_apart_from_silence() -> None:
    from pymavlink.dialects.v10 import common as version_1

    from tests.blocks.mavlink.pymavlink_peer import Wire

    old = version_1.MAVLink(Wire(), srcSystem=1, srcComponent=1)
    with bench() as run:
        run.fake.is_silent = True
        for _ in range(30):
            old.heartbeat_send(2, 12, 0, 0, 4)
            run.put(sent(old))
            run.step(10)
    assert any("it speaks MAVLink 1: set SERIALn_PROTOCOL of ArduPilot to 2" in each for each in run.reports)
