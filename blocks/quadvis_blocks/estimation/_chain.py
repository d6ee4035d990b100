"""A Kalman filter for position, velocity and disturbance along three axes, which can go back in time.

The model of an axis has a known acceleration a, which is linear between ticks, and white noises w and n:

    p' = v,    v' = a + d + w,    d' = -d / decay + n.

Estimates are an array (3, 9) with one row for each axis: p, v, d, then the covariances pp, pv, pd, vv, vd,
dd. The axes are independent. The past holds the last ticks, oldest first: instant, acceleration, and the
estimates with all frames before that instant. The present tick has the number TICKS. Frames are kept newest
first. After a late frame the filter runs again from the tick before the frame, through all later frames. The
result is, to the bit, the result for a frame that came in time.

The file is long because the filter and its way back share one form of memory.
"""

from __future__ import annotations

import math
from typing import Any

from quadvis.block import passed, reached

TICKS = 64  # kept ticks, and kept frames
FRAMES = 64
STAMP, VALUE, VARIANCE, WIDTH = 0, 1, 4, 7  # a frame: stamp, three positions, their variances
STRAIN = 1.0 / 3.0  # share of a new frame in the strain
BEGUN, LAST, STRAINED = range(3)  # of a trial: stamps of its first and its last frame, and its strain
NOTHING, TAKEN, REFUSED, LATE, RESET = range(5)  # verdicts on a frame; NOTHING: there is no frame


def begin(chains: Any, position: Any, sigma: Any, disturbance: Any) -> None:
    """Set estimates to rest at a position (3,); `sigma` (2,) are the deviations of position and velocity."""
    for axis in range(3):
        begin_axis(chains, axis, position[axis], sigma, disturbance[axis])


def begin_axis(chains: Any, axis: int, position: float, sigma: Any, disturbance: float) -> None:
    """Set the estimates of one axis to rest at a position."""
    for column in range(9):
        chains[axis, column] = 0.0
    chains[axis, 0] = position
    chains[axis, 3] = sigma[0] * sigma[0]
    chains[axis, 6] = sigma[1] * sigma[1]
    chains[axis, 8] = disturbance * disturbance


def predict(chains: Any, before: Any, after: Any, step: float, model: Any) -> None:
    """Carry estimates over a step (s) on which the known acceleration goes from `before` to `after` (3,).

    `model` (10,) has the density of w (m/s^2 / sqrt(Hz)) of each axis, then the deviation of d of each axis,
    then the decay time of d of each axis, and the height up to which the ground may touch the craft. The
    effect of the noise of d on p and v is computed as if d did not decay within the step.
    """
    for axis in range(3):
        decay = float(model[6 + axis])
        keep = math.exp(-step / decay)
        pushed = -decay * math.expm1(-step / decay)  # velocity by disturbance
        moved = decay * (step - pushed)  # position by disturbance
        row = chains[axis]
        v, d, pv, pd = float(row[1]), float(row[2]), float(row[4]), float(row[5])
        vv, vd, dd = float(row[6]), float(row[7]), float(row[8])
        first, last = float(before[axis]), float(after[axis])
        white, strength = float(model[axis]) ** 2, float(model[3 + axis]) ** 2
        random = 2.0 * strength / decay
        row[0] += step * v + moved * d + step * step * (2.0 * first + last) / 6.0
        row[1] = v + pushed * d + 0.5 * step * (first + last)
        row[2] = keep * d
        new_pv, new_pd, new_vd = pv + step * vv + moved * vd, pd + step * vd + moved * dd, vd + pushed * dd
        row[3] += step * (pv + new_pv) + moved * (pd + new_pd)
        row[3] += white * step**3 / 3.0 + random * step**5 / 20.0
        row[4] = new_pv + pushed * new_pd + white * step**2 / 2.0 + random * step**4 / 8.0
        row[5] = keep * new_pd + random * step**3 / 6.0
        row[6] = vv + pushed * (vd + new_vd) + white * step + random * step**3 / 3.0
        row[7] = keep * new_vd + random * step**2 / 2.0
        row[8] = keep * keep * dd + strength * (1.0 - keep * keep)


def correct(chains: Any, frame: Any, model: Any) -> None:
    """Correct estimates by the positions of a frame; near the ground d of x and y is not corrected."""
    low = is_low(chains, frame, model)
    for axis in range(3):
        row = chains[axis]
        pp, pv, pd = float(row[3]), float(row[4]), float(row[5])
        spread = pp + float(frame[VARIANCE + axis])
        off = float(frame[VALUE + axis]) - float(row[0])
        by_p, by_v, by_d = pp / spread, pv / spread, 0.0 if low and axis < 2 else pd / spread
        row[0] += by_p * off
        row[1] += by_v * off
        row[2] += by_d * off
        row[3] = pp - by_p * pp
        row[4] = pv - by_p * pv
        row[5] = pd - by_p * pd
        row[6] -= by_v * pv
        row[7] -= by_v * pd
        row[8] -= by_d * pd


def advance(chains: Any, begin: Any, end: Any, until: float, frames: Any, held: int, model: Any) -> None:
    """Carry estimates from a tick towards the next tick, up to an instant, through the frames on the way.

    `begin` and `end` (4,) are the ticks: instant and acceleration. Frames at the instant of `begin` count,
    frames at `until` do not.
    """
    at, length = float(begin[0]), float(end[0] - begin[0])
    slope = (end[1:] - begin[1:]) / length if length > 0.0 else 0.0 * begin[1:]
    for index in range(held - 1, -1, -1):
        stamp = float(frames[index, STAMP])
        if begin[0] <= stamp < until:
            if stamp > at:
                predict(chains, begin[1:] + slope * (at - begin[0]), begin[1:] + slope * (stamp - begin[0]),
                        stamp - at, model)  # fmt: skip
                at = stamp
            correct(chains, frames[index], model)
    if until > at:
        predict(chains, begin[1:] + slope * (at - begin[0]), begin[1:] + slope * (until - begin[0]),
                until - at, model)  # fmt: skip


def append(ticks: Any, past: Any, oldest: int, now: Any, chains: Any) -> int:
    """Replace the oldest tick by a new tick (4,) and its estimates; return the oldest tick in use."""
    ticks[:-1] = ticks[1:].copy()
    past[:-1] = past[1:].copy()
    ticks[TICKS - 1] = now
    past[TICKS - 1] = chains
    return max(oldest - 1, 0)


def place(ticks: Any, oldest: int, stamp: float) -> int:
    """Return the number of the last tick that is not after a stamp; -1 if that tick is no longer kept."""
    number = TICKS - 1
    while number >= oldest:
        if ticks[number, 0] <= stamp:
            return number
        number -= 1
    return -1


def filtered(
    chains: Any, past: Any, ticks: Any, oldest: int, now: Any, frames: Any, held: int, frame: Any,
    model: Any, sigma: Any, gate: float, tolerance: float, reach: Any, strain: float, limit: float,
    trial: Any, tried: Any, reset_after: float,
) -> tuple[int, int, int, float, float]:  # fmt: skip
    """Compute the estimates at the tick `now`, before the frames of that tick, with a new frame if believed.

    `now` (4,) is the tick after those in `ticks`. The stamp of `frame` is NaN if there is no frame. A frame
    is refused if it is beyond the gate, out of `reach` (3,), or raises `strain` above `limit`. Out of
    reach, it is first tried without the newest believed frame, which it may replace. Refused frames
    are tried on separate estimates, `trial` (3, 9) with `tried` (3,). When the trial has agreed with the
    refused frames for `reset_after`, its estimates replace the others. Where the ground may touch the craft,
    the strain is zero while frames are believed, and a frame that is beyond the gate in height alone resets
    the height.

    `chains`, `past`, `frames`, `trial` and `tried` are changed in place. The result is the verdict on the
    frame, the number of frames held, the oldest tick in use, the squared innovation of the frame over its
    variance, and the strain.
    """
    first, verdict, nis, grounded = TICKS - 1, NOTHING, math.nan, False
    start = chains.copy()
    if not math.isnan(frame[STAMP]):
        stamp = min(float(frame[STAMP]), float(now[0]))
        found = place(ticks, oldest, stamp)
        if found < 0 or passed(frame[STAMP], now[0]):
            verdict = LATE
        else:
            first, frame[STAMP] = found, stamp
            chains[:] = past[first]
            again(chains, past, ticks, first, now, stamp, frames, held, model, False)
            nis, level, beside, above = innovation(chains, frame, tolerance)
            low = is_low(chains, frame, model)
            in_reach = is_in_reach(chains, frame, frames, held, reach)
            beside = beside if in_reach else math.inf
            near = max(beside, above) <= gate * gate
            if near:  # the bound 2 limit: no single frame exceeds the limit
                calm = low and math.isnan(tried[BEGUN])
                strain += -strain if calm else STRAIN * (min(level, 2.0 * limit) - strain)
            verdict = TAKEN if near and strain <= limit else REFUSED
            if not in_reach:
                found = fits_without_newest(
                    past, ticks, oldest, now, frames, held, frame, model, gate, tolerance, reach
                )
                if found >= 0:
                    frames[: held - 1] = frames[1:held].copy()
                    first, held, verdict = found, held - 1, TAKEN
            grounded = verdict == REFUSED and low and beside <= gate * gate
            if verdict == REFUSED:
                start[:] = trial
                since, last = float(tried[BEGUN]), float(tried[LAST])
                agree(trial, tried, ticks, oldest, now, frame, model, sigma, gate, tolerance, limit)
                if grounded and math.isnan(since):
                    verdict = RESET
                elif tried[BEGUN] == since and reached(stamp - since, reset_after):
                    verdict, grounded = RESET, False
                    carry(start, ticks, oldest, now, last, float(ticks[first, 0]), model)
    chains[:] = past[first]
    if verdict == RESET:
        held, oldest, strain = 0, first, 0.0
        if grounded:
            begin_axis(chains, 2, float(frame[VALUE + 2]), sigma, float(model[5]))
        else:
            chains[:] = start
        past[first] = chains
    if verdict in (TAKEN, RESET):
        tried[BEGUN] = math.nan
        held = insert(frames, held, frame, float(ticks[oldest, 0]))
    again(chains, past, ticks, first, now, float(now[0]), frames, held, model, True)
    return verdict, held, oldest, nis, strain


def fits_without_newest(
    past: Any, ticks: Any, oldest: int, now: Any, frames: Any, held: int, frame: Any, model: Any, gate: float,
    tolerance: float, reach: Any,
) -> int:  # fmt: skip
    """Return the tick of the newest believed frame if a refused one fits without it; else -1.

    Of two frames that contradict each other either may be wrong. The one that contradicts the frames before
    is dropped, since one wrong frame sets the velocity where the model follows the frames closely.
    """
    if held < 2 or not frames[0, STAMP] < frame[STAMP]:
        return -1
    back = place(ticks, oldest, float(frames[0, STAMP]))
    if back < 0:
        return -1
    chains = past[back].copy()
    again(chains, past, ticks, back, now, float(frame[STAMP]), frames[1:], held - 1, model, False)
    _, _, beside, above = innovation(chains, frame, tolerance)
    fits = max(beside, above) <= gate * gate
    return back if fits and is_in_reach(chains, frame, frames, held, reach) else -1


def agree(
    trial: Any, tried: Any, ticks: Any, oldest: int, now: Any, frame: Any, model: Any, sigma: Any,
    gate: float, tolerance: float, limit: float,
) -> None:  # fmt: skip
    """Try a refused frame on the trial: the trial continues with the frame, or begins anew at it.

    `tried` (3,) are the stamps of the first and of the last frame that agreed, and their strain.
    """
    stamp, strain = float(frame[STAMP]), 0.0
    if tried[LAST] >= stamp and tried[BEGUN] <= stamp:
        return  # the frame was overtaken on its way
    goes_on = tried[BEGUN] < stamp and place(ticks, oldest, float(tried[LAST])) >= 0
    if goes_on:
        carry(trial, ticks, oldest, now, float(tried[LAST]), stamp, model)
        _, level, beside, above = innovation(trial, frame, tolerance)
        if is_low(trial, frame, model):
            if above > gate * gate:
                begin_axis(trial, 2, float(frame[VALUE + 2]), sigma, float(model[5]))
        else:
            strain = float(tried[STRAINED])
            strain += STRAIN * (min(level, 2.0 * limit) - strain)
            goes_on = above <= gate * gate
        goes_on = goes_on and beside <= gate * gate and strain <= limit
    if goes_on:
        correct(trial, frame, model)
        for axis in range(3):  # frames that only an unlikely wind explains do not agree
            goes_on = goes_on and abs(trial[axis, 2]) <= gate * model[3 + axis]
    if not goes_on:
        strain, tried[BEGUN] = 0.0, stamp
        begin(trial, frame[VALUE:VARIANCE], sigma, model[3:6])
        correct(trial, frame, model)
    tried[LAST], tried[STRAINED] = stamp, strain


def is_in_reach(chains: Any, frame: Any, frames: Any, held: int, reach: Any) -> bool:
    """Return whether reckoning from the newest believed frame can be as wrong as a frame says, in x and y.

    `reach` (3,) are the greatest errors of position, velocity and acceleration. Before the first believed
    frame, all frames are in reach.
    """
    if held == 0:
        return True
    elapsed = max(float(frame[STAMP] - frames[0, STAMP]), 0.0)
    bound = reach[0] + (reach[1] + 0.5 * reach[2] * elapsed) * elapsed
    away = max(abs(frame[VALUE] - chains[0, 0]), abs(frame[VALUE + 1] - chains[1, 0]))
    return bool(away <= bound)


def is_low(chains: Any, frame: Any, model: Any) -> bool:
    """Return whether the ground may touch the craft, according to the estimates and to a frame."""
    return bool(frame[VALUE + 2] <= model[9] and chains[2, 0] <= model[9])


def carry(chains: Any, ticks: Any, oldest: int, now: Any, since: float, until: float, model: Any) -> None:
    """Carry estimates from one instant to another by the accelerations of the ticks alone."""
    for number in range(oldest, TICKS):
        tick, end = ticks[number], now if number + 1 == TICKS else ticks[number + 1]
        after, before = max(since, float(tick[0])), min(until, float(end[0]))
        if before > after:
            slope = (end[1:] - tick[1:]) / float(end[0] - tick[0])
            predict(chains, tick[1:] + slope * (after - tick[0]), tick[1:] + slope * (before - tick[0]),
                    before - after, model)  # fmt: skip


def again(
    chains: Any, past: Any, ticks: Any, first: int, now: Any, until: float, frames: Any,
    held: int, model: Any, keep: bool,
) -> None:  # fmt: skip
    """Run the estimates of tick `first` forward to the instant `until`; with `keep`, renew the past.

    `now` (4,) is the tick after the last kept tick.
    """
    for number in range(first, TICKS):
        start = ticks[number]
        end = now if number + 1 == TICKS else ticks[number + 1]
        if start[0] >= until:
            return
        advance(chains, start, end, min(float(end[0]), until), frames, held, model)
        if keep and number + 1 < TICKS:
            past[number + 1] = chains


def insert(frames: Any, held: int, frame: Any, horizon: float) -> int:
    """Insert a frame into the held frames, in the order of their stamps, and return their number.

    Frames before `horizon` are dropped. The oldest frame is dropped if there is no room.
    """
    while held > 0 and (frames[held - 1, STAMP] < horizon or held >= FRAMES):
        held -= 1
    index = held
    while index > 0 and frames[index - 1, STAMP] <= frame[STAMP]:
        frames[index] = frames[index - 1]
        index -= 1
    frames[index] = frame
    return held + 1


def innovation(chains: Any, frame: Any, tolerance: float) -> tuple[float, float, float, float]:
    """Return four squared innovations over variances.

    They are the sum over all axes, the sum over x and y, and, with `tolerance` taken off each innovation, the
    greater one of x and y and that of h.
    """
    total = level = beside = above = 0.0
    for axis in range(3):
        off = float(frame[VALUE + axis]) - float(chains[axis, 0])
        variance = float(chains[axis, 3]) + float(frame[VARIANCE + axis])
        total += off * off / variance
        level += off * off / variance if axis < 2 else 0.0
        beyond = max(abs(off) - tolerance, 0.0)
        if axis < 2:
            beside = max(beside, beyond * beyond / variance)
        else:
            above = beyond * beyond / variance
    return total, level, beside, above


def latest(chains: Any, frames: Any, held: int, now: float, model: Any) -> None:
    """Correct estimates by the frames of the instant `now`."""
    for index in range(held - 1, -1, -1):
        if frames[index, STAMP] >= now:
            correct(chains, frames[index], model)
