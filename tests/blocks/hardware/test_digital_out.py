"""Tests of the block hardware.digital_out. No card was at hand: comedi and nidaqmx are stand-ins."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import pytest

from quadvis.block import ParameterError
from quadvis.realtime.outlet import Outlet, OutputPort
from quadvis.testing import drive_output
from quadvis_blocks.hardware._cards.frames import decode
from quadvis_blocks.hardware.digital_out import DigitalOut
from tests.blocks.hardware.cards import standing_in


def device(**given: Any) -> DigitalOut:
    """Return a device with two lines, or as given."""
    return DigitalOut(
        **{"port": "pty:board", "channels": [4, 1], "initial": [False, True], "safe": [False, False], **given}
    )


def lines(frame: bytes) -> list[int]:
    """Return the levels of a frame."""
    found = decode(frame[:-1])
    assert found is not None and [*found.values] == [4, 1]
    return [*found.values.values()]


@pytest.mark.parametrize("inverted", [False, True])
def test_a_board_reads_the_commands_and_after_a_kill_the_safe_lines(inverted: bool) -> None:
    found = drive_output(device(inverted=inverted), command=[[True, True]])
    wanted = [[0, 1], [1, 1], [0, 0]]
    assert [lines(frame) for frame in (found.initial, *found.commands, found.safe)] == [
        [bit ^ inverted for bit in bits] for bits in wanted
    ]


@pytest.mark.parametrize("port", ["comedi:DEVICE", "nidaqmx:Dev1"])
def test_lines_of_a_card_have_initial_and_safe_values(port: str, tmp_path: Path) -> None:
    with standing_in(tmp_path) as cards:
        made = device(port=port.replace("DEVICE", str(cards.device)))
        outlet = Outlet(OutputPort.of(made, "out", made.port_given), lambda: None)
        outlet.open()
        outlet.serve(time.monotonic_ns(), safe=False)
        outlet.serve(time.monotonic_ns() + 10**9, safe=True)
        outlet.close()
        assert [each[1:] for each in cards.writes] == [
            ("digital", 3, 0), ("digital", 0, 1), ("digital", 3, 0), ("digital", 0, 0)
        ]  # fmt: skip


def test_a_line_that_is_named_twice_is_refused() -> None:
    with pytest.raises(ParameterError, match="channels must be different from each other"):
        device(channels=[1, 1])
