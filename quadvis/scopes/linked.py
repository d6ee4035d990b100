"""Scopes that trigger each other: their events in the order of ticks.

At one tick a scope is triggered at most once, and it is ready there or not by what came before. So the order
in which scopes of the same tick have their turn changes nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from quadvis.scopes.properties import SCOPE
from quadvis.scopes.scope import SignalScope


def link(scopes: Mapping[int, SignalScope]) -> None:
    """Let each scope know for which of its samples others wait."""
    wanted: dict[int, set[int]] = {}
    for scope in scopes.values():
        if scope.settings.TriggerMode == SCOPE:
            wanted.setdefault(scope.settings.TriggerScope, set()).add(scope.settings.TriggerSample)
    for number, scope in scopes.items():
        scope.watched = frozenset(wanted.get(number, ()))


def run(scopes: Sequence[SignalScope]) -> None:
    """Let scopes take the rows that have been opened."""
    alone = [each for each in scopes if not each.watched and each.settings.TriggerMode != SCOPE]
    for scope in alone:
        while (event := scope.next_event()) is not None:
            scope.pass_event(event[1])
    together = [each for each in scopes if each not in alone]
    while together:
        events = ((event, scope) for scope in together if (event := scope.next_event()) is not None)
        found = min(events, key=lambda each: (each[0][0], each[1].number), default=None)
        if found is None:
            break
        (tick, row), scope = found
        for sample in scope.pass_event(row):
            for other in together:
                settings = other.settings
                waits = settings.TriggerMode == SCOPE and settings.TriggerScope == scope.number
                if waits and settings.TriggerSample == sample:
                    other.cause(tick)
    for scope in scopes:
        scope.close()
