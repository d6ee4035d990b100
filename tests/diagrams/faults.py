"""Flights under the failsafe with a camera that fails for three seconds, and what became of them.

``python -m tests.diagrams.faults``, or the same with ``pictures``, flies all kinds in five seeds and prints a
line for each; the tests fly one seed.
"""

import sys
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

import quadvis
from quadvis_blocks.vision.frame_fault import KINDS as OF_FRAMES
from quadvis_blocks.vision.measurement_fault import KINDS as OF_POINTS

DIAGRAMS = Path(__file__).parents[2] / "diagrams"
BEGIN, DURATION, END = 4.0, 3.0, 10.0  # s
LATENCY = 0.1  # s
FRESH = 0
LOST = 5.0  # m
MARGIN = 0.25  # m, of the craft's middle from floor and ceiling


@dataclass(frozen=True)
class Place:
    """A diagram, and when its camera fails."""

    diagram: str
    height: float  # m, of the hover
    settings: dict[str, str]
    begin: float = BEGIN
    end: float = END
    lands: bool = False  # whether the craft may come to the ground


PLACES = {
    "blackout": Place("blackout", 2.0, {"blackout.during": "[[100 s, 101 s]]"}),
    "landing": Place("landing", 2.5, {}),
    "descent": Place("landing", 2.5, {"wish.at": "3.5 s"}, end=13.0, lands=True),
    "takeover": Place("takeover", 1.5, {}, begin=13.0, end=19.0),
}


@dataclass
class Flight:
    """What became of a flight."""

    farthest: float  # m, from the target, from the begin of the fault on
    lowest: float  # m
    highest: float  # m
    lost: bool
    left: float  # s from the begin of the fault until vision was no longer FRESH; inf if it was all the time
    reasons: list[int]
    back: bool  # whether vision was FRESH in the end


def faulty(folder: Path, name: str, pictures: bool) -> Path:
    """Return a diagram whose eyes are those that fail."""
    text = (DIAGRAMS / f"{name}.yaml").read_text()
    eyes = f"{DIAGRAMS}/parts/faulty_{'rendered' if pictures else 'geometric'}_eyes.yaml"
    given = "with: {ceiling: $ceiling, side: $side, noise: $noise}"
    assert text.count("part: parts/geometric_eyes.yaml") == 1 and text.count(given) == 1
    text = text.replace("parts/geometric_eyes.yaml", eyes)
    if pictures:
        text = text.replace(given, "with: {ceiling: $ceiling, side: $side}")
        text = text.replace("  noise: 0.1 px  # what the detector makes of rendered pictures\n", "")
    text = text.replace("parts/", f"{DIAGRAMS}/parts/").replace(f"{DIAGRAMS}/{DIAGRAMS}/", f"{DIAGRAMS}/")
    text = text.replace("calib/camera", f"{DIAGRAMS}/calib/camera")
    path = folder / f"{name}_{'pictures' if pictures else 'points'}.yaml"
    path.write_text(text)
    return path


def fly(
    folder: Path,
    place: str,
    variant: str | None,
    kind: str,
    seed: int,
    pictures: bool,
    duration: float = DURATION,
) -> Flight:
    """Fly with a fault of one kind."""
    where = PLACES[place]
    fault = {"eyes.kind": kind, "eyes.begin": f"{where.begin} s", "eyes.duration": f"{duration} s"}
    path = faulty(folder, where.diagram, pictures)
    settings = where.settings | fault
    result = quadvis.load(path, variant=variant, seed=seed, settings=settings, stop_time=where.end).run()
    return _judged(result, where)


def _judged(result: Any, where: Place) -> Flight:
    times = result.times("craft/body.position")
    position = result["craft/body.position"][times >= where.begin]
    away = np.hypot(position[:, 0], position[:, 1])
    if not where.lands:
        away = np.maximum(away, np.abs(position[:, 2] - where.height))
    lowest, highest = float(position[:, 2].min()), float(position[:, 2].max())
    hit = highest > where.height + 3.0 - MARGIN or (not where.lands and lowest < MARGIN)
    times, state = result.times("supervision/vision.state"), result["supervision/vision.state"]
    gone = times[(times >= where.begin - 1e-9) & (state != FRESH)]
    during = (times >= where.begin) & (state != FRESH)
    reasons = sorted(set(result["supervision/vision.reason"][during].tolist()))
    return Flight(
        float(away.max()), lowest, highest, bool(away.max() > LOST or hit),
        float(gone[0] - where.begin) if len(gone) else np.inf, reasons, bool(state[-1] == FRESH),
    )  # fmt: skip


def sweep(pictures: bool, seeds: int) -> None:
    """Print what becomes of every place, design, kind and seed: ``python -m tests.diagrams.faults``."""
    kinds = OF_FRAMES if pictures else OF_POINTS
    for place, variant, kind, seed in product(PLACES, (None, "fused"), kinds, range(1, seeds + 1)):
        with TemporaryDirectory() as folder:
            flight = fly(Path(folder), place, variant, kind, seed, pictures)
        print("LOST" if flight.lost else "    ", place, variant or "paper", kind, seed, flight, flush=True)


if __name__ == "__main__":
    sweep(pictures="pictures" in sys.argv[1:], seeds=5)
