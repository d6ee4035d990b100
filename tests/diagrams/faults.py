"""Flights under the failsafe with a camera that fails for three seconds, and their outcomes.

``python -m tests.diagrams.faults --seeds 1:5`` flies all kinds at all places with both designs, prints a line
for each flight and a table in the end; the tests fly one seed.
"""

import argparse
from collections import defaultdict
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

NO_FRAMES, TARGET_LOST, FROZEN, BAD_STAMP, CLOCK_RESTARTED, CONTRADICTED = 1, 2, 4, 5, 6, 7
# Frames from which nothing can be learned, or that do not say of when they are; and what the watchdog says.
NO_TRUTH = {
    "drop": NO_FRAMES, "freeze": FROZEN, "alternate": FROZEN, "outdated": FROZEN, "repeated_stamp": NO_FRAMES,
    "future_stamp": BAD_STAMP, "nan_stamp": BAD_STAMP, "inf_stamp": BAD_STAMP, "falling_stamp": BAD_STAMP,
    "back_stamp": CLOCK_RESTARTED, "lagging_stamp": CLOCK_RESTARTED, "clock_restart": CLOCK_RESTARTED,
    "no_target": TARGET_LOST, "turned": CONTRADICTED, "black": FROZEN, "white": FROZEN, "noise": TARGET_LOST,
    "blur": TARGET_LOST, "inverted": TARGET_LOST, "mirrored": TARGET_LOST, "wrong_shape": TARGET_LOST,
    "one_channel": TARGET_LOST, "wrong_type": TARGET_LOST, "nan_pixels": TARGET_LOST,
    "no_pixels": TARGET_LOST,
}  # fmt: skip
POLICY = 0.3 + 1e-9  # s; so soon the failsafe takes notice of them


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
    "touchdown": Place("landing", 2.5, {"wish.at": "3.5 s"}, begin=11.5, end=18.0, lands=True),
    "takeover": Place("takeover", 1.5, {}, begin=13.0, end=19.0),
}


@dataclass
class Flight:
    """The outcome of a flight."""

    farthest: float  # m, from the target, from the begin of the fault on
    lowest: float  # m
    highest: float  # m
    impact: float  # m/s, greatest at which it came to the ground; 0 if it did not
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
    text = text.replace("calib/camera", f"{DIAGRAMS}/calib/camera").replace("crafts/", f"{DIAGRAMS}/crafts/")
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
    engine: str = "auto",
) -> Flight:
    """Fly with a fault of one kind."""
    where = PLACES[place]
    fault = {"eyes.kind": kind, "eyes.begin": f"{where.begin} s", "eyes.duration": f"{duration} s"}
    path = faulty(folder, where.diagram, pictures)
    settings = where.settings | fault
    diagram = quadvis.load(path, variant=variant, seed=seed, settings=settings, stop_time=where.end)
    return _judged(diagram.run(engine=engine), where)


def _judged(result: Any, where: Place) -> Flight:
    times = result.times("craft/body.position")
    position = result["craft/body.position"][times >= where.begin]
    away = np.hypot(position[:, 0], position[:, 1])
    if not where.lands:
        away = np.maximum(away, np.abs(position[:, 2] - where.height))
    lowest, highest = float(position[:, 2].min()), float(position[:, 2].max())
    hit = highest > where.height + 3.0 - MARGIN or (not where.lands and lowest < MARGIN)
    impact = float(result["craft/ground.impact"].max()) if where.lands else 0.0
    times, state = result.times("supervision/vision.state"), result["supervision/vision.state"]
    gone = times[(times >= where.begin - 1e-9) & (state != FRESH)]
    during = (times >= where.begin) & (state != FRESH)
    reasons = sorted(set(result["supervision/vision.reason"][during].tolist()))
    return Flight(
        float(away.max()), lowest, highest, impact, bool(away.max() > LOST or hit),
        float(gone[0] - where.begin) if len(gone) else np.inf, reasons, bool(state[-1] == FRESH),
    )  # fmt: skip


def sweep(pictures: bool, places: list[str], designs: list[str], kinds: list[str], seeds: range) -> None:
    """Print what becomes of every seed, kind, design and place, and a table by kind."""
    flown: dict[tuple[str, str], list[Flight]] = defaultdict(list)
    with TemporaryDirectory() as folder:
        for seed, kind, design, place in product(seeds, kinds, designs, places):
            variant = None if design == "paper" else design
            flight = fly(Path(folder), place, variant, kind, seed, pictures, engine="native")
            flown[kind, design].append(flight)
            late = kind in NO_TRUTH and flight.left > POLICY
            print(
                "LOST" if flight.lost else "LATE" if late else "    ",
                place,
                design,
                kind,
                seed,
                flight,
                flush=True,
            )
    print(f"{'kind':16}{'design':8}flights lost not-back farthest/m impact/(m/s) left/s: first median last")
    for (kind, design), flights in sorted(flown.items()):
        left = sorted(flight.left for flight in flights)
        print(
            f"{kind:16}{design:8}{len(flights):7}{sum(f.lost for f in flights):5}"
            f"{sum(not f.back for f in flights):9}{max(f.farthest for f in flights):11.2f}"
            f"{max(f.impact for f in flights):13.2f}"
            f"        {left[0]:5.2f} {left[len(left) // 2]:6.2f} {left[-1]:4.2f}"
        )


def main() -> None:
    """Fly what the command line says."""
    parser = argparse.ArgumentParser(prog="python -m tests.diagrams.faults", description=__doc__)
    parser.add_argument("--pictures", action="store_true", help="render pictures, and let them fail")
    parser.add_argument("--places", nargs="+", choices=PLACES, default=[*PLACES])
    parser.add_argument("--designs", nargs="+", choices=("paper", "robust"), default=["paper", "robust"])
    parser.add_argument("--kinds", nargs="+", choices=sorted({*OF_FRAMES, *OF_POINTS}))
    parser.add_argument("--seeds", default="1:5", metavar="FIRST:LAST")
    asked = parser.parse_args()
    first, last = map(int, asked.seeds.split(":"))
    kinds = asked.kinds or list(OF_FRAMES if asked.pictures else OF_POINTS)
    sweep(asked.pictures, asked.places, asked.designs, kinds, range(first, last + 1))


if __name__ == "__main__":
    main()
