"""The parameters of an application: what they are, their present values, and sets of them as files."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from quadvis.block import Param
from quadvis.diagram.diagram import Diagram
from quadvis.diagram.sections.block_text import quantity
from quadvis.document import dump_yaml, read_yaml
from quadvis.engine.program import Tunable, make_program
from quadvis.engine.tuning import Acceptance, NewValue
from quadvis.errors import Faults, QuadvisError, quoted, sentence, suggestion
from quadvis.graph.graph import Node
from quadvis.machine.files import Kind, write_output

SET = Kind("the parameter set", (b"quadvis:",), rb"quadvis: 1")


class Parameters:
    """The parameters of a loaded application with the values that they have now, in SI units.

    A value that was tuned stays when the application is started again.
    """

    def __init__(self, diagram: Diagram) -> None:
        self._diagram = diagram
        self._tuned: dict[tuple[str, str], Any] = {}

    @property
    def tuned(self) -> list[NewValue]:
        """What differs from the diagram."""
        return [NewValue(path, name, value) for (path, name), value in self._tuned.items()]

    def check(self, group: Sequence[NewValue]) -> None:
        """Check new values against declarations and the values in force; ParameterError if one is wrong."""
        graph = self._diagram.graph
        program = make_program(graph, self._diagram.seed)
        blocks = {node.path: node.block for node in graph.nodes}
        Acceptance(program.tunables, blocks, self._in_force).accept(group)

    def _in_force(self, tunable: Tunable) -> Any:
        """Return a value as the methods of its block see it."""
        value = self.value(tunable.path, tunable.name)
        param = self._diagram.graph[tunable.path].block.interface.params[tunable.name]
        return param.choices.index(value) if param.choices else value

    def took(self, group: Iterable[NewValue]) -> None:
        """Note values that parameters have taken."""
        for path, name, value in group:
            self._tuned[path, name] = value

    @property
    def names(self) -> list[str]:
        """All names, such as "control/roll.bandwidth"."""
        return [f"{node.path}.{name}" for node, name, _ in self._all()]

    def facts(self) -> list[dict[str, Any]]:
        """Return what there is to know of each parameter, with its present value as a diagram writes it."""
        return [
            {
                "name": f"{node.path}.{name}",
                "value": self.text(node.path, name),
                "unit": param.unit,
                "tunable": param.tune,
                "min": _first(param.min, param.above),
                "max": _first(param.max, param.below),
                "choices": list(param.choices),
                "doc": param.doc,
                "block": node.kind,
            }
            for node, name, param in self._all()
        ]

    def text(self, path: str, name: str) -> Any:
        """Return the present value of a parameter as a diagram writes it."""
        return self.written(path, name, self.value(path, name))

    def written(self, path: str, name: str, value: Any) -> Any:
        """Return a value of a parameter as a diagram writes it."""
        node = self._diagram.graph[path]
        param = node.block.interface.params[name]
        return value if param.choices or param.is_text else quantity(node, name, value)

    def value(self, path: str, name: str) -> Any:
        """Return the present value of a parameter in SI units, the name of a choice."""
        block = self._diagram.graph[path].block
        param = block.interface.params[name]
        if (path, name) in self._tuned:
            return self._tuned[path, name]
        value = getattr(block, name)
        return param.choices[value] if param.choices else value

    def find(self, name: str) -> tuple[str, str]:
        """Return the block and the parameter that a name means; QuadvisError if there is none.

        A parameter of a part or of the diagram means the first parameter of a block that has its value.
        """
        names, knobs = self.names, self._diagram.knobs
        if name not in names and (knob := knobs.get(name)) is not None and knob.targets:
            return knob.targets[0]
        path, _, parameter = name.rpartition(".")
        if name not in names:
            remedy = suggestion(name, [*names, *knobs])
            raise QuadvisError(sentence(f"there is no parameter {quoted(name)}", remedy))
        return path, parameter

    def _all(self) -> Iterator[tuple[Node, str, Param]]:
        for node in self._diagram.graph.nodes:
            if not node.hidden:
                for name, param in node.block.interface.params.items():
                    yield node, name, param

    # sets

    def save(self, path: Path) -> None:
        """Write the present values of all that can be tuned as a parameter file of this name."""
        values = {
            f"{node.path}.{name}": self.text(node.path, name)
            for node, name, param in self._all()
            if param.tune
        }
        self.keep(path, values)

    def keep(self, path: Path, values: Mapping[str, Any]) -> None:
        """Write values as a parameter file of this name."""
        about = f"{self._diagram.name}, as tuned on the target; diagram {self._diagram.hash[:12]}"
        write_set(path, values, about)


def write_set(path: Path, values: Mapping[str, Any], about: str) -> None:
    """Write a parameter set, which is a parameter file for `quadvis run --params`, too."""
    text = dump_yaml({"quadvis": 1, "name": path.stem, "doc": about, "set": dict(values)})
    write_output(path, SET, text)


def read_set(path: Path) -> dict[str, Any]:
    """Return the values of a parameter set by name, as texts and lists for `tune`."""
    faults = Faults()
    root = read_yaml(path, faults)
    faults.check()
    plain = root.to_python()
    found = plain.get("set") if isinstance(plain, dict) else None
    if not isinstance(found, dict):
        raise QuadvisError(f"the parameter set {quoted(path.stem)} has no key 'set'")
    return found


def as_written(value: Any) -> Any:
    """Return a value of a set as a setting is written: ``{value: [1, 2], unit: m}`` as one text."""
    return f"{{value: {value['value']}, unit: {value['unit']}}}" if isinstance(value, dict) else value


def _first(*values: float | None) -> float | None:
    return next((value for value in values if value is not None), None)
