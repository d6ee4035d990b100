"""A diagram's closed loop as matrices, by central differences of the engine's own run.

A wholly continuous loop gives the derivative of its states. Any other loop is lifted over one hyperperiod,
and `state` finds its state.

Source: lifting of multirate loops, Kranc (1957); Meyer and Burrus (1975).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from quadvis.analysis.cut import with_breaks
from quadvis.analysis.loops import AnalysisError, blocks_on_loops, full, hyperperiod
from quadvis.analysis.probe import STEP, Channel, Matrix, Positions, Probe, Vector, silence
from quadvis.analysis.progress import announce
from quadvis.analysis.state import Columns, find_state, slope, stacked
from quadvis.diagram.sections.cuts import Cut
from quadvis.engine.engine import Engine
from quadvis.graph.devices import refuse_devices
from quadvis.graph.graph import Graph
from quadvis.native.choice import AUTO, choose, use

SETTLED = 1e-6  # of the state's size: the largest change at an operating point
TRIALS = 12
LATER = 8.0
CHECKED = 4  # hyperperiods that the matrix must predict
CLOSE = 0.01
IDLE = 1e-9
MENTIONED = 8  # blocks that a message names


class Unsettled(AnalysisError):
    """No steady state was found."""


@dataclass(frozen=True)
class Linear:
    """x+ = a x + b d, y = c x + d d over a hyperperiod ``period`` (s); x' = a x + b d if the period is 0.

    Its element of d disturbs each channel on the way to the channel's readers; y is the signal that comes
    back. ``parts`` says which of the parts under a condition run at the operating point; the others stand
    still.
    """

    a: Matrix
    b: Matrix
    c: Matrix
    d: Matrix
    period: float
    states: tuple[str, ...]
    channels: tuple[Channel, ...]
    parts: Mapping[str, bool] = field(default_factory=dict)


def linearised(graph: Graph, cuts: Sequence[Cut], at: float, engine: str = AUTO) -> Linear:
    """Return the loop at its operating point, found by Newton's method from the state at a time (s).

    ``engine`` is that of `Diagram.run`. If the method fails, it starts again from a later time. AnalysisError
    if no steady state is near, if the loop is not smooth there, if a cut is not on the loop, or if the graph
    has neither a loop nor a state.
    """
    looped = blocks_on_loops(graph)
    _check_cuts(graph, looped, cuts)
    opened = with_breaks(graph, (signal for cut in cuts for signal in cut.signals))
    linear = linearised_part(opened, blocks_on_loops(opened), cuts, at, engine)
    if not looped and not linear.states:
        raise AnalysisError("there is nothing to analyse: the diagram has no loop and no state")
    return linear


def linearised_part(
    graph: Graph, blocks: set[str], cuts: Sequence[Cut], at: float, engine: str = AUTO
) -> Linear:
    """Return the same of some blocks of a graph, which has its breaks already; of none: of all."""
    refuse_devices(graph)
    try:
        return _linearised(graph, blocks, cuts, at, engine)
    except Unsettled:
        return _linearised(graph, blocks, cuts, LATER * max(at, 1.0), engine)


def _linearised(graph: Graph, blocks: set[str], cuts: Sequence[Cut], at: float, wanted: str) -> Linear:
    engine = Engine(graph)
    silence(engine)
    tasks = {node.task for node in graph.nodes if node.path in blocks}
    runs = len(engine.memory.floats) if blocks else 1
    ticks = int(full(graph, blocks, at) / graph.tick) + runs * hyperperiod(graph, tasks)
    use(engine, choose(engine, ticks, wanted, announce))
    with engine:
        announce("running to the operating point")
        probe = Probe(engine, cuts, at, blocks)
        return replace(_linearise(probe), parts=probe.parts)


def _check_cuts(graph: Graph, looped: set[str], cuts: Sequence[Cut]) -> None:
    """Refuse cuts that are not on a closed loop."""
    for cut in cuts:
        for signal in cut.signals:
            if signal.block not in looped:
                problem = f"cut '{cut.label}': '{signal.text}' comes from a block that is on no loop"
                known = [node.path for node in graph.nodes if node.path in looped]
                remedy = (
                    f"open the loop behind one of {_few_names(known)}" if known else "the diagram has none"
                )
                raise AnalysisError(f"{problem}; {remedy}")


def _few_names(names: Sequence[str]) -> str:
    """Return the first few names, followed by dots if more exist."""
    return ", ".join(names[:MENTIONED]) + (", ..." if len(names) > MENTIONED else "")


def _linearise(probe: Probe) -> Linear:
    for _ in range(TRIALS):
        places, columns = find_state(probe)
        if _is_continuous(probe, places):
            places = places[np.isin(places, probe.continuous)]
            return _continuous(probe, places)
        residual = probe.after(places[:0], 0.0)[0][places] - probe.start[places]
        if _small(residual, probe, places):
            linear = _lifted(probe, places, columns)
            _check(probe, places, linear.a)
            return _without_idle(linear)
        a = stacked(columns, places, len(probe.channels))[0]
        probe.move(places, _solved(np.eye(len(places)) - a, residual))
    raise _unsettled(probe, places, residual)


def _solved(matrix: Matrix, vector: Vector) -> Vector:
    """Return the least-norm solution: a state that nothing determines stays where it is."""
    return np.asarray(np.linalg.lstsq(matrix, vector, rcond=None)[0], np.float64)


def _small(residual: Vector, probe: Probe, places: Positions) -> bool:
    return bool((np.abs(residual) <= SETTLED * probe.scale[places]).all())


def _unsettled(probe: Probe, places: Positions, residual: Vector) -> Unsettled:
    worst = int(np.argmax(np.abs(residual) / probe.scale[places]))
    problem = f"no steady state was found: '{probe.names[int(places[worst])]}' goes on moving"
    return Unsettled(f"{problem}; begin near one, or let the diagram run longer before ('at')")


def _is_continuous(probe: Probe, places: Positions) -> bool:
    return all(task.continuous for task in probe.tasks) and bool(np.isin(places, probe.continuous).all())


def _lifted(probe: Probe, places: Positions, columns: Columns) -> Linear:
    count, none = len(probe.channels), places[:0]
    a, c = stacked(columns, places, count)
    b, d = np.zeros((len(places), count)), np.zeros((count, count))
    for column, channel in enumerate(probe.channels):
        if channel.read_only:
            continue
        announce(f"{column} of {count} instants disturbed")
        added = np.zeros(count)
        added[column] = STEP * probe.scale[channel.read]
        above, below = (probe.after(none, 0.0, sign * added) for sign in (1.0, -1.0))
        b[:, column] = slope(above[0], below[0], added[column])[places]
        d[:, column] = slope(above[1], below[1], added[column])
    return Linear(a, b, c, d, probe.period, _states(probe, places), tuple(probe.channels))


def _without_idle(linear: Linear) -> Linear:
    """Leave out the states that never move and have no effect, such as the state of a lag of zero."""
    moves = linear.a - (np.eye(len(linear.a)) if linear.period else 0.0)
    busy = [(np.abs(part) > IDLE).any(axis=axis) for part, axis in
            ((moves, 0), (moves, 1), (linear.b, 1), (linear.c, 0))]  # fmt: skip
    kept = np.flatnonzero(np.logical_or.reduce(busy))
    states = tuple(linear.states[index] for index in kept)
    return replace(
        linear, a=linear.a[np.ix_(kept, kept)], b=linear.b[kept], c=linear.c[:, kept], states=states
    )


def _continuous(probe: Probe, places: Positions) -> Linear:
    """Return the derivative of a loop without sampling."""
    for _ in range(TRIALS):
        linear = _derivative(probe, places)
        residual = probe.slopes(places[:0], 0.0, np.zeros(len(probe.channels)))[0][places]
        if _small(residual, probe, places):
            return _without_idle(linear)
        probe.move(places, _solved(linear.a, -residual))
    raise _unsettled(probe, places, residual)


def _derivative(probe: Probe, places: Positions) -> Linear:
    states, count = len(places), len(probe.channels)
    matrix = np.zeros((states + count, states + count))
    for column in range(states + count):
        added, place = np.zeros(count), places[:0]
        if column >= states and probe.channels[column - states].read_only:
            continue
        if column < states:
            place = places[column : column + 1]
            step = float(STEP * probe.scale[place[0]])
        else:
            step = float(STEP * probe.scale[probe.channels[column - states].read])
            added[column - states] = step
        above, below = (probe.slopes(place, sign * step, sign * added) for sign in (1.0, -1.0))
        matrix[:states, column] = slope(above[0], below[0], step)[places]
        matrix[states:, column] = slope(above[1], below[1], step)
    a, b = matrix[:states, :states], matrix[:states, states:]
    c, d = matrix[states:, :states], matrix[states:, states:]
    return Linear(a, b, c, d, 0.0, _states(probe, places), tuple(probe.channels))


def _states(probe: Probe, places: Positions) -> tuple[str, ...]:
    return tuple(probe.names[int(place)] for place in places)


def _check(probe: Probe, places: Positions, a: Matrix) -> None:
    """Refuse a loop that its matrix does not predict: one with an edge at its operating point."""
    if not places.size:
        return
    size = STEP * probe.scale[places]
    delta = size * np.random.default_rng(3).uniform(-1.0, 1.0, places.size)
    above, below = (probe.after(places, sign * delta, count=CHECKED)[0] for sign in (1.0, -1.0))
    found = slope(above, below, 1.0)[places]
    wrong = np.abs(found - np.linalg.matrix_power(a, CHECKED) @ delta) / size
    if not wrong.max() <= CLOSE * max(1.0, float((np.abs(found) / size).max())):
        name = probe.names[int(places[int(np.nanargmax(wrong))])]
        problem = (
            f"the loop has an edge at its operating point, '{name}' is not proportional to small changes"
        )
        raise AnalysisError(f"{problem}; begin elsewhere, away from limits and with full queues ('at')")
