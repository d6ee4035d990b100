"""Arithmetic of single numbers for machine code, in the order of `lanes`, so with the same bits."""

from __future__ import annotations

from quadvis_vision.detection.lanes import Array, Pixels


def dot(first: tuple[float, float, float], second: tuple[float, float, float]) -> float:
    """Return the scalar product."""
    return first[0] * second[0] + first[1] * second[1] + first[2] * second[2]


def sample(pixels: Pixels, u: float, v: float) -> tuple[float, float, float]:
    """Return the colour between pixels at one place."""
    height, width, _ = pixels.shape
    u, v = min(max(u, 0.0), width - 1.0), min(max(v, 0.0), height - 1.0)
    left, top = min(int(u), width - 2), min(int(v), height - 2)
    right, low = u - left, v - top
    return (
        mixed(pixels, top, left, 0, right, low),
        mixed(pixels, top, left, 1, right, low),
        mixed(pixels, top, left, 2, right, low),
    )


def mixed(pixels: Pixels, row: int, column: int, channel: int, right: float, low: float) -> float:
    """Return the level between four pixels."""
    upper = pixels[row, column, channel] * (1 - right) + pixels[row, column + 1, channel] * right
    lower = pixels[row + 1, column, channel] * (1 - right) + pixels[row + 1, column + 1, channel] * right
    return float(upper * (1 - low) + lower * low)


def ranked(values: Array, count: int, rank: int) -> float:
    """Return the value of some rank among the first ones, which lose their order (quickselect, Hoare)."""
    low, high = 0, count - 1
    while low < high:
        pivot, i, j = values[rank], low, high
        while i <= j:
            while values[i] < pivot:
                i += 1
            while pivot < values[j]:
                j -= 1
            if i <= j:
                values[i], values[j] = values[j], values[i]
                i, j = i + 1, j - 1
        if j < rank:
            low = i
        if rank < i:
            high = j
    return float(values[rank])


def halved(values: Array) -> float:
    """Return the sum, in the order of `lanes.summed`; the values are lost. Their number is a power of two."""
    half = len(values) // 2
    while half >= 1:
        for r in range(half):
            values[r] += values[r + half]
        half //= 2
    return float(values[0])


def total(values: Array, work: Array) -> float:
    """Return the sum, in the order of `lanes.summed`."""
    work[:] = values
    return halved(work)


def solve(rows: Array, size: int) -> None:
    """Bring the solutions of (size, size + 1) equations into their last column, as `lanes.solved` does."""
    for k in range(size):
        pivot = rows[k, k]
        for j in range(k, size + 1):
            rows[k, j] /= pivot
        for i in range(size):
            if i != k:
                factor = rows[i, k]
                for j in range(k, size + 1):
                    rows[i, j] -= factor * rows[k, j]
