"""The design beside the paper's: hover.yaml's variant `fused`, on the noise that the paper's law gets.

The bounds are the goals that the reference experiment's independent simulation showed to be in reach.
"""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

import quadvis
from quadvis.engine.engine import Engine

pytestmark = pytest.mark.slow

HOVER = Path(__file__).parents[2] / "diagrams" / "hover.yaml"
DEGREE = np.pi / 180
SEEDS = range(1, 6)
NOMINAL, BIASED = "nominal", "biased"
# The paper's law loses the target from the picture of eq. (38): the same camera with a larger sensor.
WIDE = (
    "size: [4520, 3220]\nmatrix: [[430, 2, 2260], [0, 438, 1610], [0, 0, 1]]\ndistortion: [0, 0, 0, 0, 0]\n"
)


def biases(seed):
    """Angle, trim and gyro errors with signs drawn anew for each seed."""
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], 8)
    angle, torque = signs[:2] * 0.5 * DEGREE, signs[2:5] * (0.05, 0.05, 0.025)
    return {
        "imu.angle_bias": f"{{value: {angle.tolist()}, unit: rad}}",
        "craft.torque_bias": f"{{value: {torque.tolist()}, unit: rad/s^2}}",
        "imu.rate_bias": f"{{value: {(signs[5:] * 0.3 * DEGREE).tolist()}, unit: rad/s}}",
    }


def fly(seed, variant="fused_geometric", noise=NOMINAL, **settings):
    given = (biases(seed) if noise == BIASED else {}) | settings
    return quadvis.load(HOVER, variant=variant, settings=given, seed=seed).run()


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
def test_it_beats_the_paper_s_law_on_identical_noise(tmp_path, noise, ratio):
    (tmp_path / "wide.yaml").write_text(WIDE)
    wide = {f"{block}.calibration": str(tmp_path / "wide.yaml") for block in ("eyes", "pose")}
    paper = [figures(fly(seed, "geometric", noise, bandwidth="1 rad/s", **wide))[0] for seed in SEEDS]
    assert np.mean(paper) >= ratio * np.mean([fused(seed, noise)[0] for seed in SEEDS])


def test_pictures_give_the_same_as_projected_circles():
    xy, greatest, _, yaw, lost = figures(fly(1, "fused"))
    assert xy == pytest.approx(fused(1, NOMINAL)[0], rel=0.2)
    assert greatest <= 0.07 and yaw <= 0.3 and lost == 0


def test_half_the_frames_are_enough():
    found = [figures(fly(seed, noise=BIASED, **{"eyes/camera.drop_rate": "0.5"}))[0] for seed in (1, 2)]
    assert max(found) <= 0.04


def test_a_latency_of_two_fifths_of_a_second_costs_little():
    found = [figures(fly(seed, noise=BIASED, **{"eyes.latency": "400 ms"}))[0] for seed in (1, 2)]
    assert max(found) <= 0.045


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
    xy, greatest, height, _, lost = figures(fly(1, noise=BIASED, **wrong))
    assert xy <= 0.022 and greatest <= 0.07 and height <= 0.02 and lost == 0


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_three_seconds_without_frames_move_it_by_some_decimetres(seed):
    diagram = quadvis.load(HOVER, variant="fused_geometric", settings=biases(seed), seed=seed)
    engine = Engine(diagram.graph, seed)
    second = round(1 / engine.period)
    camera = engine.plan["eyes/camera"]
    places = []
    with engine:
        engine.run(60 * second)
        engine.plan.memory.write(camera.field("drop_rate"), 1.0)
        for tick in range(60 * second, 75 * second, 10):
            if tick == 63 * second:
                engine.plan.memory.write(camera.field("drop_rate"), 0.0)
            engine.run(10)
            places.append(np.abs(engine.read("craft", "position")[:2]).max())
    assert max(places) <= 0.6
    assert max(places[-second // 10 :]) <= 0.07
