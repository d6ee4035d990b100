"""From the name or the address of a target to a connection, with the right keys at both ends."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from quadvis.errors import QuadvisError, quoted, sentence, suggestion
from quadvis.wire.address import WireAddress, found_path, local_path, read_address
from quadvis.wire.client import PATIENCE, Client
from quadvis.wire.introduction import introduced
from quadvis.wire.keys import fingerprint, own_key
from quadvis.wire.known import KnownTarget, KnownTargets, check_same
from quadvis.wire.refusals import NoAnswerError


def meet(
    target: str,
    *,
    key: str | None = None,
    folder: Path | None = None,
    say: Callable[[str], object] = lambda words: None,
    timeout: float = PATIENCE,
) -> Client:
    """Return a connection to a target: a name that is known here, host:port, or a path.

    ``key`` is the name of our key, if there are several. A target that is met for the first time is pinned,
    and ``say`` gets its fingerprint. NoAnswerError, WrongTargetError and NotAllowedError say within
    ``timeout`` (s) what is wrong.
    """
    known = KnownTargets(folder)
    found = known.find(target)
    if found is None and _is_local(target):
        path = (
            target.removeprefix("ipc://") if "/" in target else str(found_path(target) or local_path(target))
        )
        return _connected(Client(read_address(path), target), timeout)
    pair = own_key(key, folder)
    found = _introduced(target, found, known, say, timeout / 3)
    return _connected(Client(read_address(found.address), found.name, pair, found.public), timeout * 2 / 3)


def _is_local(target: str) -> bool:
    if "/" in target and not target.startswith("tcp://"):
        return True
    try:
        return found_path(target) is not None
    except QuadvisError:  # an address is no name
        return False


def _introduced(
    target: str,
    found: KnownTarget | None,
    known: KnownTargets,
    say: Callable[[str], object],
    timeout: float,
) -> KnownTarget:
    """Return a target with the key that it must have; refuse one that says it has another one."""
    address = read_address(found.address if found else target)
    try:
        name, public = introduced(address, timeout)
    except NoAnswerError as error:
        if found is not None:  # a firewall may let the other ports through
            return found
        raise _unknown(target, address, known, error) from None
    if found is not None:
        check_same(found, public)
        return found
    pinned = known.pin(name, str(address), public)
    say(f"{name} at {address} is met for the first time; its key is {fingerprint(public)}")
    return pinned


def _unknown(target: str, address: WireAddress, known: KnownTargets, error: NoAnswerError) -> NoAnswerError:
    near = suggestion(target, known.all())
    return NoAnswerError(sentence(f"{quoted(target)} does not answer: {error}", near))


def _connected(client: Client, timeout: float) -> Client:
    try:
        client.connect(timeout)
    except BaseException:
        client.close()
        raise
    return client
