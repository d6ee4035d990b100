"""Flights under the failsafe with a camera that fails in each of many ways: the craft stays where it is."""

from pathlib import Path

import pytest

from quadvis_vision.simulation.picture_faults import PICTURES
from tests.stages import mostly_slow

from .faults import NO_TRUTH, OF_POINTS, POLICY, Flight, fly

DESIGNS = (None, "robust")
FEW = ("freeze", "alternate", "future_stamp", "lagging_stamp", "clock_restart", "turned", "outdated")


def check(flight: Flight, kind: str) -> None:
    """Check that the craft was not lost, and that the failsafe took notice where it had to."""
    assert not flight.lost, flight
    if kind in NO_TRUTH:
        assert flight.left <= POLICY, flight
        assert NO_TRUTH[kind] in flight.reasons, flight


@pytest.mark.parametrize("kind", mostly_slow(FEW))
def test_the_better_design_outlasts_three_seconds_of_a_faulty_camera(kind: str, tmp_path: Path) -> None:
    flight = fly(tmp_path, "blackout", "robust", kind, seed=1, pictures=False)
    check(flight, kind)
    assert flight.back and flight.farthest < 1.5


@pytest.mark.parametrize("kind", mostly_slow(["black", "alternate"]))
def test_so_does_the_paper_s_with_pictures(kind: str, tmp_path: Path) -> None:
    flight = fly(tmp_path, "blackout", None, kind, seed=1, pictures=True)
    check(flight, kind)
    assert flight.back and flight.farthest < 1.5


@pytest.mark.parametrize(
    ("place", "kind", "seed"), mostly_slow([("descent", "shifted", 6), ("takeover", "shifted", 5)])
)
def test_a_frame_of_another_place_after_a_gap_sets_no_speed(
    place: str, kind: str, seed: int, tmp_path: Path
) -> None:
    flight = fly(tmp_path, place, "robust", kind, seed, pictures=False)
    assert not flight.lost and flight.farthest < 1.5


# One flight for each kind, and of few kinds one with each design, at one place after the other;
# ``python -m tests.diagrams.faults`` flies all kinds at all places in as many seeds as are asked for.
# As machine code, which the second stage compiles for test_every_diagram.py in any case. It flies each kind
# of fault of points once, and every second one of pictures, which take longer; a person flies the rest.
TURNS = [
    (kind, design, ("blackout", "descent", "touchdown", "takeover")[(number + 2 * turn) % 4])
    for number, kind in enumerate(OF_POINTS)
    for turn, design in enumerate(DESIGNS)
    if kind in FEW or (number + turn) % 2
]
FIRST = list({turn[0]: turn for turn in reversed(TURNS)}.values())
AGAIN = [turn for turn in TURNS if turn not in FIRST]
PICTURE_TURNS = [
    (kind, DESIGNS[number % 2], ("descent", "takeover", "blackout")[number % 3])
    for number, kind in enumerate(PICTURES)
]


@pytest.mark.parametrize(("kind", "design", "place"), mostly_slow(FIRST + AGAIN, quick=0, slow=len(FIRST)))
def test_no_fault_of_stamps_or_measurements_loses_a_craft(
    kind: str, design: str | None, place: str, tmp_path: Path
) -> None:
    flight = fly(tmp_path, place, design, kind, seed=1, pictures=False, engine="native")
    check(flight, kind)
    assert flight.back


@pytest.mark.parametrize(
    ("kind", "design", "place"),
    mostly_slow(PICTURE_TURNS[::2] + PICTURE_TURNS[1::2], quick=0, slow=len(PICTURE_TURNS[::2])),
)
def test_no_fault_of_pictures_does(kind: str, design: str | None, place: str, tmp_path: Path) -> None:
    flight = fly(tmp_path, place, design, kind, seed=1, pictures=True, engine="native")
    check(flight, kind)
    assert flight.back
