"""The hosts that a target lets in: `authorized_hosts.yaml`, reread whenever it changes.

An entry with a fault lets nobody in, nor does a file that cannot be read at all; the others count.
"""

from __future__ import annotations

import ipaddress
import os
import stat
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from quadvis.document import dump_yaml, read_yaml
from quadvis.document.node import YamlNode
from quadvis.errors import DiagramError, Fault, Faults, Place, QuadvisError, quoted, sentence, suggestion
from quadvis.wire.home import alone, home, write_private
from quadvis.wire.keys import checked_name, fingerprint, read_public
from quadvis.wire.levels import LEVELS

FILE = "authorized_hosts.yaml"
_HEAD = "# Who may use the target on this computer. 'quadvis keys allow' and 'revoke' write this file.\n"

IpNetwork = ipaddress.IPv4Network | ipaddress.IPv6Network


@dataclass(frozen=True)
class AuthorizedHost:
    """A host: its name, public key, level, and the networks that it may come from (all if there is none)."""

    name: str
    public: bytes
    level: int
    networks: tuple[IpNetwork, ...] = ()

    def may_come_from(self, address: str) -> bool:
        """Return whether an IP address is in one of the networks."""
        if not self.networks:
            return True
        try:
            found = ipaddress.ip_address(address.partition("%")[0])
        except ValueError:
            return False
        found = getattr(found, "ipv4_mapped", None) or found
        return any(found in network for network in self.networks)


class AuthorizedHosts:
    """The list of a target; `refresh` rereads the file if it has changed."""

    def __init__(self, folder: Path | None = None) -> None:
        self.path = (folder or home()) / FILE
        self.faults: tuple[Fault, ...] = ()
        self._hosts: Mapping[bytes, AuthorizedHost] = {}
        self._seen: tuple[int, ...] | None = (-1,)
        self.refresh()

    def __iter__(self) -> Any:
        return iter(self._hosts.values())

    def find(self, public: bytes, address: str) -> AuthorizedHost | None:
        """Return the host with a key, if it may come from an address."""
        host = self._hosts.get(public)
        return host if host is not None and host.may_come_from(address) else None

    def refresh(self) -> bool:
        """Reread a changed file; return whether it had changed."""
        seen = self._state()
        if seen == self._seen:
            return False
        self._seen = seen
        faults = Faults()
        try:
            hosts = read_hosts(self.path, faults) if seen else ()
        except DiagramError as error:
            hosts = ()
            faults.extend(error.faults)
        except OSError:  # it has been removed meanwhile; the next look sees what is there then
            hosts, self._seen = (), (-1,)
        self._hosts = {host.public: host for host in hosts}
        self.faults = tuple(faults)
        return True

    def _state(self) -> tuple[int, ...] | None:
        try:
            found = os.stat(self.path)
        except OSError:
            return None
        return found.st_ino, found.st_size, found.st_mtime_ns, found.st_ctime_ns


def read_hosts(path: Path, faults: Faults) -> list[AuthorizedHost]:
    """Return the whole entries of a list; the faults of the others are added. DiagramError if it is none."""
    found = path.stat()
    if found.st_mode & (stat.S_IWGRP | stat.S_IWOTH) or found.st_uid not in (os.geteuid(), 0):
        problem, remedy = "other users can change this file", f"run 'chmod 600 {path}'"
        raise DiagramError([Fault(Place(str(path)), "", problem, remedy)])
    hosts: dict[bytes, AuthorizedHost] = {}
    for key, node in read_yaml(path, faults).mapping().pairs():
        with faults.about(f"host {quoted(key.value)}"):
            host = faults.collect(_read_host, key.value, node)
            if host is None:
                continue
            other = hosts.get(host.public)
            if other is not None:
                faults.add(node.place, f"{quoted(other.name)} has the same key", "remove one of them")
                del hosts[host.public]  # which of the two levels was meant?
                continue
            hosts[host.public] = host
    return list(hosts.values())


def _read_host(name: str, node: YamlNode) -> AuthorizedHost:
    entry = node.fields(("key", "level"), ("networks",))
    try:
        checked_name(name)
        public = read_public(entry["key"].text())
    except DiagramError:
        raise
    except QuadvisError as error:
        raise node.fault(str(error)) from None
    level = entry["level"].integer()
    if not 0 <= level < len(LEVELS):
        raise entry["level"].wrong(f"a level from 0 to {len(LEVELS) - 1}")
    listed = entry.get("networks")
    networks = tuple(map(_read_network, listed.items())) if listed is not None else ()
    if listed is not None and not networks:
        raise listed.fault("the list of networks is empty", "leave it out, or revoke the key")
    return AuthorizedHost(name, public, level, networks)


def _read_network(node: YamlNode) -> IpNetwork:
    try:
        return read_network(node.text())
    except DiagramError:
        raise
    except QuadvisError as error:
        raise node.fault(str(error)) from None


def read_network(text: str) -> IpNetwork:
    """Return a network such as 192.168.1.0/24, or one address."""
    try:
        return ipaddress.ip_network(text.strip())
    except ValueError as error:
        raise QuadvisError(
            f"{quoted(text)} is no network: {error}; write one such as 192.168.1.0/24"
        ) from None


def allow(
    name: str, public: str, level: int, networks: Iterable[str] = (), folder: Path | None = None
) -> AuthorizedHost:
    """Let a host in, or change how; QuadvisError if the list has a fault or another name for the key."""
    host = AuthorizedHost(checked_name(name), read_public(public), level, tuple(map(read_network, networks)))
    if not 0 <= level < len(LEVELS):
        raise QuadvisError(f"there is no level {level}; levels go from 0 to {len(LEVELS) - 1}")
    path = (folder or home()) / FILE
    with alone(path.parent):
        hosts = {each.name: each for each in _whole_list(path)}
        same = next((each.name for each in hosts.values() if each.public == host.public), name)
        if same != name:
            raise QuadvisError(f"{quoted(same)} has this key already; revoke it first")
        hosts[name] = host
        _write(path, hosts.values())
    return host


def revoke(name: str, folder: Path | None = None) -> AuthorizedHost:
    """Let a host in no more; a target that runs drops it at once."""
    path = (folder or home()) / FILE
    with alone(path.parent):
        hosts = {each.name: each for each in _whole_list(path)}
        if name not in hosts:
            raise QuadvisError(sentence(f"no host {quoted(name)} is let in", suggestion(name, hosts)))
        gone = hosts.pop(name)
        _write(path, hosts.values())
    return gone


def _whole_list(path: Path) -> list[AuthorizedHost]:
    if not path.exists():
        return []
    faults = Faults()
    hosts = read_hosts(path, faults)
    faults.check()
    return hosts


def _write(path: Path, hosts: Iterable[AuthorizedHost]) -> None:
    entries = {}
    for host in sorted(hosts, key=lambda host: host.name):
        entries[host.name] = {"key": host.public.hex(), "level": host.level}
        if host.networks:
            entries[host.name]["networks"] = list(map(str, host.networks))
    write_private(path, _HEAD + (dump_yaml(entries) if entries else "{}\n"))


def described(host: AuthorizedHost) -> str:
    """Return one line about a host."""
    where = f" from {', '.join(map(str, host.networks))}" if host.networks else ""
    return f"{host.name}: {LEVELS[host.level]} (level {host.level}){where}, {fingerprint(host.public)}"
