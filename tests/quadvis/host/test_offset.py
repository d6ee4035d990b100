import itertools
import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.host.offset import measure


@given(
    st.integers(-(10**15), 10**15),
    st.lists(st.tuples(st.integers(0, 10**7), st.integers(0, 10**7)), min_size=1, max_size=30),
)
def test_the_offset_is_right_within_its_error_however_long_the_ways_are(
    offset: int, ways: list[tuple[int, int]]
) -> None:
    """Of any asymmetric delays there and back, the true offset is within the error that is said."""
    now = [10**12]
    trips = itertools.cycle(ways)
    back = [0]

    def clock() -> int:
        now[0] += back[0]
        back[0] = 0
        return now[0]

    def ask() -> int:
        there, back[0] = next(trips)
        now[0] += there
        return now[0] + offset

    found = measure(ask, len(ways), clock)
    assert abs(found.offset - offset) <= found.error
    assert found.error <= (min(map(sum, ways)) + 1) // 2


def test_the_shortest_trip_counts() -> None:
    rng = random.Random(3)
    now = [0]

    def clock() -> int:
        return now[0]

    def ask() -> int:
        now[0] += rng.choice([20_000, 5_000_000])
        theirs = now[0] + 7_000_000
        now[0] += 20_000
        return theirs

    found = measure(ask, 20, clock)
    assert found == (pytest.approx(7_000_000, abs=1), 20_000)
