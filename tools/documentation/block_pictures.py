"""The pictures of a block's page: the diagram of its example, and what its signals do when that runs.

They are kept by all that they are made of: the example, the block with the modules beside it, and quadvis.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import inspect
import tempfile
from collections.abc import Iterable
from pathlib import Path

import numpy as np

import quadvis
import quadvis_blocks
from quadvis.api import load_text
from quadvis.block import Block
from quadvis.graph.graph import Node, Wire
from quadvis.graph.names import index_text, wire_text
from quadvis.library.catalogue import Catalogue
from quadvis.library.describe import example_diagram, only_checked
from quadvis.output.figures import Figure, Panel, Trace
from quadvis.output.plot import plot_figures
from quadvis.units import Unit, parse_units

MOST_ELEMENTS = 12  # of a signal that is drawn; more would hide each other
MOST_TRACES = 8
NAMES = ("diagram.svg", "response.svg")


def draw_block(name: str, cache: Path) -> None:
    """Put the pictures of a block of the standard library into the cache."""
    pictures(name, Catalogue().find(name), cache)


def pictures(name: str, block: type[Block], cache: Path) -> dict[str, bytes]:
    """Return the pictures of a block by file name; none if its example needs what may not be here."""
    text = example_diagram(name, block)
    if not text or block.example_needs:
        return {}
    folder = cache / _key(text, block)
    if not folder.is_dir():
        cache.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=cache) as made:
            whole = Path(made, "whole")
            whole.mkdir()
            _draw(name, text, whole, runs=not only_checked(block))
            with contextlib.suppress(OSError):  # another build was sooner
                whole.rename(folder)
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


def _draw(name: str, text: str, folder: Path, *, runs: bool) -> None:
    diagram = load_text(text, folder.parent)  # what it writes is no picture
    (folder / "diagram.svg").write_text(diagram.draw(), encoding="utf-8")
    if not runs:
        return
    result = diagram.run()
    (node, *_) = (node for node in diagram.graph.nodes if node.kind == name)
    traces = [one for trace in _traces(node) if _is_shown(result, trace) for one in _by_unit(result, trace)]
    if traces := traces[:MOST_TRACES]:
        plot_figures(result.signals, [Figure(name, _panels(result, traces))], folder / "response.svg")


def _panels(result: quadvis.Result, traces: Iterable[Trace]) -> tuple[Panel, ...]:
    """Return a panel for each dimension; elements may have units of their own."""
    alike: list[tuple[Unit, list[Trace]]] = []
    for trace in traces:
        wire = trace.signal
        units = parse_units(result.units[wire.source])
        shape = result[wire.source].shape[1:]
        first = np.arange(len(units)).reshape(shape)[wire.index].flat[0] if len(units) > 1 else 0
        unit = units[int(first)]
        same = next((found for shown, found in alike if shown.dimension_equals(unit)), None)
        if same is None:
            alike.append((unit, same := []))
        same.append(trace)
    return tuple(Panel(tuple(found), unit=unit) for unit, found in alike)


def _traces(node: Node) -> Iterable[Trace]:
    """Yield the signals that come into a block, and its outputs."""
    for port, wire in node.wires():
        yield Trace(wire, f"{port} = {wire_text(wire)}")
    for port in node.block.interface.outputs:
        yield Trace(Wire(node.path, port), f"{node.path}.{port}")


def _is_shown(result: quadvis.Result, trace: Trace) -> bool:
    """Return whether a signal is recorded and has few elements."""
    if trace.signal.source not in result:
        return False
    values = result[trace.signal.source]
    return values[0].size <= MOST_ELEMENTS if len(values) else False


def _by_unit(result: quadvis.Result, trace: Trace) -> list[Trace]:
    """Return a signal as it is, or element by element if these have units of their own."""
    wire, label = trace
    shape = result[wire.source].shape[1:]
    if wire.index or " " not in result.units[wire.source] or not shape:
        return [trace]
    return [
        Trace(Wire(wire.block, wire.port, index), label + index_text(index)) for index in np.ndindex(shape)
    ]


def _key(text: str, block: type[Block]) -> str:
    module = Path(inspect.getfile(block))
    beside = [module, *sorted(module.parent.glob("_*.py"))]
    texts = [text.encode(), common(), *(path.read_bytes() for path in beside)]
    return hashlib.sha256(b"\0".join(texts)).hexdigest()[:24]


@functools.cache
def common() -> bytes:
    """Return a hash of what all pictures are made with: quadvis, the shared modules of blocks, this file."""
    roots = [(Path(quadvis.__file__).parent, "**/*.py"), (Path(quadvis_blocks.__file__).parent, "_*.py")]
    files = [Path(__file__), *(path for root, kind in roots for path in sorted(root.glob(kind)))]
    found = hashlib.sha256()
    for path in files:
        found.update(path.read_bytes())
    return found.digest()
