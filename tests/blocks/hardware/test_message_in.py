"""Tests of the block hardware.message_in."""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import quadvis
from quadvis.block import Line, ParameterError
from quadvis.errors import DiagramError
from quadvis.machine.datagrams import Datagrams
from quadvis.testing.alone import ALONE, alone
from quadvis.units import parse_period
from quadvis_blocks.hardware._protocol.checksums import xor
from quadvis_blocks.hardware._protocol.encode import encode
from quadvis_blocks.hardware.message_in import MessageIn
from tests.blocks.hardware.protocol.protocols import BYTES, NMEA
from tests.blocks.hardware.pty_pair import filled, heard, put

LAB = str(Path(__file__).parents[3] / "diagrams" / "protocols" / "lab_imu.yaml")


class Reader:
    """The block at the end of a pty, and its peer."""

    def __init__(self, rate: str = "100 Hz", **given: Any) -> None:
        self.peer, self.port = os.openpty()
        self.block = MessageIn(**{"port": os.ttyname(self.port), **given})
        self.engine = alone(self.block, {}, {}, parse_period(rate))
        self.names = [*self.block.interface.outputs]

    def step(self, came: bytes = b"") -> dict[str, Any]:
        put(self.peer, self.port, came)
        self.engine.run(1)
        return {name: np.asarray(self.engine.read(ALONE, name)).tolist() for name in self.names}

    def heard(self, count: int = 0) -> bytes:
        """Return what the block has sent."""
        return heard(self.peer, count)


@contextmanager
def reading(**given: Any) -> Iterator[Reader]:
    made = Reader(**given)
    with made.engine:
        yield made
    os.close(made.peer)
    os.close(made.port)


def line(roll: float) -> bytes:
    block = MessageIn(port="pty:imu", protocol=LAB)
    return encode(block.described.message, [roll, 0.25, np.array([1.0, -2.0, 0.5])])


def test_outputs_follow_from_the_protocol() -> None:
    block = MessageIn(port="pty:imu", protocol=LAB)
    outputs = block.interface.outputs
    assert [*outputs] == ["age", "lost", "refused", "others", "starting", "roll", "pitch", "rates"]
    assert [(outputs[name].type, outputs[name].unit) for name in ("roll", "rates")] == [
        ("float64", "rad"),
        ("float64[3]", "rad/s"),
    ]
    assert block.settings == Line(230400)
    assert MessageIn(port="pty:imu", protocol=LAB, baud=9600, rts=True).settings == Line(9600, rts=True)
    assert MessageIn(port="udp::4000", protocol=LAB).settings == Datagrams(False)
    assert MessageIn(port="udp::4000", protocol=LAB, settle=2.0).settings.settle == 2.0


def test_the_newest_message_counts_and_ages() -> None:
    with reading(protocol=LAB) as reader:
        assert np.isnan(reader.step()["age"])
        found = reader.step(line(0.1) + line(0.2)[:20])
        assert (found["age"], found["roll"], found["rates"]) == (0.0, 0.1, [1.0, -2.0, 0.5])
        found = reader.step(line(0.2)[20:] + line(0.3) + line(0.4))
        assert (found["age"], found["lost"], found["roll"]) == (0.0, 2, 0.4)
        assert reader.step()["age"] == pytest.approx(0.01)
        found = reader.step(line(0.5).replace(b"0.5", b"0.6"))
        assert (found["age"], found["refused"], found["roll"]) == (pytest.approx(0.02), 1, 0.4)


@pytest.mark.slow
def test_however_long_a_run_the_age_stays_and_what_is_skipped_is_counted() -> None:
    """D2: a sensor at 200 Hz, a task at 50 Hz, 60 s."""
    with reading(protocol=LAB, rate="50 Hz") as reader:
        sent, ages = 0, []
        for _ in range(3000):
            piece = b"".join(line_of(number) for number in range(sent, sent + 4))
            sent += 4
            found = reader.step(piece)
            ages.append(found["age"])
            assert round(1e6 * found["roll"]) == (sent - 1) % 1000
        assert max(ages) == 0.0  # read in the step in which the newest came: less than 25 ms old
        assert found["lost"] == 3 * 3000


def line_of(number: int) -> bytes:
    """Return a line with a number in its roll, quickly."""
    body = b"IMU,0.%06d,0.0,0.0,0.0,0.0" % (number % 1000)
    import binascii

    return b"$%s*%04X\r\n" % (body, binascii.crc_hqx(body, 0xFFFF))


def test_after_a_long_pause_old_messages_do_not_count() -> None:
    with reading(protocol=LAB) as reader:
        reader.step(line(0.1))
        os.set_blocking(reader.peer, False)
        written = filled(reader.peer, reader.port, 400 * line(0.9))
        found = reader.step()
        assert (found["roll"], found["age"]) == (0.1, pytest.approx(0.01))
        assert found["lost"] > 50
        rest = line(0.9)[written % len(line(0.9)) :] if written % len(line(0.9)) else b""
        found = reader.step(rest + line(0.2))
        assert (found["roll"], found["age"]) == (0.2, 0.0)


def test_while_the_device_starts_nothing_is_sent_and_nothing_counts(tmp_path: Path) -> None:
    """D1: a board that needs 2 s after its port was opened."""
    path = tmp_path / "imu.yaml"
    path.write_text(
        Path(LAB).read_text().replace("line: {baud: 230400}", "line: {baud: 230400, settle: 2 s}\n"
                                      "initialise: '$GO\\r\\n'\nterminate: ['$END\\r\\n']")
    )  # fmt: skip
    with reading(protocol=str(path)) as reader:
        for step in range(200):
            found = reader.step(line(0.3) + b"boot: 17 %\r\n" * (step % 7 == 0))
            assert found["starting"] and np.isnan(found["age"]) and found["roll"] == 0.0
            assert (found["lost"], found["refused"]) == (0, 0)
        assert reader.heard() == b""
        found = reader.step(line(0.4))  # what came until now came while it started
        assert not found["starting"] and np.isnan(found["age"])
        assert reader.heard(5) == b"$GO\r\n"
        found = reader.step(line(0.5))
        assert (found["roll"], found["age"], found["refused"], reader.heard()) == (0.5, 0.0, 0, b"")
        peer = os.dup(reader.peer)
    assert os.read(peer, 100) == b"$END\r\n"
    os.close(peer)


def test_nothing_hangs_up_at_the_end_and_the_lines_stay_low() -> None:
    import termios

    with reading(protocol=LAB) as reader:
        flags = termios.tcgetattr(reader.port)[2]
        assert not flags & termios.HUPCL


def test_a_request_is_sent_at_each_step_and_never_waits(tmp_path: Path) -> None:
    path = tmp_path / "asked.yaml"
    text = Path(LAB).read_text().replace("    checksum:", "    request: '?IMU\\r\\n'\n    checksum:")
    path.write_text(text)
    with reading(protocol=str(path)) as reader:
        reader.step()
        reader.step(line(0.1))
        assert reader.heard(12) == b"?IMU\r\n" * 2
        for _ in range(3_000):  # far more than the system keeps, if nobody hears
            reader.engine.run(1)
        assert reader.step(line(0.2))["roll"] == 0.2


def test_messages_of_other_kinds_are_counted(tmp_path: Path) -> None:
    path = tmp_path / "nmea.yaml"
    path.write_text(NMEA)
    with reading(protocol=str(path), message="depth", baud=4800) as reader:
        gll = b"GPGLL,4807.038,N,01131.000,E,123519,A"
        dpt = b"SDDPT,12.5,"
        data = b"".join(b"$%s*%02X\r\n" % (body, xor(body)) for body in (gll, dpt, b"GPZDA,1", gll))
        found = reader.step(data)
        assert (found["others"], found["refused"], found["depth"]) == (3, 0, 12.5)
        assert np.isnan(found["keel"])


def test_a_format_in_the_diagram_does_the_same() -> None:
    given = {
        "format": "<3hB", "names": "gyro mode", "units": "deg/s 1", "header": "\\xAA",
        "checksum": "crc16_modbus", "baud": 115200,
    }  # fmt: skip
    with reading(**given) as reader:
        message = reader.block.described.message
        found = reader.step(encode(message, [np.radians([90.0, -45.0, 0.0]), 3]))
        assert found["gyro"] == pytest.approx(np.radians([90.0, -45.0, 0.0]))
        assert (found["mode"], reader.block.interface.outputs["mode"].type) == (3, "int64")


@pytest.mark.parametrize(
    ("given", "parameter", "words"),
    [
        ({}, "format", "a block has a protocol, which is a file, or a format, such as %f,%f or <3h"),
        ({"protocol": LAB, "format": "<h"}, "protocol", "give one"),
        ({"protocol": LAB, "names": "a"}, "names", "names goes with a format, and the protocol says it"),
        ({"protocol": LAB, "message": "im"}, "message", "there is no message 'im' in the"),
        ({"format": "<h", "names": "a", "checksum": "none"}, "format", "'format' cannot be found in"),
        ({"format": "<h", "names": "a", "checksum": "xor"}, "baud", "baud is missing; give it, or let the"),
        ({"format": "<h", "names": "age", "checksum": "xor"}, "names", "'age' has another meaning"),
        ({"format": "<h", "names": "read", "checksum": "xor"}, "names", "'read' has another meaning"),
        ({"format": "<h", "names": "class", "checksum": "xor"}, "names", "'class' has another meaning"),
        ({"format": "<h", "names": "_port", "checksum": "xor"}, "names", "'_port' has another meaning"),
    ],
)  # fmt: skip
def test_what_cannot_be_read_is_refused(given: dict[str, Any], parameter: str, words: str) -> None:
    with pytest.raises(ParameterError) as caught:
        MessageIn(port="/dev/ttyUSB0", **given)
    assert (caught.value.parameter, words in str(caught.value)) == (parameter, True), str(caught.value)


def test_names_in_a_file_that_mean_something_else_have_their_place(tmp_path: Path) -> None:
    path = tmp_path / "imu.yaml"
    path.write_text(BYTES.replace("name: gyro", "name: lost").replace("name: armed", "name: line"))
    with pytest.raises(DiagramError) as caught:
        MessageIn(port="pty:imu", protocol=str(path), message="imu")
    assert [fault.place.line for fault in caught.value.faults] == [15, 23]
    with pytest.raises(ParameterError, match="message is missing; choose from 'imu', 'status'"):
        MessageIn(port="pty:imu", protocol=str(path))


def test_a_weak_checksum_is_a_warning_that_says_what_to_expect(tmp_path: Path) -> None:
    path = tmp_path / "imu.yaml"
    for kind, words in (
        ("xor", "message 'imu' has the checksum xor: with 1 % of the bytes damaged, some 1"),
        ("none", "message 'imu' has no checksum: with 1 % of the bytes damaged, some "),
        ("sum8", "of a million messages would give wrong values; choose a CRC of 16 bits or more"),
    ):
        path.write_text(Path(LAB).read_text().replace("crc16_ccitt_false", kind))
        (doubt,) = MessageIn(port="pty:imu", protocol=str(path)).doubts()
        assert words in str(doubt) and doubt.parameter == "protocol"
    assert MessageIn(port="pty:imu", protocol=LAB).doubts() == []


def test_check_reports_all_faults_of_the_file_at_their_places(tmp_path: Path) -> None:
    text = Path(LAB).read_text().replace("%.6f", "%s").replace("crc16_ccitt_false", "crc16")
    (tmp_path / "imu.yaml").write_text(text)
    head = "quadvis: 1\nname: x\nrates: {fast: 100 Hz}\nstop_time: 1 s\nblocks:\n"
    entry = "  imu: {block: hardware.message_in, rate: fast, with: {port: pty:imu, protocol: imu.yaml}}\n"
    (tmp_path / "x.yaml").write_text(head + entry)
    with pytest.raises(DiagramError) as caught:
        quadvis.load(tmp_path / "x.yaml")
    places = [(Path(fault.place.file).name, fault.place.line) for fault in caught.value.faults]
    assert places == [("imu.yaml", line) for line in (13, 14, 16, 22)]
    assert all(fault.subject == "block 'imu', protocol 'lab_imu'" for fault in caught.value.faults)
    (tmp_path / "x.yaml").write_text(head + entry.replace("imu.yaml", "imv.yaml"))
    with pytest.raises(DiagramError) as caught:
        quadvis.load(tmp_path / "x.yaml")
    (fault,) = caught.value.faults
    assert (Path(fault.place.file).name, fault.problem) == ("x.yaml", "'imv.yaml': there is no such file")


def test_of_datagrams_the_newest_counts_and_the_others_are_counted() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        place = free.getsockname()
    block = MessageIn(port=f"udp::{place[1]}", protocol=LAB)
    engine = alone(block, {}, {}, parse_period("50 Hz"))
    with engine, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as peer:
        for step in range(50):
            for number in range(8):
                peer.sendto(line_of(8 * step + number), place)
            peer.sendto(line_of(0)[:-3], place)  # what is left of it belongs to no other
            engine.run(1)
            assert round(1e6 * engine.read(ALONE, "roll")) == 8 * step + 7
            assert engine.read(ALONE, "age") == 0.0
        assert (engine.read(ALONE, "lost"), engine.read(ALONE, "refused")) == (50 * 7, 50)
