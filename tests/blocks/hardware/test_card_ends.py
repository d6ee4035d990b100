"""However a run ends, all channels of its cards have their safe values last, and none was ever out of bounds.

The cards are stand-ins which record all writes of all processes, since none was at hand.
"""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.blocks.hardware.cards import Cards, standing_in
from tests.processes import children, gone, wait_for
from tests.stages import mostly_slow

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="real time is Linux's")

TEXT = """\
quadvis: 1
name: cards
rates: {fast: 50 Hz}
stop_time: STOP
overload: {max: 1000000}
blocks:
  wave: {block: own.wave, rate: fast}
  three:
    block: hardware.dac_out
    rate: fast
    with:
      port: "comedi:DEVICE"
      channels: [1, 2, 3]
      ranges: [0, 0, 3]
      lowest: [1 V, 1 V, -8 V]
      highest: [4 V, 4 V, 8 V]
      initial: [2.5 V, 2.5 V, 1 V]
      safe: [1.5 V, 2 V, -3 V]
    in: {command: wave.three}
  two:
    block: hardware.dac_out
    rate: fast
    with:
      port: "nidaqmx:Dev1"
      channels: [2, 1]
      ranges: [1, 1]
      lowest: [0, 0]
      highest: [1, 1]
      at_lowest: [1 V, 9 V]
      at_highest: [3 V, 5 V]
      initial: [0.5, 0.5]
      safe: [0, 0.25]
    in: {command: wave.two}
"""
OWN = '''
"""Commands far beyond all ends."""

import os
from pathlib import Path

from quadvis.block import Block, Out


class Wave(Block, numeric=False):
    """Commands of both cards; fails once a file 'go' is there."""

    three = Out("float64[3]", unit="V")
    two = Out("float64[2]")

    def open(self):
        Path("process").write_text(str(os.getpid()))

    def output(self, time):
        if Path("go").exists():
            raise ValueError("no such luck")
        up = 50.0 * (round(time * 50) % 3 - 1)
        return [up, -up, up], [up, up]
'''
STEP = 20 / 4095  # V, of a count in the widest range
SAFE = {("comedi", 0): 1.5, ("comedi", 1): 2.0, ("comedi", 2): -3.0, ("ni", 1): 1.0, ("ni", 0): 8.0}
ENDS = {
    ("comedi", 0): (1, 4),
    ("comedi", 1): (1, 4),
    ("comedi", 2): (-8, 8),
    ("ni", 1): (1, 3),
    ("ni", 0): (5, 9),
}


@pytest.fixture
def cards(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Cards]:
    monkeypatch.chdir(tmp_path)
    with standing_in(tmp_path) as made:
        yield made


def write(cards: Cards, stop: str = "1000 s") -> None:
    Path("flight.yaml").write_text(TEXT.replace("DEVICE", str(cards.device)).replace("STOP", stop))
    Path("blocks/own").mkdir(parents=True)
    Path("blocks/own/wave.py").write_text(OWN)


def values(cards: Cards) -> dict[tuple[str, int], list[float]]:
    """Return all that was put out, by driver and channel: the stand-ins name their writes alike."""
    found: dict[tuple[str, int], list[float]] = {key: [] for key in SAFE}
    for _, what, channel, value in cards.writes:
        found["ni" if what == "analog_ni" else "comedi", channel].append(value)
    return found


class Flight:
    """A real-time run in a process of its own, whose commands have come to the cards."""

    def __init__(self, cards: Cards) -> None:
        self.cards = cards
        command = [sys.executable, "-m", "quadvis", "run", "flight.yaml", "--real-time", "--priority", "0"]
        self.process = subprocess.Popen(
            [*command, "--poll", "0", "--log", ""],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
        )  # fmt: skip

    def goes(self) -> Flight:
        """Wait until all channels have been at both ends."""

        def seen() -> bool:
            found = values(self.cards)
            return self.process.poll() is not None or all(
                any(abs(value - end) < STEP for value in found[key]) for key in SAFE for end in ENDS[key]
            )

        wait_for(seen)
        assert self.process.poll() is None, self.process.communicate()
        self.application = int(Path("process").read_text())
        self.all = children(self.process)
        (self.guardian,) = set(self.all) - {self.application}
        return self

    def ended(self) -> tuple[int, str]:
        """Wait for the end of all processes; return the exit code and what was said last."""
        _, told = self.process.communicate(timeout=60)
        wait_for(lambda: all(map(gone, self.all)))
        return self.process.returncode, told.splitlines()[-1] if told else ""

    def check(self, but: tuple[tuple[str, int], ...] = ()) -> None:
        """Check that channels have their safe values last, but those that refuse, and were within bounds."""
        for key, found in values(self.cards).items():
            lowest, highest = ENDS[key]
            assert all(lowest - STEP <= value <= highest + STEP for value in found), key
            assert key in but or found[-1] == pytest.approx(SAFE[key], abs=STEP), key


def go(_: Flight) -> None:
    Path("go").touch()


def send(number: signal.Signals, to: str) -> Callable[[Flight], None]:
    def send_it(flight: Flight) -> None:
        os.kill(flight.process.pid if to == "command" else getattr(flight, to), number)

    send_it.__name__ = f"{number.name}_{to}"
    return send_it


ALL = [
    (send(signal.SIGKILL, "application"), 1, r"t = \S+ s: the application was killed by SIGKILL"),
    (go, 1, r"block 'wave', t = \S+ s: ValueError: no such luck in .*wave\.py:\d+"),
    (send(signal.SIGTERM, "application"), 1, r"t = \S+ s: the application was told to end"),
    (send(signal.SIGINT, "command"), 130, "interrupted"),
    (send(signal.SIGTERM, "command"), 143, ".*"),
    (send(signal.SIGKILL, "command"), -9, ".*"),
    (send(signal.SIGKILL, "guardian"), 1, ".*the guardian of the outputs has been lost"),
    (send(signal.SIGTERM, "guardian"), 1, r"t = \S+ s: the guardian was told to end"),
]


@pytest.mark.parametrize(
    ("end", "code", "words"), mostly_slow(ALL), ids=lambda value: getattr(value, "__name__", None)
)
def test_every_end_leaves_safe_values_on_all_channels(
    cards: Cards, end: Callable[[Flight], None], code: int, words: str
) -> None:
    write(cards)
    flight = Flight(cards).goes()
    end(flight)
    ended = flight.ended()
    flight.check()
    assert ended[0] == code, ended
    assert re.search(f"(?:^|: ){words}$", ended[1]), ended[1]


@pytest.mark.slow
def test_the_stop_time_leaves_safe_values_on_all_channels(cards: Cards) -> None:
    write(cards, stop="1 s")
    flight = Flight(cards)
    _, told = flight.process.communicate(timeout=60)
    assert flight.process.returncode == 0, told
    flight.check()


@pytest.mark.slow
def test_a_channel_that_fails_ends_the_run_and_all_others_have_their_safe_values(cards: Cards) -> None:
    write(cards)
    flight = Flight(cards).goes()
    cards.refuse(2)
    code, told = flight.ended()
    flight.check(but=(("comedi", 2),))
    assert code == 1
    assert re.search(r"block 'three'.*: channel 3 of '.*' cannot be written: input/output error$", told), told


@pytest.mark.slow
def test_a_channel_that_fails_from_the_beginning_keeps_the_run_from_beginning(cards: Cards) -> None:
    write(cards)
    cards.refuse(2)
    flight = Flight(cards)
    _, told = flight.process.communicate(timeout=60)
    flight.check(but=(("comedi", 2),))
    assert flight.process.returncode == 1
    assert "channel 3 of " in told.splitlines()[-1]


@pytest.mark.slow
def test_a_card_that_cannot_be_opened_leaves_the_other_one_safe(cards: Cards) -> None:
    write(cards)
    cards.device.unlink()
    flight = Flight(cards)
    _, told = flight.process.communicate(timeout=60)
    found: Any = values(cards)
    assert flight.process.returncode == 1
    assert f"card '{cards.device}' cannot be opened: no such file or directory" in told
    assert [found["ni", 1][-1], found["ni", 0][-1]] == [1.0, 8.0]
