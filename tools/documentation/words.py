"""The words of other programs beside ours, from the table by which faults suggest ours."""

from __future__ import annotations

from collections.abc import Collection

from documentation.markdown import code, escaped, table
from quadvis.errors.synonyms import foreign_names
from quadvis.library.catalogue import Catalogue
from quadvis.library.describe import first_line


def words(blocks: Collection[str]) -> str:
    """Return two tables: the blocks that other programs call otherwise, and the keys of a diagram."""
    named = foreign_names()
    catalogue = Catalogue()
    rows = [
        (
            ", ".join(map(code, theirs)),
            f"[{ours}](../blocks/{ours.replace('.', '/')}.md)",
            escaped(first_line(catalogue.find(ours))),
        )
        for ours, theirs in named.items()
        if ours in blocks
    ]
    keys = [
        (", ".join(map(code, theirs)), code(ours)) for ours, theirs in named.items() if ours not in blocks
    ]
    return (
        f"\n## Blocks\n\n{table(('there', 'here', 'what it does'), rows)}\n"
        f"\n## Keys of a diagram\n\n{table(('there', 'here'), keys)}\n"
    )
