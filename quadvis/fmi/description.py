"""What an FMU says about itself, as plain data: its variables, their units, and how it can be run.

Sources: Functional Mock-up Interface for Model Exchange and Co-Simulation, version 2.0.4, chapter 2.2;
Functional Mock-up Interface Specification, version 3.0.2, chapter 2.4.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

Number = float | int | bool | str
INTEGERS = ("Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64")
REALS = ("Float64", "Float32")


@dataclass(frozen=True)
class FmuUnit:
    """A unit of an FMU: a value v of it is ``factor * v + offset`` in the product of powers ``exponents``.

    ``exponents`` is None where the FMU names the unit and does not say what it is.
    """

    name: str
    exponents: Mapping[str, int] | None = None
    factor: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class FmuVariable:
    """A variable of an FMU.

    ``kind`` is the name of its type as in FMI 3.0 (Float64, Int32, Boolean, Enumeration, String ...), in FMI
    2.0 likewise. ``index`` counts the variables from 1. ``start`` has one value for each element. ``unit`` is
    "" if the FMU says nothing; ``relative`` says of a unit with an offset that a value is a difference.
    ``derivative_of`` is the value reference (FMI 3.0) or the index (2.0) of the state, or 0.
    """

    name: str
    index: int
    reference: int
    kind: str
    causality: str
    variability: str
    initial: str
    start: tuple[Number, ...] | None = None
    unit: str = ""
    relative: bool = False
    least: float | None = None
    most: float | None = None
    text: str = ""
    dimensions: tuple[int, ...] = ()
    derivative_of: int = 0
    line: int = 0


@dataclass(frozen=True)
class FmuInterface:
    """What an FMU offers for co-simulation, or for model exchange.

    ``identifier`` is the name of its library. ``step`` is the step (s) with which it integrates by itself; 0
    if it does not say.
    """

    identifier: str
    saves_state: bool = False
    serialises: bool = False
    needs_tool: bool = False
    once_per_process: bool = False
    step: float = 0.0
    completed_step: bool = True


@dataclass(frozen=True)
class FmuDescription:
    """An FMU, as its description has it. ``version`` is 2 or 3.

    ``dependencies`` has the outputs and the derivatives of states, by value reference (FMI 3.0) or index
    (2.0), each with what it depends on; None if it may depend on everything. ``states`` are the derivatives
    among them. ``start``, ``stop`` and ``step`` (s) are those of the experiment that it suggests.
    """

    version: int
    name: str
    token: str
    generator: str
    cosimulation: FmuInterface | None
    exchange: FmuInterface | None
    scheduled: bool
    units: Mapping[str, FmuUnit]
    variables: tuple[FmuVariable, ...]
    dependencies: Mapping[int, frozenset[int] | None] = field(default_factory=dict)
    outputs: tuple[int, ...] = ()
    states: tuple[int, ...] = ()
    indicators: int = 0
    start: float = 0.0
    stop: float | None = None
    step: float | None = None

    def key(self, variable: FmuVariable) -> int:
        """Return by what the structure names a variable: its index in FMI 2.0, its reference in 3.0."""
        return variable.index if self.version == 2 else variable.reference

    def depends(self, output: FmuVariable, other: FmuVariable) -> bool:
        """Return whether an output may follow another variable at the same instant."""
        known = self.dependencies.get(self.key(output))
        return known is None or self.key(other) in known
