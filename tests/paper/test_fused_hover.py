"""The design beside the paper's: hover.yaml's variant `fused`, on the noise that the paper's law gets.

The bounds are the goals that the reference experiment's independent simulation showed to be in reach.
"""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

import quadvis

pytestmark = pytest.mark.slow

DIAGRAMS = Path(__file__).parents[2] / "diagrams"
HOVER = DIAGRAMS / "hover.yaml"
DEGREE = np.pi / 180
SEEDS = range(1, 4)
NOMINAL, BIASED = "s0", "s1"  # files in diagrams/sets
# The paper's law loses the target from the picture, and would then have no figure to compare with.
WITHOUT_EDGES = {"eyes/camera.field_of_view": "unbounded"}


def fly(seed, variant="fused_geometric", noise=NOMINAL, stop_time=None, **settings):
    params = [DIAGRAMS / "sets" / f"{noise}.yaml"]
    diagram = quadvis.load(
        HOVER, variant=variant, settings=settings, params=params, stop_time=stop_time, seed=seed
    )
    return diagram.run(engine="native")


@cache
def fused(seed, noise):
    return figures(fly(seed, noise=noise))


def figures(result):
    """The rms over x and y and the greatest of either (m), the rms of h (m) and yaw (deg), frames lost."""
    late = result.times("craft.position") >= 40
    off = result["craft.position"][late] - (0.0, 0.0, 1.5)
    yaw = result["craft.attitude"][late, 2]
    lost = next(result[name].sum() for name in result if name.startswith("eyes/") and name.endswith(".lost"))
    return rms(off[:, :2]), np.abs(off[:, :2]).max(), rms(off[:, 2]), rms(yaw) / DEGREE, lost


def rms(values):
    return np.sqrt(np.mean(values**2))


@pytest.mark.parametrize("noise", [NOMINAL, BIASED])
def test_it_holds_the_hover_to_two_centimetres(noise):
    xy, greatest, height, yaw, lost = np.transpose([fused(seed, noise) for seed in SEEDS])
    assert xy.mean() <= 0.022
    assert greatest.max() <= 0.07
    assert height.max() <= 0.02 and yaw.max() <= 0.3
    assert lost.sum() == 0


@pytest.mark.parametrize(("noise", "ratio"), [(NOMINAL, 11), (BIASED, 38)])
def test_it_beats_the_paper_s_law_on_identical_noise(noise, ratio):
    paper = [
        figures(fly(seed, "geometric", noise, bandwidth="1 rad/s", **WITHOUT_EDGES))[0] for seed in SEEDS
    ]
    assert np.mean(paper) >= ratio * np.mean([fused(seed, noise)[0] for seed in SEEDS])


def test_pictures_give_the_same_as_projected_circles():
    xy, greatest, _, yaw, lost = figures(fly(1, "fused"))
    assert xy == pytest.approx(fused(1, NOMINAL)[0], rel=0.2)
    assert greatest <= 0.07 and yaw <= 0.3 and lost == 0


def test_half_the_frames_are_enough():
    assert figures(fly(1, noise=BIASED, stop_time="90 s", **{"eyes/camera.drop_rate": "0.5"}))[0] <= 0.04


def test_a_latency_of_two_fifths_of_a_second_costs_little():
    assert figures(fly(1, noise=BIASED, stop_time="90 s", **{"eyes.latency": "400 ms"}))[0] <= 0.045


@pytest.mark.parametrize(
    "wrong",
    [
        {"craft.lag": "160 ms"},
        {"radio.delay": "45 ms"},
        {"craft.mass": "0.55 kg"},
        {"craft.inertia": "[0.0035 kg*m^2, 0.0035 kg*m^2, 0.0065 kg*m^2]"},
        {"craft.model": "rigid_body"},
        {"gust.mean": "[1 m/s, -1 m/s, 0 m/s]"},
    ],
    ids=lambda wrong: next(iter(wrong)),
)
def test_the_same_gains_hold_a_craft_and_a_wind_that_are_not_as_the_filters_think(wrong):
    xy, greatest, height, _, lost = figures(fly(1, noise=BIASED, stop_time="90 s", **wrong))
    assert xy <= 0.022 and greatest <= 0.07 and height <= 0.02 and lost == 0


@pytest.mark.parametrize("seed", [1, 2])
def test_three_seconds_without_frames_move_it_by_some_decimetres(seed):
    blackout = {"eyes/camera.blackout": "{value: [60, 3], unit: s}"}
    result = fly(seed, noise=BIASED, stop_time="75 s", **blackout)
    time, off = result.times("craft.position"), np.abs(result["craft.position"][:, :2]).max(axis=1)
    assert off[time >= 60].max() <= 0.6
    assert off[time >= 74].max() <= 0.07
