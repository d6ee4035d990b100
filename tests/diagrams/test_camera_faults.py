"""Flights under the failsafe with a camera that fails in each of many ways: the craft stays where it is."""

from pathlib import Path

import pytest

from quadvis_vision.simulation.picture_faults import PICTURES

from .faults import OF_FRAMES, OF_POINTS, PLACES, Flight, fly

NO_FRAMES, TARGET_LOST, FROZEN, BAD_STAMP, CLOCK_RESTARTED, CONTRADICTED = 1, 2, 4, 5, 6, 7
DESIGNS = (None, "fused")
TICK = 0.05  # s
# Frames from which nothing can be learned, or that do not say of when they are; and what the watchdog says.
NO_TRUTH = {
    "drop": NO_FRAMES, "freeze": FROZEN, "repeated_stamp": NO_FRAMES, "future_stamp": BAD_STAMP,
    "nan_stamp": BAD_STAMP, "inf_stamp": BAD_STAMP, "falling_stamp": BAD_STAMP, "back_stamp": CLOCK_RESTARTED,
    "lagging_stamp": CLOCK_RESTARTED, "clock_restart": CLOCK_RESTARTED, "no_target": TARGET_LOST,
    "turned": CONTRADICTED, "black": FROZEN, "white": FROZEN, "noise": TARGET_LOST, "blur": TARGET_LOST,
    "inverted": TARGET_LOST, "mirrored": TARGET_LOST, "wrong_shape": TARGET_LOST, "one_channel": TARGET_LOST,
    "wrong_type": TARGET_LOST, "nan_pixels": TARGET_LOST, "no_pixels": TARGET_LOST,
}  # fmt: skip
FEW = ("freeze", "future_stamp", "lagging_stamp", "clock_restart", "turned", "outdated")


def check(flight: Flight, kind: str) -> None:
    """Check that the craft was not lost, and that the failsafe took notice where it had to."""
    assert not flight.lost, flight
    if kind in NO_TRUTH:
        assert flight.left <= 0.3 + 1e-9, flight
        assert NO_TRUTH[kind] in flight.reasons, flight


@pytest.mark.parametrize("kind", FEW)
def test_the_better_design_outlasts_three_seconds_of_a_faulty_camera(kind: str, tmp_path: Path) -> None:
    flight = fly(tmp_path, "blackout", "fused", kind, seed=1, pictures=False)
    check(flight, kind)
    assert flight.back and flight.farthest < 1.5


@pytest.mark.parametrize("kind", ["freeze", "black"])
def test_so_does_the_paper_s_with_pictures(kind: str, tmp_path: Path) -> None:
    flight = fly(tmp_path, "blackout", None, kind, seed=1, pictures=True)
    check(flight, kind)
    assert flight.back and flight.farthest < 1.5


# One flight for each kind and design, at one place after the other; ``python -m tests.diagrams.faults`` flies
# all kinds at all places in five seeds.
TURNS = [
    (kind, design, ("blackout", "descent", "takeover")[(number + turn) % 3])
    for number, kind in enumerate(OF_POINTS)
    for turn, design in enumerate(DESIGNS)
]


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "design", "place"), TURNS)
def test_no_fault_of_stamps_or_measurements_loses_a_craft(
    kind: str, design: str | None, place: str, tmp_path: Path
) -> None:
    flight = fly(tmp_path, place, design, kind, seed=1, pictures=False)
    check(flight, kind)
    assert flight.back or PLACES[place].lands


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "design"),
    [(kind, DESIGNS[number % 2]) for number, kind in enumerate(OF_FRAMES) if kind in PICTURES or kind in FEW],
)
def test_no_fault_of_pictures_does(kind: str, design: str | None, tmp_path: Path) -> None:
    flight = fly(tmp_path, "blackout", design, kind, seed=1, pictures=True)
    check(flight, kind)
    assert flight.back


@pytest.mark.slow
@pytest.mark.parametrize(
    ("place", "seed"), [("blackout", 1), ("landing", 2), ("descent", 3), ("takeover", 4)]
)
@pytest.mark.parametrize("duration", [1.0, 3.0])
def test_a_frozen_camera_does_not_lose_the_better_design(
    place: str, duration: float, seed: int, tmp_path: Path
) -> None:
    flight = fly(tmp_path, place, "fused", "freeze", seed, pictures=False, duration=duration)
    check(flight, "freeze")
    assert flight.farthest < 1.0
