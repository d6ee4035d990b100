"""Sums over the last samples that do not drift: no sample is ever subtracted again.

The ring of a window holds the samples of the present round up to ``place``, and behind it, of the round
before, the sums of each sample and all later ones. So a sum over the window is one of these and the sum of
the present round. At the end of a round its samples are summed up once, from the last to the first.
"""

from __future__ import annotations

from typing import Any


def over_window(block: Any, ring: Any, now: float, round_sum: float, index: int, count: int) -> float:
    """Return the sum over the window of one element, of ``count``, with the sample of now."""
    later = block.place + 1
    older = ring.flat[later * count + index] if block.full and later < block.samples else 0.0
    return float(older + round_sum + now)


def sum_up(ring: Any, samples: int) -> None:
    """Replace each sample by the sum of it and all later ones: the round is over."""
    count = ring.size // samples
    for place in range((samples - 1) * count - 1, -1, -1):
        ring.flat[place] += ring.flat[place + count]


def held(block: Any) -> int:
    """Return how many samples are in the window, the one of now included."""
    return int(block.samples if block.full else block.place + 1)
