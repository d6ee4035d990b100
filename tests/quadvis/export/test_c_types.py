"""Constants of LLVM's text as bytes."""

from __future__ import annotations

import struct

import pytest

from quadvis.export.c_types import Unexportable, content


@pytest.mark.parametrize(
    ("kind", "text", "wanted"),
    [
        ("[4 x i8]", r'c"a\\b\22"', b'a\\b"'),
        ("[3 x i8]", r'c"\80\5C\00"', b"\x80\\\x00"),
        ("[2 x double]", "[double 1.5, double 0x7FF8000000000000]", struct.pack("<2d", 1.5, float("nan"))),
        ("{ i8, i64 }", "{ i8 -1, i64 7 }", b"\xff" + bytes(7) + struct.pack("<q", 7)),
        ("[2 x i32]", "zeroinitializer", bytes(8)),
    ],
)
def test_a_constant_has_its_bytes(kind: str, text: str, wanted: bytes) -> None:
    assert content(kind, text) == wanted


def test_an_address_has_none() -> None:
    with pytest.raises(Unexportable, match="the constant '@other' has no translation into C"):
        content("ptr", "@other")
