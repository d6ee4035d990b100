"""PathSim: an ODE block with the fixed-step formula of Runge and Kutta; sampled blocks are events."""

from __future__ import annotations

from collections.abc import Callable
from math import cos
from typing import Any

from benchmarks.tasks import PERIOD, START, STEP, Task, Values, euler, front, law, parts, slopes

MOST = 200  # blocks: the time of a step grows with their square


def load() -> str:
    """Return the version."""
    import pathsim

    return pathsim.__version__


def build(task: Task) -> Callable[[int], Callable[[], Values]]:
    """Make the model; each run makes it again, since a model runs once."""
    make = _hybrid if task.letter == "a" else lambda: _sampled(task)
    made = [make()]

    def prepare(steps: int) -> Callable[[], Values]:
        simulation, blocks = made.pop() if made else make()

        def run() -> Values:
            if task.letter == "a":
                simulation.run(STEP * steps, adaptive=False)
                return blocks["plant"].engine.state
            simulation.run(STEP * (steps - 0.5), adaptive=False)  # it takes one step more
            if task.letter == "b":
                return blocks["plant"].outputs.to_array()
            return [blocks[name].outputs[0] for name in front(task.count, steps)]

        return run

    return prepare


def _hybrid() -> tuple[Any, dict[str, Any]]:
    import numpy as np
    from pathsim import Connection, Simulation
    from pathsim.blocks import ODE, Wrapper
    from pathsim.solvers import RK4

    plant = ODE(lambda s, u, _: np.array(slopes(s, u)), np.array(START))
    control = Wrapper(lambda *s: np.array(law(s)), T=PERIOD)
    wires = [Connection(plant[:12], control[:12]), Connection(control[:4], plant[:4])]
    return Simulation([plant, control], wires, dt=STEP, Solver=RK4, log=False), {"plant": plant}


def _sampled(task: Task) -> tuple[Any, dict[str, Any]]:
    import numpy as np
    import pathsim.blocks as library
    from pathsim import Connection, Simulation
    from pathsim.solvers import EUF

    class Weighted(library.Block):
        def __init__(self, weights: tuple[float, ...]) -> None:
            super().__init__()
            self.weights = np.array(weights)

        def update(self, _: float) -> None:
            self.outputs[0] = float(self.weights @ self.inputs.to_array())

    def plant() -> Any:
        states: list[Any] = [list(START)]

        def move(*u: float) -> Any:
            states[0] = euler(states[0], u)
            return np.array(states[0])

        block = library.Wrapper(move, T=STEP, tau=STEP)
        block.outputs.update_from_array(np.array(START))
        return block

    makers: dict[str, Callable[..., Any]] = {
        "plant": lambda *_: plant(),
        "demux": lambda _: library.Function(lambda *s: np.array(s)),
        "mux": lambda _: library.Function(lambda *s: np.array(s)),
        "weighted": lambda *weights: Weighted(weights),
        "saturation": lambda limit: library.Clip(-limit, limit),
        "gain": library.Amplifier,
        "constant": library.Constant,
        "thrust": lambda weight: library.Function(lambda f, a, b: (f + weight) / (cos(a) * cos(b))),
        # Events of one instant come one after the other, and the whole graph follows each of them: only a
        # block with a state of its own delays by exactly one sample then.
        "delay": lambda start: library.discrete.DiscreteStateSpace(initial_value=start, T=STEP),
    }
    blocks = {part.name: makers[part.kind](*part.numbers) for part in parts(task)}
    wires = []
    for part in parts(task):
        if part.kind in ("demux", "plant"):
            source, width = part.inputs[0][0], 12 if part.kind == "demux" else 4
            wires.append(Connection(blocks[source][:width], blocks[part.name][:width]))
        else:
            wires += [
                Connection(blocks[source][port], blocks[part.name][index])
                for index, (source, port) in enumerate(part.inputs)
            ]
    return Simulation(list(blocks.values()), wires, dt=STEP, Solver=EUF, log=False), blocks
