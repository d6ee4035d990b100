"""Words about blocks, made from their declarations: `quadvis list` and `quadvis describe`."""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from quadvis.block import Block, Declared, Param
from quadvis.catalogue import Catalogue, CatalogueError


def first_line(block: type[Block]) -> str:
    """Return the sentence that says what a block does."""
    return (inspect.getdoc(block) or "").partition("\n")[0]


def catalogue_lines(catalogue: Catalogue) -> tuple[list[str], list[str]]:
    """Return one line per block, and one per block that cannot be loaded: those are told, never skipped."""
    rows, failures = [], []
    for name in catalogue.names():
        try:
            rows.append((name, first_line(catalogue.find(name))))
        except CatalogueError as error:
            failures.append(str(error))
    return table(rows), failures


def description(name: str, block: type[Block]) -> str:
    """Return a block's docstring, ports, parameters and states as text."""
    interface = block.interface
    parts = [f"{name}\n", inspect.getdoc(block) or "", ""]
    feedthrough = interface.feedthrough
    for title, items, extra in (
        ("inputs", interface.inputs, lambda port: "direct feedthrough" if port.name in feedthrough else ""),
        ("outputs", interface.outputs, lambda port: "NaN means missing" if port.nan else ""),
        ("parameters", interface.params, _param_words),
        ("states", interface.states, lambda state: "continuous" if state.continuous else ""),
    ):
        if items:
            rows = [(f"  {item.name}", item.type, _unit(item), extra(item), item.doc) for item in items.values()]
            parts += [f"{title}:", *table(rows), ""]
    return "\n".join(parts)


def facts(name: str, block: type[Block]) -> dict[str, Any]:
    """Return the same as plain data."""

    def plain(items: Iterable[Declared]) -> dict[str, Any]:
        return {item.name: {"type": item.type, "unit": item.unit, "doc": item.doc} for item in items}

    interface = block.interface
    params = plain(interface.params.values())
    for param in interface.params.values():
        params[param.name] |= {"default": default_text(param), "bounds": _bounds(param), "tune": param.tune}
        if param.choices:
            params[param.name]["choices"] = list(param.choices)
    return {
        "block": name,
        "doc": inspect.getdoc(block) or "",
        "inputs": plain(interface.inputs.values()),
        "outputs": plain(interface.outputs.values()),
        "params": params,
        "states": plain(interface.states.values()),
        "feedthrough": sorted(interface.feedthrough),
        "numeric": block.numeric,
    }


def _unit(item: Declared) -> str:
    return "" if item.unit == "1" else item.unit


def default_text(param: Param) -> str | None:
    """Return a parameter's default as a diagram would write it; None if it must be given."""
    if param.required:
        return None
    if param.is_text or param.choices:
        return str(param.default)
    value = np.asarray(param.default).tolist()
    text = str(value).lower() if isinstance(value, bool) else f"{value:g}" if isinstance(value, float) else str(value)
    return text if param.unit == "1" else f"{text} {param.unit}"


def _param_words(param: Param) -> str:
    words = [f"= {default_text(param)}" if not param.required else "required"]
    words += [" | ".join(param.choices)] if param.choices else []
    words += [_bounds(param)] if _bounds(param) else []
    words += ["tunable"] if param.tune else []
    return ", ".join(words)


def _bounds(param: Param) -> str:
    marks = ((param.min, ">="), (param.above, ">"), (param.max, "<="), (param.below, "<"))
    return ", ".join(f"{mark} {bound:g}" for bound, mark in marks if bound is not None)


def table(rows: Sequence[Sequence[str]]) -> list[str]:
    """Return rows with aligned columns; empty columns take no room."""
    if not rows:
        return []
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    kept = [column for column, width in enumerate(widths) if width]
    return ["  ".join(row[column].ljust(widths[column]) for column in kept).rstrip() for row in rows]
