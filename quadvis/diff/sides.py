"""One side of a difference: a diagram file in one variant, or the log of a run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from quadvis.diagram.load import load
from quadvis.document import parse_yaml
from quadvis.errors import QuadvisError, quoted
from quadvis.library.catalogue import OwnBlocks
from quadvis.machine.files import LOG
from quadvis.machine.inputs import open_input
from quadvis.machine.shipped import named_file
from quadvis.output.log_reader import Log, read_log

FACTS = {"quadvis": "quadvis", "python": "Python", "variant": "variant", "params": "params", "clock": "clock"}


@dataclass(frozen=True)
class Side:
    """``sections`` are those of the resolved diagram, as plain data; ``log`` is None for a diagram file."""

    name: str
    sections: Mapping[str, Any]
    log: Log | None = None

    @property
    def facts(self) -> dict[str, str]:
        """The facts of a run that can differ though its diagram is the same; {} for a diagram file."""
        return {word: self.log.metadata.get(key, "") for key, word in FACTS.items()} if self.log else {}


def read_side(path: str | Path, variant: str | None, own_blocks: OwnBlocks = True) -> Side:
    """Return a side; a diagram is loaded and checked, that of a log is taken as it stands there."""
    file = named_file(str(path))
    with open_input(file) as opened:
        is_log = opened.read(len(LOG.heads[0])) == LOG.heads[0]
    if not is_log:
        diagram = load(path, variant=variant, own_blocks=own_blocks)
        name = f"{path} ({variant})" if variant else str(path)
        return Side(name, _plain(diagram.resolved, str(path)))
    if variant is not None:
        raise QuadvisError(f"'{path}' is a log, which has no variants; leave {quoted(variant)} out")
    log = read_log(path)
    return Side(str(path), _plain(log.diagram, f"{path}: diagram"), log)


def _plain(text: str, name: str) -> Mapping[str, Any]:
    """Return a resolved diagram as plain data."""
    found = parse_yaml(text, name).to_python() if text.strip() else {}
    if not isinstance(found, dict):
        raise QuadvisError(f"{name} is no diagram")
    return found
