"""Tests of the block hardware.dac_out. No card was at hand: comedi and nidaqmx are stand-ins."""

from __future__ import annotations

import math
import pickle
import struct
import time
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given as given_by
from hypothesis import strategies as st

from quadvis.block import ChannelError, ParameterError, PortError
from quadvis.realtime.outlet import Outlet, OutputPort
from quadvis.testing import drive, drive_output
from quadvis_blocks.hardware._cards.frames import ChannelKind, decode
from quadvis_blocks.hardware.dac_out import DacOut
from tests.blocks.hardware.cards import Cards, standing_in

GOLDEN = "06410180841e020603093d0590f63fff00"  # 2 V at channel 1, 4 V at channel 6
LEVELS = {"at_lowest": [1.0, 4.0], "at_highest": [3.0, 1.0]}


def device(**given: Any) -> DacOut:
    """Return a device with two channels of 0 to 5 V and commands from -1 to 1, or as given."""
    return DacOut(
        **{
            "port": "pty:board", "channels": [1, 6], "ranges": [0, 0], "lowest": [-1.0, -1.0],
            "highest": [1.0, 1.0], **LEVELS, "initial": [0.0, -1.0], "safe": [0.0, 1.0], **given,
        }
    )  # fmt: skip


def levels(frame: bytes) -> list[float]:
    """Return the levels (V) of a frame."""
    found = decode(frame[:-1])
    assert found is not None and found.kind is ChannelKind.ANALOG
    return [value / 1e6 for value in found.values.values()]


@pytest.fixture
def cards(tmp_path: Path) -> Iterator[Cards]:
    with standing_in(tmp_path) as made:
        yield made


def test_a_frame_is_what_the_documentation_says() -> None:
    body = b"A" + struct.pack("<BiBi", 1, 2_000_000, 6, 4_000_000)
    body += struct.pack("<I", zlib.crc32(body))
    frame = device().initial_frame()
    assert frame == bytes.fromhex(GOLDEN)
    assert 0 not in frame[:-1]
    rebuilt, place = b"", 0  # COBS undone as its paper has it
    while place < len(frame) - 1:
        code = frame[place]
        rebuilt += frame[place + 1 : place + code] + b"\0"
        place += code
    assert rebuilt[:-1] == body


def test_the_ends_of_a_command_are_those_of_its_level() -> None:
    made = device()
    found = [levels(made.frame(np.array(command))) for command in ([-1.0, 1.0], [0.5, 0.0], [7.0, -9.0])]
    assert found == [[1.0, 1.0], [2.5, 2.5], [3.0, 4.0]]
    assert levels(made.safe_frame()) == [2.0, 1.0]


def test_without_levels_the_command_is_the_level() -> None:
    ends = {"lowest": [0.5, -8.0], "highest": [4.5, 8.0], "initial": [2.5, 0.0], "safe": [2.5, 0.0]}
    made = device(**ends, ranges=[0, 3], at_lowest=[], at_highest=[])
    assert levels(made.frame(np.array([1.25, -9.0]))) == [1.25, -8.0]
    currents = {"lowest": [4e-3], "highest": [20e-3], "initial": [4e-3], "safe": [4e-3]}
    made = DacOut(port="pty:board", channels=[1], ranges=[4], **currents)
    assert levels(made.frame(np.array([0.0123]))) == [0.0123]


@given_by(st.lists(st.floats(allow_nan=False), min_size=2, max_size=2), st.floats(0.01, 100.0))
def test_no_level_is_ever_beyond_the_ends(command: list[float], slew: float) -> None:
    made = device(slew=slew)
    first, second = levels(made.frame(np.array(command)))
    assert 1.0 <= first <= 3.0
    assert 1.0 <= second <= 4.0
    sent = drive(made, command=[command, command], rate="20 Hz").sent
    assert (np.abs(sent) <= 1.0).all()


def test_sent_is_what_goes_out_and_changes_as_slowly_as_asked() -> None:
    sent: list[bytes] = []
    made = device(slew=2.0)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(DacOut, "deliver", staticmethod(sent.append))
        found = drive(made, command=[[1.0, -1.0]] * 12, rate="20 Hz").sent
    steps = np.minimum(0.1 * np.arange(1, 13), 1.0)
    assert found[:, 0] == pytest.approx(steps, abs=1e-6)
    assert found[:, 1].tolist() == [-1.0] * 12
    assert [levels(frame)[0] for frame in sent[:-1]] == pytest.approx(list(2.0 + steps), abs=1e-6)
    assert sent[-1] == made.safe_frame()


def test_a_board_reads_the_commands_and_after_a_kill_the_safe_levels() -> None:
    found = drive_output(device(), command=[[1.0, 0.0], [-1.0, 0.5]])
    assert [levels(frame) for frame in (found.initial, *found.commands, found.safe)] == [
        [2.0, 4.0], [3.0, 2.5], [1.0, 1.75], [2.0, 1.0],
    ]  # fmt: skip
    assert found.wire.endswith(2 * found.safe)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"channels": [6, 6]}, "channels must be different from each other"),
        ({"channels": [1, 256]}, "channels must be at most 255, got 256"),
        ({"ranges": [0, 5]}, "ranges must be at most 4, got 5"),
        ({"safe": [0.0, 1.5]}, "safe must lie between lowest and highest, element by element"),
        ({"initial": [-2.0, 0.0]}, "initial must lie between lowest and highest, element by element"),
        (
            {"at_highest": [5.5, 1.0]},
            "at_highest must lie between the ends of the ranges (0 to 5 V), element by element",
        ),
        (
            {"at_lowest": [], "at_highest": []},
            "lowest must lie between the ends of the ranges (0 to 5 V), element by element",
        ),
        ({"at_lowest": [1.0]}, "at_lowest must have 2 values, one for each channel"),
        ({"at_highest": []}, "at_highest must be given if at_lowest is, and only then"),
        ({"highest": [1.0, -1.0]}, "highest must be different from lowest, element by element"),
        ({"port": "comedi:"}, "port must be such as comedi:/dev/comedi0, got 'comedi:'"),
    ],
)
def test_what_cannot_be_put_out_is_refused(given: dict[str, Any], words: str) -> None:
    with pytest.raises(ParameterError) as caught:
        device(**given)
    assert str(caught.value) == words


def test_a_command_that_is_missing_is_an_error() -> None:
    with pytest.raises(ValueError, match="NaN"):
        device().frame(np.array([math.nan, 0.0]))


DRIVERS = ["comedi", "nidaqmx"]


def driven(cards: Cards, driver: str, **given: Any) -> DacOut:
    """Return a device at a card."""
    port = f"comedi:{cards.device}" if driver == "comedi" else "nidaqmx:Dev1"
    return device(**{"port": port, "channels": [1, 2], **given})


def outlet_of(made: DacOut, *frames: bytes) -> Outlet:
    """Return the outlet of a device, opened, as it is in the guardian's process."""
    newest = list(frames)
    port = pickle.loads(pickle.dumps(OutputPort.of(made, "out", made.port_given)))
    outlet = Outlet(port, lambda: newest.pop(0) if newest else None)
    outlet.open()
    return outlet


@pytest.mark.parametrize("driver", DRIVERS)
def test_all_channels_of_a_card_have_initial_commands_and_safe_levels(cards: Cards, driver: str) -> None:
    made = driven(cards, driver)
    outlet = outlet_of(made, made.initial_frame(), made.frame(np.array([1.0, 1.0])))
    for number, safe in enumerate((False, False, True)):
        outlet.serve(time.monotonic_ns() + number * 10**9, safe=safe)
    outlet.finish(time.monotonic_ns())
    found = [(what, channel, value) for _, what, channel, value in cards.writes]
    wanted = [2.0, 4.0, 3.0, 1.0, 2.0, 1.0]
    assert [each[1] for each in found] == [0, 1] * 3
    assert [value for *_, value in found] == pytest.approx(wanted, abs=5 / 4095)


@pytest.mark.parametrize("driver", DRIVERS)
def test_a_channel_that_refuses_keeps_no_other_from_its_value(cards: Cards, driver: str) -> None:
    outlet = outlet_of(driven(cards, driver))
    cards.refuse(0)
    for number, safe in enumerate((False, True)):
        with pytest.raises(ChannelError, match=r"channel 1 of '.*' cannot be written: "):
            outlet.serve(time.monotonic_ns() + number * 10**9, safe=safe)
    assert cards.last() == {1: pytest.approx(1.0, abs=5 / 4095)}
    cards.refuse()
    outlet.serve(time.monotonic_ns() + 3 * 10**9, safe=True)
    assert cards.last()[0] == pytest.approx(2.0, abs=5 / 4095)


@pytest.mark.parametrize("driver", DRIVERS)
def test_a_level_that_does_not_fit_into_whole_counts_stays_within_its_ends(cards: Cards, driver: str) -> None:
    made = driven(cards, driver, ranges=[0, 0], at_lowest=[0.0, 0.0], at_highest=[5.0, 5.0])
    for command in (-1.0, 1.0, 1 / 3):
        outlet_of(made, made.frame(np.full(2, command))).serve(time.monotonic_ns(), safe=False)
        level = 2.5 * (1 + command)
        assert cards.last()[0] == pytest.approx(level, abs=5 / 4095)
        assert 0.0 <= cards.last()[0] <= 5.0


def test_each_channel_of_a_card_has_the_range_of_its_code(cards: Cards) -> None:
    made = DacOut(
        port=f"comedi:{cards.device}",
        channels=[1, 2, 3, 4],
        ranges=[0, 1, 2, 3],
        lowest=[-1.0] * 4,
        highest=[1.0] * 4,
        at_lowest=[0.0, 0.0, -5.0, -10.0],
        at_highest=[5.0, 10.0, 5.0, 10.0],
        initial=[1.0] * 4,
        safe=[-1.0] * 4,
    )
    outlet_of(made).serve(time.monotonic_ns(), safe=False)
    assert cards.last() == {0: 5.0, 1: 10.0, 2: 5.0, 3: 10.0}
    current = {"lowest": [4e-3], "highest": [20e-3], "initial": [12e-3], "safe": [4e-3]}
    made = DacOut(port=f"comedi:{cards.device}:0", channels=[1], ranges=[4], **current)
    outlet_of(made).serve(time.monotonic_ns(), safe=False)
    assert cards.last()[0] == pytest.approx(12.0, abs=16 / 4095)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"channels": [1, 7]}, "channel 7 of 'comedi:DEVICE' does not exist: it has 6"),
        ({"port": "comedi:/dev/none"}, "card '/dev/none' cannot be opened: no such file or directory"),
        ({"port": "comedi:DEVICE:one"}, "'comedi:DEVICE:one' is no subdevice; write its number, as in"),
        ({"port": "comedi:DEVICE:1"}, "has no range 0 to 5 V; it has -5 to 5 V, -0.5 to 0.5 V, 0 to 10 V"),
        ({"port": "nidaqmx:Dev1", "channels": [1, 3]}, "channel 3 of 'nidaqmx:Dev1': Physical channel"),
    ],
)
def test_what_a_card_does_not_have_is_named(cards: Cards, given: dict[str, Any], words: str) -> None:
    path = str(cards.device)
    port = given.get("port", "comedi:DEVICE").replace("DEVICE", path)
    with pytest.raises(PortError) as caught:
        outlet_of(device(**{**given, "port": port}))
    assert words.replace("DEVICE", path)[:30] in str(caught.value)


@pytest.mark.parametrize(
    ("port", "words"),
    [
        (
            "comedi:/dev/comedi0",
            "port 'comedi:/dev/comedi0' needs the module comedi; install Debian's python3-comedilib, and "
            "make the environment with --system-site-packages",
        ),
        ("nidaqmx:Dev1", "port 'nidaqmx:Dev1' needs the module nidaqmx; install quadvis[daq]"),
    ],
)
def test_a_driver_that_is_not_installed_is_named(
    port: str, words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("quadvis_blocks.hardware._cards.ports.find_spec", lambda _: None)
    made = device(port=port)
    assert made.missing() == words
    with pytest.raises(PortError) as caught:
        outlet_of(made)
    assert str(caught.value) == words


def test_two_devices_may_have_one_card_but_no_channel_in_common() -> None:
    one, two = device(port="nidaqmx:Dev1"), device(port="nidaqmx:Dev1", channels=[2, 6])
    claims = [{*made.settings.claims(made.port_given)} for made in (one, two)]
    assert len(claims[0] & claims[1]) == 1


@pytest.mark.parametrize("driver", DRIVERS)
def test_safe_levels_need_no_import(cards: Cards, driver: str) -> None:
    outlet = outlet_of(driven(cards, driver))
    outlet.serve(time.monotonic_ns(), safe=False)

    def refuse(name: str, *_: Any, **__: Any) -> Any:
        raise AssertionError(f"{name} is imported")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("builtins.__import__", refuse)
        outlet.serve(time.monotonic_ns() + 10**9, safe=True)
        outlet.finish(time.monotonic_ns())
    assert cards.last() == {0: pytest.approx(2.0, abs=5 / 4095), 1: pytest.approx(1.0, abs=5 / 4095)}
