"""Find the known word that was most likely meant by an unknown one."""

from __future__ import annotations

from collections.abc import Iterable

from quadvis.errors.synonyms import synonym
from quadvis.errors.words import quoted


def suggestion(word: str, candidates: Iterable[str]) -> str:
    """Return the remedy for an unknown word: "did you mean 'y'?", a short list of what exists, or ""."""
    names = list(dict.fromkeys(candidates))
    best = closest(word, names)
    if best is not None:
        return f"did you mean {quoted(best)}?"
    if not 0 < len(names) <= 8:
        return ""
    return f"use {quoted(names[0])}" if len(names) == 1 else f"choose from {', '.join(map(quoted, names))}"


# Costs of one slip, in tenths of a changed letter. Swapped neighbours are the likeliest typing error.
_EDIT, _SWAP, _PREFIX, _NO_GROUP, _OTHER_GROUP = 10, 7, 15, 2, 15
_LONGEST = 64


def closest(word: str, candidates: Iterable[str]) -> str | None:
    """Return the candidate that was most likely meant by a mistyped word, or None if no candidate is near.

    Nearness is the edit distance with swapped neighbours counted as one slip; case and `-` for `_` do not
    count, and a dotted name (`signal.derivative`) is also found by its last part alone. Of equally near
    candidates the one with the same first letter wins, then the first one. If none is as near as one slip, a
    word of other programs for one of the candidates counts before it.
    """
    if not 0 < len(word) <= _LONGEST:
        return None
    names = list(candidates)
    plain = _plain(word)
    found, least, same = None, _EDIT * _LONGEST, False
    for candidate in names:
        cost = _cost(plain, _plain(candidate), least)
        first = candidate[:1] == word[:1]
        if cost is not None and (cost < least or (cost == least and first and not same)):
            found, least, same = candidate, cost, first
    return found if found and least <= _EDIT else synonym(word, names) or found


def _plain(word: str) -> str:
    return word.casefold().replace("-", "_").replace(" ", "_")


def _cost(word: str, candidate: str, limit: int) -> int | None:
    """Return the cost of reading `word` as `candidate`, or None if it is above the limit."""
    whole = _distance(word, candidate, limit)
    if "." not in candidate:
        return whole
    more = _OTHER_GROUP if "." in word else _NO_GROUP
    tail = _distance(word.rpartition(".")[2], candidate.rpartition(".")[2], limit - more)
    if whole is None or tail is None:
        return whole if tail is None else tail + more
    return min(whole, tail + more)


def _distance(a: str, b: str, limit: int) -> int | None:
    """Return the optimal string alignment distance, or None above the limit or a third of the first word."""
    if a == b:
        return 0 if limit >= 0 else None
    short, long = sorted((len(a), len(b)))
    if short >= 3 and (a.startswith(b) or b.startswith(a)):
        cost = min(_PREFIX, _EDIT * (long - short))
        return cost if cost <= limit else None
    # A word that shares no letter is another word, even if it is short.
    limit = min(limit, _EDIT * max(1, (len(a) + 1) // 3), _EDIT * long - 1)
    letters, others = set(a), set(b)
    least = max(long - short, len(letters - others), len(others - letters))
    if least * _EDIT > limit or long > _LONGEST:
        return None
    last: list[int] = []
    row = list(range(0, _EDIT * (len(b) + 1), _EDIT))
    for i, x in enumerate(a, 1):
        row, last = _next_row(i, x, a[i - 2] if i > 1 else "", b, row, last), row
        if min(row) > limit + _EDIT - _SWAP:
            return None
    return row[-1] if row[-1] <= limit else None


def _next_row(i: int, x: str, x_before: str, b: str, before: list[int], last: list[int]) -> list[int]:
    """Return the costs of making each beginning of `b` from `i` letters that end in `x_before`, `x`."""
    row = [_EDIT * i]
    y_before = ""
    for j, y in enumerate(b, 1):
        cost = before[j - 1] if x == y else _EDIT + min(before[j - 1], before[j], row[-1])
        if x == y_before and y == x_before and x_before:
            cost = min(cost, last[j - 2] + _SWAP)
        row.append(cost)
        y_before = y
    return row
