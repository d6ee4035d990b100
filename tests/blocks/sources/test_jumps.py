"""Sources that jump, in continuous time: the integral over a jump at a tick is exact, whatever the solver."""

from __future__ import annotations

import pytest

from quadvis.api import load_text
from quadvis.graph.graph import SOLVERS

JUMPS = {
    "step": "block: sources.step, with: {before: 1, after: 0, at: 100 ms}",
    "pulse": "block: sources.pulse, with: {begin: 100 ms, width: 1 ms, interval: 100 s}",
    "table": "block: sources.table, with: {times: {value: [0, 0.1, 0.101], unit: s}, "
    "values: [[0], [1], [0]], interpolation: hold}",
    "repeating": "block: sources.repeating_sequence, with: {times: {value: [0, 0.1, 0.101, 50], unit: s}, "
    "values: [0, 1, 0, 0], interpolation: hold}",
}
INTEGRALS = {"step": 0.1, "pulse": 1e-3, "table": 1e-3, "repeating": 1e-3}


@pytest.mark.parametrize("method", SOLVERS)
@pytest.mark.parametrize("source", JUMPS)
def test_the_integral_over_a_jump_is_exact(source: str, method: str) -> None:
    diagram = load_text(
        f"quadvis: 1\nname: jump\nsolver: {{method: {method}, step: 1 ms}}\nstop_time: 150 ms\nblocks:\n"
        f"  source: {{{JUMPS[source]}}}\n"
        "  twice: {block: signal.gain, with: {factor: 2}, in: {u: source.y}}\n"
        "  sum: {block: signal.integrator, in: {u: twice.y}}\n"
    )
    assert diagram.run()["sum.y"][-1] == pytest.approx(2.0 * INTEGRALS[source], abs=1e-12)


def test_between_the_rows_of_a_table_a_line_is_followed() -> None:
    diagram = load_text(
        "quadvis: 1\nname: line\nsolver: {step: 100 ms}\nstop_time: 1 s\nblocks:\n"
        "  line: {block: sources.table, with: {times: {value: [0, 1], unit: s}, values: [[0], [1]]}}\n"
        "  sum: {block: signal.integrator, in: {u: line.y}}\n"
    )
    assert diagram.run()["sum.y"][-1] == pytest.approx([0.5], abs=1e-12)
