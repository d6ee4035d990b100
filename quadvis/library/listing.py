"""One line for each block and each file that comes with quadvis, and the search in them: `quadvis list`.

A block of the standard library is not imported for that: its words are read from its file, which is quicker.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

from quadvis.errors import QuadvisError, quoted, suggestion
from quadvis.errors.synonyms import foreign_words, plain_word
from quadvis.library.catalogue import Catalogue, CatalogueError
from quadvis.library.shipped_files import first_sentence, shipped_texts
from quadvis.machine.columns import table

_CLASS = re.compile(r'^class (?!_)[^\n]*(?:\n    [^\n]*\n\))?:\n    r?"""(.*?)"""', re.MULTILINE | re.DOTALL)


class Listed(NamedTuple):
    """A block or a file: what it does in one sentence, and all words in which it may be found."""

    name: str
    headline: str
    text: str


def listed_blocks(catalogue: Catalogue) -> tuple[list[Listed], list[str]]:
    """Return all blocks by name, and a sentence for each that cannot be loaded."""
    found, failures = [], []
    for name in catalogue.names():
        try:
            doc = _written(catalogue.standard_file(name)) or inspect.getdoc(catalogue.find(name)) or ""
        except CatalogueError as error:
            failures.append(str(error))
            continue
        found.append(Listed(name, doc.partition("\n")[0], doc))
    return found, failures


def _written(file: Path | None) -> str:
    """Return the docstring of the block in a file; "" if it is not found."""
    match = _CLASS.search(file.read_text(encoding="utf-8")) if file is not None else None
    return inspect.cleandoc(match[1]) if match is not None else ""


def listed_files() -> list[Listed]:
    """Return the files that come with quadvis."""
    sentences = {name: first_sentence(text) for name, text in shipped_texts().items()}
    return [Listed(name, sentence, sentence) for name, sentence in sentences.items()]


def matching(listed: Iterable[Listed], words: Sequence[str]) -> list[Listed]:
    """Return what has all words, the likeliest first: in its name, as other programs call it, in its text.

    QuadvisError, with a suggestion, if nothing has.
    """
    everything = list(listed)
    ranked = [(rank, each) for each in everything if (rank := _rank(each, words)) is not None]
    if not ranked:
        remedy = suggestion(words[0], [each.name for each in everything]) or "quadvis list shows all"
        raise QuadvisError(f"nothing has {_named(words)}; {remedy}")
    return [each for _, each in sorted(ranked, key=lambda pair: pair[0])]


def _named(words: Sequence[str]) -> str:
    """Return words as they stand in a sentence."""
    named = " and ".join(map(quoted, words))
    return f"the {'word' if len(words) == 1 else 'words'} {named}"


def _rank(each: Listed, words: Sequence[str]) -> int | None:
    """Return how far a block or file is from the words; None if one of them is not there."""
    if plain_word("".join(words)) in foreign_words(each.name):  # such as "dead time"
        return 1
    ranks = [_rank_of_word(each, word.casefold()) for word in words]
    return None if None in ranks else sum(rank for rank in ranks if rank is not None)


def _rank_of_word(each: Listed, word: str) -> int | None:
    if word in each.name.casefold():
        return 0
    if plain_word(word) in foreign_words(each.name):
        return 1
    return 2 if word in each.text.casefold() else None


def lines(listed: Sequence[Listed], width: int | None = None) -> list[str]:
    """Return one line for each."""
    return table([(each.name, each.headline) for each in listed], width)
