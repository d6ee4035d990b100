"""Keys of signed MAVLink links, and the times of their signatures, which outlive a run.

Both lie in the folder ``mavlink`` of the home of keys (`quadvis.wire.home`), closed to others: ``NAME.key``
has 64 hexadecimal digits; ``NAME.times`` is made here. The times are shared memory over a file: who signs
writes a word, without a call of the system, and a process that is killed leaves the last one.
"""

from __future__ import annotations

import mmap
import os
import re
import time
from contextlib import suppress
from pathlib import Path

from quadvis.errors import QuadvisError, quoted, sentence
from quadvis.machine.files import reason
from quadvis.wire.home import home, private_folder, read_private
from quadvis_blocks.mavlink._signing import MINUTE, Clock, signing_time

KEY = re.compile(r"[0-9a-fA-F]{64}")
NAME = re.compile(r"[A-Za-z0-9][\w.-]*")
MARK, SENT, HEARD, BOOT, STREAMS = 0, 1, 2, 3, 5  # words; BOOT is two
ROOM = 61  # streams that can be heard
WORDS = STREAMS + 2 * ROOM
MAGIC = int.from_bytes(b"mavtime1", "little")
BOOT_FILE = Path("/proc/sys/kernel/random/boot_id")


def folder() -> Path:
    """Return the folder of the keys, which need not exist."""
    return home() / "mavlink"


def read_key(name: str) -> bytes:
    """Return the 32 bytes of a key; QuadvisError if there is none of this name, or others can read it."""
    if not NAME.fullmatch(name):
        raise QuadvisError(f"{quoted(name)} is no name of a key; use letters, digits, '_', '-' and '.'")
    path = folder() / f"{name}.key"
    if not path.exists():
        remedy = f"write 64 hexadecimal digits into '{path}', and run 'chmod 600' on it"
        raise QuadvisError(sentence(f"there is no signing key {quoted(name)}", remedy))
    found = read_private(path).strip()
    if not KEY.fullmatch(found):
        raise QuadvisError(f"the signing key in '{path}' must be 64 hexadecimal digits")
    return bytes.fromhex(found)


class KeptTimes:
    """The times of a key, see `quadvis_blocks.mavlink._signing.SigningTimes`.

    One process of all ``signs``; QuadvisError if another one does. After a start of the machine the file may
    lack the last half minute before that, which is left out.
    """

    def __init__(self, name: str, *, signs: bool, clock: Clock = time.time_ns) -> None:
        import fcntl

        path = private_folder(folder()) / f"{name}.times"
        try:
            self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
            if signs:
                fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            os.ftruncate(self._file, 8 * WORDS)
            self._map = mmap.mmap(self._file, 8 * WORDS)
        except BlockingIOError:
            os.close(self._file)
            raise QuadvisError(f"the signing key {quoted(name)} is in use by another run") from None
        except OSError as error:
            raise QuadvisError(f"cannot use '{path}': {reason(error)}") from None
        self._words = memoryview(self._map).cast("Q")
        if signs:
            self._begin(clock)

    def _begin(self, clock: Clock) -> None:
        words, boot = self._words, _boot()
        if words[MARK] == MAGIC and (words[BOOT], words[BOOT + 1]) != boot:
            words[SENT] = max(words[SENT] + MINUTE, signing_time(clock))
        words[MARK] = MAGIC
        words[BOOT], words[BOOT + 1] = boot
        self._map.flush()

    @property
    def sent(self) -> int:
        """The time of the last packet sent."""
        return int(self._words[SENT])

    @sent.setter
    def sent(self, stamp: int) -> None:
        self._words[SENT] = stamp

    @property
    def heard(self) -> int:
        """The latest time heard."""
        return int(self._words[HEARD])

    @heard.setter
    def heard(self, stamp: int) -> None:
        self._words[HEARD] = stamp

    def of(self, stream: int) -> int | None:
        """Return the last time heard of a stream; None if it is a new one."""
        place = self._place(stream)
        return int(self._words[place + 1]) if place and self._words[place] else None

    def set(self, stream: int, stamp: int) -> bool:
        """Keep the last time of a stream; return False if there is no room for another one."""
        if place := self._place(stream):
            self._words[place + 1] = stamp
            self._words[place] = stream + 1
        return bool(place)

    def _place(self, stream: int) -> int:
        """Return the word of a stream, or of a free place; 0 if there is none."""
        for place in range(STREAMS, WORDS, 2):
            if self._words[place] in (0, stream + 1):
                return place
        return 0

    def close(self) -> None:
        """Give the times back."""
        self._words.release()
        self._map.close()
        os.close(self._file)


def _boot() -> tuple[int, int]:
    """Return the number of this start of the machine."""
    found = ""
    with suppress(OSError):
        found = BOOT_FILE.read_text(encoding="ascii").replace("-", "").strip()
    number = int(found or "0", 16)
    return number >> 64, number & (1 << 64) - 1
