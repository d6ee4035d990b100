"""Hovers of a craft, instruments and a camera that are not as the design believes, and their outcomes.

``python -m tests.diagrams.robustness --seeds 1:20`` flies every case with every design and prints a line for
each: flights lost, and the rms and the greatest of x and y. The tests fly a few of the cases.
"""

import argparse
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

import quadvis

HOVER = Path(__file__).parents[2] / "diagrams" / "hover.yaml"
PARAMETERS = HOVER.parent / "sets" / "s1.yaml"
DESIGNS = {
    "paper": "geometric",
    "integral": "integral",
    "fused": "fused_geometric",
    "robust": "robust_geometric",
    "accelerometer": "accelerometer_geometric",
}
SETTLED, END = 40.0, 100.0  # s
WATCHED = 10.0  # s before the end, in which every frame must show the target
FLOOR, CEILING, WALLS = 0.0, 4.25, 5.0  # m


def inertia(factor: float) -> dict[str, str]:
    """Return the settings of a craft whose inertia is the nominal one times a factor."""
    values = ", ".join(f"{factor * value:g}" for value in (5e-3, 5e-3, 9e-3))
    return {"craft.inertia": f"{{value: [{values}], unit: kg*m^2}}"}


def thrust(factor: float) -> dict[str, str]:
    """Return the settings of rotors that give their commanded thrust times a factor."""
    return {"craft.thrust_scale": f"[{', '.join([str(factor)] * 4)}]"}


def wind(speed: float) -> dict[str, str]:
    """Return the settings of a wind that begins to blow (m/s) when the craft has long been hovering."""
    return {"gust.step": f"{{value: [{speed}, 0, 0], unit: m/s}}", "gust.step_time": "50 s"}


def tilted(roll: float, pitch: float) -> dict[str, str]:
    """Return the settings of a camera that leans (deg) against the craft."""
    return {"eyes/mount.angles": f"{{value: [{roll}, {pitch}, 0], unit: deg}}"}


def beside(forward: float, right: float) -> dict[str, str]:
    """Return the settings of a camera that is not in the middle of the craft (cm)."""
    return {"eyes/mount.offset": f"{{value: [{forward}, {right}, 0], unit: cm}}"}


def start(x: float, y: float, turned: float) -> dict[str, str]:
    """Return the settings of a start beside the target (m), turned (deg)."""
    return {
        "craft.initial_position": f"{{value: [{x}, {y}, 1.5], unit: m}}",
        "craft.initial_attitude": f"{{value: [0, 0, {turned}], unit: deg}}",
    }


CASES: dict[str, dict[str, str]] = {
    "as believed": {},
    "IMU 40 ms late": {"imu.delay": "40 ms"},
    "IMU gain 0.75": {"imu.scale": "0.75"},
    "IMU gain 1.3": {"imu.scale": "1.3"},
    "motor lag x 3": {"craft.lag": "240 ms"},
    "inertia x 0.4": inertia(0.4),
    "inertia x 2.5": inertia(2.5),
    "mass - 40 %": {"craft.mass": "0.3 kg"},
    "mass + 45 %": {"craft.mass": "0.725 kg"},
    "thrust - 15 %": thrust(0.85),
    "thrust + 15 %": thrust(1.15),
    "target 10 % smaller": {"eyes.side": "0.9 m"},
    "target 10 % larger": {"eyes.side": "1.1 m"},
    "vision 0.6 s late": {"eyes.latency": "600 ms"},
    "70 % of frames lost": {"eyes/camera.drop_rate": "0.7"},
    "camera rolled 8 deg": tilted(8, 0),
    "camera pitched 8 deg": tilted(0, 8),
    "camera 10 cm off": beside(7, 7),
    "wind step 6 m/s": wind(6),
    "start 1.5 m off, 120 deg": start(0.75, -1.3, 120),
    "middling, light": {
        "imu.delay": "20 ms", "imu.scale": "1.15", "craft.lag": "140 ms", "craft.mass": "0.4 kg",
        "eyes.side": "1.05 m", "eyes.latency": "300 ms", "eyes/camera.drop_rate": "0.35",
        **inertia(0.7), **thrust(1.07), **tilted(4, 0), **beside(4, 4), **wind(3), **start(0.4, -0.6, 60),
    },
    "middling, heavy": {
        "imu.delay": "20 ms", "imu.scale": "0.87", "craft.lag": "140 ms", "craft.mass": "0.6 kg",
        "eyes.side": "0.95 m", "eyes.latency": "300 ms", "eyes/camera.drop_rate": "0.35",
        **inertia(1.6), **thrust(0.93), **tilted(0, -4), **beside(-4, 4), **wind(3), **start(-0.4, -0.6, -60),
    },
}  # fmt: skip


@dataclass(frozen=True)
class Flight:
    """The outcome of a flight."""

    rms: float  # m, over x and y, from SETTLED on
    farthest: float  # m, the greatest of x and y, from SETTLED on
    height: float  # m, the rms from SETTLED on
    lost: bool  # whether it left the room, or did not see its target in the end


def fly(design: str, case: str, seed: int, engine: str = "auto", end: float = END) -> Flight:
    """Fly a design in a case, with constant errors of instruments and trim."""
    diagram = quadvis.load(
        HOVER, variant=DESIGNS[design], settings=CASES[case], params=[PARAMETERS], seed=seed, stop_time=end
    )
    eyes = [f"eyes/camera.{name}" for name in ("lost", "fresh")]
    result = diagram.run(engine=engine, keep=["craft.position", *eyes])
    if result.duration < end:
        return Flight(np.inf, np.inf, np.inf, True)
    position, late = result["craft.position"], result.times("craft.position") >= SETTLED
    across = np.abs(position[:, :2])
    inside = position[:, 2].min() > FLOOR and position[:, 2].max() < CEILING and across.max() < WALLS
    watched = result.times(eyes[0]) >= end - WATCHED
    blind = result[eyes[0]][watched].any() or not result[eyes[1]][watched].any()
    off = position[late, 2] - 1.5
    return Flight(
        float(np.sqrt(np.mean(position[late, :2] ** 2))), float(across[late].max()),
        float(np.sqrt(np.mean(off**2))), bool(blind or not inside),
    )  # fmt: skip


def line(design: str, case: str, flights: list[Flight]) -> str:
    """Return a line of the table; its figures are those of the flights that were not lost."""
    kept = [flight for flight in flights if not flight.lost]
    lost = len(flights) - len(kept)
    words = f"{design:13} {case:26} {lost:2} of {len(flights):2}"
    if not kept:
        return words
    rms = 100 * np.sqrt(np.mean([flight.rms**2 for flight in kept]))
    height = 100 * np.sqrt(np.mean([flight.height**2 for flight in kept]))
    worst = 100 * max(flight.farthest for flight in kept)
    return f"{words} {rms:9.1f} cm {worst:9.1f} cm {height:9.1f} cm"


def table(designs: Iterable[str], cases: Iterable[str], seeds: range, workers: int) -> None:
    """Print what becomes of every design and case."""
    print(f"{'design':13} {'case':26} {'lost':8} {'rms of x, y':>12} {'greatest':>12} {'rms of h':>12}")
    with ProcessPoolExecutor(workers) as pool:
        for design in designs:
            for case in cases:
                flown = pool.map(partial(fly, design, case, engine="native"), seeds)
                print(line(design, case, list(flown)), flush=True)


def main() -> None:
    """Fly what the command line says."""
    parser = argparse.ArgumentParser(prog="python -m tests.diagrams.robustness", description=__doc__)
    parser.add_argument("--designs", nargs="+", choices=DESIGNS, default=["fused", "robust", "accelerometer"])
    parser.add_argument("--cases", nargs="+", choices=CASES, default=[*CASES])
    parser.add_argument("--seeds", default="1:20", metavar="FIRST:LAST")
    parser.add_argument("--workers", type=int, default=2)
    asked = parser.parse_args()
    first, last = map(int, asked.seeds.split(":"))
    table(asked.designs, asked.cases, range(first, last + 1), asked.workers)


if __name__ == "__main__":
    main()
