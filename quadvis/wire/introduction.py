"""How a host learns the key of a target that it meets for the first time, or that has changed.

The target tells its name and public key in one line to whoever connects, reads nothing, and closes. The line
proves nothing: it is the handshake that follows which only the owner of the private key can answer.
"""

from __future__ import annotations

import re
import socket
from contextlib import suppress

from quadvis.wire.address import WireAddress
from quadvis.wire.limits import VERSION
from quadvis.wire.refusals import NoAnswerError

_AT_ONCE = 16
_LINE = re.compile(rb"quadvis (\d{1,3}) ([A-Za-z0-9][A-Za-z0-9_.-]{0,63}) ([0-9a-f]{64})\n")


def introduce(listener: socket.socket, target: str, public: bytes) -> int:
    """Answer those who wait at a listening socket, and return how many."""
    line = f"quadvis {VERSION} {target} {public.hex()}\n".encode("ascii")
    for count in range(_AT_ONCE):
        try:
            connection, _ = listener.accept()
        except OSError:
            return count
        with connection, suppress(OSError):
            connection.setblocking(False)
            connection.send(line)
    return _AT_ONCE


def introduced(address: WireAddress, timeout: float) -> tuple[str, bytes]:
    """Return the name and the public key that a target says it has; NoAnswerError if nobody does."""
    place = f"{address.host}, port {address.port + 1}"
    try:
        with socket.create_connection((address.host, address.port + 1), timeout) as connection:
            connection.settimeout(timeout)
            with connection.makefile("rb") as file:
                match = _LINE.fullmatch(file.readline(200))
    except TimeoutError:
        raise NoAnswerError(
            f"{place} is silent; is a target there, and does a firewall let it answer?"
        ) from None
    except socket.gaierror:
        raise NoAnswerError(f"there is no computer '{address.host}' in this network") from None
    except (OSError, UnicodeError) as error:
        words = getattr(error, "strerror", None) or str(error)
        remedy = "start the target there with 'quadvis target --listen'"
        raise NoAnswerError(f"nothing answers at {place} ({words.lower()}); {remedy}") from None
    if match is None:
        raise NoAnswerError(f"what answers at {place} is no target of quadvis")
    if int(match[1]) != VERSION:
        raise NoAnswerError(f"the target at {place} talks version {int(match[1])} of the wire, not {VERSION}")
    return match[2].decode("ascii"), bytes.fromhex(match[3].decode("ascii"))
