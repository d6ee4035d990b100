"""What can be tuned in a run, by the names and the values that people write."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from quadvis.block import Param, entry_name
from quadvis.diagram.diagram import Diagram
from quadvis.diagram.knobs import Knob
from quadvis.diagram.parameters import read_constant
from quadvis.diagram.settings import read_setting
from quadvis.diagram.values import read_numbers
from quadvis.engine.tuning import NewValue
from quadvis.errors import Faults, Place, QuadvisError, known, quoted, sentence, suggestion
from quadvis.graph.graph import Index, Node
from quadvis.graph.names import read_name

SHOWN = 3  # of what stands against a new value


def new_values(diagram: Diagram, given: Mapping[str, Any]) -> list[NewValue]:
    """Return the parameters of blocks that get new values, which hold together.

    A name is that of a parameter of a block, such as "control/roll.bandwidth", of a part, such as
    "control.bandwidth", or of the diagram, "bandwidth". A value is a text in any unit of the parameter's,
    "2.5 rad/s", or a value in SI units. QuadvisError says what is wrong with a name or a text, or that a
    parameter gives its value to something that cannot change in a run; the value is checked by the block.
    """
    return [new for name, value in given.items() for new in _new_values(diagram, name, value)]


def find_value(diagram: Diagram, name: str) -> tuple[str, str, Index]:
    """Return the block, the name within it, and the index; QuadvisError if nothing has the name.

    Names are those of signals, also at the ports of parts, of parameters and of states. That of a parameter
    of a part or of the diagram means the first parameter of a block that has its value.
    """
    knob = diagram.knobs.get(name)
    if knob is not None and knob.targets:
        return (*knob.targets[0], ())
    nodes = diagram.graph.nodes
    head, bracket, tail = name.partition("[")
    wire = read_name(diagram.ports.get(head, head) + bracket + tail)
    if wire is None or wire.block not in (node.path for node in nodes):
        outputs = [f"{node.path}.{port}" for node in nodes for port in node.block.interface.outputs]
        names = [*outputs, *diagram.ports, *tunable_names(diagram)]
        raise QuadvisError(sentence(f"this run has no {quoted(name)}", suggestion(head, names)))
    interface = diagram.graph[wire.block].block.interface
    names = [*interface.outputs, *interface.inputs, *interface.params, *interface.states]
    port, index = wire.port, wire.index
    if index and isinstance(index[0], int) and entry_name(port, index[0]) in interface.inputs:
        port, index = entry_name(port, index[0]), index[1:]
    if port not in names:
        raise QuadvisError(
            sentence(f"block '{wire.block}' has no '{wire.port}'", suggestion(wire.port, names))
        )
    return wire.block, port, index


def tunable_names(diagram: Diagram) -> list[str]:
    """Return the names of all that can be tuned: parameters of blocks, of parts and of the diagram."""
    own = [f"{node.path}.{param.name}" for node in diagram.graph.nodes for param in _tunable(node)]
    return [*own, *(name for name, knob in diagram.knobs.items() if _is_free(diagram, knob))]


def _new_values(diagram: Diagram, name: str, value: Any) -> list[NewValue]:
    knob = diagram.knobs.get(name)
    if knob is not None:
        return _of_knob(diagram, name, knob, value)
    path, parameter, index = find_value(diagram, name)
    if index:
        raise QuadvisError(f"{quoted(name)} is a part of a parameter; give all of it")
    node = diagram.graph[path]
    params = node.block.interface.params
    if parameter not in params:
        remedy = suggestion(name, tunable_names(diagram)) or "only parameters can be tuned"
        raise QuadvisError(f"{quoted(name)} is no parameter; {remedy}")
    return [NewValue(path, parameter, _value(node, params[parameter], name, value))]


def _of_knob(diagram: Diagram, name: str, knob: Knob, value: Any) -> list[NewValue]:
    """Return the new values of all parameters of blocks that have that of a part or of the diagram."""
    obstacles = _obstacles(diagram, knob)
    if not knob.targets and not obstacles:
        raise QuadvisError(f"{quoted(name)} cannot be tuned, since no block has its value")
    if obstacles:
        some = ", ".join(obstacles[:SHOWN]) + (", ..." if len(obstacles) > SHOWN else "")
        raise QuadvisError(f"{quoted(name)} cannot be tuned, since it also gives its value to {some}")
    found = []
    for path, parameter in knob.targets:
        node = diagram.graph[path]
        param = node.block.interface.params[parameter]
        found.append(NewValue(path, parameter, _value(node, param, name, value)))
    return found


def _is_free(diagram: Diagram, knob: Knob) -> bool:
    return bool(knob.targets) and not _obstacles(diagram, knob)


def _obstacles(diagram: Diagram, knob: Knob) -> list[str]:
    """Return what has a parameter's value and cannot change in a run, in words."""
    fixed = [
        f"'{path}.{name}'"
        for path, name in knob.targets
        if name not in (param.name for param in _tunable(diagram.graph[path]))
    ]
    return [*fixed, *knob.elsewhere]


def _tunable(node: Node) -> Iterator[Param]:
    yield from (param for param in node.block.interface.params.values() if param.tune and not param.is_text)


def _value(node: Node, param: Param, name: str, value: Any) -> Any:
    """Return a value in SI units, read from a text in the parameter's unit or taken as it is."""
    if not isinstance(value, str) or param.is_text or param.choices:
        return value
    faults = Faults()
    written = read_constant(read_setting(value, param.name, Place(name)), faults)
    faults.check()
    assert known(written)
    return read_numbers(param, node.units[param.name], written)[0]
