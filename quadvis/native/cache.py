"""Machine code kept on disk, under a key that changes with everything that the code depends on.

A file has a header with the checksum of the rest, so that a damaged one is compiled again. Files are replaced
in one step, so two processes never see half of one; a claim keeps them from compiling the same at the same
time. Whatever the disk refuses: the run goes on without.
"""

from __future__ import annotations

import hashlib
import json
import os
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from quadvis.errors import QuadvisError
from quadvis.machine.files import reason

FOLDER = "QUADVIS_CACHE"  # environment variable: the folder for the cache
MAGIC = b"quadvis machine code 1\n"
SUFFIX = ".native"
CLAIM = ".claim"


@dataclass(frozen=True)
class MachineCode:
    """An object file, the names of its functions by method, and the methods that can fail.

    ``refusal`` says why a block type cannot be compiled; then there is no code. If it is ``passing``, it
    may be gone the next time, and is not kept.
    """

    content: bytes = b""
    names: Mapping[str, str] | None = None
    fallible: frozenset[str] = frozenset()
    refusal: str = ""
    passing: bool = False


def folder() -> Path:
    """Return the folder of the cache."""
    if given := os.environ.get(FOLDER):
        return Path(given)
    if os.name == "nt":
        base = os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local"
    else:
        base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "quadvis"


def load(key: str) -> MachineCode | None:
    """Return the machine code that is kept under a key; None if there is none, or a damaged one."""
    try:
        data = _path(key).read_bytes()
    except (OSError, RuntimeError):
        return None
    if not data.startswith(MAGIC):
        return None
    checksum, _, rest = data[len(MAGIC) :].partition(b"\n")
    if checksum.decode("ascii", "replace") != hashlib.sha256(rest).hexdigest():
        return None
    facts, _, content = rest.partition(b"\n")
    found = json.loads(facts)
    return MachineCode(content, found["names"], frozenset(found["fallible"]), found["refusal"])


def keep(key: str, code: MachineCode) -> bool:
    """Keep machine code under a key; return whether the disk took it."""
    facts = {"names": dict(code.names or {}), "fallible": sorted(code.fallible), "refusal": code.refusal}
    rest = json.dumps(facts).encode() + b"\n" + code.content
    data = MAGIC + hashlib.sha256(rest).hexdigest().encode() + b"\n" + rest
    try:
        path = _path(key)
        path.parent.mkdir(parents=True, exist_ok=True)
        descriptor, name = tempfile.mkstemp(dir=path.parent, prefix=f"{key[:8]}.")
        try:
            with open(descriptor, "wb") as file:
                file.write(data)
            os.replace(name, path)
        except BaseException:
            with suppress(OSError):
                os.unlink(name)
            raise
    except (OSError, RuntimeError):
        return False
    return True


@contextmanager
def claim(key: str, *, wait: bool = True) -> Iterator[bool]:
    """Keep other processes from compiling what a key stands for, yield whether that is granted.

    It ends with its process, too. Who waited finds the machine code kept, if the other one could compile it.
    Without locks of files every claim is granted.
    """
    try:
        import fcntl

        path = _path(key).with_suffix(CLAIM)
        path.parent.mkdir(parents=True, exist_ok=True)
        file = open(path, "wb")  # noqa: SIM115
    except (ImportError, OSError, RuntimeError):
        yield True
        return
    with file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
        except BlockingIOError:
            yield False
            return
        except OSError:  # no locks on this disk
            pass
        try:
            yield True
        finally:
            with suppress(OSError):
                path.unlink()


def files() -> Iterator[tuple[Path, int]]:
    """Yield the files of the cache, and their sizes in bytes."""
    try:
        for path in sorted(folder().glob(f"*{SUFFIX}")):
            with suppress(OSError):
                yield path, path.stat().st_size
    except (OSError, RuntimeError):
        return


def clear() -> None:
    """Remove all files of the cache; QuadvisError if one cannot be removed."""
    for path, _ in list(files()):
        try:
            path.unlink(missing_ok=True)
        except OSError as error:
            raise QuadvisError(f"cannot remove '{path}': {reason(error)}") from error


def _path(key: str) -> Path:
    return folder() / f"{key}{SUFFIX}"
