"""Correct spellings for mistyped units: "Nm" is N*m, "m/s2" is m/s^2, "milliseconds" is ms."""

from __future__ import annotations

import itertools
import re
from collections.abc import Collection, Iterator

from quadvis.errors import closest
from quadvis.units.names import ELSEWHERE, PREFIX_WORDS, PREFIXED, VARIABLES, WORDS

_PIECE = re.compile(
    r"(?P<word>[A-Za-z%]+)(?P<power> *-?[0-9]+(?![0-9.])|\^\(?-?[0-9./]+\)?)?|(?P<sign>[^A-Za-z%])"
)
_FACTORS = 3  # factors of a product that is written as one word
_TRIED = 64


def elsewhere(text: str) -> tuple[str, str, str] | None:
    """Return a known name that is no unit here, the reason, and what to write in its place."""
    for word in re.findall(r"[A-Za-z]+", text):
        found = ELSEWHERE.get(word if len(word) <= 2 else word.lower())
        if found:
            return word, *found
    return None


def spellings(text: str, names: Collection[str], likely: Collection[str]) -> Iterator[str]:
    """Yield units that a text may mean that is no unit, the likeliest first.

    ``names`` are the names of all units, ``likely`` the names of units of the wanted dimension. The unit
    variables of declarations are never suggested. Some of the texts are no units: the caller tries them.
    """
    known = [name for name in names if name not in VARIABLES]
    plain = re.sub(r"\s+per\s+|\s*/\s*", "/", text.replace("**", "^").strip())
    plain = re.sub(r"\s*\*\s*|(?<=[A-Za-z0-9)])(?:\s+|\.|-)(?=[A-Za-z(])", "*", plain)
    choices = [_choices(match, known, likely) for match in _PIECE.finditer(plain)]
    for chosen in itertools.islice(itertools.product(*choices), _TRIED):
        yield _joined(chosen)


def _choices(match: re.Match[str], names: Collection[str], likely: Collection[str]) -> list[str]:
    if match["sign"]:
        return [match["sign"]]
    power = (match["power"] or "").strip()
    power = f"^{power}" if power and power[0] != "^" else power
    return [meant + power for meant in dict.fromkeys(_meant(match["word"], names, likely))]


def _joined(pieces: tuple[str, ...]) -> str:
    """Return the pieces as one text; a product after '/' gets brackets."""
    text = ""
    for piece in pieces:
        text += f"({piece})" if "*" in piece and text.endswith("/") and piece != "*" else piece
    return text


def _meant(word: str, names: Collection[str], likely: Collection[str]) -> Iterator[str]:
    """Yield the units, or products of units, that a word may mean."""
    if word in names:
        yield word
        return
    yield from _spelt_out(word.lower(), names)
    if word[-1:] == "s" and len(word) > 3 and word[:-1] in names:
        yield word[:-1]
    products = ["*".join(parts) for parts in _split(word, names, _FACTORS)]
    if word != word.lower() or word.startswith("kg"):  # Nm, but not a mistyped 'hm'
        yield from products
    near = closest(word, WORDS) if len(word) > 3 else None
    if near is not None:
        yield WORDS[near]
    for candidates in (likely, names):
        near = closest(word, candidates)
        if near is not None and (len(word) > 1 or near.lower() == word.lower()):
            yield near
    yield from products


def _spelt_out(word: str, names: Collection[str]) -> Iterator[str]:
    for ending in ("", "s"):
        stem = word.removesuffix(ending)
        if stem in WORDS:
            yield WORDS[stem]
        for prefix, letter in PREFIX_WORDS.items():
            rest = stem.removeprefix(prefix)
            name = letter + WORDS.get(rest, rest)
            if rest != stem and name in names:
                yield name


def _split(word: str, names: Collection[str], most: int) -> list[list[str]]:
    """Return the ways to read a word as a product of at most ``most`` units, the likeliest first.

    In "Nms" the m is the metre, though ms is a unit as well; in "kNm" the k belongs to the newton.
    """
    whole = [[word]] if word in names else []
    if most == 1:
        return whole
    found = whole + [
        [word[:length], *rest]
        for length in range(len(word) - 1, 0, -1)
        if word[:length] in names
        for rest in _split(word[length:], names, most - 1)
    ]
    return sorted(found, key=lambda parts: (sum(part in PREFIXED for part in parts[1:]), len(parts)))
