"""Every numeric block of the library as machine code.

Each is taken as its example has it, or in the first shape of its conformance tests if it has none.
"""

from __future__ import annotations

from benchmarks.rows import ROOT
from quadvis.api import load_text
from quadvis.block import Block
from quadvis.engine.engine import Engine
from quadvis.library.catalogue import Catalogue
from quadvis.library.describe import example_diagram
from quadvis.native.library import block_types, library
from quadvis.testing.rig import Subject, rigs

# Of the parameters that have no default.
VALUES = {
    "calibration": str(ROOT / "diagrams" / "calib" / "camera.yaml"),
    "colours": str(ROOT / "diagrams" / "calib" / "colours.yaml"),
    "times": [0.0, 0.35, 1.0],
    "values": [[1.0, 2.0], [3.0, -1.0], [0.0, 0.0]],
    "during": [[0.3, 0.6]],
}


def compile_all() -> int:
    """Compile all that is not kept yet; return the number of blocks."""
    catalogue = Catalogue()
    found = {name: block for name in catalogue.names() if (block := catalogue.find(name)).numeric}
    for name, block in found.items():
        engine = _example(name, block) if block.example else _alone(block)
        kinds = block_types(engine.program, [node.block for node in engine.graph.nodes])
        library().prepare(kinds.values())
    library().loop()
    return len(found)


def _example(name: str, block: type[Block]) -> Engine:
    diagram = load_text(example_diagram(name, block))
    return Engine(diagram.graph, diagram.seed)


def _alone(block: type[Block]) -> Engine:
    required = [name for name, param in block.interface.params.items() if param.required]
    return next(rigs(Subject(block, {name: VALUES[name] for name in required}))).engine
