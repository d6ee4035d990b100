"""Read input files: each one once, whole, within bounds, and note the SHA-256 of its contents.

A run must use the same files that were checked. So what reads a file notes its digest, and the loader of a
diagram keeps the noted digests: a file that changes between two readings is refused.
"""

from __future__ import annotations

import hashlib
import os
import stat
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from io import BufferedReader
from typing import Any, NamedTuple, TypeVar

from quadvis.errors import QuadvisError
from quadvis.machine.files import PathLike, reason

MOST_BYTES = 256_000_000

_Read = TypeVar("_Read")


class InputError(QuadvisError):
    """A file that cannot be read; ``why`` is the reason without the file's name."""

    def __init__(self, path: PathLike, why: str, what: str = "") -> None:
        """Keep the reason separately, for messages that name the place of the file by themselves."""
        self.why = why
        super().__init__(f"cannot read {f'{what} ' if what else ''}'{os.fspath(path)}': {why}")


class TooLongError(InputError):
    """A file that has more bytes than are read."""


class _Noted(NamedTuple):
    digests: dict[str, str]  # by path
    results: dict[tuple[Callable[[str], Any], str], Any]  # of `read_once`


_noted: ContextVar[_Noted | None] = ContextVar("noted", default=None)


def read_input(path: PathLike, most: int | None = MOST_BYTES, what: str = "") -> bytes:
    """Return a file's contents; InputError if it is no file, unreadable, or longer than `most` bytes.

    `what` names the file in the error, such as "the log". Pipes and devices are refused without waiting.
    """
    with open_input(path, what) as file:
        try:
            data = file.read() if most is None else file.read(most + 1)
        except OSError as error:
            raise InputError(path, reason(error), what) from error
    if most is not None and len(data) > most:
        raise TooLongError(path, f"it has more than {most / 1e6:g} MB", what)
    if _noted.get() is not None:
        note_digest(path, hashlib.sha256(data).hexdigest())
    return data


def open_input(path: PathLike, what: str = "") -> BufferedReader:
    """Open a file for reading. InputError if it is missing, or a pipe or device, without waiting."""
    try:
        descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_CLOEXEC", 0))
    except (OSError, ValueError) as error:
        raise InputError(path, reason(error), what) from error
    kind = os.fstat(descriptor).st_mode
    if not stat.S_ISREG(kind):
        os.close(descriptor)
        why = "it is a folder" if stat.S_ISDIR(kind) else "it is a device or a pipe, not a file"
        raise InputError(path, why, what)
    return os.fdopen(descriptor, "rb")


def read_once(read: Callable[[str], _Read], path: str) -> _Read:
    """Return ``read(path)``; inside `noted_inputs` one result serves all who ask for it. Do not modify it."""
    noted = _noted.get()
    if noted is None:
        return read(path)
    if (read, path) not in noted.results:
        noted.results[read, path] = read(path)
    found: _Read = noted.results[read, path]
    return found


def results_of(read: Callable[[str], Any]) -> list[str]:
    """Return the files that `read_once` has read with this function, inside `noted_inputs`."""
    noted = _noted.get()
    return [path for function, path in noted.results if function is read] if noted is not None else []


def note_digest(path: PathLike, digest: str) -> None:
    """Note the SHA-256 of a file's contents; QuadvisError if an earlier reading gave another one."""
    noted = _noted.get()
    if noted is not None and noted.digests.setdefault(os.fspath(path), digest) != digest:
        raise QuadvisError(f"'{os.fspath(path)}' was changed while it was being read; try again")


def file_digest(path: PathLike) -> str:
    """Return the SHA-256 of a file of any size, and note it; InputError if it cannot be read."""
    with open_input(path) as file:
        try:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
        except OSError as error:
            raise InputError(path, reason(error)) from error
    note_digest(path, digest)
    return digest


@contextmanager
def noted_inputs() -> Iterator[Mapping[str, str]]:
    """Collect the SHA-256 of all files that are read inside, by path."""
    noted = _Noted({}, {})
    token = _noted.set(noted)
    try:
        yield noted.digests
    finally:
        _noted.reset(token)
