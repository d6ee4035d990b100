"""The archive of an FMU: a ZIP file from anybody, read and unpacked within limits.

Nothing of the archive is trusted. The number of its files and the size of its directory are known before
`zipfile` reads it, names are checked before anything is unpacked, and no file grows beyond its announcement.
"""

from __future__ import annotations

import os
import re
import stat
import struct
import unicodedata
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from io import BufferedReader
from itertools import pairwise
from pathlib import Path

from quadvis.errors import QuadvisError, quoted
from quadvis.machine.files import reason
from quadvis.machine.inputs import open_input

DESCRIPTION = "modelDescription.xml"
MOST_ARCHIVE = 512_000_000  # bytes of the archive
MOST_FILES = 10_000
MOST_DIRECTORY = 8_000_000  # bytes of the list of its files
MOST_UNPACKED = 1_000_000_000  # bytes of all files
MOST_DESCRIPTION = 64_000_000  # bytes of the description
MOST_RATIO = 100.0  # of unpacked to packed bytes, beyond `SMALL` bytes
SMALL = 50_000_000
LONGEST_NAME, LONGEST_PART, DEEPEST = 1000, 200, 30  # bytes, bytes, folders
CHUNK = 1 << 20

_END = struct.Struct("<4s4H2LH")  # the end of the list of files
_END_MARK, _LARGE_MARK = b"PK\x05\x06", b"PK\x06\x07"
_LONGEST_COMMENT = 65_535
_DRIVE = re.compile(r"[A-Za-z]:")
_LOCAL_HEADER = 30  # bytes before the name of each file
_DAMAGES = (
    zipfile.BadZipFile, zlib.error, struct.error, EOFError, NotImplementedError, RuntimeError, ValueError,
    OSError, OverflowError,
)  # fmt: skip


class FmuArchive:
    """The files of an FMU by name, which `opened` gives; every name is plain and stays inside a folder."""

    def __init__(self, path: str, archive: zipfile.ZipFile) -> None:
        self.path, self._archive = path, archive
        self._files = {info.filename: info for info in archive.infolist() if not info.is_dir()}

    @property
    def names(self) -> list[str]:
        """The names of its files, with "/" between folders."""
        return list(self._files)

    def description(self) -> bytes:
        """Return the bytes of the model description; QuadvisError if there is none or it is too large."""
        info = self._files.get(DESCRIPTION)
        if info is None:
            raise refused(self.path, f"it has no {DESCRIPTION}")
        if info.file_size > MOST_DESCRIPTION:
            raise refused(self.path, f"its {DESCRIPTION} has more than {MOST_DESCRIPTION / 1e6:g} MB")
        return b"".join(self._chunks(info))

    def unpack(self, folder: Path, beginnings: Sequence[str]) -> None:
        """Write the files whose names begin so into a folder that is new and the user's own.

        QuadvisError if the archive is damaged, or the disk refuses.
        """
        for name, info in self._files.items():
            if not name.startswith(tuple(beginnings)):
                continue
            target = folder / name
            runs = bool(info.external_attr >> 16 & stat.S_IXUSR)
            try:
                target.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
                flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_NOFOLLOW", 0)
                with open(os.open(target, flags, 0o700 if runs else 0o600), "wb") as file:
                    for chunk in self._chunks(info):
                        file.write(chunk)
            except OSError as error:
                raise QuadvisError(f"cannot unpack '{self.path}': {reason(error)}") from error

    def _chunks(self, info: zipfile.ZipInfo) -> Iterator[bytes]:
        """Yield the contents of a file; no more than the archive has announced."""
        left = info.file_size
        try:
            with self._archive.open(info) as file:
                while chunk := file.read(min(CHUNK, left + 1)):
                    left -= len(chunk)
                    if left < 0:
                        raise refused(self.path, f"{quoted(info.filename)} is larger than announced")
                    yield chunk
        except _DAMAGES as error:
            raise refused(self.path, f"{quoted(info.filename)} is damaged ({_cause(error)})") from error
        if left:
            raise refused(self.path, f"{quoted(info.filename)} is cut short")


@contextmanager
def opened(path: str) -> Iterator[FmuArchive]:
    """Open an archive whose list of files was found to be harmless; QuadvisError, in a sentence, if not."""
    with open_input(path, "the FMU") as file:
        _look_ahead(path, file)
        try:
            archive = zipfile.ZipFile(file)
        except _DAMAGES as error:
            raise refused(path, f"it is no ZIP archive that can be read ({_cause(error)})") from error
        with archive:
            _check(path, archive.infolist())
            yield FmuArchive(path, archive)


def refused(path: str, why: str) -> QuadvisError:
    """Return the refusal of an FMU."""
    return QuadvisError(f"'{path}' is not a usable FMU: {why}")


def _cause(error: BaseException) -> str:
    return quoted(str(error) or type(error).__name__, 80)


def _look_ahead(path: str, file: BufferedReader) -> None:
    """Refuse an archive by its last bytes, before anything is made of its list of files."""
    size = file.seek(0, os.SEEK_END)
    if size > MOST_ARCHIVE:
        raise refused(path, f"it has more than {MOST_ARCHIVE / 1e6:g} MB")
    file.seek(max(0, size - _END.size - _LONGEST_COMMENT))
    tail = file.read()
    at = tail.rfind(_END_MARK)
    if at < 0 or len(tail) - at < _END.size:
        raise refused(path, "it is no ZIP archive, or is cut short")
    _, disk, first, here, count, length, start, _ = _END.unpack_from(tail, at)
    if disk or first or here != count:
        raise refused(path, "it is a part of an archive of several files")
    if tail[max(0, at - 20) : at].startswith(_LARGE_MARK) or max(length, start) == 0xFFFFFFFF:
        raise refused(path, "it is a ZIP64 archive, for files beyond 4 GB")
    if count > MOST_FILES or length > MOST_DIRECTORY:
        raise refused(path, f"it has {count} files, {MOST_FILES} are the most")
    file.seek(0)


def _check(path: str, entries: Sequence[zipfile.ZipInfo]) -> None:
    """Refuse what could write elsewhere, fill the disk, or mean two things."""
    if len(entries) > MOST_FILES:
        raise refused(path, f"it has {len(entries)} files, {MOST_FILES} are the most")
    for info in entries:
        if why := _wrong_name(info.orig_filename):
            raise refused(path, f"the name {quoted(info.orig_filename)} {why}")
        if why := _wrong_kind(info):
            raise refused(path, f"{quoted(info.orig_filename)} {why}")
    _check_places(path, entries)
    unpacked, packed = (
        sum(getattr(info, name) for info in entries) for name in ("file_size", "compress_size")
    )
    if unpacked > MOST_UNPACKED:
        raise refused(path, f"unpacked it has more than {MOST_UNPACKED / 1e6:g} MB")
    if unpacked > SMALL and unpacked > MOST_RATIO * packed:
        raise refused(
            path, f"{packed / 1e6:.2g} MB become {unpacked / 1e6:.3g} MB when unpacked, as in a bomb"
        )


def _wrong_name(name: str) -> str:
    """Return what is wrong with the name of a file; "" if it is plain."""
    parts = name.removesuffix("/").split("/")
    if name.startswith("/") or _DRIVE.match(name):
        return "is absolute; an FMU has names inside a folder"
    if "\\" in name:
        return "has a backslash; folders end in '/'"
    if any(part == ".." for part in parts):
        return "leads out of the FMU"
    if any(part in ("", ".") for part in parts) or not name.isprintable():
        return "is not a plain one"
    if len(name.encode("utf-8", "surrogatepass")) > LONGEST_NAME or len(parts) > DEEPEST:
        return "is too long"
    if any(len(part.encode("utf-8", "surrogatepass")) > LONGEST_PART for part in parts):
        return "is too long"
    return ""


def _wrong_kind(info: zipfile.ZipInfo) -> str:
    """Return why a file is none that an FMU needs; "" if it may be there."""
    kind = stat.S_IFMT(info.external_attr >> 16)
    if kind not in (0, stat.S_IFREG, stat.S_IFDIR):
        return "is a link or a device"
    if info.flag_bits & 0x1:
        return "is encrypted"
    if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        return "is packed in a way that FMI does not allow"
    return ""


def _check_places(path: str, entries: Sequence[zipfile.ZipInfo]) -> None:
    """Refuse two files of one name, a file that is a folder, too, and files that share their bytes.

    A file that is packed twice, as some tools do it, means one thing.
    """
    files, folders = dict[str, tuple[str, int, int]](), set[str]()
    for info in entries:
        name = unicodedata.normalize("NFC", info.orig_filename).casefold()
        if not info.is_dir():
            facts = (info.orig_filename, info.file_size, info.CRC)
            if files.setdefault(name, facts) != facts:
                raise refused(path, f"the name {quoted(info.orig_filename)} stands there twice")
        parts = name.removesuffix("/").split("/")
        folders.update("/".join(parts[:end]) for end in range(1, len(parts) + info.is_dir()))
    if both := files.keys() & folders:
        raise refused(path, f"{quoted(min(both))} is both a file and a folder")
    in_order = sorted(entries, key=lambda info: info.header_offset)
    for one, other in pairwise(in_order):
        end = one.header_offset + _LOCAL_HEADER + len(one.orig_filename) + one.compress_size
        if end > other.header_offset:
            raise refused(path, f"{quoted(other.orig_filename)} begins inside another file, as in a bomb")
