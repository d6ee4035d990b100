"""The methods of blocks in C give the bits of the interpreted ones, and fail where these do."""

from __future__ import annotations

import ctypes
import hashlib
import subprocess
from pathlib import Path
from typing import Any

import pytest

from quadvis.block import METHODS
from quadvis.engine.layout import TIME
from quadvis.engine.memory import SLOT
from quadvis.engine.program import Op
from quadvis.export.blocks import block_code
from quadvis.export.package import OPTIONS
from quadvis.library.catalogue import Catalogue
from quadvis.testing.checks.compiled import _same
from quadvis.testing.rig import PERIOD, STEPS, Rig, Subject, rigs, sources, targets
from tests.blocks.test_every_block import CAMERA, INPUTS, PARAMETERS
from tests.fmus.builder import needs_gcc
from tests.stages import mostly_slow

pytestmark = needs_gcc
GIVEN: dict[str, Any] = {
    "calibration": CAMERA, "times": [0.0, 0.35, 1.0], "values": [[1.0, 2.0], [3.0, -1.0], [0.0, 0.0]],
    "during": [[0.3, 0.6]],
}  # fmt: skip
# To compile takes seconds: a few stand for the others, with arrays that are allocated, noise, powers, loops.
FIRST = ("control.trim",)
SOME = (
    "plant.rotorcraft", "sources.noise", "sources.table", "signal.transport_delay",
    "control.nested_saturation", "supervision.failsafe", "sensors.imu",
    "signal.gain", "signal.lookup_2d", "logic.multiport_switch", "math.function",
)  # fmt: skip
LARGE = ("estimation.position_filter",)  # numba works at it for 40 s


def library(rig: Rig, folder: Path) -> tuple[dict[str, Any], dict[str, Op]]:
    """Return the methods of a rig's block as functions of addresses, and their calls.

    The folder has the compiled code, each text once: rigs that differ in values alone have the same.
    """
    placed, arguments = rig.placed, rig.interface.arguments
    ops = {
        method: Op(0, method, tuple(sources(placed, names)), tuple(targets(placed, method).values()))
        for method, names in arguments.items()
    }
    code = block_code(rig.engine.program, [rig.engine.graph.nodes[0].block])
    lines = ["#include <math.h>\n#include <stdint.h>\n#include <stdlib.h>\n#include <string.h>", code.text]
    for method, op in ops.items():
        count = 1 + len(op.sources) + len(op.targets)
        listed = ", ".join(f"(char *)p[{k}]" for k in range(count))
        name = code.names[0, method]
        lines.append(
            f'__attribute__((visibility("default"))) int call_{method}(char **p) '
            f"{{ char *error = 0; return {name}((char *)&error, {listed}); }}"
        )
    text = "\n".join(lines)
    made = folder / f"{hashlib.sha256(text.encode()).hexdigest()}.so"
    if not made.exists():
        source = made.with_suffix(".c")
        source.write_text(text)
        subprocess.run(["gcc", *OPTIONS, str(source), "-o", str(made), "-lm"], check=True)
    loaded = ctypes.CDLL(str(made))
    return {method: loaded[f"call_{method}"] for method in ops}, ops


def passes(function: Any, op: Op, rig: Rig) -> bool:
    """Call a method in C over the memory of a rig; return whether it did not fail."""
    positions = [rig.placed.position, *(slot.position for slot in (*op.sources, *op.targets))]
    base = rig.memory.floats.ctypes.data
    places = (ctypes.c_void_p * len(positions))(*(base + SLOT * position for position in positions))
    return not function(places)


def agree(rig: Rig, functions: dict[str, Any], ops: dict[str, Op], step: int) -> None:
    """Call every method both ways; then take an Euler step, to reach another state."""
    program, memory = rig.engine.program, rig.memory
    memory.write(TIME, float(step * PERIOD))
    for method in METHODS:
        call = getattr(rig.block, "start", None) if method == "start" else rig.call(method)
        if call is None or (method == "start" and step > 0):
            continue
        before, raised = rig.whole(), False
        try:
            call()
        except (ArithmeticError, ValueError, IndexError):
            raised = True
        interpreted = rig.whole()
        rig.put_back(before)
        passed = passes(functions[method], ops[method], rig)
        if raised:
            assert not passed, f"{method} at step {step}: interpreted, it raises an exception; in C, none"
            rig.put_back(before)
        elif passed:
            _same(rig, interpreted, f"{method} at step {step}")
        else:
            rig.put_back(interpreted)  # C refuses a little more
    memory.floats[list(program.states)] += float(PERIOD) * memory.floats[list(program.slopes)]


NAMES = [name for name in Catalogue().names() if Catalogue().find(name).numeric]


@pytest.mark.parametrize("name", mostly_slow((*FIRST, *SOME, *LARGE), quick=len(FIRST), slow=len(SOME)))
def test_a_block_does_the_same_in_c(name: str, tmp_path: Path) -> None:
    check(name, tmp_path)


def check(name: str, folder: Path) -> None:
    kind, known = Catalogue().find(name), GIVEN | PARAMETERS.get(name, {})
    given = {
        key: known[key] for key, param in kind.interface.params.items() if param.required and key in known
    }
    (subject,) = Subject(kind, given, INPUTS.get(name, {})).of_any_number((3,))
    for rig in rigs(subject, missing=True):
        functions, ops = library(rig, folder)
        with rig.engine:
            for step in range(STEPS):
                rig.feed(step)
                agree(rig, functions, ops, step)


if __name__ == "__main__":  # all of the library, or some: python -m tests.quadvis.export.test_blocks
    import sys
    import tempfile

    for each in sys.argv[1:] or NAMES:
        with tempfile.TemporaryDirectory() as made:
            check(each, Path(made))
        print(each, "the same", flush=True)
