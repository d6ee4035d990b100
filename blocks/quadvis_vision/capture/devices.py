"""The cameras of this computer (Linux), and what a name of a camera stands for.

A number changes when a camera is plugged in again, and may then be that of another camera. So a camera is
known by its lasting name, a link in /dev/v4l/by-id or by-path; a bare number is taken only while there is one
camera, and stands for that camera's lasting name.
"""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from quadvis.errors import quoted, sentence
from quadvis.machine.ports import PortError

SYSTEM = Path("/")
URL = re.compile(r"[a-zA-Z][a-zA-Z0-9+.-]*://")
LINKS = ("by-id", "by-path")
NAME = 200  # characters of a camera's name in a message: what tells two of one make apart stands last
START_OF_EXPOSURE = {"uvcvideo"}  # drivers whose stamps are the start of the exposure; others stamp its end


@dataclass(frozen=True)
class FoundCamera:
    """A camera: its node, such as /dev/video0, its lasting names, its title and the name of its driver."""

    node: str
    names: tuple[str, ...]
    title: str
    driver: str

    @property
    def lasting(self) -> str:
        """The best name for a diagram."""
        return self.names[0] if self.names else self.node


def cameras(system: Path = SYSTEM) -> list[FoundCamera]:
    """Return the cameras that Linux knows; nodes of a camera that give no pictures are left out."""
    found = []
    for entry in sorted((system / "sys/class/video4linux").glob("video*"), key=_number):
        if _text(entry / "index") in ("", "0"):  # a second node has data about the pictures
            node = system / "dev" / entry.name
            names = tuple(str(name) for name in _links(system) if name.resolve() == node.resolve())
            driver = (entry / "device/driver").resolve().name
            found.append(FoundCamera(str(node), names, _text(entry / "name"), driver))
    return found


def lasting_name(device: str, system: Path = SYSTEM) -> str:
    """Return the lasting name of a camera that is named by its number or node, else the name as it is.

    PortError if it is a number and there is not exactly one camera.
    """
    known = cameras(system)
    if not device.isdecimal():
        return next((camera.lasting for camera in known if camera.node == device), device)
    node = str(system / "dev" / f"video{device}")
    if len(known) > 1:
        names = ", ".join(named(camera.lasting) for camera in known)
        problem = f"camera {device} may be another one after each start, since there are {len(known)}"
        raise PortError(sentence(problem, f"name one of {names}"))
    return next((camera.lasting for camera in known if camera.node == node), node)


def missing(device: str, system: Path = SYSTEM) -> str:
    """Return a sentence if a camera is surely not there, else ""."""
    try:
        device = lasting_name(device, system)
    except PortError as error:
        return str(error)
    if is_url(device) or os.path.exists(device):
        return ""
    there = ", ".join(named(camera.lasting) for camera in cameras(system))
    remedy = "plug it in, or give the path of another one" + (f", such as {there}" if there else "")
    return sentence(f"camera {named(device)} is missing", remedy)


def named(device: str) -> str:
    """Return the name of a camera for a message."""
    return quoted(device, NAME)


def is_url(device: str) -> bool:
    """Return whether a camera is named by a URL."""
    return URL.match(device) is not None


def is_driver(device: str) -> bool:
    """Return whether a camera is a device of the system, which V4L2 reads."""
    try:
        return stat.S_ISCHR(os.stat(device).st_mode)
    except OSError:
        return False


def is_file(device: str) -> bool:
    """Return whether a camera is a plain file: a video in its place."""
    return os.path.isfile(device)


def stamps_start(device: str, system: Path = SYSTEM) -> bool:
    """Return whether the driver of a camera stamps the start of the exposure, not its end."""
    node = os.path.realpath(device)
    return any(camera.driver in START_OF_EXPOSURE for camera in cameras(system) if camera.node == node)


def _links(system: Path) -> Iterator[Path]:
    for folder in LINKS:
        yield from sorted((system / "dev/v4l" / folder).glob("*"))


def _number(entry: Path) -> int:
    digits = entry.name.removeprefix("video")
    return int(digits) if digits.isdecimal() else 0


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace").strip()
    except OSError:
        return ""
