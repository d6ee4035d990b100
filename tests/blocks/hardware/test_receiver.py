"""What a loss of the link makes of a pilot's commands, of all inputs of radio control."""

from __future__ import annotations

import socket
from typing import Any

import numpy as np
import pytest
from hypothesis import given as drawn
from hypothesis import settings
from hypothesis import strategies as st

from quadvis.block import ParameterError
from quadvis.testing.alone import ALONE, alone
from quadvis.units import parse_period
from quadvis_blocks.hardware import _crsf, _sbus
from quadvis_blocks.hardware._receiver import RadioLink, ReceiverInput
from quadvis_blocks.hardware.crsf_in import CrsfIn
from quadvis_blocks.hardware.sbus_in import SbusIn
from tests.blocks.hardware.receivers import counts, given, receiving

KINDS: list[tuple[type[ReceiverInput], Any]] = [(SbusIn, _sbus.encode), (CrsfIn, _crsf.encode)]
ROLES = "throttle stick arm switch"
CHANNELS = [3, 1, 5, 6]


def sent(encode: Any, values: list[int]) -> bytes:
    made = [992] * 16
    for channel, value in zip(CHANNELS, values, strict=True):
        made[channel - 1] = value
    return bytes(encode(made))


@pytest.mark.parametrize(("kind", "encode"), KINDS)
def test_from_the_last_frame_to_the_loss_the_throttle_never_rises_and_then_it_is_at_its_minimum(
    kind: type[ReceiverInput], encode: Any
) -> None:
    random = np.random.default_rng(6)
    with receiving(kind, rate="50 Hz", **given(CHANNELS, ROLES)) as made:
        for _ in range(20):
            values = [int(value) for value in random.integers(172, 1812, 4)]
            whole = sent(encode, values)
            for _ in range(30):
                row = made.step(whole)
            assert row["good"] and row["command"] == pytest.approx([value - 992 for value in values])
            cut = int(random.integers(len(whole)))  # the last one stops in the middle
            rows = [made.step(whole[:cut]), *(made.step() for _ in range(40))]
            throttles = [each["command"][0] for each in rows]
            assert max(throttles) == row["command"][0]
            assert throttles == pytest.approx(25 * [values[0] - 992] + 16 * [-820])
            assert rows[-1]["command"] == [-820, -0.5, -820, -820] and not rows[-1]["good"]
            made.step(b"\0" * 64)  # what was cut off is no beginning of the next one


@pytest.mark.parametrize(("kind", "encode"), KINDS)
def test_receivers_that_send_zeros_without_a_flag_move_nothing(
    kind: type[ReceiverInput], encode: Any
) -> None:
    """ardupilot #9400: frames with zeros in three channels around a failsafe, for up to 0.4 s."""
    roles = "stick throttle arm switch switch"
    with receiving(kind, rate="50 Hz", **given([1, 3, 5, 9, 10], roles, lost_after=0.3)) as made:
        for _ in range(50):
            good = made.step(encode(counts(c3=1200)))
        held, lost = good["command"], [-0.5, -820.0, -820.0, -820.0, -820.0]
        assert good["good"] and held == pytest.approx([0.0, 208.0, 0.0, 0.0, 0.0])
        rows = [made.step(encode(counts(c3=1500, c5=0, c9=0, c10=0))) for _ in range(20)]
        assert [row["command"] for row in rows] == 15 * [held] + 5 * [lost]
        assert [row["age"] for row in rows] == pytest.approx([0.02 * number for number in range(1, 21)])
        after = [made.step(encode(counts(c3=1300))) for _ in range(50)]
        assert after[0]["refused"] == 20 and after[-1]["refused"] == 20
        assert [row["good"] for row in after] == [False] * 4 + [True] * 46
        assert [row["command"] for row in after[:4]] == 4 * [lost]
        assert after[4]["command"] == pytest.approx([0.0, 308.0, 0.0, 0.0, 0.0])


@pytest.mark.parametrize(("kind", "encode"), KINDS)
def test_what_an_element_becomes_can_be_declared(kind: type[ReceiverInput], encode: Any) -> None:
    said = given(CHANNELS, ROLES, on_loss="-700 hold high centre", lost_after=0.1)
    with receiving(kind, rate="50 Hz", **said) as made:
        assert made.step()["command"] == [-700, -0.5, 819, -0.5]  # nothing to hold yet
        row = made.step(7 * sent(encode, [1000, 300, 172, 1800]))
        assert (row["command"], row["good"], row["heard"]) == ([8, -692, -820, 808], True, True)
        rows = [made.step() for _ in range(8)]
        assert [each["good"] for each in rows] == 5 * [True] + 3 * [False]
        assert rows[-1]["command"] == [-700, -692, 819, -0.5] and rows[-1]["heard"]


@pytest.mark.parametrize(("kind", "encode"), KINDS)
def test_a_datagram_is_a_whole_frame_that_nothing_need_follow(kind: type[ReceiverInput], encode: Any) -> None:
    random = np.random.default_rng(7)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as peer:
        peer.bind(("127.0.0.1", 0))
        place = peer.getsockname()
        peer.close()
        said = given(CHANNELS, ROLES, port=f"udp:127.0.0.1:{place[1]}")
        engine = alone(kind(**said), {}, {"n": 4}, parse_period("50 Hz"))
        with engine, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            for number in range(300):
                values = [int(value) for value in random.integers(172, 1812, 4)]
                sender.sendto(sent(encode, values), place)
                engine.run(1)
                if number >= 5:
                    wanted = pytest.approx([value - 992 for value in values])
                    assert engine.read(ALONE, "command").tolist() == wanted
            assert engine.read(ALONE, "refused") == 0


def test_a_reversed_channel_has_its_low_end_on_the_other_side() -> None:
    block = CrsfIn(
        port="pty:rc", channels=[1, 2], lowest=[1.0, 1.0], highest=[0.0, -1.0], roles="throttle arm"
    )
    with receiving(
        CrsfIn, **{name: getattr(block, name) for name in ("channels", "lowest", "highest", "roles")}
    ) as made:
        assert made.step()["command"] == [0.0, -1.0]


@pytest.mark.parametrize("kind", [SbusIn, CrsfIn])
@pytest.mark.parametrize("word", ["centre", "hold", "high", "0.5"])
def test_a_throttle_that_does_not_go_to_its_minimum_is_a_warning(
    kind: type[ReceiverInput], word: str
) -> None:
    (doubt,) = kind(**given([1, 3], "stick throttle", on_loss=f"centre {word}")).doubts()
    assert doubt.parameter == "on_loss"
    assert str(doubt).startswith("on_loss leaves a throttle above its minimum")


@pytest.mark.parametrize("on_loss", ["", "hold low", "high -820"])
def test_a_throttle_at_its_minimum_is_none(on_loss: str) -> None:
    assert CrsfIn(**given([1, 3], "stick throttle", on_loss=on_loss)).doubts() == []


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"roles": "stick"}, "roles must have 2 words, one for each element, got 1"),
        (
            {"roles": "stick trottle"},
            "roles must be words such as throttle, arm, stick, switch, got 'trottle'",
        ),
        ({"roles": "stick 3"}, "roles must be words such as throttle, arm, stick, switch, got '3'"),
        ({"on_loss": "low"}, "on_loss must have 2 words, one for each element, got 1"),
        ({"on_loss": "low nan"}, "on_loss must be words such as low, centre, high, hold, got 'nan'"),
        ({"on_loss": "low 820"}, "on_loss must lie between lowest and highest, element by element, got 820"),
        ({"lost_after": 1.5}, "lost_after must be at most 1 s, got 1.5 s"),
        ({"channels": [1, 17]}, "channels must be at most 16, got 17"),
        ({"channels": [3, 3]}, "channels must be different from each other"),
        ({"shortest": 2000.0, "longest": 1000.0}, "longest must be above shortest"),
    ],
)
def test_what_cannot_be_meant_is_refused(wrong: dict[str, Any], words: str) -> None:
    with pytest.raises(ParameterError) as caught:
        CrsfIn(**{**given([1, 3], "stick throttle"), **wrong})
    assert str(caught.value).startswith(words)


@settings(max_examples=80)
@drawn(
    st.lists(
        st.tuples(st.floats(0.0, 0.4), st.sampled_from(["frame", "spoilt", "silence", "lose"])), max_size=60
    )
)
def test_a_link_is_good_only_after_five_frames_in_a_row_and_never_after_a_silence(
    events: list[tuple[float, str]],
) -> None:
    link, now, row, last = RadioLink(0.5), 0.0, 0, -np.inf
    for wait, event in events:
        was_good, now = link.good, now + wait
        link.silence(now)
        assert link.good == (was_good and now - last <= 0.5 + 1e-9)
        row = row if now - last <= 0.5 else 0
        if event == "frame":
            row, last = row + 1, now
            assert link.frame(now) == (link.good or row >= 5) == link.good
        elif event == "spoilt":
            link.spoilt()
            row = 5 if link.good else 0
        elif event == "lose":
            link.lose()
            row = 0
            assert not link.good
