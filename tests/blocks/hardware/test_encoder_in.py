"""Tests of the block hardware.encoder_in. No card was at hand: comedi and nidaqmx are stand-ins."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis_blocks.hardware._cards.frames import ChannelKind, encode
from quadvis_blocks.hardware._cards.ports import CardInputs, open_card
from quadvis_blocks.hardware.encoder_in import EncoderIn
from tests.blocks.hardware.board_line import board
from tests.blocks.hardware.cards import standing_in


def counts(*values: int) -> bytes:
    """Return the frame of a board's counters."""
    return encode(ChannelKind.COUNTS, list(enumerate(values, 1)))


def test_counts_go_on_beyond_the_ends_of_a_counter() -> None:
    scale = [2 * math.pi / 4000, -1e-5]
    with board(EncoderIn, channels=[1, 2], bits=16, scale=scale) as line:
        assert all(map(math.isnan, line.step()["position"]))
        assert line.step(counts(65000, 10))["count"] == [0, 0]
        assert line.step(counts(464, 65526))["count"] == [1000, -20]
        found = line.step(counts(30000, 40000) + counts(60000, 20000))
        assert found["count"] == [1000 + 59536, -20 - 45526]
        assert found["position"] == pytest.approx(np.array(found["count"]) * scale)
        assert found["lost"] == 1


@given(
    st.integers(2, 32).flatmap(
        lambda bits: st.tuples(
            st.just(bits),
            st.lists(st.integers(-(1 << (bits - 1)), (1 << (bits - 1)) - 1), min_size=1, max_size=30),
        )
    )
)
def test_any_row_of_steps_of_less_than_half_a_turn_is_followed(case: tuple[int, list[int]]) -> None:
    bits, steps = case
    block = EncoderIn(port="pty:board", channels=[1], bits=bits, scale=[1.0])
    block._count = None
    count = 12345
    block.message(np.array([count % (1 << bits)]))
    total = 0
    for step in steps:
        count, total = count + step, total + step
        found = block.message(np.array([count % (1 << bits)]))
        assert found is not None and found[1].tolist() == [total]


def test_the_first_count_of_an_absolute_encoder_is_its_position() -> None:
    with board(EncoderIn, channels=[2], bits=12, scale=[0.5], first="count") as line:
        assert line.step(counts(7, 4095))["position"] == [-0.5]
        assert line.step(counts(7, 1))["position"] == [0.5]


@pytest.mark.parametrize("port", ["comedi:DEVICE", "nidaqmx:Dev1"])
def test_the_counters_of_a_card_are_read(port: str, tmp_path: Path) -> None:
    with standing_in(tmp_path) as cards:
        cards.module.values["subdevice 4", 1] = cards.module.values["ctr", 1] = 321
        made = EncoderIn(port=port.replace("DEVICE", str(cards.device)), channels=[2, 1], scale=[1.0, 1.0])
        assert isinstance(made.settings, CardInputs)
        opened = open_card(made.settings.card, sends=False)
        assert opened.read() == [321.0, 0.0]
        opened.close()
