"""`solver`: how continuous states are integrated."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Any, NamedTuple

from quadvis.diagram.parameters import named_parameters
from quadvis.diagram.sections.forms import QUANTITY, Schema, closed
from quadvis.diagram.sections.section import Checked, FileSection
from quadvis.diagram.times import read_step
from quadvis.document import YamlNode, YamlScalar
from quadvis.errors import UNKNOWN, Faults, Place, Unknown, known, quoted
from quadvis.graph.graph import SOLVERS, USUAL, VARIABLE, Tolerances

SOLVER_KEYS = ("method", "step", "rtol", "atol")
METHODS = (*SOLVERS, *VARIABLE)
METHOD = "ode4"  # where none is written
LEAST = 1e-13  # of rtol: below, rounding alone is larger
MEANT = {  # what Simulink, and others, call these
    "ode45": "RK45", "ode23": "RK45", "rk4": "ode4", "euler": "ode1", "heun": "ode2",
    "ode15s": "BDF", "ode23s": "Radau", "ode23t": "Radau", "ode23tb": "Radau", "ode14x": "Radau",
    "implicit": "Radau", "cvode": "BDF",
}  # fmt: skip


class SolverSpec(NamedTuple):
    """The method and the step (s) of the solver, and where the step is written.

    ``node`` is the step as it is written; if that names a parameter, `timing` reads it.
    """

    method: str = METHOD
    step: Fraction | Unknown | None = None
    place: Place | None = None
    node: YamlNode | None = None
    tolerances: Tolerances = USUAL


class SolverSection(FileSection[SolverSpec]):
    """The solver of a diagram."""

    key = "solver"
    words = (
        "`{method: ode1 to ode4, step: 5 ms}` for continuous blocks; the step divides every period, "
        "and may be a parameter, `$name`; or a `method` of variable step, RK45, Radau, BDF or LSODA, with "
        "`rtol` and `atol`; `--set solver.step=...` and the like replace each of them"
    )

    def read(self, node: YamlNode | None, faults: Faults) -> SolverSpec:
        """Return method, step and tolerances."""
        fields = faults.collect(node.fields, (), SOLVER_KEYS, faults) if node is not None else None
        if fields is None:
            return SolverSpec(step=UNKNOWN if node is not None else None)
        method = faults.collect(read_method, fields["method"]) if "method" in fields else None
        tolerances = read_tolerances(fields.values, method or METHOD, faults)
        found = SolverSpec(method or METHOD, tolerances=tolerances)
        if "step" not in fields:
            return found
        written = fields["step"]
        step = UNKNOWN if named_parameters(written) else faults.read(read_step, written)
        return found._replace(step=step, place=written.place, node=written)

    def schema(self) -> Schema:
        """Return the schema: method, step and tolerances."""
        return closed(SOLVER_KEYS, {
            "method": {
                "enum": list(METHODS),
                "description": "ode1 to ode4: of fixed step, named as in Simulink; the others choose their "
                "steps, as in scipy; for stiff equations Radau and BDF",
            },
            "step": {**QUANTITY, "description": "such as 5 ms; it divides every period"},
            "rtol": {**QUANTITY, "description": "of such a method: the error of a step, relative to a state"},
            "atol": {**QUANTITY, "description": "of such a method: the error in the SI unit of each state"},
        })  # fmt: skip

    def resolved(self, diagram: Checked) -> Any:
        """Return method and step if anything is continuous."""
        graph = diagram.graph
        if graph.step is None:
            return None
        tolerances = graph.tolerances._asdict() if graph.solver in VARIABLE else {}
        return {"method": graph.solver, "step": f"{graph.step} s", **tolerances}


def read_method(node: YamlNode) -> str:
    """Read a method, in small or capital letters; one that another program calls otherwise is suggested."""
    text = node.value.lower() if isinstance(node, YamlScalar) else ""
    if (meant := MEANT.get(text)) is not None:
        raise node.fault(f"there is no method {quoted(node.text())}", f"did you mean '{meant}'?")
    return next((each for each in METHODS if each.lower() == text), "") or node.choice(METHODS)


def read_tolerances(
    fields: Mapping[str, YamlNode], method: str, faults: Faults, before: Tolerances = USUAL
) -> Tolerances:
    """Read the tolerances, which a method of fixed step does not have; ``before`` are those not written."""
    read: dict[str, float] = {}
    for name in Tolerances._fields:
        if name not in fields:
            continue
        node = fields[name]
        if method not in VARIABLE:
            remedy = f"leave it out, or choose one of {', '.join(VARIABLE)}"
            faults.add(
                node.place, f"'{name}' is for a method that chooses its steps, not for {method}", remedy
            )
            continue
        value = faults.read(_tolerance, node)
        if known(value):
            read[name] = value
    return before._replace(**read)


def _tolerance(node: YamlNode) -> float:
    value = node.quantity()
    if not (LEAST if node.key == "rtol" else 0.0) <= value < 1.0 or value == 0.0:
        least = f"{LEAST:g}" if node.key == "rtol" else "0"
        raise node.fault(f"'{node.key}' must be above {least} and below 1", "write such as 1e-6")
    return value


SOLVER = SolverSection()
