"""The reference experiment: hover statistics with 0.3 px of noise for a camera, and with the rendered one.

The expected numbers are of an independent simulation of the same loop: 30 seeds, RMS over both axes. The sets
of errors are the files in diagrams/sets. That the rendered camera holds the hover to what the paper calls
satisfactory is what the diagram itself expects, and tests/test_readmes.py flies it.
"""

from pathlib import Path

import numpy as np
import pytest

import quadvis

pytestmark = pytest.mark.slow

DIAGRAMS = Path(__file__).parents[2] / "diagrams"
HOVER = DIAGRAMS / "hover.yaml"
BANDWIDTHS = ("1 rad/s", "2 rad/s", "2.5 rad/s")
# The statistics were taken without the edges of the picture: with them, slow gains lose the target.
WITHOUT_EDGES = {"eyes/camera.field_of_view": "unbounded"}


def flights(name, seeds, variant="geometric", **settings):
    """RMS of x and y together (m) and of yaw (rad) after 40 s with a set of errors, means over the seeds."""
    params = DIAGRAMS / "sets" / f"{name}.yaml"
    found = []
    for seed in seeds:
        result = quadvis.load(HOVER, variant=variant, settings=settings, params=[params], seed=seed).run(
            engine="native"
        )
        late = result.times("craft.position") >= 40
        position, yaw = result["craft.position"][late, :2], result["craft.attitude"][late, 2]
        found.append([np.sqrt(np.mean(position**2)), np.sqrt(np.mean(yaw**2))])
    return np.mean(found, axis=0)


@pytest.mark.parametrize(
    ("name", "bandwidth", "expected"),
    [
        *(("sq", *pair) for pair in zip(BANDWIDTHS, (0.048, 0.073, 0.082), strict=True)),
        *(("s0", *pair) for pair in zip(BANDWIDTHS, (0.259, 0.123, 0.110), strict=True)),
        *(("s1", *pair) for pair in zip(BANDWIDTHS, (0.895, 0.246, 0.184), strict=True)),
    ],
)
def test_each_set_of_errors_gives_the_hover_of_the_reference(name, bandwidth, expected):
    # The constant errors of s1 have a random sign in each flight, which matters more than the noise.
    seeds = range(1, 11 if name == "s1" else 5)
    position, yaw = flights(name, seeds, bandwidth=bandwidth, **WITHOUT_EDGES)
    assert position == pytest.approx(expected, rel=0.25)
    if name == "s1":  # 0.025 rad/s^2 of trim error against a stiffness of 1 per s^2
        assert np.degrees(yaw) == pytest.approx(1.43, rel=0.25)


def test_the_rendered_camera_and_the_geometric_one_hover_alike():
    # The detector's own error is 0.014 px at 2 grey levels of noise; 0.3 px is a far worse camera.
    rendered = flights("s0", range(1, 3), variant=None)
    geometric = flights("s0", range(1, 3), **{"eyes/camera.noise": "0.014 px"})
    assert rendered == pytest.approx(geometric, rel=0.2)
