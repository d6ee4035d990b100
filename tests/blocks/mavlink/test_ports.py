"""Blocks at one port of MAVLink: what a diagram refuses, and what goes out under one name."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import quadvis
from quadvis.errors import DiagramError
from quadvis_blocks.mavlink._dialect import dialect
from quadvis_blocks.mavlink._packets import LooseMessage, loosened
from quadvis_blocks.mavlink._sealer import PacketSealer
from tests.blocks.mavlink.pymavlink_peer import KEY, read

TEXT = """\
quadvis: 1
name: port
rates: {fast: 50 Hz}
stop_time: 1 s
blocks:
  first: {block: mavlink.autopilot, rate: fast, with: {port: "udp::14540" FIRST}}
  target:
    block: mavlink.attitude_target
    rate: fast
    with:
      port: "udp::14540" SECOND
      initial: {value: [0, 0, 0, 0], unit: rad rad rad 1}
      safe: {value: [0, 0, 0, 0], unit: rad rad rad 1}
    in: {command: {value: [0, 0, 0, 0], unit: rad rad rad 1}}
MORE
"""


def load(first: str = "", second: str = "", more: str = "", port: str = "udp::14540") -> None:
    text = TEXT.replace(" FIRST", first).replace(" SECOND", second).replace("MORE", more)
    Path("port.yaml").write_text(text.replace("udp::14540", port))
    quadvis.load("port.yaml")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_several_blocks_may_have_one_port() -> None:
    load()
    load(port="/dev/serial/by-id/usb-autopilot")


UDP, TTY = "udp::14540", "/dev/ttyX"
SECOND_READER = '  other: {block: mavlink.autopilot, rate: fast, with: {port: "udp::14540"}}'
RATES = """\
  out:
    block: mavlink.rate_target
    rate: fast
    with:
      port: "udp::14540"
      baud: 19200
      spacing: 60 ms
      initial: {value: [0, 0, 0, 0], unit: rad/s rad/s rad/s 1}
      safe: {value: [0, 0, 0, 0], unit: rad/s rad/s rad/s 1}
    in: {command: {value: [0, 0, 0, 0], unit: rad/s rad/s rad/s 1}}
"""
SBUS = """\
  sbus:
    block: hardware.sbus_out
    rate: fast
    with: {port: "udp::14540", channels: [1], lowest: [0], highest: [1], initial: [0], safe: [0]}
    in: {command: {value: [0]}}
"""


@pytest.mark.parametrize(
    ("first", "second", "more", "port", "words"),
    [
        (
            ", own_system: 255",
            "",
            "",
            UDP,
            "port 'udp::14540' is that of block 'first', too, which speaks there",
        ),
        ("", "\n      key: lab", "", UDP, "which speaks there under another name; give both the same"),
        ("", "", SECOND_READER, UDP, "two blocks would read there; let one block read"),
        ("", "\n      baud: 57600", "", TTY, "which sets it to 921600 baud 8N1; give both one setting"),
        ("", "", "", "pty:autopilot", "'pty:autopilot' is a cable between two blocks of the diagram"),
        (
            ", baud: 19200",
            "\n      baud: 19200\n      spacing: 80 ms",
            RATES,
            TTY,
            r"the frames of all blocks at '/dev/ttyX' take \d+% of its time",
        ),
        ("", "", SBUS, TTY, "port '/dev/ttyX' is that of block 'target'; name another one"),
    ],
)
def test_what_cannot_be_at_one_port_is_refused(
    first: str, second: str, more: str, port: str, words: str
) -> None:
    with pytest.raises(DiagramError, match=words):
        load(first, second, more, port)


def test_a_heartbeat_goes_out_once_a_second_beside_everything_else() -> None:
    sealer = PacketSealer(1, 191, 18)
    kind = dialect("common").names["COMMAND_LONG"]
    frame = loosened([LooseMessage(kind.number, kind.extra, kind.pack(command=511))])
    sent = b"".join(sealer.seal(frame if at % 3 == 0 else b"", at * 10**8) for at in range(50))
    found = list(read(sent))
    names = [each.get_type() for each in found]
    assert names.count("HEARTBEAT") == 5 and names.count("COMMAND_LONG") == 17 and len(names) == 22
    assert [each.get_seq() for each in found] == list(range(22))
    beat = found[names.index("HEARTBEAT")]
    assert (beat.type, beat.autopilot, beat.system_status, beat.mavlink_version) == (18, 8, 4, 3)


def test_sequence_numbers_begin_again_after_255() -> None:
    sealer = PacketSealer(1, 191, 18)
    kind = dialect("common").names["COMMAND_LONG"]
    frame = loosened([LooseMessage(kind.number, kind.extra, kind.pack(command=511))])
    found = list(read(b"".join(sealer.seal(frame, 0) for _ in range(600))))
    assert [each.get_seq() for each in found] == [number % 256 for number in range(601)]


@given(st.sampled_from(sorted(dialect("common").names)), st.booleans())
def test_a_sealed_frame_is_no_longer_than_the_sealer_says(name: str, signs: bool) -> None:
    class Times:
        sent, heard = 0, 0

    from quadvis_blocks.mavlink._signing import Signer

    kind = dialect("common").names[name]
    frame = loosened([LooseMessage(kind.number, kind.extra, b"\1" * kind.layout.size)])
    sealer = PacketSealer(1, 191, 18, key="lab" if signs else "")
    sealer._signer = Signer(KEY, 0, Times()) if signs else None  # type: ignore[arg-type]
    assert len(sealer.seal(frame, 0)) <= len(frame) + sealer.added


@pytest.mark.slow
def test_nothing_imports_pymavlink_before_a_block_of_it_is_made() -> None:
    code = """
import sys
from quadvis.library.catalogue import Catalogue
catalogue = Catalogue()
blocks = [catalogue.find(name) for name in catalogue.names() if name.startswith("mavlink.")]
assert len(blocks) >= 8
assert not [name for name in sys.modules if name.startswith("pymavlink")]
"""
    subprocess.run([sys.executable, "-c", code], check=True)
