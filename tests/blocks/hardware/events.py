"""Events of joysticks, a FIFO that carries them, and Linux's folders of joysticks, made up."""

from __future__ import annotations

import os
import struct
from pathlib import Path
from typing import Any

from quadvis_blocks.hardware._event_codes import (
    EV_SYN,
    MOST_KEY,
    SYN_REPORT,
    EventCode,
    event_code,
)
from quadvis_blocks.hardware._event_device import (
    ABSINFO,
    EVENT,
    GET_AXES_THERE,
    GET_AXIS,
    GET_KEYS,
    GET_KEYS_THERE,
    SET_CLOCK,
)


def code(word: str) -> EventCode:
    """Return the code of a name."""
    found = event_code(word)
    assert found is not None
    return found


def event(kind: int, number: int, value: int, stamp: int = 0) -> bytes:
    """Return one struct input_event; its stamp is in ns."""
    return EVENT.pack(stamp // 10**9, stamp % 10**9 // 1000, kind, number, value)


def report(stamp: int = 0, **values: int) -> bytes:
    """Return a report: `report(ABS_X=-32767, BTN_TL=1)`."""
    changes = [event(*code(name), value, stamp) for name, value in values.items()]
    return b"".join(changes) + event(EV_SYN, SYN_REPORT, 0, stamp)


class Fifo:
    """A FIFO in the place of a joystick, and who writes into it."""

    def __init__(self, path: Path) -> None:
        self.path = str(path)
        os.mkfifo(path)
        self._descriptor = -1

    def plug(self) -> None:
        """Be there; blocks until somebody reads."""
        self._descriptor = os.open(self.path, os.O_WRONLY)

    def send(self, piece: bytes) -> None:
        """Send bytes."""
        os.write(self._descriptor, piece)

    def unplug(self) -> None:
        """Be gone."""
        os.close(self._descriptor)
        self._descriptor = -1


class Driver:
    """Answers the calls by which Linux describes a device: stands in for the kernel."""

    def __init__(
        self, axes: dict[str, tuple[int, int, int]], buttons: dict[str, int], clock: bool = True
    ) -> None:
        self.axes = {code(name).code: values for name, values in axes.items()}
        self.buttons = {code(name).code: pressed for name, pressed in buttons.items()}
        self._clock = clock
        self.failure = 0

    def __call__(self, descriptor: int, number: int, room: Any) -> Any:
        if self.failure:
            raise OSError(self.failure, os.strerror(self.failure))
        if number == SET_CLOCK:
            assert struct.unpack("i", room) == (1,)
            if not self._clock:
                raise OSError(22, "invalid argument")
            return 0
        if number == GET_AXES_THERE:
            return bits(self.axes, len(room))
        if number == GET_KEYS_THERE:
            return bits(self.buttons, len(room))
        if number == GET_KEYS:
            return bits({key for key, pressed in self.buttons.items() if pressed}, len(room))
        value, low, high = self.axes[number - GET_AXIS]
        return ABSINFO.pack(value, low, high, 0, 0, 0)


def bits(numbers: Any, length: int) -> bytes:
    """Return a list of bits as the kernel gives it."""
    return sum(1 << number for number in numbers).to_bytes(length, "little")


class Folders:
    """/sys and /dev with joysticks that are FIFOs."""

    def __init__(self, root: Path) -> None:
        self.root, self.system = root, str(root)
        for folder in ("sys/class/input", "dev/input/by-id", "dev/input/by-path"):
            (root / folder).mkdir(parents=True)

    def node(self, number: int) -> Path:
        """Return the path of a node."""
        return self.root / f"dev/input/event{number}"

    def add(
        self, number: int, name: str, *, uniq: str = "", links: tuple[str, ...] = (), stick: bool = True
    ) -> None:
        """Add a device."""
        device = self.root / f"sys/class/input/event{number}/device"
        (device / "id").mkdir(parents=True)
        (device / "capabilities").mkdir()
        keys = 1 << code("BTN_TRIGGER").code if stick else 1 << 30
        texts = {
            "name": name, "uniq": uniq, "id/bustype": "0003", "id/vendor": "046d", "id/product": "c216",
            "capabilities/abs": "3003f" if stick else "0", "capabilities/key": words(keys),
        }  # fmt: skip
        for path, text in texts.items():
            (device / path).write_text(text + "\n")
        if not self.node(number).exists():
            os.mkfifo(self.node(number))
        for link in links:
            (self.root / "dev/input" / link).symlink_to(self.node(number))

    def remove(self, number: int) -> None:
        """Take a device away, with its links."""
        for path in (self.root / "dev/input").glob("by-*/*"):
            if path.resolve() == self.node(number):
                path.unlink()
        self.node(number).unlink()
        entry = self.root / f"sys/class/input/event{number}"
        for path in sorted(entry.rglob("*"), reverse=True):
            path.unlink() if path.is_file() else path.rmdir()
        entry.rmdir()


def words(value: int) -> str:
    """Return bits as Linux's text has them: words of 64 bits in hexadecimal, the highest first."""
    parts = [value >> 64 * number & (1 << 64) - 1 for number in range((MOST_KEY + 64) // 64)]
    return " ".join(f"{part:x}" for part in reversed(parts)).lstrip("0 ") or "0"
