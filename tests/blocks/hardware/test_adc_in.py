"""Tests of the block hardware.adc_in. No card was at hand: comedi and nidaqmx are stand-ins."""

from __future__ import annotations

import contextlib
import math
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given as given_by
from hypothesis import strategies as st

import quadvis
from quadvis.block import Counted, ParameterError, PortError
from quadvis.errors import RunError
from quadvis.machine.capture import GOOD, HOPELESS, OPENING, STATUS, Post
from quadvis_blocks.hardware._cards.frames import LONGEST, ChannelKind, decode, encode
from quadvis_blocks.hardware._cards.ports import CardInputs, Reading
from quadvis_blocks.hardware._cards.reading import work
from quadvis_blocks.hardware.adc_in import AdcIn
from quadvis_blocks.hardware.dac_out import DacOut
from tests.blocks.hardware.board_line import Board, at_card, board
from tests.blocks.hardware.cards import Cards, standing_in
from tests.processes import wait_for

GIVEN: dict[str, Any] = {"channels": [3, 1], "ranges": [-10.0, 5.0]}


def frame(three: float, one: float) -> bytes:
    """Return a frame of a board with three channels."""
    return encode(ChannelKind.ANALOG, [(1, round(1e6 * one)), (2, 77), (3, round(1e6 * three))])


@pytest.fixture
def cards(tmp_path: Path) -> Iterator[Cards]:
    with standing_in(tmp_path) as made:
        yield made


def test_the_newest_frame_of_a_board_counts_and_ages() -> None:
    with board(AdcIn, **GIVEN) as line:
        first = line.step()
        assert all(map(math.isnan, [first["age"], *first["voltage"]]))
        assert line.step(frame(-2.5, 1.25))["voltage"] == [-2.5, 1.25]
        found = line.step(frame(1.0, 1.0) + frame(2.0, 3.0)[:-3])
        assert (found["voltage"], found["age"], found["lost"]) == ([1.0, 1.0], 0.0, 0)
        found = line.step()
        assert (found["voltage"], found["age"]) == ([1.0, 1.0], pytest.approx(0.01))
        found = line.step(frame(2.0, 3.0)[-3:] + frame(3.0, 4.0))
        assert (found["voltage"], found["lost"], found["refused"]) == ([3.0, 4.0], 1, 0)


def test_what_is_damaged_incomplete_or_impossible_is_refused_and_other_kinds_are_left_alone() -> None:
    with board(AdcIn, **GIVEN) as line:
        spoilt = bytearray(frame(1.0, 1.0))
        spoilt[4] ^= 1
        for number, came in enumerate(
            (
                bytes(spoilt),
                encode(ChannelKind.ANALOG, [(1, 0)]),
                frame(-10.51, 0.0),
                frame(0.0, -0.26),
                bytes([9] * 2000),
            )
        ):
            assert line.step(came)["refused"] >= number + 1
        before = line.step(b"\0")["refused"]
        found = line.step(encode(ChannelKind.DIGITAL, [(1, 1), (3, 1)]) + frame(-10.49, 5.24))
        assert (found["voltage"], found["refused"]) == ([-10.49, 5.24], before)


@given_by(st.lists(st.tuples(st.integers(1, 255), st.integers(-(2**31), 2**31 - 1)), max_size=40))
def test_a_frame_says_what_it_was_made_of(values: list[tuple[int, int]]) -> None:
    made = encode(ChannelKind.ANALOG, values)
    assert 0 not in made[:-1]
    assert len(made) <= LONGEST
    found = decode(made[:-1])
    assert found is not None and found.values == dict(values)


@given_by(st.data())
def test_a_frame_with_a_wrong_bit_is_refused(data: st.DataObject) -> None:
    made = bytearray(frame(1.5, -2.5))
    made[data.draw(st.integers(0, len(made) - 2))] ^= 1 << data.draw(st.integers(0, 7))
    block = AdcIn(port="pty:board", **GIVEN)
    assert set(block.decode(made)) <= {Counted.REFUSED}


def test_what_a_dac_puts_out_can_be_read() -> None:
    ends = {"lowest": [-10.0, 0.0], "highest": [10.0, 5.0], "initial": [0.0, 0.0], "safe": [0.0, 0.0]}
    made = DacOut(port="pty:board", channels=[3, 1], ranges=[3, 0], **ends)
    with board(AdcIn, **GIVEN) as line:
        assert line.step(made.frame(np.array([-7.25, 4.5])))["voltage"] == [-7.25, 4.5]


def until(line: Board, condition: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
    """Step until the outputs are as they should be."""
    found: dict[str, Any] = {}

    def step() -> bool:
        found.update(line.step())
        return condition(found)

    wait_for(step)
    return found


def test_a_process_of_its_own_reads_a_card_and_opens_it_again_after_a_loss(cards: Cards) -> None:
    block = AdcIn(port=f"comedi:{cards.device}", channels=[3, 1], ranges=[-10.0, 10.0], spacing=5e-3)
    with (
        pytest.raises(RunError, match=r"channel 1 of '.*' cannot be read: input/output error"),
        at_card(block) as line,
    ):
        found = until(line, lambda found: 0.0 < found["age"] < 0.3)
        assert found["voltage"] == pytest.approx([-10.0 + 200 / 4095 * 20, 0.0])
        cards.refuse(0)
        until(line, lambda found: found["age"] > 0.3)
        cards.refuse()
        until(line, lambda found: found["age"] < 0.3)
        cards.refuse(0)
        until(line, lambda found: found["age"] > 0.3)


class Ends(Exception):
    """Enough has been read."""


class Reader:
    """The work of the process that reads a card, here."""

    def __init__(self, block: AdcIn, count: int = 2, then: Exception | None = None) -> None:
        settings = block.settings
        assert isinstance(settings, CardInputs)
        request = settings.request
        post = Post(np.zeros(Post.size(request.room), np.int64), request.room)
        self.records: list[dict[int, int]] = []

        def put(instant: int, number: int, pieces: list[bytes]) -> None:
            found = decode(pieces[0][:-1])
            assert found is not None and number == len(self.records) + 1
            self.records.append(dict(found.values))
            if len(self.records) == count:
                raise then or Ends

        post.put = put  # type: ignore[method-assign,assignment]
        assert isinstance(request.about, Reading)
        with contextlib.suppress(Ends):
            work(post, request.about)
        self.status, self.text, self.hopeless = post.words[STATUS], post.text, bool(post.words[HOPELESS])


def test_a_card_is_read_in_the_range_and_between_the_wires_that_were_asked_for(cards: Cards) -> None:
    cards.module.values["subdevice 1", 0] = 0
    cards.module.values["subdevice 1", 1] = 4095
    port = f"comedi:{cards.device}"
    read = Reader(AdcIn(port=port, channels=[1, 2], ranges=[-0.5, 10.0], mux="differential"))
    assert read.records == [{1: -500_000, 2: 10_000_000}] * 2
    assert cards.module.asked[:2] == [(1, 0, 1, 2), (1, 1, 2, 2)]
    assert (read.status, read.text) == (GOOD, f"comedi:{cards.device} is read")
    Reader(AdcIn(port=port, channels=[1], ranges=[-5.0]))
    assert cards.module.asked[-1] == (1, 0, 0, 0)


def test_a_card_of_national_instruments_is_read(cards: Cards) -> None:
    cards.module.values["ai", 4] = -3.25
    read = Reader(AdcIn(port="nidaqmx:Dev1", channels=[5, 2], ranges=[-10.0, -10.0]))
    assert read.records == [{5: -3_250_000, 2: 500_000}] * 2
    assert Reader(AdcIn(port="nidaqmx:Dev1", channels=[2], ranges=[5.0])).records == [{2: 500_000}] * 2


def test_a_card_that_is_lost_or_refuses_says_why(cards: Cards) -> None:
    block = AdcIn(port="nidaqmx:Dev1", channels=[1], ranges=[5.0])
    lost = Reader(block, then=PortError("gone"))
    assert (lost.status, lost.text, lost.hopeless) == (OPENING, "gone", False)
    cards.refuse(0)
    assert Reader(block).text == "card 'nidaqmx:Dev1' cannot be read: The device is not accessible."
    refused = Reader(AdcIn(port=f"comedi:{cards.device}", channels=[1], ranges=[7.0]))
    assert refused.hopeless
    assert "has no range 0 to 7 V; it has -5 to 5 V, -0.5 to 0.5 V, 0 to 10 V, -10 to 10 V" in refused.text


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"ranges": [0.0, 5.0]}, "ranges must be different from 0 V, element by element"),
        ({"channels": [1, 1]}, "channels must be different from each other"),
        ({"port": "nidaqmx:"}, "port must be such as nidaqmx:Dev1, got 'nidaqmx:'"),
        (
            {"mux": "both"},
            "mux must be one of single_ended, differential, got 'both'; choose from 'single_ended', "
            "'differential'",
        ),
    ],
)
def test_what_cannot_be_read_is_refused(given: dict[str, Any], words: str) -> None:
    with pytest.raises(ParameterError) as caught:
        AdcIn(**{"port": "pty:board", **GIVEN, **given})
    assert str(caught.value) == words


def test_a_pty_is_no_card(tmp_path: Path) -> None:
    block = AdcIn(port=os.fspath(tmp_path / "none"), **GIVEN)
    assert "is missing; plug the device in" in block.missing()


DIAGRAM = """\
quadvis: 1
name: sticks
rates: {fast: 50 Hz}
overload: {max: 1000, consecutive: 1000, action: warn}
stop_time: 1 s
computers: {target: {}, radio: {}}
blocks:
  stick: {block: sources.constant, rate: fast, at: target, with: {value: {value: [1.25, 3.5], unit: V}}}
  out:
    block: hardware.dac_out
    rate: fast
    at: target
    with:
      port: "pty:sticks"
      channels: [1, 2]
      ranges: [0, 0]
      lowest: [1 V, 1 V]
      highest: [4 V, 4 V]
      initial: [2.5 V, 2.5 V]
      safe: [1 V, 2.5 V]
    in: {command: stick.y}
  read:
    block: hardware.adc_in
    rate: fast
    at: radio
    with: {port: "pty:sticks", channels: [2, 1], ranges: [5 V, 5 V]}
"""


@pytest.mark.slow
def test_a_cable_brings_what_a_board_puts_out_to_what_another_one_measures(tmp_path: Path) -> None:
    (tmp_path / "sticks.yaml").write_text(DIAGRAM)
    result = quadvis.load(tmp_path / "sticks.yaml").run(real_time=quadvis.RealTime(priority=0, poll="0 s"))
    assert result["read.voltage"][-1].tolist() == [3.5, 1.25]
    assert result["read.refused"][-1] <= 1  # the first bytes may be the rest of a frame
