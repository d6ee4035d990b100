"""A page for each block and each group of blocks, made of what the catalogue declares."""

from __future__ import annotations

import inspect
from collections.abc import Mapping, Sequence

from documentation.markdown import code, escaped, from_docstring, table
from quadvis.block import Block
from quadvis.errors.synonyms import foreign_words
from quadvis.library.describe import (
    declarations,
    example,
    example_diagram,
    first_line,
    only_checked,
    tags,
)

COLUMNS = {
    "inputs": ("input", "type and unit", "", "what it is"),
    "outputs": ("output", "type and unit", "", "what it is"),
    "parameters": ("parameter", "type and unit", "default", "bounds", "what it is"),
    "states": ("state", "type and unit", "", "what it is"),
}
CAPTIONS = {
    "diagram.svg": ("The example as a diagram", "as `quadvis draw` shows it"),
    "response.svg": ("Response", "what comes into the block and what it gives, from a run of the example"),
}


def block_page(name: str, block: type[Block], pictures: Sequence[str], used: Mapping[str, str]) -> str:
    """Return the page of a block; ``used`` are the pages of the shipped files that have it, by name."""
    parts = [f"# {name}", from_docstring(inspect.getdoc(block) or "")]
    parts += [f"**{tag.capitalize()}:** {escaped(reason)}" for tag, reason in tags(block).items()]
    parts += [_declared(kind, rows) for kind, rows in declarations(block).items() if rows]
    parts += _example(name, block, pictures)
    if used:
        listed = ", ".join(f"[{file}]({page})" for file, page in used.items())
        parts.append(f"## Where it is used\n\n{listed}")
    if words := foreign_words(name):
        parts.append(f"Other programs call it {', '.join(map(code, words))}.")
    return "\n\n".join(parts) + "\n"


def group_page(group: str, text: str, blocks: Mapping[str, type[Block]]) -> str:
    """Return the page of a group: its blocks by name, each with its first sentence."""
    rows = [
        (f"[{name}]({name.rpartition('.')[2]}.md)", escaped(first_line(block)))
        for name, block in blocks.items()
    ]
    listed = table(("block", "what it does"), rows)
    return f"# {group}\n\n{text}\n\n{listed}\n{contents([name.rpartition('.')[2] for name in blocks])}"


def contents(pages: Sequence[str], caption: str = "") -> str:
    """Return a table of contents, which the margin of every page shows."""
    title = f":caption: {caption}\n" if caption else ""
    return f"\n```{{toctree}}\n:hidden:\n{title}\n" + "\n".join(pages) + "\n```\n"


def _declared(kind: str, rows: Sequence[Sequence[str]]) -> str:
    head = COLUMNS[kind]
    cells = [
        [code(row[0]), *(_shown(title, cell) for title, cell in zip(head[1:], row[1:], strict=True))]
        for row in rows
    ]
    return f"## {kind.capitalize()}\n\n{table(head, cells)}"


def _shown(title: str, cell: str) -> str:
    """Return a cell: what a diagram could hold stands in code."""
    return code(cell.removeprefix("= ")) if title in {"type and unit", "default"} else escaped(cell)


def _words(file: str, reason: str) -> str:
    """Return what can be done with an example."""
    if reason:
        return f"`quadvis check {file}.yaml` accepts this diagram; a simulation does not run it: {reason}."
    return f"This diagram runs: `quadvis run {file}.yaml`."


def _example(name: str, block: type[Block], pictures: Sequence[str]) -> list[str]:
    runs = example_diagram(name, block)
    text = runs or "\n".join(example(name, block)) + "\n"
    words = (
        _words(name.rpartition(".")[2], only_checked(block))
        if runs
        else "What an entry in a diagram must have:"
    )
    parts = [f"## In a diagram\n\n{words}\n\n```yaml\n{text}```"]
    for picture in pictures:
        title, caption = CAPTIONS[picture]
        file = f"{name.rpartition('.')[2]}-{picture}"
        parts.append(f"### {title}\n\n![{title} of {name}]({file})\n\n*{caption}*")
    return parts
