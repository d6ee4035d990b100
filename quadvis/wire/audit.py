"""The audit file of a target: a JSON line for each command that changes something, and for each refusal.

The file grows at its end alone and is renamed when it is long, so it takes a bounded part of the disk.
Refusals beyond a rate are counted in place of written: whoever asks for the forbidden cannot push out what
was done.
"""

from __future__ import annotations

import hashlib
import json
import os
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from quadvis.errors import QuadvisError
from quadvis.machine.files import reason
from quadvis.wire.budget import Budget
from quadvis.wire.home import private_folder
from quadvis.wire.refusals import WireError
from quadvis.wire.who import Who

LONGEST_FILE = 4_000_000  # bytes
FILES = 5  # old files that are kept
LONGEST_TEXT = 2000  # characters of an argument or a value
REFUSALS = 5.0  # a second and key
REFUSED_AT_ONCE = 20.0


class Audit:
    """Writes one audit file. QuadvisError if it cannot be opened; what fails later is counted in ``lost``."""

    def __init__(
        self,
        path: Path,
        *,
        longest: int = LONGEST_FILE,
        files: int = FILES,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.path = path
        self.lost = 0
        self._longest, self._files = longest, files
        self._budget = Budget(REFUSALS, REFUSED_AT_ONCE, clock)
        self._unwritten = 0
        self._descriptor = -1
        private_folder(path.parent)
        try:
            self._open()
        except OSError as error:
            raise QuadvisError(f"cannot write the audit file '{path}': {reason(error)}") from None

    def accepted(
        self,
        who: Who,
        verb: str,
        args: Mapping[str, Any],
        *,
        old: Any = None,
        new: Any = None,
        tick: int | None = None,
    ) -> None:
        """Write a command that was done, with the values before and after, and the tick, if it has them."""
        facts = {"old": old, "new": new, "tick": tick}
        self._write(who, verb, args, {key: value for key, value in facts.items() if value is not None})

    def failed(self, who: Who, verb: str, args: Mapping[str, Any], error: WireError) -> None:
        """Write a command that was allowed and could not be done."""
        self._write(who, verb, args, {"kind": error.kind, "failed": str(error)})

    def refused(self, who: Who, verb: str, error: WireError) -> None:
        """Write a refusal, or count it if there were many."""
        if self._budget.spend(who.public):
            facts = {"unwritten": self._unwritten} if self._unwritten else {}
            self._unwritten = 0
            self._write(who, verb, {}, {"kind": error.kind, "refused": str(error), **facts})
        else:
            self._unwritten += 1

    def note(self, words: str) -> None:
        """Write what happened by itself, such as the loss of the lease."""
        self._line({"note": words})

    def close(self) -> None:
        """Write how many refusals were not written, and close the file."""
        if self._descriptor < 0:
            return
        if self._unwritten:
            self._line({"unwritten": self._unwritten})
        os.close(self._descriptor)
        self._descriptor = -1

    def _write(self, who: Who, verb: str, args: Mapping[str, Any], facts: Mapping[str, Any]) -> None:
        given = {"args": {key: value for key, value in args.items() if key != "token"}} if args else {}
        host = {"host": who.name, "key": who.public.hex()[:16], "level": who.level}
        self._line({**host, "verb": verb, **given, **facts})

    def _line(self, facts: Mapping[str, Any]) -> None:
        now = datetime.now(UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
        line = json.dumps({"time": now, **{key: _short(value) for key, value in facts.items()}}) + "\n"
        try:
            if self._size + len(line) > self._longest:
                self._rotate()
            os.write(self._descriptor, line.encode("ascii"))
            self._size += len(line)
        except OSError:
            self.lost += 1

    def _open(self) -> None:
        flags = os.O_WRONLY | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC | os.O_NOFOLLOW
        self._descriptor = os.open(self.path, flags, 0o600)
        self._size = os.fstat(self._descriptor).st_size

    def _rotate(self) -> None:
        """Begin a new file; if the system refuses that, the next line tries it again."""
        names = [
            self.path,
            *(self.path.with_suffix(f".{n}{self.path.suffix}") for n in range(1, self._files + 1)),
        ]
        if self.path.exists():  # else it was renamed by a call that could not make the new one
            for older, newer in zip(names[:0:-1], names[-2::-1], strict=True):
                with suppress(FileNotFoundError):
                    newer.replace(older)
        full = self._descriptor
        self._open()
        os.close(full)  # only now: whoever opens a file meanwhile must not get this number


def _short(value: Any) -> Any:
    """Return a value for a line: bytes and long values by their length and SHA-256."""
    if value is None or isinstance(value, bool | int | float):
        return value
    if isinstance(value, bytes):
        return f"{len(value)} bytes, SHA-256 {hashlib.sha256(value).hexdigest()}"
    if isinstance(value, Mapping) and len(value) <= 1000:
        value = {str(key): _short(each) for key, each in value.items()}
    elif hasattr(value, "tolist"):
        value = value.tolist()
    try:
        text = json.dumps(value)
    except TypeError:
        text = json.dumps(value, default=str)
        value = json.loads(text)
    if len(text) > LONGEST_TEXT:
        return f"{text[:80]}... {len(text)} characters, SHA-256 {hashlib.sha256(text.encode()).hexdigest()}"
    return value
