"""`solver`: how continuous states are integrated."""

from __future__ import annotations

from fractions import Fraction
from typing import Any, NamedTuple

from quadvis.diagram.parameters import named_parameters
from quadvis.diagram.sections.forms import QUANTITY, Schema, closed
from quadvis.diagram.sections.section import Checked, FileSection
from quadvis.diagram.times import read_step
from quadvis.document import YamlNode
from quadvis.errors import UNKNOWN, Faults, Place, Unknown
from quadvis.graph.graph import SOLVERS

SOLVER_KEYS = ("method", "step")
METHOD = "ode4"  # where none is written


class SolverSpec(NamedTuple):
    """The method and the step (s) of the solver, and where the step is written.

    ``node`` is the step as it is written; if that names a parameter, `timing` reads it.
    """

    method: str = METHOD
    step: Fraction | Unknown | None = None
    place: Place | None = None
    node: YamlNode | None = None


class SolverSection(FileSection[SolverSpec]):
    """The solver of a diagram."""

    key = "solver"
    words = (
        "`{method: ode1 to ode4, step: 5 ms}` for continuous blocks; the step divides every period, "
        "and may be a parameter, `$name`; `--set solver.step=...` replaces it"
    )

    def read(self, node: YamlNode | None, faults: Faults) -> SolverSpec:
        """Return method and step."""
        fields = faults.collect(node.fields, (), SOLVER_KEYS, faults) if node is not None else None
        if fields is None:
            return SolverSpec(step=UNKNOWN if node is not None else None)
        method = faults.collect(fields["method"].choice, SOLVERS) if "method" in fields else None
        if "step" not in fields:
            return SolverSpec(method or METHOD)
        written = fields["step"]
        step = UNKNOWN if named_parameters(written) else faults.read(read_step, written)
        return SolverSpec(method or METHOD, step, written.place, written)

    def schema(self) -> Schema:
        """Return the schema: method and step."""
        return closed(SOLVER_KEYS, {
            "method": {"enum": list(SOLVERS), "description": "fixed-step solver, named as in Simulink"},
            "step": {**QUANTITY, "description": "such as 5 ms; it divides every period"},
        })  # fmt: skip

    def resolved(self, diagram: Checked) -> Any:
        """Return method and step if anything is continuous."""
        graph = diagram.graph
        return {"method": graph.solver, "step": f"{graph.step} s"} if graph.step is not None else None


SOLVER = SolverSection()
