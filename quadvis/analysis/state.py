"""The state of a sampled loop, and the derivatives by each of its slots.

The state is that part of memory which lasts from one hyperperiod to the next and which a disturbance of some
signal can reach. Delay lines, queues of measurements and held values belong to the state; stamps, counters
and random streams follow the clock and do not belong to it.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

import numpy as np

from quadvis.analysis.probe import STEP, Matrix, Positions, Probe, Vector
from quadvis.analysis.progress import announce
from quadvis.errors import RunError

Columns = dict[int, tuple[Vector, Vector]]  # by slot: the derivatives of the later memory and of the channels
CHUNK = 32  # slots that are changed together


def find_state(probe: Probe) -> tuple[Positions, Columns]:
    """Return the slots of the state, and for each slot the derivatives of the memory and of the channels."""
    still = probe.after(probe.positions[:0], 0.0)
    columns: Columns = {}
    slots, rounds = _reached(probe, still)
    known = set(slots.tolist())
    fresh = np.setdiff1d(slots, _unread(probe, slots, rounds, still))
    while fresh.size:
        reached: set[int] = set()
        passing = np.isin(fresh, probe.signals)
        for place in [*fresh[~passing].tolist(), *_influential(probe, fresh[passing], still)]:
            announce(f"{len(columns)} states disturbed")
            step = STEP * probe.scale[place]
            one = np.array([place], np.intp)
            above, below = (probe.after(one, sign * step) for sign in (1.0, -1.0))
            changed = _changed(probe, above[0], below[0])
            if changed.size or not np.array_equal(above[1], below[1]):
                columns[place] = slope(above[0], below[0], step), slope(above[1], below[1], step)
                reached.update(changed.tolist())
        fresh = np.array(sorted(reached - known), np.intp)
        known |= reached
    return _observable(np.array(sorted(columns), np.intp), columns, len(probe.channels)), columns


def _observable(places: Positions, columns: Columns, channels: int) -> Positions:
    """Drop, until no more can be dropped, the slots on which no channel and no remaining slot depends."""
    a, c = stacked(columns, places, channels)
    left = np.arange(places.size)
    while left.size:
        matter = (a[np.ix_(left, left)] != 0.0).any(axis=0) | (c[:, left] != 0.0).any(axis=0)
        if matter.all():
            break
        left = left[matter]
    return places[left]


def _reached(probe: Probe, still: tuple[Vector, Vector]) -> tuple[Positions, int]:
    """Return the slots that a disturbance of some signal reaches, and after how many hyperperiods."""
    found = np.union1d(_changed(probe, probe.shaken(), still[0]), probe.continuous).astype(np.intp)
    rounds, known = 1, found[:0]
    while found.size > known.size:
        rounds, known = rounds + 1, found
        found = np.union1d(known, _changed(probe, _nudged(probe, known)[0], still[0])).astype(np.intp)
    return found, rounds


def _nudged(probe: Probe, places: Positions, count: int = 1) -> tuple[Vector, Vector]:
    """Return the effects of a small random change of all these slots together."""
    random = np.random.default_rng(2)
    return probe.after(
        places, STEP * probe.scale[places] * random.uniform(0.5, 1.0, places.size), count=count
    )


def _unread(probe: Probe, places: Positions, rounds: int, still: tuple[Vector, Vector]) -> Positions:
    """Return slots whose value no block reads any more, such as the tail of an overlong shift register.

    No channel and no other slot depends on them, and their poles are at zero.
    """
    chunks: list[Positions] = []
    for _, array in groupby(places.tolist(), lambda place: probe.names[place].partition("[")[0]):
        slots = np.array(list(array), np.intp)
        chunks += np.split(slots, range(CHUNK, slots.size, CHUNK))
    results = [_nudged(probe, chunk) for chunk in chunks]
    left = [
        (chunk, _changed(probe, memory, still[0]))
        for chunk, (memory, read) in zip(chunks, results, strict=True)
        if np.array_equal(read, still[1], equal_nan=True)
    ]
    while (ends := _closed(left)).size:
        lasting = _lasting(probe, ends, rounds)
        if not lasting.size:
            return ends
        left = [(chunk, changed) for chunk, changed in left if not np.isin(chunk, lasting).any()]
        if not np.isin(ends, lasting).any():
            break  # it lasts outside, and no chunk is to blame
    return places[:0]


def _closed(chunks: Sequence[tuple[Positions, Positions]]) -> Positions:
    """Return the slots of those chunks whose change changes only slots of the same and of earlier ones."""
    found, left = np.array([], np.intp), list(chunks)
    while True:
        inside = [chunk for chunk, changed in left if np.isin(changed, np.append(found, chunk)).all()]
        if not inside:
            return found
        found = np.concatenate([found, *inside])
        left = [(chunk, changed) for chunk, changed in left if not np.isin(chunk, found).any()]


def _lasting(probe: Probe, places: Positions, rounds: int) -> Positions:
    """Return the slots that still differ so many hyperperiods after a change of all these slots together.

    A change that makes a block fail, such as that of a covariance, lasts in all of them.
    """
    try:
        changed = _nudged(probe, places, rounds)[0]
    except RunError:
        return places
    return _changed(probe, changed, probe.after(places[:0], 0.0, count=rounds)[0])


def stacked(columns: Columns, places: Positions, channels: int) -> tuple[Matrix, Matrix]:
    """Return the derivatives of the state and of the channels by the state."""
    a = [columns[place][0][places] for place in places.tolist()]
    c = [columns[place][1] for place in places.tolist()]
    return np.reshape(a, (len(a), len(a))).T, np.reshape(c, (len(a), channels)).T


@np.errstate(invalid="ignore", over="ignore")  # a parameter may be infinite, and a signal NaN
def slope(above: Vector, below: Vector, step: float) -> Vector:
    """Return the central difference of two results of changes by ``step`` up and down."""
    return np.asarray((above - below) / (2 * step), np.float64)


def _changed(probe: Probe, one: Vector, other: Vector) -> Positions:
    """Return the slots whose bits differ."""
    places = probe.positions
    return np.asarray(places[one[places].view(np.int64) != other[places].view(np.int64)], np.intp)


def _influential(probe: Probe, places: Positions, still: tuple[Vector, Vector]) -> list[int]:
    """Return the signals with an effect a hyperperiod later, found by halving, as most signals have none."""
    found: list[int] = []
    waiting = [places] if places.size else []
    while waiting:
        group = waiting.pop()
        memory, read = _nudged(probe, group)
        if not _changed(probe, memory, still[0]).size and np.array_equal(read, still[1]):
            continue
        if group.size == 1:
            found.append(int(group[0]))
        else:
            waiting += [group[: group.size // 2], group[group.size // 2 :]]
    return found
