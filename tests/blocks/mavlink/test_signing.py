"""Signatures: pymavlink accepts ours and makes those that we accept; nothing old, wrong or unsigned does."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from quadvis.errors import QuadvisError
from quadvis_blocks.mavlink._dialect import dialect
from quadvis_blocks.mavlink._keys import KeptTimes, read_key
from quadvis_blocks.mavlink._packets import SIGNED, LooseMessage, packet
from quadvis_blocks.mavlink._scanner import PacketScanner
from quadvis_blocks.mavlink._signing import EPOCH, MINUTE, SignatureCheck, Signer, signing_time
from tests.blocks.mavlink.pymavlink_peer import KEY, attitude, read, speaker

COMMON = dialect("common")
SECOND, DAY = 10**9, 86_400 * 10**9
NOW = 1_796_000_000 * SECOND


class SetClock:
    """A clock that stands still until it is set."""

    def __init__(self) -> None:
        self.now = NOW

    def __call__(self) -> int:
        return self.now


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("QUADVIS_HOME", str(tmp_path / "home"))
    made = tmp_path / "home" / "mavlink"
    made.mkdir(parents=True, mode=0o700)
    made.parent.chmod(0o700)
    made.chmod(0o700)
    return made


class Sender:
    """Signs attitudes as a run does, with times on the disk."""

    def __init__(self, clock: SetClock, link: int = 1) -> None:
        self.times = KeptTimes("bench", signs=True, clock=clock)
        self._signer = Signer(KEY, link, self.times, clock)
        self._sequence = 0

    def packet(self) -> bytes:
        kind = COMMON.names["ATTITUDE"]
        self._sequence = (self._sequence + 1) % 256
        made = packet(
            LooseMessage(kind.number, kind.extra, kind.pack(roll=0.5)), self._sequence, 255, 190, SIGNED
        )
        return made + self._signer.signature(made)


def accepted(receiver: Any, data: bytes) -> int:
    return sum(each.get_type() == "ATTITUDE" for each in receiver.parse_buffer(data) or [])


def test_pymavlink_accepts_what_is_signed_here_and_nothing_with_another_key(folder: Path) -> None:
    sender, receiver = Sender(SetClock()), speaker(1, 1, key=KEY)
    receiver.signing.timestamp = signing_time(SetClock())
    other = speaker(1, 1, key=bytes(32))
    for _ in range(20):
        sent = sender.packet()
        assert accepted(receiver, sent) == 1
        assert accepted(other, sent) == 0
        assert accepted(receiver, sent) == 0  # again


def test_after_a_pause_of_five_minutes_a_command_is_accepted_at_once(folder: Path) -> None:
    clock = SetClock()
    sender, receiver = Sender(clock), speaker(1, 1, key=KEY, stamp=signing_time(clock))
    assert accepted(receiver, sender.packet()) == 1
    clock.now += 300 * SECOND
    # Another sender, on time, has moved the receiver's clock: a new stream a minute behind is refused.
    ahead = speaker(42, 1, key=KEY, stamp=signing_time(clock))
    assert accepted(receiver, attitude(ahead, 1)) == 1
    sent = sender.packet()
    assert accepted(receiver, sent) == 1
    assert int.from_bytes(sent[-12:-6], "little") == signing_time(clock)


def test_after_a_restart_with_the_clock_a_day_back_the_first_packet_is_accepted(folder: Path) -> None:
    clock = SetClock()
    sender, receiver = Sender(clock), speaker(1, 1, key=KEY, stamp=signing_time(clock))
    last = [sender.packet() for _ in range(5)][-1]
    assert accepted(receiver, last) == 1
    sender.times.close()
    clock.now -= DAY
    again = Sender(clock)
    assert accepted(receiver, again.packet()) == 1
    again.times.close()


def test_the_time_rises_from_packet_to_packet_whatever_the_clock_does(folder: Path) -> None:
    clock, random = SetClock(), np.random.default_rng(5)
    sender, last = Sender(clock), 0
    for _ in range(500):
        clock.now += int(random.integers(-(10**9), 10**9))
        stamp = int.from_bytes(sender.packet()[-12:-6], "little")
        assert stamp > last and stamp >= signing_time(clock)
        last = stamp


def test_a_receiver_that_is_ahead_is_followed(folder: Path) -> None:
    clock = SetClock()
    sender = Sender(clock)
    ahead = speaker(1, 1, key=KEY, stamp=signing_time(clock) + 10 * MINUTE)
    check = SignatureCheck(KEY, KeptTimes("bench", signs=False), clock)
    assert check.refusal(attitude(ahead, 1), (1, 1)) == ""
    assert accepted(ahead, sender.packet()) == 1


def scanner(clock: SetClock) -> PacketScanner:
    return PacketScanner(COMMON.numbers, SignatureCheck(KEY, KeptTimes("bench", signs=False), clock))


def test_replayed_packets_are_refused_now_and_after_a_restart(folder: Path) -> None:
    clock = SetClock()
    mav = speaker(1, 1, key=KEY, stamp=signing_time(clock))
    recorded = b"".join(attitude(mav, number) for number in range(1000))
    found = scanner(clock)
    assert len(list(found.take(bytearray(recorded)))) == 1000
    assert list(found.take(bytearray(recorded))) == []
    assert found.counts.rejected == {"old signature": 1000}
    anew = scanner(clock)
    assert list(anew.take(bytearray(recorded))) == []
    assert anew.counts.rejected == {"old signature": 1000}


def test_unsigned_wrong_and_old_packets_are_refused_each_with_its_word(folder: Path) -> None:
    clock = SetClock()
    found = scanner(clock)
    spoilt = bytearray(attitude(speaker(1, 1, key=KEY, stamp=signing_time(clock)), 1))
    spoilt[-1] ^= 1
    late = attitude(speaker(2, 1, key=KEY, stamp=signing_time(clock) - MINUTE - 1), 1)
    for data in (attitude(speaker(1, 1), 1), bytes(spoilt), late):
        assert list(found.take(bytearray(data))) == []
    assert found.counts.rejected == {"unsigned": 1, "wrong signature": 1, "old signature": 1}
    good = attitude(speaker(1, 1, key=KEY, stamp=signing_time(clock)), 1)
    assert len(list(found.take(bytearray(good)))) == 1  # the wrong one has not moved its stream


def test_of_signed_packets_with_wrong_bytes_none_counts(folder: Path) -> None:
    clock, random = SetClock(), np.random.default_rng(2)
    mav, found, came = speaker(1, 1, key=KEY, stamp=signing_time(clock)), scanner(clock), 0
    for number in range(3000):
        data = bytearray(attitude(mav, number))
        spoilt = random.random() < 0.2
        if spoilt:
            data[int(random.integers(1, len(data)))] ^= 1 << int(random.integers(8))
        count = len(list(found.take(data)))
        assert not (spoilt and count)
        came += count
    assert came > 2300


def test_a_key_has_one_run_at_a_time(folder: Path) -> None:
    first = Sender(SetClock())
    with pytest.raises(QuadvisError, match="the signing key 'bench' is in use by another run"):
        Sender(SetClock())
    first.times.close()
    Sender(SetClock()).times.close()


def test_a_machine_that_lost_its_last_half_minute_leaves_it_out(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock, boot = SetClock(), tmp_path / "boot_id"
    boot.write_text("6fd6b8b2-7a3c-4b23-8f0e-2a06c1b6c0de\n")
    monkeypatch.setattr("quadvis_blocks.mavlink._keys.BOOT_FILE", boot)
    sender = Sender(clock)
    sender.packet()
    sent = sender.times.sent
    copy = (folder / "bench.times").read_bytes()  # as it is on the disk when the power fails
    sender.times.close()
    (folder / "bench.times").write_bytes(copy)
    boot.write_text("00000000-7a3c-4b23-8f0e-2a06c1b6c0de\n")
    clock.now -= DAY
    again = Sender(clock)
    again.packet()
    assert again.times.sent > sent + 30 * SECOND // 10_000


def test_keys_are_read_from_files_that_only_their_owner_can_read(folder: Path) -> None:
    with pytest.raises(
        QuadvisError, match=r"there is no signing key 'bench'; write 64 hexadecimal digits into"
    ):
        read_key("bench")
    path = folder / "bench.key"
    path.write_text(KEY.hex() + "\n")
    path.chmod(0o644)
    with pytest.raises(QuadvisError, match="is open to other users"):
        read_key("bench")
    path.chmod(0o600)
    assert read_key("bench") == KEY
    path.write_text("abc")
    with pytest.raises(QuadvisError, match="must be 64 hexadecimal digits"):
        read_key("bench")
    with pytest.raises(QuadvisError, match=r"'\.\./bench' is no name of a key"):
        read_key("../bench")


def test_pymavlink_knows_the_same_time_as_we() -> None:
    assert EPOCH == 1_420_070_400 * SECOND
    assert next(read(attitude(speaker(1, 1, key=KEY, stamp=5), 3), key=KEY)).get_type() == "ATTITUDE"
