"""Three lists side by side: the stretches in which all three agree, and those between them."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from difflib import SequenceMatcher


def aligned(lists: Sequence[Sequence[Hashable]]) -> Iterator[tuple[slice, slice, slice]]:
    """Yield stretches of a list and of two that were made of it, in order; together they cover all three."""
    base = lists[0]
    matches = [dict(_matches(base, other)) for other in lists[1:]]
    place = [0, 0, 0]
    for number in range(len(base)):
        found = [each.get(number) for each in matches]
        if None in found:
            continue
        ends = [number, *(each for each in found if each is not None)]
        if ends != place:
            yield _slices(place, ends)
        yield _slices(ends, [end + 1 for end in ends])
        place = [end + 1 for end in ends]
    ends = [len(each) for each in lists]
    if ends != place:
        yield _slices(place, ends)


def _matches(base: Sequence[Hashable], other: Sequence[Hashable]) -> Iterator[tuple[int, int]]:
    for block in SequenceMatcher(None, base, other, autojunk=False).get_matching_blocks():
        for number in range(block.size):
            yield block.a + number, block.b + number


def _slices(begins: Sequence[int], ends: Sequence[int]) -> tuple[slice, slice, slice]:
    first, second, third = (slice(begin, end) for begin, end in zip(begins, ends, strict=True))
    return first, second, third
