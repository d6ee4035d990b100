"""A scope as its host sees it: packages that are fetched or come in pieces."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from quadvis.errors import QuadvisError
from quadvis.host.scope import NEWER, ROWS, WAITING, HostScope

HEAD = {"scope": 1, "names": ["a"], "units": ["1"], "trigger": None, "lost": 0, "tick": 1.0}
COUNT = ROWS + 3  # samples of a package, which need two messages


class FakeConnection:
    """A target whose scope has packages of one value each, the number of the package.

    Those up to ``busy`` are replaced by the next one as soon as a part of them was fetched; ``parts`` of
    packages, as (number, part), are what it sends by itself.
    """

    name = "lab"

    def __init__(self, busy: int = 0, parts: tuple[tuple[int, int], ...] = ()) -> None:
        self._busy, self._parts, self._newest = busy, parts, 0

    def request(self, verb: str, *, id: int, first: int, count: int) -> dict[str, Any]:
        assert (verb, id) == ("getscope", 1)
        number = self._newest
        self._newest = min(self._busy, number + 1)
        ticks = np.arange(COUNT)[first : first + count]
        samples = np.column_stack((ticks, np.full(len(ticks), number)))
        return {**HEAD, "sequence": number, "count": COUNT, "samples": samples.ravel().tolist()}

    def subscribe(self, topic: str, take: Callable[..., object]) -> None:
        for number, part in self._parts:
            take({**HEAD, "sequence": number, "part": part, "parts": 2}, np.full((3, 2), float(number)))

    def unsubscribe(self, topic: str) -> None:
        return


def scope(**given: Any) -> HostScope:
    return HostScope(FakeConnection(**given), 1)  # type: ignore[arg-type]


@pytest.mark.parametrize("busy", [0, 1, NEWER])
def test_all_samples_of_a_package_are_of_this_package(busy: int) -> None:
    found = scope(busy=busy).package
    assert (len(found), set(found.samples[:, 0])) == (COUNT, {float(found.sequence)})


def test_a_scope_that_is_always_newer_is_a_sentence() -> None:
    with pytest.raises(QuadvisError, match="scope 1 has newer packages before one of them has come whole"):
        _ = scope(busy=10**9).package


def test_parts_of_two_packages_make_none() -> None:
    parts = ((0, 0), (1, 1), (2, 0), (2, 1), (3, 0), (4, 0), (4, 1), (5, 1))
    found = scope(parts=parts).packages(timeout=0.001)
    assert [(each.sequence, set(each.samples[:, 0])) for each in found] == [(2, {2.0}), (4, {4.0})]


def test_of_packages_that_nobody_takes_the_newest_wait() -> None:
    parts = tuple((number, part) for number in range(WAITING + 5) for part in (0, 1))
    found = [each.sequence for each in scope(parts=parts).packages(timeout=0.001)]
    assert found == list(range(5, WAITING + 5))
