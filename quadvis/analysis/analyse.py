"""`quadvis analyse`: a diagram's closed loop, linearised; its poles, margins, transfers, and limits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from quadvis.analysis.linearise import Linear, linearised
from quadvis.analysis.loops import AnalysisError
from quadvis.analysis.margins import Loop, rates
from quadvis.analysis.systems import closed_loop
from quadvis.analysis.transfers import Transfers
from quadvis.analysis.vary import STABLE, Limits
from quadvis.analysis.verdict import (
    LoopVerdict,
    judge_limit,
    judge_margin,
    judge_sensitivity,
    judge_transfer,
)
from quadvis.diagram.loop_requirements import (
    LoopRequirement,
    RequiredMargin,
    RequiredSensitivity,
    RequiredTransfer,
)
from quadvis.diagram.sections.cuts import Cut
from quadvis.errors import DiagramError, counted
from quadvis.errors.caller import as_given
from quadvis.graph.graph import Graph
from quadvis.native.choice import AUTO
from quadvis.output.statistics import finite

if TYPE_CHECKING:
    from quadvis.diagram.diagram import Diagram


@dataclass(frozen=True)
class Analysis:
    """The closed loop of a diagram around its operating point.

    ``linear`` holds its matrices, ``loops`` the loops opened at the cut points, by name; ``transfers`` holds
    the responses of one signal to another one, ``limits`` the tolerances of parameters. Each of these is
    computed when it is first read.
    """

    diagram: Diagram
    linear: Linear
    loops: Mapping[str, Loop]
    transfers: Transfers
    limits: Limits

    def __repr__(self) -> str:
        states, stable = counted(len(self.linear.states), "state"), "stable" if self.stable else "not stable"
        return f"<Analysis of {self.diagram.name}: {states}, {stable}, {counted(len(self.loops), 'cut')}>"

    @property
    def period(self) -> float:
        """The hyperperiod (s) over which a sampled loop is lifted; 0 for a continuous loop."""
        return self.linear.period

    @cached_property
    def poles(self) -> NDArray[np.complex128]:
        """The closed loop's poles (1/s), slowest first; those of a lifted loop by their logarithms."""
        return rates(self.linear)

    @property
    def stable(self) -> bool:
        """True if all poles decay."""
        return bool((self.poles.real < STABLE).all())

    @cached_property
    def verdicts(self) -> tuple[LoopVerdict, ...]:
        """What is to be said on each margin and limit that the diagram expects, in the order of the file."""
        return tuple(self._judge(requirement) for requirement in self.diagram.loop_requirements)

    def _judge(self, requirement: LoopRequirement) -> LoopVerdict:
        if isinstance(requirement, RequiredMargin):
            return judge_margin(requirement, self.loops[requirement.label])
        if isinstance(requirement, RequiredSensitivity):
            return judge_sensitivity(requirement, self.loops[requirement.label])
        if isinstance(requirement, RequiredTransfer):
            return judge_transfer(requirement, self.transfers[requirement.label])
        return judge_limit(requirement, self.stable, self.limits.answer(requirement.limit))

    def transfer(self, name: str) -> Any:
        """Return a transfer as `control.StateSpace`: continuous, or discrete with the hyperperiod as its dt.

        A sampled one has an input and an output for each instant of the hyperperiod. AnalysisError if there
        is no such transfer, or if it cannot be linearised.
        """
        return self.transfers[name].system

    @property
    def passed(self) -> bool:
        """True if the loop is stable and has every margin that the diagram expects."""
        return self.stable and all(verdict.met for verdict in self.verdicts)

    @cached_property
    def system(self) -> Any:
        """The closed loop as `control.StateSpace`, from disturbances of the cut signals to these signals."""
        return closed_loop(self.linear)

    def facts(self) -> dict[str, Any]:
        """Return the analysis as plain data: what `quadvis analyse --json` prints."""
        loops = {
            label: {"signals": list(loop.signals), **{
                key: finite(value) for key, value in (vars(loop.margins) | _peaks(loop)).items()
            }}
            for label, loop in self.loops.items()
        }  # fmt: skip
        limits = {
            label: {
                "vary": found.limit.variable.name,
                "unit": str(found.limit.variable.unit),
                "stable_to": finite(found.value),
                "reached": found.reached,
                "reason": found.reason or None,
            }
            for label, found in self.limits.items()
        }
        return {
            "diagram": self.diagram.name,
            "variant": self.diagram.variant,
            "hash": self.diagram.hash,
            "hyperperiod_s": self.period,
            "states": list(self.linear.states),
            "parts": {part: "runs" if runs else "stands still" for part, runs in self.linear.parts.items()},
            "stable": self.stable,
            "passed": self.passed,
            "poles": [[float(pole.real), float(pole.imag)] for pole in self.poles],
            "cuts": loops,
            "transfers": {label: response.facts() for label, response in self.transfers.items()},
            "limits": limits,
            "expect": [verdict.facts() for verdict in self.verdicts],
        }


def analyse(
    diagram: Diagram,
    cuts: Mapping[str, str | Sequence[str]] = MappingProxyType({}),
    limits: Mapping[str, tuple[str, str, str]] = MappingProxyType({}),
    at: float | None = None,
    engine: str = AUTO,
    transfers: Mapping[str, Sequence[str]] = MappingProxyType({}),
) -> Analysis:
    """Linearise a diagram's closed loop, and answer the questions of its section ``analyse`` and the caller.

    ``cuts`` maps names of cut points to signals. ``limits`` maps names to a parameter and the first and last
    value of its search: ``("eyes/camera.latency", "50 ms", "2 s")``; ``transfers`` to two signals, ``(from,
    to)``. ``at`` (s) is the time at which the operating point is sought. ``engine`` is that of `Diagram.run`.
    AnalysisError if no operating point is found, or if the loop has no derivative; DiagramError if a cut, a
    limit or a transfer names nothing that exists.
    """
    opened, sought = diagram.questions.more(cuts, limits)
    ways = diagram.questions.more_transfers(transfers)
    at = diagram.questions.at if at is None else at
    _check_pictures(diagram)
    linear = linearised(diagram.graph, opened, at, engine)
    stable = bool((rates(linear).real < STABLE).all())
    loops = {cut.label: _loop(linear, cut, stable) for cut in opened}
    return Analysis(
        diagram,
        linear,
        loops,
        Transfers(diagram.graph, ways, at, engine),
        Limits(diagram, sought, at, engine),
    )


def _peaks(loop: Loop) -> dict[str, float]:
    return {f"{name}_peak": value for name, value in vars(loop.peaks).items()}


def _loop(linear: Linear, cut: Cut, stable: bool) -> Loop:
    mine = [index for index, channel in enumerate(linear.channels) if channel.cut == cut.label]
    closed = Linear(
        linear.a, linear.b[:, mine], linear.c[mine], linear.d[np.ix_(mine, mine)],
        linear.period, linear.states,
        tuple(linear.channels[index] for index in mine),
    )  # fmt: skip
    return Loop(cut.label, tuple(signal.text for signal in cut.signals), closed, stable)


def _check_pictures(diagram: Diagram) -> None:
    """Refuse loops through pictures, which change in steps of a pixel's value and have no derivative."""
    if (block := _seen(diagram.graph)) is not None:
        problem = f"block '{block}' gives pictures, and these cannot be linearised"
        raise AnalysisError(f"{problem}; {_way_out(diagram)}")


def _seen(graph: Graph) -> str | None:
    """Return the first block whose pictures another block reads."""
    read = {(wire.block, wire.port) for node in graph.nodes for _, wire in node.wires()}
    for node in graph.nodes:
        for name, port in node.block.interface.outputs.items():
            if port.signal.scalar == "frame" and (node.path, name) in read:
                return node.path
    return None


def _way_out(diagram: Diagram) -> str:
    from quadvis.diagram.load import load

    for variant in diagram.variants:
        params = [file.path for file in diagram.parameter_files]
        with suppress(DiagramError):  # the variant may not fit the settings of this diagram
            other = load(diagram.path, variant=variant, settings=diagram.settings, params=params)
            if _seen(other.graph) is None:
                choice = as_given(f"--variant {variant}", f"variant={variant!r}")
                return f"the variant '{variant}' has none: {choice}"
    return "use a camera without pictures, such as vision.geometric_camera"
