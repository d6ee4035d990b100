"""The file of a protocol: what it says, and every fault in it at its place."""

from __future__ import annotations

from pathlib import Path

import pytest

from quadvis.block import Line
from quadvis.errors import DiagramError
from tests.blocks.hardware.protocol.protocols import BYTES, NMEA, protocol


def test_a_file_says_how_the_line_is_and_what_is_sent_at_both_ends(tmp_path: Path) -> None:
    found = protocol(BYTES, tmp_path)
    assert found.line == Line(460800, parity="even", stop_bits=2, settle=1.5, dtr=True)
    assert (found.initialise, found.terminate) == ((b"\x01start", b"\x02\x03"), (b"stop",))
    assert protocol(NMEA, tmp_path).line is None


def test_values_are_in_si_units_and_whole_ones_are_whole_numbers(tmp_path: Path) -> None:
    values = {value.name: value for value in protocol(BYTES, tmp_path).messages["imu"].values}
    assert [*values] == ["gyro", "temperature", "mode", "trim", "armed", "height", "ticks"]
    assert {name: (value.type, str(value.unit)) for name, value in values.items()} == {
        "gyro": ("float64[3]", "rad/s"),
        "temperature": ("float64", "K"),
        "mode": ("int64", "1"),
        "trim": ("float64", "V"),
        "armed": ("int64", "1"),
        "height": ("float64", "m"),
        "ticks": ("int64", "1"),
    }


def test_a_length_counts_what_it_says(tmp_path: Path) -> None:
    text = BYTES.replace("{type: u8, counts: after}", "{type: u16, counts: %s, plus: %d}")
    lengths = {}
    for counts, plus in (("after", 0), ("body", 0), ("all", 0), ("after", -1)):
        status = protocol(text % (counts, plus, "after", 0), tmp_path).messages["imu"]
        lengths[counts, plus] = int.from_bytes(status.prefix[2:4], "little")
    assert lengths == {("after", 0): 22, ("body", 0): 24, ("all", 0): 29, ("after", -1): 21}


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("quadvis: 1", "quadvis: 2", "2:10: 'quadvis' must be 1, not '2'"),
        ("baud: 460800", "baud: 1e5", "5:14: 'baud' must be a whole number, such as 12 or 0x0C, not '1e5'"),
        ("parity: even", "parity: evne", "5:30: 'parity' must be one of 'none', 'even', 'odd', not 'evne'"),
        ("settle: 1.5 s", "settle: 1.5", "5:58: 'settle': '1.5' has no unit"),
        ("settle: 1.5 s", "settle: 2 min", "5:58: 'settle' must be a time from 0 s to 60 s, not '2 min'"),
        ("terminate: stop", "terminate: {}", "7:12: 'terminate' must be a list, not a map"),
        ("terminate: stop", "terminate: '→'", "7:12: '→' is not one byte"),
        ("terminate: stop", "terminate: 'a\\q'", "7:12: '\\q' is no byte; write '\\\\' for a backslash"),
        ("terminate: stop", "terminate: [[256]]", "7:14: 'terminate[0][0]' must be a byte, 0 to 255"),
        ("order: little\n", "", "14:9: the order of the bytes of this i16 is missing"),
        ("name: gyro", "name: 3gyro", "15:16: 'name' must be a name, not '3gyro'"),
        ("name: temperature", "name: gyro", "16:16: the name 'gyro' is already in line 15"),
        ("type: i16", "type: int16", "15:28: 'type' must be a known word, not 'int16'; did you mean 'i16'?"),
        ("type: i16", "format: '%f'", "15:9: this belongs to a line of text, and the field in line 12"),
        ("elements: 3", "elements: 0", "15:43: 'elements' must be a whole number from 1 to 256, not '0'"),
        ("scale: 0.01", "scale: 0", "15:53: 'scale' must be a number other than 0"),
        ("unit: deg/s", "unit: grad/s", "15:65: 'unit': 'grad/s' is not a unit"),
        ("[-320, 320]", "[320, -320]", "15:79: 'range' must be two numbers, the lower one first"),
        ("[-320, 320]", "[320]", "15:79: 'range' must be two numbers, such as [-180, 180], not 1 of them"),
        ("{ignore: 2}", "{ignore: two}", "17:18: 'ignore' must be a whole number"),
        ("{ignore: 2}", "{}", "17:9: the field has no name; add 'name: ...', or write {ignore: 2}"),
        ("{width: 2}", "{width: 12}", "20:11: these are 22 bits, and u16 has 16; use a wider type"),
        ("{width: 2}", "{signed: true}", "21:13: the width of these bits is missing; add such as 'width: 3'"),
        ("type: u16\n", "type: i16\n", "18:15: 'type' must be one of 'u8', 'u16', 'u32', 'u64', not 'i16'"),
        ("counter: 1000", "counter: 70000", "14:30: a counter to 69999 does not fit its type"),
        ("crc16_modbus", "crc16_mobus", "there is no checksum 'crc16_mobus'; did you mean 'crc16_modbus'?"),
        ("crc16_modbus", "crc16_ccitt", "'crc16_ccitt' is the name of several checksums; write "),
        ("over: all", "over: everything", "'over' must be one of 'body', 'all', not 'everything'"),
        ("over: all", "width: 16", "'width' belongs to a CRC of your own; leave it out, or write kind: crc"),
        ("over: all", "mark: '*'", "'mark' belongs to text"),
        ("kind: crc16_modbus, over: all", "kind: crc, width: 12, polynomial: 7", "'width' must be 8, 16"),
        ("kind: crc16_modbus, over: all", "kind: crc, width: 16", "key 'polynomial' is missing"),
        ("    checksum: {kind: crc16_modbus, over: all}\n", "", "key 'checksum' is missing"),
        ("header: [0xAA, 0x55]", "header: ''", "'header' is empty; leave it out"),
        ("header: [0xAA, 0x55]", "separator: ';'", "10:5: this belongs to a line of text, and the field in"),
    ],
)  # fmt: skip
def test_a_fault_has_its_place_and_its_words(tmp_path: Path, old: str, new: str, words: str) -> None:
    assert old in BYTES
    with pytest.raises(DiagramError) as caught:
        protocol(BYTES.replace(old, new), tmp_path)
    text = str(caught.value).replace(f"{tmp_path}/protocol.yaml:", "").replace("protocol 'bytes_imu': ", "")
    assert words in text, text


def test_all_faults_are_reported_together(tmp_path: Path) -> None:
    text = BYTES.replace("type: i16", "type: i17").replace("{width: 2}", "{width: 0}")
    text = text.replace("crc16_modbus", "crc16").replace("parity: even", "parity: evne")
    with pytest.raises(DiagramError) as caught:
        protocol(text, tmp_path)
    assert [fault.place.line for fault in caught.value.faults] == [5, 15, 21, 26, 34]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            '    separator: ","\n',
            "",
            "nothing stands between two fields of text; write such as separator: ','",
        ),
        (
            '    terminator: "\\r\\n"\n',
            "",
            "a line of text needs a terminator; write such as terminator: '\\r\\n'",
        ),
        ('format: "%.1f"', 'format: "%.1f%d"', "'format' must be a format of one number, such as %.3f"),
        ('format: "%.1f"', 'format: "%s"', "'format' must be a format of one number, such as %.3f"),
        ('format: "%.1f"', "type: f32", "this belongs to a line of text, and the field in line 9 to bytes"),
        ("optional: true", "optional: true, elements: 2", "only one number in text may be missing"),
        (
            "words: {N: 1, S: -1}",
            "words: {}",
            "'words' must be words and their numbers, such as {A: 1, V: 0}",
        ),
        ("words: {N: 1, S: -1}", "words: {N: north}", "'N' must be a whole number, not 'north'"),
        ("{ignore: text}", "{ignore: 3}", "'ignore' must be 'text' in a line of text, not '3'"),
        ("{ignore: text}", "{type: u8, bits: [{width: 3}]}", "the field in line 22 to bytes"),
        (
            'terminator: "\\r\\n"',
            'terminator: ","',
            "the terminator could stand inside the message, too; choose",
        ),
        (
            'terminator: "\\r\\n"',
            "terminator: e",
            "the terminator could stand inside the message, too; choose",
        ),
        ("- SDDPT", "- '\\x01'", "what stands in a line of text must be printable ASCII"),
        ("header: $", "header: '\\xAA'", "'header' of a line of text must be printable ASCII"),
    ],
)
def test_lines_of_text_have_faults_of_their_own(tmp_path: Path, old: str, new: str, words: str) -> None:
    assert old in NMEA
    with pytest.raises(DiagramError) as caught:
        protocol(NMEA.replace(old, new, 1), tmp_path)
    assert words in str(caught.value)


def test_a_file_of_another_kind_is_refused_and_not_quoted(tmp_path: Path) -> None:
    with pytest.raises(DiagramError, match="this is not the file of a protocol") as caught:
        protocol("password: hunter2\nuser: [\n", tmp_path)
    assert "hunter2" not in str(caught.value)


def test_a_missing_file_is_reported(tmp_path: Path) -> None:
    from quadvis_blocks.hardware._protocol.reading import read_protocol

    with pytest.raises(DiagramError, match="there is no such file"):
        read_protocol(tmp_path / "none.yaml")


def test_a_message_that_is_too_long_to_be_read_is_refused(tmp_path: Path) -> None:
    text = BYTES.replace("elements: 3", "elements: 256").replace("type: i16", "type: i64")
    with pytest.raises(DiagramError, match="a message of 2071 bytes is too long; 1024 can be read"):
        protocol(text.replace("type: u8, counts", "type: u16, counts"), tmp_path)
