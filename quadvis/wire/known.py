"""The targets that a host knows: name, address and public key, pinned when they are first seen."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from quadvis.document import dump_yaml, read_yaml
from quadvis.document.node import YamlNode
from quadvis.errors import DiagramError, QuadvisError, quoted, sentence, suggestion
from quadvis.wire.home import alone, home, write_private
from quadvis.wire.keys import checked_name, fingerprint, read_public
from quadvis.wire.refusals import WrongTargetError

FILE = "known_targets.yaml"
_HEAD = "# Targets by name, with the keys that they had when they were first seen.\n"


@dataclass(frozen=True)
class KnownTarget:
    """A target: its name here, its address as host:port, its public key."""

    name: str
    address: str
    public: bytes


class KnownTargets:
    """The list of a host."""

    def __init__(self, folder: Path | None = None) -> None:
        self.path = (folder or home()) / FILE

    def all(self) -> dict[str, KnownTarget]:
        """Return the targets by name; DiagramError if the file has a fault."""
        if not self.path.exists():
            return {}
        return {key.value: _read(key.value, node) for key, node in read_yaml(self.path).mapping().pairs()}

    def find(self, name: str) -> KnownTarget | None:
        """Return a target by its name or by its address."""
        known = self.all()
        return known.get(name) or next((each for each in known.values() if each.address == name), None)

    def pin(self, name: str, address: str, public: bytes) -> KnownTarget:
        """Keep a target that is seen for the first time; WrongTargetError if it had another key before."""
        target = KnownTarget(checked_name(name), address, public)
        with alone(self.path.parent):
            known = self.all()
            for old in known.values():
                if old.name == name or old.address == address:
                    check_same(old, public)
            self._write(known | {name: target})
        return target

    def forget(self, name: str) -> KnownTarget:
        """Remove a target, so that its next key is pinned anew."""
        with alone(self.path.parent):
            known = self.all()
            if name not in known:
                raise QuadvisError(sentence(f"no target {quoted(name)} is known", suggestion(name, known)))
            gone = known.pop(name)
            self._write(known)
        return gone

    def _write(self, known: dict[str, KnownTarget]) -> None:
        entries = {
            name: {"address": each.address, "key": each.public.hex()} for name, each in sorted(known.items())
        }
        write_private(self.path, _HEAD + (dump_yaml(entries) if entries else "{}\n"))


def check_same(known: KnownTarget, public: bytes) -> None:
    """Raise WrongTargetError, with both fingerprints, if a target has another key than the one pinned."""
    if known.public != public:
        raise WrongTargetError(
            f"{known.name} at {known.address} has the key {fingerprint(public)}, and it had "
            f"{fingerprint(known.public)}: another computer may pose as it; if it was set up anew, run "
            f"'quadvis keys forget {known.name}'"
        )


def _read(name: str, node: YamlNode) -> KnownTarget:
    entry = node.fields(("address", "key"))
    try:
        return KnownTarget(checked_name(name), entry["address"].text(), read_public(entry["key"].text()))
    except DiagramError:
        raise
    except QuadvisError as error:
        raise node.fault(str(error)) from None
