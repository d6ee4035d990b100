"""Where a target listens: host and port, or the path of a socket on this computer."""

from __future__ import annotations

import os
import re
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from quadvis.errors import QuadvisError, quoted
from quadvis.wire.home import home
from quadvis.wire.keys import checked_name
from quadvis.wire.limits import PORT

SERVICES = Path("/run/quadvis")  # the folders of the units of `quadvis target install`
LOOPBACK = ("127.0.0.1", "::1", "localhost")
_LONGEST_PATH = 100  # bytes; the system takes 107, and the second socket has a longer name
_TCP = re.compile(
    r"(?:tcp://)?(?:\[(?P<six>[0-9A-Fa-f:.%]+)\]|(?P<host>[A-Za-z0-9._-]+))(?::(?P<port>\d{1,5}))?"
)


@dataclass(frozen=True)
class WireAddress:
    """A host and the port of its control socket, or the path of a control socket."""

    host: str = ""
    port: int = 0
    path: str = ""

    def __str__(self) -> str:
        """Return "host:port" or the path."""
        return self.path or f"{f'[{self.host}]' if ':' in self.host else self.host}:{self.port}"

    @property
    def endpoint(self) -> str:
        """The address in the words of ZeroMQ."""
        return f"ipc://{self.path}" if self.path else f"tcp://{self}"

    def stream(self, place: object) -> WireAddress:
        """Return the address of the second socket, from what 'hello' says of it."""
        if self.path:
            return WireAddress(path=str(place))
        return (
            WireAddress(self.host, place) if isinstance(place, int) else WireAddress(self.host, self.port + 2)
        )


def read_address(text: str) -> WireAddress:
    """Return the address in a text such as "lab1:22222", "192.168.1.7", "/run/user/1000/quadvis/lab1"."""
    if text.startswith(("/", "ipc://")):
        return WireAddress(path=checked_path(text.removeprefix("ipc://")))
    match = _TCP.fullmatch(text)
    port = int(match["port"] or PORT) if match else 0
    if match is None or not 0 < port < 65536:
        raise QuadvisError(f"{quoted(text)} is no address; write one such as 192.168.1.7:{PORT}")
    return WireAddress(match["six"] or match["host"], port)


def local_path(target: str) -> Path:
    """Return the path at which a target of this computer's user listens."""
    base = os.environ.get("XDG_RUNTIME_DIR")
    return (Path(base) / "quadvis" if base else home() / "run") / checked_name(target)


def service_path(target: str, folder: str | Path | None = None) -> Path:
    """Return the path at which a target listens that systemd has started, in its folder of `/run/quadvis`."""
    return Path(folder or SERVICES / checked_name(target)) / checked_name(target)


def found_path(target: str) -> Path | None:
    """Return the path at which a target of this computer is found; None if there is none for this user."""
    for path in (local_path(target), service_path(target)):
        with suppress(OSError):  # the folder of another user's target
            if path.exists():
                return path
    return None


def checked_path(path: str) -> str:
    """Return the path of a socket; QuadvisError if it is too long for one."""
    if len(os.fsencode(path)) > _LONGEST_PATH:
        raise QuadvisError(
            f"the path of a socket has at most {_LONGEST_PATH} bytes, this one has more: {path}"
        )
    return path
