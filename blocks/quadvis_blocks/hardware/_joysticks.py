"""The joysticks of this computer (Linux), and what a name of one stands for.

A number changes when a joystick is plugged in again, and may then be that of another one. So a joystick is
known by a lasting name: a link in /dev/input/by-id or by-path, or the name that it gives itself, if it is the
only one of this name. A bare number is taken only while there is one joystick.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from quadvis.errors import quoted, sentence
from quadvis.machine.ports import PortError
from quadvis_blocks.hardware._event_codes import JOYSTICK_BUTTONS

SYSTEM = "/"
BY_NAME = "name:"
LINKS = ("by-id", "by-path")
LONG = 200  # characters of a name in a message: what tells two of one make apart stands last
WORD = 64  # bits of a word of a list of capabilities
ABS_X = 0


@dataclass(frozen=True)
class FoundJoystick:
    """A joystick: its node, such as /dev/input/event5, its lasting names, its title, and who made it."""

    node: str
    names: tuple[str, ...]
    title: str
    identity: tuple[str, ...]

    @property
    def lasting(self) -> str:
        """The best name for a diagram."""
        return self.names[0] if self.names else BY_NAME + self.title


def joysticks(system: str = SYSTEM) -> list[FoundJoystick]:
    """Return the devices that have a stick and the buttons of a joystick."""
    found = []
    for entry in sorted(
        Path(system, "sys/class/input").glob("event*"), key=lambda path: (len(path.name), path.name)
    ):
        if _is_joystick(entry / "device/capabilities"):
            node = Path(system, "dev/input", entry.name)
            names = tuple(str(name) for name in _links(system) if name.resolve() == node.resolve())
            found.append(
                FoundJoystick(str(node), names, _text(entry / "device/name"), identity_of(str(node), system))
            )
    return found


def identity_of(device: str, system: str = SYSTEM) -> tuple[str, ...]:
    """Return maker, product, name and serial number of a device, as far as Linux knows them."""
    entry = Path(system, "sys/class/input", os.path.basename(os.path.realpath(device)), "device")
    parts = "id/bustype", "id/vendor", "id/product", "name", "uniq"
    return tuple(_text(entry / part) for part in parts)


def lasting_name(device: str, system: str = SYSTEM) -> str:
    """Return the lasting name of a joystick.

    PortError if it is a number or a node and there is not exactly one joystick, and if there are two that its
    name does not tell apart.
    """
    known = joysticks(system)
    node = str(Path(system, "dev/input", f"event{device}")) if device.isdecimal() else device
    if device.isdecimal() or any(joystick.node == node for joystick in known):
        if len(known) > 1:
            problem = f"joystick {quoted(device, LONG)} may be another one after each start: there are"
            raise PortError(sentence(f"{problem} {len(known)}", f"name one of {_all(known)}"))
        return next((joystick.lasting for joystick in known if joystick.node == node), node)
    _check_twins(device, known)
    return device


def node_of(device: str, system: str = SYSTEM) -> str:
    """Return the path to open for a lasting name; PortError if there is none, or more than one."""
    if not device.startswith(BY_NAME):
        if os.path.exists(device):
            return device
        raise PortError(absent(device, system))
    found = [joystick for joystick in joysticks(system) if joystick.title == device.removeprefix(BY_NAME)]
    if not found:
        raise PortError(absent(device, system))
    if len(found) > 1:
        raise PortError(_twins(device, found))
    return found[0].node


def missing(device: str, system: str = SYSTEM) -> str:
    """Return a sentence if a joystick is surely not there, or not told apart from another one, else ""."""
    try:
        node_of(lasting_name(device, system), system)
    except PortError as error:
        return str(error)
    return ""


def absent(device: str, system: str = SYSTEM) -> str:
    """Return a sentence about a joystick that is not there."""
    there = _all(joysticks(system))
    remedy = "plug it in, or give the path of another one" + (f", such as {there}" if there else "")
    return sentence(f"joystick {quoted(device, LONG)} is missing", remedy)


def _check_twins(device: str, known: list[FoundJoystick]) -> None:
    """Refuse a name by identity if two joysticks have that identity; a path of by-path tells them apart."""
    for joystick in known:
        if os.path.dirname(device).endswith("by-id") and device in joystick.names:
            found = [other for other in known if other.identity == joystick.identity]
            if len(found) > 1:
                raise PortError(_twins(device, found))


def _twins(device: str, found: list[FoundJoystick]) -> str:
    paths = [name for joystick in found for name in joystick.names if "by-path" in name]
    places = " or ".join(quoted(path, LONG) for path in paths)
    problem = f"{quoted(device, LONG)} is the name of {len(found)} joysticks"
    return sentence(problem, f"name one by its place, {places}" if paths else "unplug one")


def _all(known: list[FoundJoystick]) -> str:
    return ", ".join(quoted(joystick.lasting, LONG) for joystick in known)


def _is_joystick(capabilities: Path) -> bool:
    axes, buttons = (_bits(_text(capabilities / name)) for name in ("abs", "key"))
    return ABS_X in axes and any(code in buttons for codes in JOYSTICK_BUTTONS for code in codes)


def _bits(text: str) -> set[int]:
    """Return the bits that a list of capabilities sets: words in hexadecimal, the highest first."""
    found = set()
    for number, word in enumerate(reversed(text.split())):
        try:
            value = int(word, 16)
        except ValueError:
            return set()
        found |= {WORD * number + bit for bit in range(WORD) if value >> bit & 1}
    return found


def _links(system: str) -> Iterator[Path]:
    for folder in LINKS:
        yield from sorted(Path(system, "dev/input", folder).glob("*"))


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace").strip()
    except OSError:
        return ""
