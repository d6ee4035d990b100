"""Tests of the block hardware.digital_in. No card was at hand: comedi and nidaqmx are stand-ins."""

from __future__ import annotations

from pathlib import Path

import pytest

from quadvis_blocks.hardware._cards.frames import ChannelKind, encode
from quadvis_blocks.hardware._cards.ports import CardInputs, open_card
from quadvis_blocks.hardware.digital_in import DigitalIn
from tests.blocks.hardware.board_line import board
from tests.blocks.hardware.cards import standing_in


@pytest.mark.parametrize("inverted", [False, True])
def test_the_newest_lines_of_a_board_count(inverted: bool) -> None:
    with board(DigitalIn, channels=[2, 5], inverted=inverted) as line:
        assert line.step()["on"] == [False, False]
        found = line.step(encode(ChannelKind.DIGITAL, [(1, 0), (2, 1), (5, 0)]))
        assert found["on"] == [not inverted, inverted]
        assert line.step(encode(ChannelKind.DIGITAL, [(2, 0), (5, 2)]))["refused"] == 1


@pytest.mark.parametrize("port", ["comedi:DEVICE", "nidaqmx:Dev1"])
def test_the_lines_of_a_card_are_read(port: str, tmp_path: Path) -> None:
    with standing_in(tmp_path) as cards:
        settings = DigitalIn(port=port.replace("DEVICE", str(cards.device)), channels=[1, 2, 4]).settings
        assert isinstance(settings, CardInputs)
        opened = open_card(settings.card, sends=False)
        assert opened.read() == [0.0, 1.0, 1.0]
        opened.close()
