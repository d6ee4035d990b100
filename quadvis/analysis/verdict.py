"""Verdicts on what a diagram expects of its loop: margins and peaks at cuts, transfers, and limits.

A loop that is not stable meets nothing. Nor does a margin at a cut through which no loop passes: it is
infinite, because nothing that happens there matters.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from quadvis.analysis.margins import Loop
from quadvis.analysis.response import Response
from quadvis.analysis.vary import Tolerance
from quadvis.diagram.loop_requirements import (
    TRANSFERS,
    LoopRequirement,
    RequiredLimit,
    RequiredMargin,
    RequiredSensitivity,
    RequiredTransfer,
)
from quadvis.output.statistics import finite

UNSTABLE = "the loop is not stable"
STEP_KINDS = ("rise_time", "overshoot", "settling_time")


@dataclass(frozen=True)
class LoopVerdict:
    """A requirement on the loop and the margin or limit found, in its unit; NaN if there is none.

    ``found`` is infinite for a margin without limit. ``lack`` says why nothing can be found.
    """

    requirement: LoopRequirement
    found: float
    met: bool
    lack: str = ""

    @property
    def shown(self) -> str:
        """The value that was found, as text."""
        found = "none" if math.isnan(self.found) else self.requirement.shows(self.found)
        return f"{found}: {self.lack}" if self.lack else found

    def facts(self) -> dict[str, Any]:
        """Return the verdict as plain data."""
        requirement = self.requirement
        return {
            "expectation": str(requirement),
            "label": requirement.label,
            "kind": requirement.kind,
            "unit": requirement.unit,
            "limit": requirement.bound,
            "found": finite(self.found),
            "met": self.met,
            "lack": self.lack or None,
        }

    def __str__(self) -> str:
        return f"{'met' if self.met else 'NOT MET'}: {self.requirement}: {self.shown}"


def judge_margin(requirement: RequiredMargin, loop: Loop) -> LoopVerdict:
    """Return whether a loop has a margin, both of gain and of phase in either direction."""
    if lack := _lack(loop):
        return LoopVerdict(requirement, math.nan, False, lack)
    margins = loop.margins
    down = 1.0 / margins.gain_down if margins.gain_down else math.inf
    found = {
        "gain": min(margins.gain_up, down),
        "phase": min(margins.phase_lag, margins.phase_lead),
        "delay": margins.delay,
    }[requirement.kind]
    return LoopVerdict(requirement, found, found >= requirement.bound)


def judge_sensitivity(requirement: RequiredSensitivity, loop: Loop) -> LoopVerdict:
    """Return whether the peak of a sensitivity is below its limit."""
    if lack := _lack(loop):
        return LoopVerdict(requirement, math.nan, False, lack)
    peaks = loop.peaks
    found = peaks.sensitivity if requirement.kind == "sensitivity" else peaks.complementary
    return LoopVerdict(requirement, found, found < requirement.bound)


def _lack(loop: Loop) -> str:
    """Return why nothing of a loop is met, if so."""
    if not loop.stable:
        return UNSTABLE
    return f"no loop passes through {', '.join(loop.idle)}" if loop.idle else ""


def judge_transfer(requirement: RequiredTransfer, response: Response) -> LoopVerdict:
    """Return whether a number of a transfer is within its bound."""
    if not response.stable:
        return LoopVerdict(requirement, math.nan, False, "the response to a step does not settle")
    kind, step = requirement.kind, response.step
    found = float(getattr(step if kind in STEP_KINDS else response, kind))
    if math.isnan(found):
        return LoopVerdict(requirement, found, False, f"its gain at frequency 0 is {response.dc_gain:g}")
    bound = requirement.bound
    return LoopVerdict(requirement, found, found >= bound if TRANSFERS[kind].least else found <= bound)


def judge_limit(requirement: RequiredLimit, stable: bool, tolerance: Tolerance) -> LoopVerdict:
    """Return whether a parameter may go beyond a value; at the end of its range the loop is stable too."""
    if not stable:
        return LoopVerdict(requirement, math.nan, False, UNSTABLE)
    found, least = tolerance.value, requirement.bound
    if math.isnan(found):
        return LoopVerdict(requirement, found, False, tolerance.text)
    beyond = found > least if requirement.kind == "above" else found < least
    return LoopVerdict(requirement, found, beyond or (found == least and not tolerance.reached))
