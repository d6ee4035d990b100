"""Archives that are hostile, each of a kind, and models whose native code is."""

from __future__ import annotations

import struct
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from .builder import Model, Var, description
from .models import DAHLQUIST, STAIR

XML = description(DAHLQUIST, 2)
LIBRARY = "binaries/linux64/Dahlquist.so"
BODY = XML.partition("?>")[2]
Files = dict[str | zipfile.ZipInfo, bytes]


def _packed(path: Path, files: Files, kind: int = zipfile.ZIP_DEFLATED) -> Path:
    with zipfile.ZipFile(path, "w", kind) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return path


def _with(more: Files, xml: str | bytes = XML) -> Callable[[Path], Path]:
    text = xml if isinstance(xml, bytes) else xml.encode()
    return lambda path: _packed(path, {"modelDescription.xml": text, LIBRARY: b"\x7fELF", **more})


def _special(name: str, mode: int, data: bytes) -> Files:
    info = zipfile.ZipInfo(name)
    info.create_system, info.external_attr = 3, mode << 16
    return {info: data}


def _edited(change: Callable[[bytearray], object]) -> Callable[[Path], Path]:
    """Return a maker of an archive whose bytes are changed afterwards."""

    def make(path: Path) -> Path:
        data = bytearray(_with({"resources/a": b"1", "resources/b": b"2"})(path).read_bytes())
        found = change(data)
        path.write_bytes(found if isinstance(found, bytes | bytearray) else data)
        return path

    return make


def _encrypted(data: bytearray) -> None:
    at = 0
    while (at := data.find(b"PK\x01\x02", at)) >= 0:
        data[at + 8] |= 1
        at += 4


def _lying(data: bytearray) -> None:
    """Let the list of files announce one byte for a file that has more."""
    at = data.find(b"PK\x01\x02")
    struct.pack_into("<I", data, at + 24, 1)


def _overlapping(data: bytearray) -> None:
    """Let the second file begin where the first does, as the bombs of David Fifield do."""
    first = data.find(b"PK\x01\x02")
    second = data.find(b"PK\x01\x02", first + 4)
    struct.pack_into("<I", data, second + 42, 0)


def _many(path: Path) -> Path:
    files: Files = {f"resources/{n}": b"" for n in range(20_000)}
    return _packed(path, {"modelDescription.xml": XML.encode(), **files}, zipfile.ZIP_STORED)


def _bomb(path: Path) -> Path:
    """Pack 200 MB of zeros into 200 kB."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("modelDescription.xml", XML)
        with archive.open("resources/zeros", "w") as file:
            for _ in range(200):
                file.write(bytes(1_000_000))
    return path


def _quiet_bomb(path: Path) -> Path:
    """Pack a file that says that it has 1 kB and has 50 MB."""
    made = _with({"resources/zeros": bytes(50_000_000)})(path)
    data = bytearray(made.read_bytes())
    at = data.rfind(b"PK\x01\x02")
    struct.pack_into("<I", data, at + 24, 1000)
    path.write_bytes(data)
    return path


def _twice(path: Path) -> Path:
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", XML)
        archive.writestr(LIBRARY, b"one")
        archive.writestr(LIBRARY.replace("Dahl", "DAHL"), b"other")
    return path


def _links(path: Path) -> Path:
    return _with({**_special("resources/away", 0o120777, b"/tmp"), "resources/away/escaped": b"x"})(path)


_NAMED = '<?xml version="1.0"?><!DOCTYPE a [{}]>' + BODY.replace("{", "{{").replace("}", "}}")
XXE = _NAMED.replace("Dahlquist", "&x;", 1).format('<!ENTITY x SYSTEM "file:///etc/passwd">')
LAUGHS = _NAMED.replace("Dahlquist", "&a9;", 1).format(
    '<!ENTITY a0 "ha">' + "".join(f'<!ENTITY a{n} "{f"&a{n - 1};" * 10}">' for n in range(1, 10))
)
_HEAD = "<?xml version='1.0'?>"
ARCHIVES: dict[str, tuple[Callable[[Path], Path], str]] = {
    "up": (_with({"../escaped": b"x"}), "leads out of the FMU"),
    "up, deep inside": (_with({"resources/a/../../../escaped": b"x"}), "leads out of the FMU"),
    "absolute": (_with({"/tmp/quadvis-escaped": b"x"}), "is absolute"),
    "a drive": (_with({"C:/escaped": b"x"}), "is absolute"),
    "backslashes": (_with({"..\\escaped": b"x"}), "has a backslash"),
    "a link": (_with(_special("resources/link", 0o120777, b"/etc/passwd")), "is a link or a device"),
    "through a link": (_links, "is a link or a device"),
    "a device": (_with(_special("resources/null", 0o020666, b"")), "is a link or a device"),
    "twice": (_twice, "stands there twice"),
    "a file and a folder": (_with({"resources/a": b"x", "resources/a/b": b"x"}), "both a file and a folder"),
    "a bomb": (_bomb, "as in a bomb"),
    "a bomb that announces little": (_quiet_bomb, "larger than announced|is damaged|cut short"),
    "files in each other": (_edited(_overlapping), "begins inside another file|is damaged"),
    "20,000 files": (_many, "has 20001 files, 10000 are the most"),
    "a long name": (_with({"resources/" + "a" * 5000: b"x"}), "is too long"),
    "deep folders": (_with({"a/" * 500 + "b": b"x"}), "is too long"),
    "a name with a control character": (_with({"resources/a\rb": b"x"}), "is not a plain one"),
    "encrypted": (_edited(_encrypted), "is encrypted"),
    "packed in another way": (
        lambda path: _packed(path, {"modelDescription.xml": XML.encode()}, zipfile.ZIP_BZIP2),
        "in a way that FMI does not allow",
    ),
    "no list of files": (lambda path: path.write_bytes(b"PK" + bytes(500)) and path, "no ZIP archive"),
    "nothing": (lambda path: path.write_bytes(b"") or path, "no ZIP archive"),
    "cut short": (_edited(lambda data: data[: len(data) // 2]), "no ZIP archive"),
    "bits flipped": (_edited(lambda data: data.__setitem__(slice(60, 90), bytes(30))), "is damaged"),
    "a list that lies": (_edited(_lying), "larger than announced|is damaged|cut short"),
    "no description": (lambda path: _packed(path, {LIBRARY: b""}), "has no modelDescription.xml"),
    "an entity from outside": (_with({}, XXE), "a document type or an entity has no place here"),
    "a billion laughs": (_with({}, LAUGHS), "a document type or an entity has no place here"),
    "deep XML": (_with({}, f"{_HEAD}{'<a>' * 100_000}"), "nested deeper than"),
    "many elements": (_with({}, f"{_HEAD}<a>{'<a/>' * 2_100_000}</a>"), "more than 2000000 elements"),
    "an endless attribute": (_with({}, f"{_HEAD}<a b='{'x' * 70_000_000}'/>"), "64 MB|as in a bomb"),
    "an unknown encoding": (_with({}, XML.replace("UTF-8", "KLINGON-8")), "encoding|unknown"),
    "no XML": (_with({}, b"\xff\xfe\x00"), "model description: "),
    "an identifier that leads out": (
        _with({}, XML.replace('modelIdentifier="Dahlquist"', 'modelIdentifier="../../evil"')),
        "is no name in C",
    ),
    "no library for this machine": (
        lambda path: _packed(
            path, {"modelDescription.xml": XML.encode(), "binaries/win64/Dahlquist.dll": b"MZ"}
        ),
        "has no library 'Dahlquist' for linux64; it has some for win64",
    ),
    "a library that is none": (_with({}), "library of the FMU cannot be used"),
}  # fmt: skip

_BAD = replace(STAIR, name="Bad", near="1e300")
_DEEP = "static int deep(volatile char *a) { volatile char b[4096]; b[0] = *a; return deep(b) + b[1]; }"
_FOREIGN = "crashed: it used memory that is not its own"


def _does(step: str, **more: str) -> Model:
    return replace(_BAD, step=step, **more)  # type: ignore[arg-type]


NATIVE: dict[str, tuple[Model, str]] = {
    "foreign memory": (_does("*(volatile int *)8 = 1;"), _FOREIGN),
    "abort": (_does("abort();"), r"crashed: it gave up by abort\(\)"),
    "division by zero": (
        _does("volatile int z = 0, n = 7; v_counter = n / z;"),
        "crashed: it divided by zero",
    ),
    "exit": (_does("exit(0);"), "ended its process with the code 0"),
    "hang": (_does("for (volatile int k = 0; ; k++) {}"), "did not answer within 0.5 s and was ended"),
    "not a number": (
        replace(_does("v_y = NAN;"), variables=[Var("y", causality="output")]),
        "port 'y'.*the output became nan",
    ),
    "no instance": (
        _does("", start='say(m, 3, "no licence", 7.0); return 1;'),
        "refuses to make an instance.*no licence: 7",
    ),
    "error": (_does('say(m, 3, "too hot", 99.5); return 3;'), "gave the status Error: too hot: 99.5"),
    "fatal": (_does("return 4;"), "gave the status Fatal"),
    "discard": (_does('say(m, 2, "step too large", h); return 2;'), "status Discard: step too large: 0.1"),
    "warning": (_does('say(m, 1, "odd", 1.0); return 1;'), "status Warning: odd: 1"),
    "asks to end": (_does("return 2;", ends="1"), "asks to end the simulation"),
    "stack": (_does("char a = 0; v_counter = deep(&a);", head=_DEEP), _FOREIGN),
    "closes everything": (
        _does("for (int k = 3; k < 256; k++) close(k);"),
        "closed the line|ended its process|did not answer",
    ),
    "kills its process": (_does("raise(SIGKILL);"), "crashed: something killed it"),
    "crash when loaded": (
        _does("", head="__attribute__((constructor)) static void load(void) { abort(); }"),
        r"gave up by abort\(\)",
    ),
    "messages without end": (
        _does('for (int k = 0; k < 20000; k++) say(m, 1, "again", k); return 3;'),
        "status Error: again",
    ),
    "writes on the terminal": (_does('puts("from the FMU"); fflush(stdout); return 3;'), "status Error"),
}
SLOW = _does("usleep(20000); v_counter += 1;")  # slower than its period, and right
