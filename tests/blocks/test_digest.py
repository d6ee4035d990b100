import math
from itertools import pairwise, permutations

import numpy as np

from quadvis_blocks._digest import NOTHING, digest


def test_equal_numbers_have_equal_digests() -> None:
    value = np.array([0.0, -3.5, 1e300, math.nan, math.inf])
    assert digest(value) == digest(value.copy()) == digest(value + 0.0)
    assert digest(np.array([0.0])) == digest(np.array([-0.0]))


def test_numbers_that_differ_in_one_bit_have_others() -> None:
    for number in (0.0, 1.0, -1.0, 226.3, 1e-300, 5e-324, 1e300):
        found = [digest(np.array([1.0, n])) for n in (number, np.nextafter(number, math.inf), -number - 1.0)]
        assert len(set(found)) == 3


def test_places_signs_and_what_is_no_finite_number_count() -> None:
    one = {digest(np.array(order)) for order in permutations((1.0, 2.0, -1.0, math.nan, math.inf, -math.inf))}
    assert len(one) == 720
    assert digest(np.ones(2)) != digest(np.ones(3))


def test_a_scalar_is_one_number() -> None:
    assert digest(2.5) == digest(np.array([2.5])) != digest(-2.5)


def test_nothing_has_no_digest() -> None:
    assert digest(np.full((4, 2), math.nan)) == digest(math.nan) == NOTHING
    assert digest(np.zeros(4)) != NOTHING


def test_random_ones_do_not_meet_and_fit_into_an_int64() -> None:
    found = sorted(digest(row) for row in np.random.default_rng(1).normal(300.0, 50.0, (20_000, 8)))
    assert all(one < other for one, other in pairwise(found))
    assert found[0] > 0 and found[-1] < 2**63
