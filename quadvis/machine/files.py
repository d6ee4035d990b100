"""Write files; no output replaces an input, another kind of file, or the open log of a run.

A file is known by its identity, not by its name: another spelling, a symbolic link or a hard link is the same
file. The writer states the kind of the file and the inputs of the same command. Every reason against writing
raises one `QuadvisError` before the first byte of the old file is lost. The inputs of a run are stated once,
by `reading`, and protected from all writers meanwhile.
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
from io import BytesIO
from pathlib import Path
from types import MappingProxyType
from typing import BinaryIO, NamedTuple

from quadvis.errors import QuadvisError

HEAD = 1 << 16  # bytes at the beginning of a file that show its kind
LONGEST = 100  # characters of a file's name that is joined from other names

PathLike = str | os.PathLike[str]
Content = bytes | str | Callable[[BinaryIO], object]  # or a function that writes the content into a file
Identity = tuple[int, int]  # device and number of a file


class Kind(NamedTuple):
    """A kind of file: a phrase such as "the log", and the marks of such files.

    Files of the kind begin with one of `heads`, and contain `pattern` (a regular expression, ^ at each line)
    near their beginning. A kind without both fits any file.
    """

    name: str
    heads: tuple[bytes, ...] = ()
    pattern: bytes = b""

    def holds(self, head: bytes) -> bool:
        """Return whether a file with this beginning is of the kind; an empty file is of every kind."""
        text = head.removeprefix(b"\xef\xbb\xbf").lstrip() if head[:1] != b"\x89" else head
        begins = not self.heads or text.startswith(self.heads)
        return not head or (begins and re.search(self.pattern, head, re.MULTILINE) is not None)


LOG = Kind("the log", (b"\x89MCAP0\r\n",))
PNG = Kind("the picture", (b"\x89PNG\r\n",))
JPG = Kind("the picture", (b"\xff\xd8\xff",))
PDF = Kind("the document", (b"%PDF-",))
PLOT = Kind("the plot", PNG.heads)
SVG = Kind("the drawing", (b"<svg", b"<?xml"))
YAML = Kind("the file")

_NOTHING: Mapping[Identity, Path] = MappingProxyType({})
_read = ContextVar("files that are read now", default=_NOTHING)


@contextmanager
def reading(inputs: Iterable[PathLike]) -> Iterator[None]:
    """Protect these files, and the files in these folders, from all writers inside."""
    token = _read.set({**_read.get(), **_identities(inputs)})
    try:
        yield
    finally:
        _read.reset(token)


def check_output(path: PathLike, kind: Kind, inputs: Iterable[PathLike] = ()) -> None:
    """Raise QuadvisError if `path` cannot be written, or if writing it would destroy a protected file.

    Refused are: a path in a missing folder; a folder, a device or a pipe; one of `inputs`; a file of another
    kind than `kind`.
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
    """Write a whole file; an old file stays until the new one is complete. QuadvisError as `check_output`.

    A symbolic link stays a link: its target is replaced and keeps its permissions.
    """
    check_output(path, kind, inputs)
    try:
        _replace(Path(path).resolve(), data).close()
    except OSError as error:
        raise _refusal(Path(path), kind, reason(error)) from error


def _replace(target: Path, data: Content) -> BinaryIO:
    """Replace `target` by a whole new file; return the file open and locked for this process."""
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
    """Open an empty file that grows while others read it, for this process alone. QuadvisError as above.

    The file is locked until it is closed or the process ends: a second writer is refused, so the output of
    the first one stays whole.
    """
    file = _open_locked(Path(path), kind, inputs)
    file.truncate(0)
    return file


def _open_locked(path: Path, kind: Kind, inputs: Iterable[PathLike]) -> BinaryIO:
    """Open a file, with its contents, for this process alone."""
    check_output(path, kind, inputs)
    try:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NONBLOCK, 0o666)
    except OSError as error:
        raise _refusal(path, kind, reason(error)) from error
    file = os.fdopen(descriptor, "r+b")
    try:
        # Since the check the name may have become the name of another file.
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
    """A file of this process alone, which is rewritten or extended again and again, and whole at each moment.

    An old file stays until the first write; a file that the claim made and never wrote is removed. A second
    claim is refused, as for `open_output`.
    """

    def __init__(self, path: PathLike, kind: Kind, inputs: Iterable[PathLike] = ()) -> None:
        """Take the file; QuadvisError as `check_output`, or if another process has it."""
        self.path, self.kind = Path(path), kind
        self._fresh = not os.path.lexists(path)
        self._file = _open_locked(self.path, kind, inputs)

    def write(self, data: Content) -> None:
        """Replace the whole content."""
        with self._reasons():
            file = _replace(self.path.resolve(), data)
        self._file.close()
        self._file, self._fresh = file, False

    def append(self, data: bytes) -> None:
        """Append to the content."""
        with self._reasons():
            self._file.seek(0, os.SEEK_END)
            self._file.write(data)
            self._file.flush()

    def close(self) -> None:
        """Release the file."""
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
    """Return names joined by '+', as a valid file name; different names give different file names.

    Letters without accents, digits, '_', '-' and '.' stay; if other characters were replaced or the name was
    cut, a few digits of a hash follow.
    """
    plain = "+".join(re.sub(r"[^A-Za-z0-9_.-]+", "-", name).strip("-.") for name in names)
    if plain == "+".join(names) and all(names) and len(plain) <= LONGEST:
        return plain
    digest = hashlib.sha256("\0".join(names).encode(errors="backslashreplace")).hexdigest()[:6]
    return "-".join(filter(None, (plain[:LONGEST].rstrip("-.+"), digest)))


def same_file(path: PathLike, others: Iterable[PathLike]) -> Path | None:
    """Return the one of `others` that is the same file as `path`, under any name; None if no other is."""
    try:
        return _identities(others).get(_identity(os.stat(path)))
    except (OSError, ValueError):
        return None


def file_key(path: PathLike) -> object:
    """Return an identity that is equal for two names of one file or folder, even if it does not exist yet."""
    try:
        found = os.stat(path)
    except (OSError, ValueError):
        return os.path.realpath(path)
    return _identity(found)


def reason(error: OSError | ValueError) -> str:
    """Return the system's reason for an error, as a part of a sentence; ValueError is that of a bad name."""
    if isinstance(error, FileNotFoundError):
        return "there is no such file or folder"
    if isinstance(error, ValueError):
        return "no file can have this name"
    return (error.strerror or str(error)).lower()


def _identity(found: os.stat_result) -> Identity:
    return found.st_dev, found.st_ino


def _identities(paths: Iterable[PathLike]) -> dict[Identity, Path]:
    """Return the identities of files; a folder stands for the files in it."""
    found: dict[Identity, Path] = {}
    for path in map(Path, paths):
        with suppress(OSError, ValueError):
            for each in path.iterdir() if path.is_dir() else [path]:
                with suppress(OSError):
                    found.setdefault(_identity(each.stat()), each)
    return found


def _check_found(path: Path, kind: Kind, found: os.stat_result, inputs: Iterable[PathLike]) -> None:
    """Refuse an output that is not a regular file, or that is an input."""
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
    """Lock the file for this process, or return False; on a system without locks return True."""
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
