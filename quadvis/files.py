"""Files that are written: none takes the place of an input, of another kind of file, or of a run's open log.

A file is known by its identity, not by its name: another spelling, a symbolic link or a hard link is the same
file. Whoever writes states what kind of file it is and what is read beside it; everything that speaks against
writing raises one `QuadvisError` before the first byte of the old file is lost.
"""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from quadvis.errors import QuadvisError

HEAD = 512  # bytes at the beginning of a file by which its kind is known

PathLike = str | os.PathLike[str]


@dataclass(frozen=True)
class Kind:
    """A kind of file: a phrase such as "the log", and what such files begin with; nothing fits any file."""

    name: str
    heads: tuple[bytes, ...] = ()

    def holds(self, head: bytes) -> bool:
        """Return whether a file that begins like this is of the kind; an empty one is of every kind."""
        text = head.removeprefix(b"\xef\xbb\xbf").lstrip() if head[:1] != b"\x89" else head
        return not head or not self.heads or text.startswith(self.heads)


LOG = Kind("the log", (b"\x89MCAP0\r\n",))
PNG = Kind("the picture", (b"\x89PNG\r\n",))
SVG = Kind("the drawing", (b"<svg", b"<?xml"))


def check_output(path: PathLike, kind: Kind, inputs: Iterable[PathLike] = ()) -> None:
    """Raise QuadvisError if `path` cannot be written, or if writing it would destroy what it must not.

    Refused: a name without a folder, a folder, a device or pipe; a file that is one of `inputs`; a file that
    holds something else than `kind`.
    """
    path = Path(path)
    if not path.parent.is_dir():
        raise _refusal(path, kind, f"there is no folder '{path.parent}'")
    try:
        found = path.stat()
    except FileNotFoundError:
        return
    except (OSError, ValueError) as error:
        raise _refusal(path, kind, reason(error)) from error
    _check_found(path, kind, found, inputs)
    try:
        with path.open("rb") as file:
            _check_head(path, kind, file.read(HEAD))
    except OSError as error:
        raise _refusal(path, kind, reason(error)) from error


def write_output(path: PathLike, kind: Kind, data: bytes | str, inputs: Iterable[PathLike] = ()) -> None:
    """Write a whole file: what was there stays until the new one is complete. QuadvisError as `check_output`.

    A symbolic link stays a link: the file that it names is replaced.
    """
    check_output(path, kind, inputs)
    target = Path(path).resolve()
    temporary = target.with_name(f".{target.name[:200]}.{os.getpid()}.tmp")
    try:
        temporary.write_bytes(data.encode() if isinstance(data, str) else data)
        os.replace(temporary, target)
    except OSError as error:
        raise _refusal(Path(path), kind, reason(error)) from error
    finally:
        with suppress(OSError):
            temporary.unlink()


def open_output(path: PathLike, kind: Kind, inputs: Iterable[PathLike] = ()) -> BinaryIO:
    """Open a file that grows while others may read it, empty, for this process alone. QuadvisError as above.

    It is locked until it is closed or the process ends: a second one that opens it is refused, and what the
    first one writes stays whole.
    """
    path = Path(path)
    check_output(path, kind, inputs)
    try:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NONBLOCK, 0o666)
    except OSError as error:
        raise _refusal(path, kind, reason(error)) from error
    file = os.fdopen(descriptor, "r+b")
    try:
        # Between the check and here the name may have come to mean another file.
        _check_found(path, kind, os.fstat(descriptor), inputs)
        _lock(path, kind, descriptor)
        _check_head(path, kind, os.pread(descriptor, HEAD, 0))
        file.truncate(0)
    except OSError as error:
        file.close()
        raise _refusal(path, kind, reason(error)) from error
    except BaseException:
        file.close()
        raise
    return file


def same_file(path: PathLike, others: Iterable[PathLike]) -> Path | None:
    """Return that one of `others` which is the same file as `path`, by whatever name; None if none is."""
    try:
        return _same(os.stat(path), others)
    except (OSError, ValueError):
        return None


def reason(error: OSError | ValueError) -> str:
    """Return why the system refused, as a part of a sentence."""
    if isinstance(error, FileNotFoundError):
        return "there is no such file or folder"
    return ((error.strerror if isinstance(error, OSError) else None) or str(error)).lower()


def _same(found: os.stat_result, others: Iterable[PathLike]) -> Path | None:
    for other in others:
        with suppress(OSError, ValueError):
            if os.path.samestat(found, os.stat(other)):
                return Path(other)
    return None


def _check_found(path: Path, kind: Kind, found: os.stat_result, inputs: Iterable[PathLike]) -> None:
    """Refuse what is no file, and what is read beside the output."""
    if stat.S_ISDIR(found.st_mode):
        raise _refusal(path, kind, "it is a folder")
    if not stat.S_ISREG(found.st_mode):
        raise _refusal(path, kind, "it is a device or a pipe, not a file")
    same = _same(found, inputs)
    if same is not None:
        other = "" if same == path else f" (as '{same}')"
        raise _refusal(path, kind, f"it is an input{other} and would be lost; choose another name")


def _check_head(path: Path, kind: Kind, head: bytes) -> None:
    if not kind.holds(head):
        raise _refusal(path, kind, "a file of another kind is there; choose another name, or remove it")


def _lock(path: Path, kind: Kind, descriptor: int) -> None:
    """Take the file for this process; a system without locks goes without."""
    try:
        import fcntl
    except ImportError:  # not a Unix
        return
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        if error.errno in (errno.EWOULDBLOCK, errno.EACCES):
            raise _refusal(path, kind, "another run is writing it; choose another name") from error
        if error.errno not in (errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS):
            raise


def _refusal(path: Path, kind: Kind, why: str) -> QuadvisError:
    return QuadvisError(f"cannot write {kind.name} '{path}': {why}")
