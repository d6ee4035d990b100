"""Key pairs of hosts and targets: Curve25519, as in ZeroMQ's CURVE; private halves in closed files."""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass, field
from pathlib import Path

import zmq
from zmq.utils import z85

from quadvis.errors import QuadvisError, quoted, sentence, suggestion
from quadvis.wire.home import home, read_private, write_private

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}", re.ASCII)
_KEY = re.compile(r"[0-9a-f]{64}")
_LINE = re.compile(r"^(public|private): ([0-9a-f]{64})$", re.MULTILINE)
SUFFIX = ".key"


@dataclass(frozen=True)
class KeyPair:
    """A name and its key: 32 bytes public, 32 bytes private."""

    name: str
    public: bytes
    private: bytes = field(repr=False)


def checked_name(name: str) -> str:
    """Return a name of a key or of a target; QuadvisError if it cannot be one."""
    if _NAME.fullmatch(name) is None:
        raise QuadvisError(
            f"{quoted(name)} cannot be a name; use at most 64 letters, digits, '_', '.' and '-'"
        )
    return name


def read_public(text: str) -> bytes:
    """Return the public key in a text of 64 hexadecimal digits."""
    plain = text.strip().lower()
    if _KEY.fullmatch(plain) is None:
        raise QuadvisError(f"{quoted(text)} is no public key; it has 64 hexadecimal digits")
    return bytes.fromhex(plain)


def fingerprint(public: bytes) -> str:
    """Return 32 hexadecimal digits of a public key's SHA-256, in groups of four, for people to compare."""
    digits = hashlib.sha256(public).hexdigest()[:32]
    return "-".join(digits[at : at + 4] for at in range(0, 32, 4))


def made_pair(name: str) -> KeyPair:
    """Return a fresh key pair."""
    public, private = zmq.curve_keypair()
    return KeyPair(checked_name(name), z85.decode(public), z85.decode(private))


def new_key(name: str, folder: Path | None = None) -> tuple[KeyPair, Path]:
    """Make a key pair and keep it; return it with its file. QuadvisError if the name has one already."""
    pair = made_pair(name)
    path = _folder(folder) / f"{name}{SUFFIX}"
    text = (
        f"# Whoever can read this file is '{name}' to quadvis. Give nobody more than the public line.\n"
        f"public: {pair.public.hex()}\nprivate: {pair.private.hex()}\n"
    )
    write_private(path, text, new=True)
    return pair, path


def own_key(name: str | None = None, folder: Path | None = None) -> KeyPair:
    """Return one of the keys that are kept here; without a name the only one."""
    names = own_names(folder)
    if name is None:
        if len(names) != 1:
            have = f"there are the keys {', '.join(map(quoted, names))}" if names else "there is no key"
            remedy = "name one of them" if names else "make one with 'quadvis keys new NAME'"
            raise QuadvisError(sentence(have, remedy))
        name = names[0]
    if checked_name(name) not in names:
        remedy = suggestion(name, names) or f"make it with 'quadvis keys new {name}'"
        raise QuadvisError(sentence(f"there is no key {quoted(name)}", remedy))
    path = _folder(folder) / f"{name}{SUFFIX}"
    found = {which: bytes.fromhex(digits) for which, digits in _LINE.findall(read_private(path))}
    if found.keys() != {"public", "private"}:
        raise QuadvisError(f"'{path}' is no key file; it has a line 'public: ...' and a line 'private: ...'")
    if zmq.curve_public(z85.encode(found["private"])) != z85.encode(found["public"]):
        raise QuadvisError(f"the public line of '{path}' does not belong to its private line")
    return KeyPair(name, **found)


def own_names(folder: Path | None = None) -> list[str]:
    """Return the names of the keys that are kept here."""
    return sorted(path.name.removesuffix(SUFFIX) for path in _folder(folder).glob(f"[!.]*{SUFFIX}"))


def _folder(given: Path | None) -> Path:
    return (given or home()) / "keys"
