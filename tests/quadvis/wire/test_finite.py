"""Plain data for JSON: nothing in it is infinite or NaN."""

from __future__ import annotations

import json
import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from quadvis.wire.finite import finite

LEAVES = st.none() | st.booleans() | st.integers() | st.floats() | st.text()
KEYS = st.text(max_size=3) | st.integers()
VALUES = st.recursive(
    LEAVES, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(KEYS, inner, max_size=3), max_leaves=6
)


def test_numbers_that_are_not_finite_are_texts_wherever_they_lie() -> None:
    value = {1: [math.inf, (-math.inf, 2.5)], "b": np.array([1.0, math.nan]), "c": np.int64(3), "d": True}
    assert finite(value, str) == {"1": ["inf", ["-inf", 2.5]], "b": [1.0, "nan"], "c": 3, "d": True}


@settings(max_examples=25)
@given(VALUES)
def test_all_plain_data_can_be_json(value: object) -> None:
    json.dumps(finite(value, str), allow_nan=False)
