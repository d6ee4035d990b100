"""Admission: whether a target runs an application, from what the bundle says and what is installed here."""

from __future__ import annotations

import hashlib
import inspect
import os
from dataclasses import replace
from pathlib import Path

from quadvis.diagram.diagram import Diagram
from quadvis.diagram.knobs import Knob
from quadvis.diagram.load import load_text
from quadvis.errors import QuadvisError, quoted
from quadvis.graph.graph import Node
from quadvis.machine.shipped import is_shipped
from quadvis.target.bundle import ApplicationBundle
from quadvis.version import __version__


def admit(bundle: ApplicationBundle, place: Path) -> Diagram:
    """Return the diagram of a bundle whose file stands at a place; QuadvisError if it may not run here.

    Its blocks must be installed, from the same source as on the host. Its files stay in its folder.
    """
    diagram = load_text(bundle.text, place.parent, place.name, own_blocks=False)
    tree = place
    for _ in Path(bundle.place).parts:
        tree = tree.parent
    for kind, digest in sources_of(diagram).items():
        if bundle.sources.get(kind) != digest:
            problem = f"the block {quoted(kind)} is not the same on host and target"
            raise QuadvisError(f"{problem}{_versions(bundle)}")
    for node in diagram.graph.nodes:
        _check_paths(node, tree)
    if diagram.hash != bundle.hash:
        raise QuadvisError(f"the diagram reads otherwise here than on the host{_versions(bundle)}")
    computers = diagram.graph.computers
    for each in bundle.computers:
        if each not in computers:
            raise QuadvisError(f"the diagram has no computer {quoted(each)}; it has {', '.join(computers)}")
    here = tuple(each for each in computers if each in bundle.computers)
    return replace(diagram, ports=_ports(bundle, diagram), knobs=_knobs(bundle, diagram), here=here)


def _ports(bundle: ApplicationBundle, diagram: Diagram) -> dict[str, str]:
    """Return the ports of parts whose signals are there."""
    signals = {f"{node.path}.{port}" for node in diagram.graph.nodes for port in node.block.interface.outputs}
    return {name: str(of) for name, of in bundle.ports.items() if str(of).partition("[")[0] in signals}


def _knobs(bundle: ApplicationBundle, diagram: Diagram) -> dict[str, Knob]:
    """Return the parameters of parts and of the diagram; QuadvisError if they mean what is not there."""
    found = {}
    for name, plain in bundle.knobs.items():
        try:
            targets, elsewhere = plain
            knob = Knob(tuple((str(path), str(own)) for path, own in targets), tuple(map(str, elsewhere)))
            known = all(own in diagram.graph[path].block.interface.params for path, own in knob.targets)
        except (TypeError, ValueError, LookupError):
            known = False
        if not known:
            raise QuadvisError(f"the bundle's parameter {quoted(name)} means none of the diagram's blocks")
        found[name] = knob
    return found


def sources_of(diagram: Diagram) -> dict[str, str]:
    """Return the SHA-256 of the Python file that defines each block of a diagram, by the block's name."""
    made = {node.kind: type(node.block) for node in diagram.graph.nodes if not node.origin}
    return {
        kind: hashlib.sha256(Path(inspect.getfile(block)).read_bytes()).hexdigest()
        for kind, block in made.items()
    }


def _check_paths(node: Node, tree: Path) -> None:
    """Refuse a block that reads or writes outside the folder of the application."""
    for param in node.block.interface.params.values():
        if not param.is_file or not getattr(node.block, param.name):  # "" is no file
            continue
        path = os.path.realpath(getattr(node.block, param.name))
        inside = path.startswith(os.path.realpath(tree) + os.sep)
        if not inside and not (is_shipped(path) and not param.writes):
            raise QuadvisError(
                f"block {quoted(node.path)}: {param.name} names a file outside the application's folder"
            )


def _versions(bundle: ApplicationBundle) -> str:
    if bundle.version == __version__:
        return ": install the same quadvis and the same blocks on both"
    return f": the host has quadvis {bundle.version}, the target {__version__}; install the same"
