"""The priorities of a real-time run's tasks: rate-monotonic, over all computers of a diagram.

Computers of one machine share its processors. A task that is due more often than another one goes before
it, whichever computer it is of: a slow loop that looks at the clock before its deadline must not keep a fast
one waiting.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING

from quadvis.realtime.options import RealTime

if TYPE_CHECKING:
    from quadvis.diagram.diagram import Diagram


def ladders(diagram: Diagram, wishes: Mapping[str, RealTime]) -> dict[str, tuple[int, ...]]:
    """Return the priority of each task of each computer, 0 for none; the first is that of the loop.

    The fastest tasks have the priority that is asked for, those of the next longer period one less, and so
    on. A priority that the diagram gives a computer is that of its own fastest task.
    """
    periods = {name: [task.period for task in diagram.graph.part_of(name).tasks] for name in wishes}
    ordered = sorted({period for each in periods.values() for period in each})
    found = {}
    for name, own in periods.items():
        computer = diagram.computer(name)
        given = computer is not None and computer.priority == wishes[name].priority is not None
        found[name] = _ladder(own, sorted(set(own)) if given else ordered, wishes[name].priority or 0)
    return found


def _ladder(periods: Sequence[Fraction], ordered: Sequence[Fraction], highest: int) -> tuple[int, ...]:
    """Return priorities of tasks, fastest first; the first one releases the others, and is above them."""
    wanted = [highest - ordered.index(period) for period in periods]
    below = [min(each, wanted[0] - 1) for each in wanted[1:]]
    return tuple(max(1, each) if highest else 0 for each in (wanted[0], *below))
