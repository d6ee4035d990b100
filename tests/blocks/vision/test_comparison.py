"""Statistics, table and figure of a comparison of pose methods."""

import math

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.errors import QuadvisError
from quadvis_vision.trials import comparison
from quadvis_vision.trials.comparison import Poses
from tests.stages import mostly_slow


def poses(values, name="a"):
    values = np.array(values, dtype=float).reshape(-1, 6)
    return Poses(name, np.arange(len(values)) / 10, values)


def random_poses(count, name="a", seed=0):
    return poses(np.random.default_rng(seed).uniform(0.5, 1, (count, 6)), name)


@given(
    offset=st.lists(st.floats(-0.4, 0.4), min_size=6, max_size=6),
    turns=st.integers(-3, 3),
    count=st.integers(1, 20),
)
def test_a_constant_offset_is_the_difference_and_whole_turns_do_not_count(offset, turns, count):
    first = random_poses(count)
    values = first.values + offset
    values[:, 3:] += 2 * math.pi * turns
    found = comparison.difference(first, poses(values, "b"))
    assert found.rms == pytest.approx(np.abs(offset), abs=1e-9)
    assert found.ratios == pytest.approx(first.values[:, 2] / values[:, 2])


def test_pictures_without_a_pose_by_either_method_do_not_count():
    first, second = random_poses(5), random_poses(5, "b")
    second.values[:] = first.values + 0.25
    first.values[0, 2] = math.nan
    second.values[[3, 4]] = math.nan
    found = comparison.difference(first, second)
    assert found.count == 2
    assert found.rms == pytest.approx(np.full(6, 0.25))


def test_methods_that_never_meet_are_told_so():
    first, second = random_poses(2), random_poses(2, "b")
    first.values[0], second.values[1] = math.nan, math.nan
    found = comparison.difference(first, second)
    assert found.count == 0 and np.isnan(found.rms).all() and not len(found.ratios)
    assert comparison.sentences([found]) == "a - b: no picture with a pose by both"


def test_methods_of_different_rates_are_refused():
    with pytest.raises(QuadvisError, match="3 and 4 pictures; give both one rate"):
        comparison.difference(random_poses(3), random_poses(4, "b"))


def test_every_method_is_compared_with_every_other():
    found = comparison.differences([random_poses(3, name) for name in "abcd"])
    assert [pair.first + pair.second for pair in found] == ["ab", "ac", "ad", "bc", "bd", "cd"]


@given(st.lists(st.booleans(), max_size=30), st.integers(1, 8))
def test_pictures_for_the_table_are_spread_over_those_with_a_pose(found, count):
    method = random_poses(len(found))
    method.values[~np.array(found, dtype=bool)] = math.nan
    good = [number for number, there in enumerate(found, 1) if there]
    chosen = comparison.spread([method, random_poses(len(found), "b")], count)
    assert len(chosen) == min(count, len(good))
    assert set(chosen) <= set(good) and chosen == sorted(set(chosen))
    if len(chosen) > 1:
        assert (chosen[0], chosen[-1]) == (good[0], good[-1])


def test_a_missing_pose_is_a_dash_and_nothing_is_minus_zero():
    lines = comparison.table([poses([[math.nan] * 6, [-1e-5] * 6])], [1, 2]).splitlines()
    assert lines[3].split() == ["1", *["-"] * 6]
    assert lines[4].split() == ["2", *["0.0"] * 6]


@pytest.mark.parametrize("count", mostly_slow([30, 1, 200]))
def test_the_figure_shows_every_method(tmp_path, count):
    methods = [random_poses(count, name, seed) for seed, name in enumerate("abc")]
    methods[1].values[::2] = math.nan
    path = tmp_path / "new" / "figure.png"
    comparison.draw(methods, [1, count], path)
    picture = cv2.imread(str(path)).astype(int)
    assert picture.shape[1] == 1560
    for blue_green_red in [(0xB2, 0x72, 0x00), (0x00, 0x5E, 0xD5), (0x73, 0x9E, 0x00)]:
        assert (np.abs(picture - blue_green_red).max(axis=2) < 10).sum() > 30


@pytest.mark.slow
def test_a_figure_without_any_pose_is_drawn_too(tmp_path):
    methods = [poses(np.full((3, 6), math.nan), name) for name in "ab"]
    comparison.draw(methods, [], tmp_path / "figure.png")
    assert (tmp_path / "figure.png").is_file()


def test_a_figure_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(QuadvisError, match="cannot write the figure"):
        comparison.draw([random_poses(2)], [], tmp_path / "file" / "figure.png")
