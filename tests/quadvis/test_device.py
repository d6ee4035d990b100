"""The contract of devices, and what a diagram with devices may do."""

from __future__ import annotations

import socket
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import quadvis
from quadvis.block import Counted, In, Initial, Input, Line, Out, Output, Param, ParameterError, Safe, Sealer
from quadvis.cli import main
from quadvis.errors import DiagramError, QuadvisError
from quadvis.library.describe import description
from quadvis.sweeps.sweep import sweep
from quadvis.testing import check_block, drive, drive_output
from quadvis.testing.conformance import CHECKS, Subject


class Thruster(Output):
    """Commands of a thruster board."""

    line = Line("baud")
    rate = "50 Hz"

    port = Param(type="port", doc="port")
    baud = Param(9600, "int64", min=1, doc="of the line")
    initial = Initial("thrust", doc="before")
    safe = Safe("thrust", doc="after")
    thrust = In("float64[n]", unit="N", doc="of each rotor")

    def frame(self, thrust: Any) -> bytes:
        """Return a letter and whole newtons."""
        return b"T" + bytes(int(each) for each in thrust)


class Scale(Input):
    """Weights, a letter and a digit each."""

    line = Line(9600)
    port = Param(type="port", doc="port")
    weight = Out(unit="N", doc="weight")

    def decode(self, received: bytearray) -> Iterator[Any]:
        """Take pairs off the beginning."""
        while len(received) >= 2:
            letter, digit = received[:2]
            del received[:2]
            yield (float(digit),) if letter == ord("W") else Counted.REFUSED


GIVEN = {"port": "pty:x", "initial": [1.0, 2.0], "safe": [3.0, 4.0]}


def test_an_output_says_its_frames_and_its_line() -> None:
    device = Thruster(**GIVEN)
    assert [device.initial_frame(), device.safe_frame()] == [b"T\1\2", b"T\3\4"]
    assert device.frame(np.array([7.0, 8.0])) == b"T\7\x08"
    assert (device.interval, device.settings.baud) == (0.02, 9600)
    assert Thruster(**GIVEN, baud=1800).settings == Line(1800)


def test_frames_are_delivered_at_each_step_and_the_safe_one_at_the_end(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    sent: list[bytes] = []
    monkeypatch.setattr(Thruster, "deliver", staticmethod(sent.append))
    drive(Thruster(**GIVEN), thrust=[[5.0, 6.0], [7.0, 8.0]])
    assert sent == [b"T\5\6", b"T\7\x08", b"T\3\4"]


def test_a_port_of_datagrams_needs_no_line() -> None:
    devices = Thruster(**GIVEN | {"port": "udp:craft:9"}), Scale(port="udp::9")
    assert [str(device.settings) for device in devices] == ["datagrams", "datagrams"]
    found = drive_output(Thruster(**GIVEN | {"port": "udp:craft:9", "baud": 1}), thrust=[[5.0, 6.0]])
    assert (found.initial, found.commands, found.safe) == (b"T\1\2", [b"T\5\6"], b"T\3\4")


class Networked(Scale):
    """Weights over a network alone."""

    line = None


def test_a_device_without_a_line_has_no_other_port_than_datagrams() -> None:
    with pytest.raises(ParameterError) as caught:
        Networked(port="/dev/ttyUSB0")
    assert str(caught.value) == "port must be such as udp:192.168.0.5:14550, got '/dev/ttyUSB0'"
    assert "device: input by the port of 'port'\n" in description("own.networked", Networked)


def test_of_datagrams_the_newest_counts_and_no_piece_belongs_to_the_next() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.bind(("127.0.0.1", 0))
        place = sender.getsockname()
        sender.connect(place)
        scale = Scale(port=f"udp::{place[1]}")
        sender.close()
        scale.open()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            for datagram in (b"W\1W\2W", b"W\3x", b"X\4", b"W\5"):
                sender.sendto(datagram, place)
            scale.read(1.0)
    assert scale.output() == (0.0, 3, 1, 5.0)
    scale.close()


def test_the_frames_of_a_device_say_how_long_it_is_held() -> None:
    class Held(Thruster):
        hold = "1.5 s"

    class HeldAsGiven(Thruster):
        hold = "kept"
        kept = Param(2.0, unit="s", doc="time of safe frames")

    assert [Thruster(**GIVEN).held, Held(**GIVEN).held, HeldAsGiven(**GIVEN, kept=3.0).held] == [0, 1.5, 3]


def test_what_a_sealer_adds_takes_its_time() -> None:
    class Numbered(Thruster):
        def sealer(self) -> Sealer:
            return Numbering()

    Thruster(**GIVEN, baud=2400)
    with pytest.raises(ParameterError, match=r"a frame of 7 bytes takes 29\.2 ms at 2400 baud 8N1"):
        Numbered(**GIVEN, baud=2400)


class Numbering:
    """Adds four bytes."""

    added = 4

    def seal(self, frame: bytes, now_ns: int) -> bytes:
        """Add the millisecond."""
        return frame + struct.pack("<I", now_ns // 10**6)


def test_devices_of_ones_own_pass_the_conformance_suite() -> None:
    module = ("one_block_in_its_module", "tested", "documented")
    for kind, given in ((Thruster, GIVEN), (Scale, {"port": "pty:x"})):
        inputs = {"thrust": [[1.0, 2.0], [3.0, 4.0]]} if kind is Thruster else {}
        for name, check in CHECKS.items():
            if name not in module:
                check(Subject(kind, given, inputs))


class Counting(Thruster):
    """Frames with a number, which nobody can know before."""

    def open(self) -> None:
        """Begin to count."""
        self._count = 0

    def frame(self, thrust: Any) -> bytes:
        """Return a number."""
        self._count = getattr(self, "_count", 0) + 1
        return bytes([self._count % 256])


class Careless(Scale):
    """Yields a number in place of a tuple."""

    def decode(self, received: bytearray) -> Iterator[Any]:
        """Take bytes off the beginning."""
        while received:
            yield float(received.pop(0))


@pytest.mark.parametrize(
    ("kind", "given", "check", "words"),
    [
        (Counting, GIVEN, "frames_follow_from_commands", "frame gives two frames of one command at step 0"),
        (
            Careless,
            {"port": "pty:x"},
            "outlives_hostile_bytes",
            "decode must yield a tuple of weight for each",
        ),
    ],
)
def test_the_suite_finds_what_devices_do_wrong(
    kind: type[Any], given: dict[str, Any], check: str, words: str
) -> None:
    with pytest.raises(AssertionError, match=words):
        CHECKS[check](Subject(kind, given, {"thrust": [[1.0, 2.0]]} if kind is Counting else {}))
    with pytest.raises(AssertionError, match=words):
        check_block(kind, given=given, inputs={"thrust": [[1.0, 2.0]]} if kind is Counting else {})


@pytest.mark.parametrize(
    ("given", "parameter", "words"),
    [
        (
            {"baud": 900}, "port",
            "a frame of 3 bytes takes 33.3 ms at 900 baud 8N1, and one is due every 20 ms; send fewer "
            "frames, or use a faster line",
        ),
        ({"safe": [300.0, 0.0]}, "safe", "safe gives no frame: bytes must be in range(0, 256)"),
        (
            {"port": "pty:1"}, "port",
            "port must be the path of a port, such as /dev/ttyUSB0, udp:HOST:PORT or pty:NAME, got 'pty:1'",
        ),
    ],
)  # fmt: skip
def test_what_cannot_be_sent_is_refused_when_the_block_is_made(
    given: dict[str, Any], parameter: str, words: str
) -> None:
    with pytest.raises(ParameterError) as caught:
        Thruster(**GIVEN | given)
    assert (caught.value.parameter, str(caught.value)) == (parameter, words)


def test_a_class_that_lacks_a_declaration_is_refused() -> None:
    with pytest.raises(
        TypeError, match="must ask for inputs that have an initial value each; declare initial ="
    ):

        class NoInitial(Output):
            line, rate = Line(9600), "50 Hz"
            port, u, safe = Param(type="port"), In(), Safe("u")

            def frame(self, u: Any) -> bytes:
                return b"u"

    with pytest.raises(TypeError, match=r"NoSafe\.write has no safe value for 'u'"):

        class NoSafe(Output):
            line, rate = Line(9600), "50 Hz"
            port, u, initial = Param(type="port"), In(), Initial("u")

            def frame(self, u: Any) -> bytes:
                return b"u"

    with pytest.raises(TypeError, match="must have a parameter of type port, a 'line' and a 'rate'"):

        class NoPort(Output):
            line, rate = Line(9600), "50 Hz"
            u, initial, safe = In(), Initial("u"), Safe("u")

            def frame(self, u: Any) -> bytes:
                return b"u"

    with pytest.raises(TypeError, match="must have one parameter of type port, and say its 'line'"):

        class NoLine(Input):
            port = Param(type="port")


def test_a_description_names_port_line_and_rate() -> None:
    text = description("hardware.thruster", Thruster)
    assert "device: output by the port of 'port', 'baud' baud 8N1, a frame every '50 Hz'" in text
    assert "initial value of thrust" in text
    assert "port: pty:name" in text


DIAGRAM = """\
quadvis: 1
name: devices
rates: {it: 20 Hz}
stop_time: 1 s
blocks:
  stick: {block: sources.constant, rate: it, with: {value: [0.5]}}
  out:
    block: hardware.sbus_out
    rate: it
    with: {port: "pty:rc", channels: [1], lowest: [0], highest: [1], initial: [0], safe: [0]}
    in: {command: stick.y}
"""
SECOND = """\
  more:
    block: hardware.sbus_out
    rate: it
    with: {port: PORT, channels: [1], lowest: [0], highest: [1], initial: [0], safe: [0]}
    in: {command: stick.y}
"""


SENDER = SECOND.replace("PORT", '"udp:craft:9"')


@pytest.fixture
def file(tmp_path: Path) -> Path:
    (tmp_path / "devices.yaml").write_text(DIAGRAM)
    return tmp_path / "devices.yaml"


def test_a_diagram_with_devices_is_checked_but_not_simulated(
    file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", str(file)]) == 0
    capsys.readouterr()
    assert main(["run", str(file), "--log", ""]) == 2
    words = "block 'out' reaches port 'pty:rc', and only a real-time run may do so; add --real-time\n"
    assert capsys.readouterr().err == words
    diagram = quadvis.load(file)
    for simulate in (diagram.start, diagram.analyse, lambda: sweep(file, over={"seed": "0..1"})):
        with pytest.raises(
            QuadvisError, match="only a real-time run may do so; choose a variant without devices"
        ):
            simulate()


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (
            SECOND.replace("PORT", '"pty:rc"'),
            "block 'more': port 'pty:rc' is that of block 'out'; name another one; a cable has one end "
            "for an output and one for an input",
        ),
        (SECOND.replace("PORT", "/dev/null"), ""),
        (
            SENDER + SENDER.replace("more", "also"),
            "block 'also': port 'udp:craft:9' is that of block 'more'; name another one",
        ),
    ],
)
def test_a_port_has_one_device(file: Path, more: str, words: str) -> None:
    file.write_text(DIAGRAM + more)
    if not words:
        quadvis.load(file)
        file.write_text(DIAGRAM.replace('"pty:rc"', "/dev/../dev/null") + more)
        words = "block 'more': port '/dev/null' is that of block 'out'; name another one"
    with pytest.raises(DiagramError) as caught:
        quadvis.load(file)
    assert str(caught.value).endswith(words)


def test_the_ends_of_a_cable_have_one_setting(file: Path) -> None:
    blocks = file.parent / "blocks" / "own"
    blocks.mkdir(parents=True)
    (blocks / "scale.py").write_text(
        "from quadvis.block import Input, Line, Out, Param\n"
        "class Scale(Input):\n"
        "    line, port, weight = Line(9600), Param(type='port'), Out()\n"
        "    def decode(self, received):\n        yield from ()\n"
    )
    file.write_text(DIAGRAM + '  scale: {block: own.scale, rate: it, with: {port: "pty:rc"}}\n')
    with pytest.raises(DiagramError) as caught:
        quadvis.load(file)
    words = "the two ends of 'pty:rc' are set to 100000 baud 8E2 and 9600 baud 8N1; give both one setting"
    assert str(caught.value).endswith(f":12:46: block 'scale': {words}")


def test_the_loss_of_the_host_is_part_of_the_hash_only_if_it_is_unusual(file: Path) -> None:
    usual = quadvis.load(file)
    assert usual.on_host_loss == "safe"
    for word, same in (("safe", True), ("continue", False), ("stop", False)):
        file.write_text(DIAGRAM.replace("stop_time", f"on_host_loss: {word}\nstop_time"))
        diagram = quadvis.load(file)
        assert (diagram.on_host_loss, diagram.hash == usual.hash) == (word, same)
        assert quadvis.api.load_text(diagram.resolved).on_host_loss == word
