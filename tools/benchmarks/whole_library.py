"""Every numeric block of the library as machine code, each in the first shape of its conformance tests."""

from __future__ import annotations

from benchmarks.rows import ROOT
from quadvis.library.catalogue import Catalogue
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
    found = [block for block in map(catalogue.find, catalogue.names()) if block.numeric]
    for block in found:
        required = [name for name, param in block.interface.params.items() if param.required]
        engine = next(rigs(Subject(block, {name: VALUES[name] for name in required}))).engine
        kinds = block_types(engine.program, [node.block for node in engine.graph.nodes])
        library().prepare(kinds.values())
    library().loop()
    return len(found)
