"""Files that are written: none takes the place of an input, of another kind of file, or of a run's open log.

A file is known by its identity, not by its name: another spelling, a symbolic link or a hard link is the same
file. Whoever writes states what kind of file it is and what is read beside it; everything that speaks against
writing raises one `QuadvisError` before the first byte of the old file is lost. What a run reads is stated
once, by `reading`, and holds for all that is written meanwhile, whoever writes it.
"""

from __future__ import annotations

import errno
import hashlib
import os
import re
import stat
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from types import MappingProxyType
from typing import BinaryIO

from quadvis.errors import QuadvisError

HEAD = 1 << 16  # bytes at the beginning of a file by which its kind is known
LONGEST = 100  # characters of a file's name that is made of other names

PathLike = str | os.PathLike[str]
Content = bytes | str | Callable[[BinaryIO], object]  # or what writes it into a file
Identity = tuple[int, int]  # device and number of a file


@dataclass(frozen=True)
class Kind:
    """A kind of file: a phrase such as "the log", and how such files are known.

    They begin with one of `heads`, and `pattern` (a regular expression, ^ at each line) is found near their
    beginning. A kind without both fits any file.
    """

    name: str
    heads: tuple[bytes, ...] = ()
    pattern: bytes = b""

    def holds(self, head: bytes) -> bool:
        """Return whether a file that begins like this is of the kind; an empty one is of every kind."""
        text = head.removeprefix(b"\xef\xbb\xbf").lstrip() if head[:1] != b"\x89" else head
        begins = not self.heads or text.startswith(self.heads)
        return not head or (begins and re.search(self.pattern, head, re.MULTILINE) is not None)


LOG = Kind("the log", (b"\x89MCAP0\r\n",))
PNG = Kind("the picture", (b"\x89PNG\r\n",))
JPG = Kind("the picture", (b"\xff\xd8\xff",))
PLOT = Kind("the plot", PNG.heads)
SVG = Kind("the drawing", (b"<svg", b"<?xml"))

_NOTHING: Mapping[Identity, Path] = MappingProxyType({})
_read = ContextVar("files that are read now", default=_NOTHING)


@contextmanager
def reading(inputs: Iterable[PathLike]) -> Iterator[None]:
    """Let these files, and those in these folders, be inputs for all that is written meanwhile."""
    token = _read.set({**_read.get(), **_identities(inputs)})
    try:
        yield
    finally:
        _read.reset(token)


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


def write_output(path: PathLike, kind: Kind, data: Content, inputs: Iterable[PathLike] = ()) -> None:
    """Write a whole file: what was there stays until the new one is complete. QuadvisError as `check_output`.

    A symbolic link stays a link: the file that it names is replaced, and its permissions stay.
    """
    check_output(path, kind, inputs)
    try:
        _replace(Path(path).resolve(), data).close()
    except OSError as error:
        raise _refusal(Path(path), kind, reason(error)) from error


def _replace(target: Path, data: Content) -> BinaryIO:
    """Put a whole file in the place of `target`, and return it open, locked for this process."""
    temporary = target.with_name(f".{target.name[:60]}.{os.getpid()}.tmp")
    try:
        temporary.write_bytes(_bytes(data))
        with suppress(OSError):
            os.chmod(temporary, stat.S_IMODE(target.stat().st_mode))
        file = temporary.open("r+b")
        try:
            _try_lock(file.fileno())
            os.replace(temporary, target)
        except BaseException:
            file.close()
            raise
    finally:
        with suppress(OSError):
            temporary.unlink()
    return file


def _bytes(data: Content) -> bytes:
    if callable(data):
        buffer = BytesIO()
        data(buffer)
        return buffer.getvalue()
    return data.encode() if isinstance(data, str) else data


def open_output(path: PathLike, kind: Kind, inputs: Iterable[PathLike] = ()) -> BinaryIO:
    """Open a file that grows while others may read it, empty, for this process alone. QuadvisError as above.

    It is locked until it is closed or the process ends: a second one that opens it is refused, and what the
    first one writes stays whole.
    """
    file = _open_locked(Path(path), kind, inputs)
    file.truncate(0)
    return file


def _open_locked(path: Path, kind: Kind, inputs: Iterable[PathLike]) -> BinaryIO:
    """Open a file, with what is in it, for this process alone."""
    check_output(path, kind, inputs)
    try:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NONBLOCK, 0o666)
    except OSError as error:
        raise _refusal(path, kind, reason(error)) from error
    file = os.fdopen(descriptor, "r+b")
    try:
        # Between the check and here the name may have come to mean another file.
        _check_found(path, kind, os.fstat(descriptor), inputs)
        if not _try_lock(descriptor) or not os.path.samestat(os.fstat(descriptor), path.stat()):
            raise _refusal(path, kind, "another run is writing it; choose another name")
        _check_head(path, kind, os.pread(descriptor, HEAD, 0))
    except OSError as error:
        file.close()
        raise _refusal(path, kind, reason(error)) from error
    except BaseException:
        file.close()
        raise
    return file


class Claim:
    """A file that is this process's alone, rewritten or lengthened again and again, and whole at each moment.

    What was there stays until something is written; a file that the claim made and never wrote goes away. A
    second claim is refused, as `open_output` is.
    """

    def __init__(self, path: PathLike, kind: Kind, inputs: Iterable[PathLike] = ()) -> None:
        """Take the file; QuadvisError as `check_output`, or if another process has it."""
        self.path, self.kind = Path(path), kind
        self._fresh = not os.path.lexists(path)
        self._file = _open_locked(self.path, kind, inputs)

    def write(self, data: Content) -> None:
        """Put this in the place of all that is there."""
        with self._reasons():
            file = _replace(self.path.resolve(), data)
        self._file.close()
        self._file, self._fresh = file, False

    def append(self, data: bytes) -> None:
        """Add this at the end."""
        with self._reasons():
            self._file.seek(0, os.SEEK_END)
            self._file.write(data)
            self._file.flush()

    def close(self) -> None:
        """Let others have the file."""
        if self._fresh:
            self._fresh = False
            with suppress(OSError):
                self.path.unlink()
        self._file.close()

    @contextmanager
    def _reasons(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise _refusal(self.path, self.kind, reason(error)) from error


def file_name(*names: str) -> str:
    """Return names joined by '+', fit for the name of a file: other names never give the same one.

    Letters without accents, digits, '_', '-' and '.' stay; where anything else was replaced or cut off, a few
    digits of a hash follow.
    """
    plain = "+".join(re.sub(r"[^A-Za-z0-9_.-]+", "-", name).strip("-.") for name in names)
    if plain == "+".join(names) and all(names) and len(plain) <= LONGEST:
        return plain
    digest = hashlib.sha256("\0".join(names).encode(errors="backslashreplace")).hexdigest()[:6]
    return "-".join(filter(None, (plain[:LONGEST].rstrip("-.+"), digest)))


def same_file(path: PathLike, others: Iterable[PathLike]) -> Path | None:
    """Return that one of `others` which is the same file as `path`, by whatever name; None if none is."""
    try:
        return _identities(others).get(_identity(os.stat(path)))
    except (OSError, ValueError):
        return None


def reason(error: OSError | ValueError) -> str:
    """Return why the system refused, as a part of a sentence."""
    if isinstance(error, FileNotFoundError):
        return "there is no such file or folder"
    return ((error.strerror if isinstance(error, OSError) else None) or str(error)).lower()


def _identity(found: os.stat_result) -> Identity:
    return found.st_dev, found.st_ino


def _identities(paths: Iterable[PathLike]) -> dict[Identity, Path]:
    """Return who the files are; a folder stands for the files in it."""
    found: dict[Identity, Path] = {}
    for path in map(Path, paths):
        with suppress(OSError, ValueError):
            for each in path.iterdir() if path.is_dir() else [path]:
                with suppress(OSError):
                    found.setdefault(_identity(each.stat()), each)
    return found


def _check_found(path: Path, kind: Kind, found: os.stat_result, inputs: Iterable[PathLike]) -> None:
    """Refuse what is no file, and what is read beside the output."""
    if stat.S_ISDIR(found.st_mode):
        raise _refusal(path, kind, "it is a folder")
    if not stat.S_ISREG(found.st_mode):
        raise _refusal(path, kind, "it is a device or a pipe, not a file")
    identity = _identity(found)
    same = _identities(inputs).get(identity) or _read.get().get(identity)
    if same is not None:
        other = "" if same == path else f" (as '{same}')"
        raise _refusal(path, kind, f"it is an input{other} and would be lost; choose another name")


def _check_head(path: Path, kind: Kind, head: bytes) -> None:
    if not kind.holds(head):
        raise _refusal(path, kind, "a file of another kind is there; choose another name, or remove it")


def _try_lock(descriptor: int) -> bool:
    """Take the file for this process, or return False; a system without locks goes without."""
    try:
        import fcntl
    except ImportError:  # not a Unix
        return True
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        if error.errno in (errno.EWOULDBLOCK, errno.EACCES):
            return False
        if error.errno not in (errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS):
            raise
    return True


def _refusal(path: Path, kind: Kind, why: str) -> QuadvisError:
    return QuadvisError(f"cannot write {kind.name} '{path}': {why}")
