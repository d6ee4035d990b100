"""Datagrams for PlotJuggler, read as its plugin reads them."""

from __future__ import annotations

import json
import math
from typing import Any

import msgpack
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.bridge.blocks import BlockSamples
from quadvis.bridge.datagrams import ENCODINGS, MOST, datagrams
from quadvis.output.recording import RecordedBlock, RecordedPort

CRAFT = RecordedBlock("/craft", (RecordedPort("position", "float64", (3,), "m"), RecordedPort("x")), "fast")
LAW = RecordedBlock("/control/roll", (RecordedPort("level", "int64"), RecordedPort("on", "bool")), "fast")
BEGAN = 1_796_024_903_882_418_142
DECODERS = {"json": json.loads, "messagepack": msgpack.unpackb}


def curves(data: list[bytes], encoding: str) -> dict[str, list[tuple[float, float]]]:
    """Return the curves that PlotJuggler makes of datagrams: its NlohmannParser, in Python."""
    found: dict[str, list[tuple[float, float]]] = {}

    def flatten(prefix: str, value: Any, moment: float) -> None:
        if isinstance(value, dict):
            for key, each in value.items():
                flatten(f"{prefix}/{key}", each, moment)
        elif isinstance(value, list):
            for number, each in enumerate(value):
                flatten(f"{prefix}[{number}]", each, moment)
        elif isinstance(value, bool | int | float):
            found.setdefault(prefix, []).append((moment, float(value)))

    for each in data:
        message = DECODERS[encoding](each)
        flatten("", message, message["timestamp"])
    return found


def samples(*rows: list[float]) -> BlockSamples:
    stamps = BEGAN + 10_000_000 * np.arange(len(rows), dtype=np.int64)
    return BlockSamples((CRAFT, LAW), stamps, np.array(rows))


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_every_number_is_a_curve_at_its_time(encoding: str) -> None:
    data = list(
        datagrams(samples([1, 2, 3, 4.5, 7, 1], [5, math.nan, math.inf, 0, 8, 0]), ENCODINGS[encoding])
    )
    assert len(data) == 2
    found = curves(data, encoding)
    first, second = (BEGAN + 10_000_000 * number for number in range(2))
    assert found.pop("/timestamp") == [(first / 1e9, first / 1e9), (second / 1e9, second / 1e9)]
    assert second / 1e9 - first / 1e9 == pytest.approx(0.01, abs=1e-6)
    assert found == {
        "/craft/position[0]": [(first / 1e9, 1.0), (second / 1e9, 5.0)],
        "/craft/position[1]": [(first / 1e9, 2.0)],  # what is not finite is left out
        "/craft/position[2]": [(first / 1e9, 3.0)],
        "/craft/x": [(first / 1e9, 4.5), (second / 1e9, 0.0)],
        "/control/roll/level": [(first / 1e9, 7.0), (second / 1e9, 8.0)],
        "/control/roll/on": [(first / 1e9, 1.0), (second / 1e9, 0.0)],
    }


@pytest.mark.parametrize("encoding", ENCODINGS)
@given(sizes=st.lists(st.integers(0, 300), min_size=1, max_size=8))
def test_however_many_numbers_there_are_each_datagram_is_short_and_none_is_missing(
    encoding: str, sizes: list[int]
) -> None:
    ports = tuple(RecordedPort(f"y{n}", "float64", (size,) if size else ()) for n, size in enumerate(sizes))
    block = RecordedBlock("/wide/block", ports, "fast")
    values = np.random.default_rng(1).normal(size=(1, sum(size or 1 for size in sizes)))
    data = list(datagrams(BlockSamples((block,), np.array([BEGAN]), values), ENCODINGS[encoding]))
    assert max(map(len, data)) <= MOST
    found = curves(data, encoding)
    del found["/timestamp"]
    names = [
        f"/wide/block/y{n}" + (f"[{element}]" if size else "")
        for n, size in enumerate(sizes)
        for element in range(size or 1)
    ]
    assert {name: [value for _, value in curve] for name, curve in found.items()} == {
        name: [value] for name, value in zip(names, values[0].tolist(), strict=True)
    }
