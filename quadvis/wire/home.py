"""The folder in which keys and lists of keys are kept: closed to others, or refused."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from quadvis.errors import QuadvisError, sentence
from quadvis.machine.files import reason

HOME = "QUADVIS_HOME"  # environment variable: the folder
_OTHERS = 0o077
_LARGEST = 4096  # bytes of a private file


def home() -> Path:
    """Return the folder, which need not exist."""
    if given := os.environ.get(HOME):
        return Path(given)
    return Path(os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config") / "quadvis"


def private_folder(path: Path) -> Path:
    """Return a folder that only its owner can open; make it if there is none. QuadvisError if others can."""
    try:
        for each in (*reversed(path.parents), path):  # `parents=True` would leave those above open
            if not each.exists():
                each.mkdir(mode=0o700, exist_ok=True)
        _check(path, path.stat(), "folder", "700")
    except OSError as error:
        raise QuadvisError(f"cannot use the folder '{path}': {reason(error)}") from None
    return path


def read_private(path: Path) -> str:
    """Return the text of a file that only its owner can read; QuadvisError if others can."""
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK)
        with open(descriptor, "rb") as file:
            found = os.fstat(descriptor)
            if not stat.S_ISREG(found.st_mode):
                raise QuadvisError(f"'{path}' is no file")
            _check(path, found, "file", "600")
            return file.read(_LARGEST).decode("ascii", "replace")
    except OSError as error:
        raise QuadvisError(f"cannot read '{path}': {reason(error)}") from None


def _check(path: Path, found: os.stat_result, what: str, mode: str) -> None:
    if found.st_uid not in (os.geteuid(), 0):
        raise QuadvisError(f"the {what} '{path}' belongs to another user")
    if stat.S_IMODE(found.st_mode) & _OTHERS:
        remedy = f"run 'chmod {mode} {path}'"
        raise QuadvisError(sentence(f"the {what} '{path}' is open to other users", remedy))


def write_private(path: Path, text: str, *, new: bool = False) -> None:
    """Write a file that only its owner can read, whole or not at all; ``new`` refuses to replace one."""
    private_folder(path.parent)
    part = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        descriptor = os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
        try:
            with open(descriptor, "w", encoding="utf-8") as file:
                file.write(text)
                file.flush()
                os.fsync(descriptor)
            if new:
                os.link(part, path)  # fails if there is one, which `replace` would not
            else:
                part.replace(path)
        finally:
            with suppress(FileNotFoundError):
                part.unlink()
    except FileExistsError:
        raise QuadvisError(f"there is a file '{path}' already; remove it, or choose another name") from None
    except OSError as error:
        raise QuadvisError(f"cannot write '{path}': {reason(error)}") from None


@contextmanager
def alone(folder: Path) -> Iterator[None]:
    """Let one process at a time change the lists in a folder."""
    import fcntl

    private_folder(folder)
    with open(folder / ".lock", "a", encoding="ascii") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield
