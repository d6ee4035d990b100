"""bdsim: blocks on one clock; scipy's integrator of variable step runs from sample to sample."""

from __future__ import annotations

import contextlib
import io
import os
from collections.abc import Callable
from math import cos
from typing import Any

from benchmarks.tasks import PERIOD, START, STEP, Task, Values, euler, front, law, parts, slopes


def load() -> str:
    """Return the version."""
    os.environ["MPLBACKEND"] = "Agg"
    from importlib.metadata import version

    import bdsim  # noqa: F401

    return version("bdsim")


def build(task: Task) -> Callable[[int], Callable[[], Values]]:
    """Make the model, which runs as often as one likes."""
    import bdsim

    with contextlib.redirect_stdout(io.StringIO()):
        program = bdsim.BDSim(
            graphics=False, progress=False, quiet=True, verbose=False, animation=False, sysargs=False
        )
        diagram = program.blockdiagram()
        (_hybrid if task.letter == "a" else _sampled)(diagram, task)
        diagram.compile()

    def prepare(steps: int) -> Callable[[], Values]:
        def run() -> Values:
            with contextlib.redirect_stdout(io.StringIO()):
                if task.letter == "a":
                    given = {"rtol": 1e-6, "atol": 1e-9}
                    return program.run(diagram, T=STEP * steps, solver_args=given).x[-1]
                watch = [f"{name}[0]" for name in front(task.count, steps)] if task.count else ["plant[0]"]
                return program.run(diagram, T=STEP * (steps + 0.5), watch=watch).y[-1]

        return run

    return prepare


def _hybrid(diagram: Any, _: Task) -> None:
    import numpy as np
    from bdsim.block import ContinuousBlock

    class Plant(ContinuousBlock):
        nin, nout = 1, 1

        def __init__(self, **given: Any) -> None:
            super().__init__(nstates=12, x0=START, **given)

        def output(self, _: float, __: Any, x: Any) -> list[Any]:
            return [x]

        def deriv(self, _: float, inputs: Any, x: Any) -> Any:
            return np.array(slopes(x, inputs[0]))

    clock = diagram.clock(PERIOD, "s")
    plant = _added(diagram, Plant(name="plant"))
    control = diagram.FUNCTION(lambda s: np.array(law(s)), name="law")
    hold = diagram.ZOH(clock, x0=np.array(law(START)), name="hold")
    diagram.connect(plant, control)
    diagram.connect(control, hold)
    diagram.connect(hold, plant)


def _added(diagram: Any, block: Any) -> Any:
    diagram.add_block(block)
    return block


def _sampled(diagram: Any, task: Task) -> None:
    import numpy as np
    from bdsim.block import FunctionBlock, SampledBlock

    clock = diagram.clock(STEP, "s")

    class Plant(SampledBlock):
        nin, nout = 1, 1

        def __init__(self, **given: Any) -> None:
            super().__init__(clock=clock, x0=START, **given)

        def output(self, _: float, __: Any, x: Any) -> list[Any]:
            return [x]

        def next(self, _: float, inputs: Any, x: Any) -> Any:
            return np.array(euler(x, inputs[0]))

    class Weighted(FunctionBlock):
        nout = 1

        def __init__(self, weights: tuple[float, ...], **given: Any) -> None:
            super().__init__(nin=len(weights), **given)
            self.weights = weights

        def output(self, _: float, inputs: Any, __: Any) -> list[float]:
            return [sum(a * b for a, b in zip(self.weights, inputs, strict=True))]

    makers: dict[str, Callable[..., Any]] = {
        "plant": lambda name: _added(diagram, Plant(name=name)),
        "demux": lambda name, count: diagram.DEMUX(count, name=name),
        "mux": lambda name, count: diagram.MUX(count, name=name),
        "weighted": lambda name, *weights: _added(diagram, Weighted(weights, name=name)),
        "saturation": lambda name, limit: diagram.CLIP(min=-limit, max=limit, name=name),
        "gain": lambda name, factor: diagram.GAIN(factor, name=name),
        "constant": lambda name, value: diagram.CONSTANT(value, name=name),
        "thrust": lambda name, weight: diagram.FUNCTION(
            lambda force, a, b: (force + weight) / (cos(a) * cos(b)), nin=3, name=name
        ),
        "delay": lambda name, start: diagram.ZOH(clock, x0=start, name=name),
    }
    blocks = {part.name: makers[part.kind](part.name, *part.numbers) for part in parts(task)}
    for part in parts(task):
        for index, (source, port) in enumerate(part.inputs):
            diagram.connect(blocks[source][port], blocks[part.name][index])
