"""The sets of errors: parameter files for the hover."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import quadvis
from quadvis.api import Diagram

DIAGRAMS = Path(__file__).parents[2] / "diagrams"
HOVER = DIAGRAMS / "hover.yaml"
SETS = sorted(path.stem for path in (DIAGRAMS / "sets").glob("*.yaml"))


def load(name: str, **more: Any) -> Diagram:
    return quadvis.load(HOVER, params=[DIAGRAMS / "sets" / f"{name}.yaml"], **more)


def errors(name: str, seed: int) -> np.ndarray:
    """Roll and pitch as measured at the first instant of a flight, when both are zero."""
    result = load(name, variant="geometric", stop_time=0.1, seed=seed).run()
    return np.array([result["imu.roll"][0], result["imu.pitch"][0]])


def test_there_are_the_three_sets_of_the_reference_experiment() -> None:
    assert {"s0", "s1", "sq"} <= set(SETS)


@pytest.mark.parametrize("variant", [None, "geometric"])
@pytest.mark.parametrize("name", SETS)
def test_a_set_fits_the_hover(name: str, variant: str | None) -> None:
    assert load(name, variant=variant, stop_time=0.2).run().duration == 0.2


def test_s0_is_what_the_hover_has_by_itself() -> None:
    plain = quadvis.load(HOVER, variant="geometric", stop_time=2.0).run()
    with_set = load("s0", variant="geometric", stop_time=2.0).run()
    assert np.array_equal(plain["craft.position"], with_set["craft.position"])


@pytest.mark.slow
def test_on_the_same_seed_s1_adds_constant_errors_to_the_noise_of_s0() -> None:
    added = np.array([errors("s1", seed) - errors("s0", seed) for seed in range(1, 9)])
    assert np.degrees(np.abs(added)) == pytest.approx(np.full((8, 2), 0.5))
    assert len(set(map(tuple, np.sign(added)))) > 2


def test_in_sq_the_inertial_unit_tells_the_truth() -> None:
    assert not errors("sq", 1).any()
