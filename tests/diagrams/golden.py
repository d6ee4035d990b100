"""The golden file: hash and signals of every shipped diagram and variant, so that each change is a decision.

    python -m tests.diagrams.golden renew   # write golden.json anew, after a change that was meant
    python -m tests.diagrams.golden bits    # print a SHA-256 of all signals: no pure move changes it

Signals differ in their last bits from processor to processor, so the file holds one number a signal, the mean
of its values under fixed weights, and the test compares with a tolerance. ``bits`` compares two trees on one
machine.
"""

from __future__ import annotations

import hashlib
import json
import shutil
import sys
import tempfile
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import yaml

import quadvis
from quadvis.block import Device
from quadvis.diagram.diagram import Diagram
from quadvis.library.catalogue import Catalogue

DIAGRAMS = Path(__file__).parents[2] / "diagrams"
FILE = Path(__file__).with_name("golden.json")
DURATION = 1.5  # s; all tasks, transitions and cameras have worked by then
MISSING = 0.123  # stands for NaN
DEVICES, PROGRAM = "devices", "program"


@cache
def parsed(path: Path) -> dict[str, Any]:
    """Return what a YAML file says, which nobody changes."""
    data: dict[str, Any] = yaml.load(path.read_text(), yaml.CSafeLoader)
    return data


@cache
def every_case() -> tuple[tuple[str, str | None, str], ...]:
    """Return every diagram by itself and with each of its variants, and what it needs that tests may lack."""
    return tuple(_every_case())


def _every_case() -> Iterator[tuple[str, str | None, str]]:
    for path in sorted(DIAGRAMS.glob("*.yaml")):
        data = parsed(path)
        variants, blocks = data.get("variants", {}), data.get("blocks", {})
        yield path.name, None, need(blocks.values())
        for name, variant in variants.items():
            lineage = [variant]
            while base := lineage[-1].get("base"):
                lineage.append(variants[base])
            slots = {key: block for each in reversed(lineage) for key, block in each.get("slots", {}).items()}
            yield path.name, name, need((blocks | slots).values())


def need(blocks: Iterable[dict[str, Any]]) -> str:
    """Return what blocks need: DEVICES, or a PROGRAM of somebody else in a process of its own; or nothing."""
    classes = [Catalogue().find(kind) for kind in kinds(blocks)]
    if any(issubclass(found, Device) for found in classes):
        return DEVICES
    return PROGRAM if any(found.not_replayable and found.not_restorable for found in classes) else ""


def kinds(blocks: Iterable[dict[str, Any]], folder: Path = DIAGRAMS) -> Iterator[str]:
    """Yield the names of the classes of blocks, those in parts included."""
    for block in blocks:
        if "part" in block:
            part = folder / block["part"]
            yield from kinds(parsed(part)["blocks"].values(), part.parent)
        else:
            yield block["block"]


def cases() -> tuple[tuple[str, str | None], ...]:
    """Return every diagram that can be simulated anywhere, by itself and with each of its variants."""
    return needing("")


def with_programs() -> tuple[tuple[str, str | None], ...]:
    """Return those that fly with a program of somebody else; the golden file has their hashes alone."""
    return needing(PROGRAM)


def on_devices() -> tuple[tuple[str, str | None], ...]:
    """Return the variants with devices, which run in real time alone."""
    return needing(DEVICES)


def needing(wanted: str) -> tuple[tuple[str, str | None], ...]:
    """Return every diagram and variant that needs this."""
    return tuple((name, variant) for name, variant, found in every_case() if found == wanted)


def loaded(folder: Path, name: str, variant: str | None) -> Diagram:
    """Return a diagram in a copy of their folder; it stops early, or when it wants to if that is earlier."""
    whole = quadvis.load(folder / name, variant=variant)
    return quadvis.load(folder / name, variant=variant, stop_time=min(DURATION, whole.duration))


def mean(values: np.ndarray[Any, Any]) -> float:
    """Return the mean of a signal under weights that no exchange of rows or elements leaves alone."""
    flat = np.nan_to_num(np.asarray(values, float), nan=MISSING).ravel()
    return float(np.mean(flat * (1.0 + np.arange(flat.size) % 997 / 997.0))) if flat.size else 0.0


def digest(result: Any) -> dict[str, float]:
    """Return what the golden file holds of each signal of a run."""
    return {signal: float(f"{mean(result[signal]):.10g}") for signal in result}


def facts(folder: Path, name: str, variant: str | None) -> dict[str, Any]:
    """Return what the golden file holds of one diagram."""
    flown = {} if (name, variant) in with_programs() else digest(loaded(folder, name, variant).run())
    return {"hash": quadvis.load(DIAGRAMS / name, variant=variant).hash, "signals": flown}


def bits(folder: Path, name: str, variant: str | None) -> str:
    """Return the SHA-256 of all signals of a run and of their names."""
    result, found = loaded(folder, name, variant).run(), hashlib.sha256()
    for signal in result:
        found.update(signal.encode())
        found.update(result.times(signal).tobytes())
        found.update(result[signal].tobytes())
    return found.hexdigest()


def title(name: str, variant: str | None) -> str:
    """Return the name of a case, such as hover.yaml:plane."""
    return f"{name}:{variant}" if variant else name


def main() -> int:
    """Write the golden file, or print the digests."""
    if sys.argv[1:] not in (["renew"], ["bits"]):
        print(__doc__)
        return 2
    with tempfile.TemporaryDirectory() as there:
        folder = Path(shutil.copytree(DIAGRAMS, Path(there) / "diagrams"))
        if sys.argv[1] == "bits":
            for case in cases():
                print(bits(folder, *case), title(*case))
        else:
            found = {title(*case): facts(folder, *case) for case in (*cases(), *with_programs())}
            FILE.write_text(json.dumps(found, indent=0) + "\n")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
