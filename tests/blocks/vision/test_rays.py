"""Rays by arrays and by loops: the same bits, whatever the picture shows and wherever circles are thought."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.native.functions import prepare
from quadvis_vision.detection.approach import approach, approach_by_loops
from quadvis_vision.detection.lanes import solved, summed
from quadvis_vision.detection.loops import ranked
from quadvis_vision.detection.measure import NATIVE
from quadvis_vision.detection.ray_loops import look_by_loops
from quadvis_vision.detection.rays import look
from quadvis_vision.trials.scenes import CONDITIONS, shoot
from tests.stages import mostly_slow

SCENES = ("clean", "combined", "30 % hidden", "12 decoys")


def picture(seed):
    """Return a picture and circles that are thought near some of its own, or anywhere."""
    rng = np.random.default_rng(seed)
    shot = shoot(rng, (160, 120), CONDITIONS[SCENES[seed % len(SCENES)]])
    centres = np.nan_to_num(shot.centres, nan=5.0) + rng.uniform(-2, 2, shot.centres.shape)
    centres = np.concatenate((centres, rng.uniform(-20, 180, (1, 2))))
    return rng, shot.pixels, centres, rng.uniform(2, 12, len(centres))


@pytest.mark.parametrize("stiff", [0.0, 1.0])
@pytest.mark.parametrize("seed", mostly_slow(range(40), quick=2, slow=8))
def test_arrays_and_loops_see_the_same_to_the_bit(seed, stiff):
    rng, pixels, centres, radii = picture(seed)
    for by_arrays, by_loops in zip(
        approach(pixels, centres, radii), approach_by_loops(pixels, centres, radii), strict=True
    ):
        assert (by_arrays == by_loops).all()
    shapes = radii[:, None, None] * (np.eye(2) + rng.normal(0, 0.2, (len(radii), 2, 2)))
    reach = radii * rng.uniform(0.2, 1.2, len(radii))
    arrays, loops = (each(pixels, centres, shapes, reach, stiff) for each in (look, look_by_loops))
    for name, by_arrays, by_loops in zip(arrays._fields, arrays, loops, strict=True):
        assert (by_arrays == by_loops).all(), name


@pytest.mark.slow
def test_machine_code_measures_the_same_to_the_bit_as_python():
    prepare(NATIVE)
    assert all(function.is_native for function in NATIVE)
    try:
        for seed in range(40):
            _, pixels, centres, radii = picture(seed)
            shapes = radii[:, None, None] * np.eye(2)
            guesses = np.column_stack((centres, radii))
            places = np.column_stack((guesses, np.ones((len(radii), 3))))
            for function, arguments in zip(
                NATIVE,
                ((guesses,), (centres, shapes, 0.7), (places[:4], shapes[:4])),
                strict=True,
            ):
                compiled, interpreted = (each(pixels, *arguments) for each in (function, function.function))
                one, other = (
                    found if isinstance(found, tuple) else (found,) for found in (compiled, interpreted)
                )
                assert all((np.asarray(p) == np.asarray(q)).all() for p, q in zip(one, other, strict=True))
    finally:
        for function in NATIVE:
            function.bind(None)


@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=40), st.data())
def test_a_value_is_found_by_its_rank(values, data):
    rank = data.draw(st.integers(0, len(values) - 1))
    assert ranked(np.array(values), len(values), rank) == sorted(values)[rank]


def test_sums_and_equations_agree_with_numpy():
    rng = np.random.default_rng(1)
    values = rng.normal(size=(3, 7, 32))
    assert summed(values) == pytest.approx(values.sum(-1))
    roots = rng.normal(size=(6, 5, 5))
    normal, sides = roots @ roots.transpose(0, 2, 1) + np.eye(5), rng.normal(size=(6, 5))
    equations = np.concatenate((normal, sides[:, :, None]), axis=2).transpose(1, 2, 0)
    found = solved(equations).T
    assert found == pytest.approx(np.linalg.solve(normal, sides[:, :, None])[..., 0])
