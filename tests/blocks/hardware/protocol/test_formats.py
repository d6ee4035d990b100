"""Messages that a diagram describes by a format: of printf, or of Python's struct."""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.block import ParameterError
from quadvis_blocks.hardware._protocol.decode import Decoded, decoding
from quadvis_blocks.hardware._protocol.encode import encode
from quadvis_blocks.hardware._protocol.formats import WrittenMessage, message_of


def written(format: str, names: str, **others: str) -> WrittenMessage:
    given = {"units": "", "ranges": "", "header": "", "terminator": "", "checksum": "none", **others}
    return WrittenMessage(format, names, **given)


@given(
    st.sampled_from("<>!"),
    st.lists(
        st.tuples(st.sampled_from("bBhHiIqfd"), st.integers(1, 3), st.integers(0, 2)), min_size=1, max_size=6
    ),
    st.data(),
)
def test_a_struct_string_packs_what_struct_packs(
    order: str, fields: list[tuple[str, int, int]], data: st.DataObject
) -> None:
    text = order + "".join(f"{count}{code}{'x' * blank}" for code, count, blank in fields)
    names = " ".join(f"v{number}" for number in range(len(fields)))
    numbers: list[float] = []
    for code, count, _ in fields:
        bits = 8 * struct.calcsize("<" + code)
        limits = (0, 2**bits - 1) if code.isupper() else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
        whole = st.integers(max(limits[0], -(2**53)), min(limits[1], 2**53))
        one = st.floats(-1e6, 1e6, width=32).map(abs) if code in "fd" else whole
        numbers += data.draw(st.lists(one, min_size=count, max_size=count))
    packed = struct.pack(text, *numbers)
    made = message_of(written(text, names))
    found = decoding(made)(packed)
    assert isinstance(found, Decoded)
    assert np.concatenate([np.atleast_1d(value) for value in found.values]).tolist() == numbers
    assert encode(made, found.values) == struct.pack(text, *numbers)


@given(st.floats(-999, 999), st.integers(-99999, 99999), st.integers(0, 0xFFFF), st.floats(-1e-3, 1e-3))
def test_a_printf_string_prints_what_printf_prints(one: float, two: int, three: int, four: float) -> None:
    text = "T=%7.3f;N:%+05d 100%% #%04X, %.3e"
    made = message_of(written(text, "t n x e", terminator="\\n"))
    line = (text % (one, two, three, four)).encode() + b"\n"
    assert encode(made, [one, two, three, four]) == line
    found = decoding(made)(line)
    assert isinstance(found, Decoded)
    assert found.values == (float(f"{one:.3f}"), two, three, float(f"{four:.3e}"))


def test_units_and_ranges_are_one_for_all_or_one_for_each() -> None:
    made = message_of(
        written("<2hB", "angle mode", units="deg 1", ranges="-180..180 0..5", header="\\xAA", checksum="xor")
    )
    angle, mode = made.values
    assert (angle.type, str(angle.unit), mode.type) == ("float64[2]", "rad", "int64")
    assert (angle.bounds, mode.bounds) == (pytest.approx((-np.pi, np.pi)), (0, 5))
    assert encode(made, [[np.pi, -9.0], 7]) == b"\xaa" + struct.pack("<2hB", 180, -180, 5) + bytes(
        [180 ^ 0x4C ^ 0xFF ^ 5]
    )


@pytest.mark.parametrize(
    ("text", "names", "others", "parameter", "words"),
    [
        ("3h", "a", {}, "format", "format must begin with the order of the bytes, or be text such as %f,%f"),
        ("<3s", "a", {}, "format", "'s' in '<3s' is no number of Python's module struct; use x and b"),
        ("<h", "", {}, "names", "names must be 1 names for the numbers of '<h', got 0"),
        ("<h", "2a", {}, "names", "'2a' in names is no name, or there twice"),
        ("<hh", "a a", {}, "names", "'a' in names is no name, or there twice"),
        ("<4x", "", {}, "format", "names must be 0 names for the numbers of '<4x', got 0"),
        ("<h", "a", {"units": "grad"}, "units", "'grad' is not a unit"),
        ("<hh", "a b", {"units": "m m m"}, "units", "units must be one for all names, or 2, got 3"),
        ("<h", "a", {"ranges": "1"}, "ranges", "'1' in ranges is no range; write such as -180..180"),
        ("<h", "a", {"ranges": "2..1"}, "ranges", "'2..1' in ranges is empty; write the lower number first"),
        ("<h", "a", {"checksum": ""}, "checksum", "there is no checksum ''; write 'none' if"),
        ("<h", "a", {"checksum": "crc16"}, "checksum", "there is no checksum 'crc16'; write crc16_cc"),
        ("<h", "a", {"header": "\\q"}, "header", "header must be bytes: '\\q' is no byte"),
        ("%f", "a", {}, "terminator", "terminator is missing; write such as terminator: '\\r\\n'"),
        ("%f%f", "a b", {"terminator": "\\n"}, "format", "nothing stands between two numbers in '%f%f'"),
        ("%s", "a", {"terminator": "\\n"}, "format", "'%s' is no format of one number; write such as %.3f"),
        ("%.99f", "a", {"terminator": "\\n"}, "format", "'%.99f' is no format of one number"),
    ],
)  # fmt: skip
def test_a_wrong_format_names_its_parameter(
    text: str, names: str, others: dict[str, Any], parameter: str, words: str
) -> None:
    with pytest.raises(ParameterError) as caught:
        message_of(written(text, names, **others))
    assert (caught.value.parameter, words in str(caught.value)) == (parameter, True), str(caught.value)
