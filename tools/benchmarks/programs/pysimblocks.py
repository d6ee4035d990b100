"""pySimBlocks. It has sampled blocks only, so the plant of task a is a block that takes a step of 1 ms."""

from __future__ import annotations

from collections.abc import Callable
from math import cos
from typing import Any

from benchmarks.tasks import PERIOD, START, STEP, Task, Values, euler, front, law, parts, runge_kutta

# A run to a time takes one step more, and a step begins half a step early or late by rounding.
BEFORE_END = 1.5 * STEP


def load() -> str:
    """Return the version."""
    import pySimBlocks

    return pySimBlocks.__version__


def _types() -> tuple[type, type]:
    import numpy as np
    from pySimBlocks.core.block import Block

    class Plant(Block):
        direct_feedthrough = False

        def __init__(self, name: str, move: Callable[[Values, Values], list[float]]) -> None:
            super().__init__(name)
            self.move = move
            self.inputs["in"] = None
            self.state["x"] = np.array(START).reshape(-1, 1)
            self.next_state["x"] = self.state["x"].copy()
            self.outputs["out"] = self.state["x"]

        def initialize(self, _: float) -> None:
            self.outputs["out"] = self.state["x"]

        def output_update(self, _: float, __: float) -> None:
            self.outputs["out"] = self.state["x"]

        def state_update(self, _: float, __: float) -> None:
            moved = self.move(self.state["x"][:, 0], self.inputs["in"][:, 0])
            self.next_state["x"] = np.array(moved).reshape(-1, 1)

    class Function(Block):
        direct_feedthrough = True

        def __init__(
            self, name: str, function: Callable[..., Any], count: int, period: float | None = None
        ) -> None:
            super().__init__(name, period)
            self.function, self.names = function, [f"in{index + 1}" for index in range(count)]
            self.inputs.update(dict.fromkeys(self.names))
            self.outputs["out"] = None

        def initialize(self, _: float) -> None:
            if all(self.inputs[name] is not None for name in self.names):
                self.output_update(0.0, 0.0)

        def output_update(self, _: float, __: float) -> None:
            self.outputs["out"] = self.function(*(self.inputs[name] for name in self.names))

        def state_update(self, _: float, __: float) -> None:
            pass

    return Plant, Function


def build(task: Task) -> Callable[[int], Callable[[], Values]]:
    """Make the model; each run makes it again, since a model runs once."""
    make = _hybrid if task.letter == "a" else lambda: _sampled(task)
    made = [make()]

    def prepare(steps: int) -> Callable[[], Values]:
        from pySimBlocks.core.config import SimulationConfig
        from pySimBlocks.core.simulator import Simulator

        model = made.pop() if made else make()
        simulator = Simulator(model, SimulationConfig(dt=STEP, T=STEP * steps))

        def run() -> Values:
            simulator.run(T=STEP * steps - BEFORE_END)
            if task.letter == "c":
                return [model.blocks[name].state["buffer"][0][0, 0] for name in front(task.count, steps)]
            return model.blocks["plant"].state["x"][:, 0]

        return run

    return prepare


def _hybrid() -> Any:
    import numpy as np
    from pySimBlocks import Model

    plant, function = _types()
    model = Model("hybrid")
    model.add_block(plant("plant", runge_kutta))
    model.add_block(function("law", lambda s: np.array(law(s[:, 0])).reshape(-1, 1), 1, PERIOD))
    model.connect("plant", "out", "law", "in1")
    model.connect("law", "out", "plant", "in")
    return model


def _sampled(task: Task) -> Any:
    from pySimBlocks import Model
    from pySimBlocks.blocks.operators.delay import Delay
    from pySimBlocks.blocks.operators.demux import Demux
    from pySimBlocks.blocks.operators.gain import Gain
    from pySimBlocks.blocks.operators.mux import Mux
    from pySimBlocks.blocks.operators.saturation import Saturation
    from pySimBlocks.blocks.sources.constant import Constant

    plant, function = _types()
    makers: dict[str, Callable[[str, tuple[float, ...]], Any]] = {
        "plant": lambda name, _: plant(name, euler),
        "demux": lambda name, numbers: Demux(name, numbers[0]),
        "mux": lambda name, numbers: Mux(name, numbers[0]),
        "weighted": lambda name, numbers: function(
            name, lambda *inputs: sum(a * b for a, b in zip(numbers, inputs, strict=True)), len(numbers)
        ),
        "saturation": lambda name, numbers: Saturation(name, -numbers[0], numbers[0]),
        "gain": lambda name, numbers: Gain(name, numbers[0]),
        "constant": lambda name, numbers: Constant(name, numbers[0]),
        "thrust": lambda name, numbers: function(
            name, lambda force, a, b: (force + numbers[0]) / (cos(a[0, 0]) * cos(b[0, 0])), 3
        ),
        "delay": lambda name, numbers: Delay(name, 1, numbers[0]),
    }
    blocks = list(parts(task))
    kinds = {part.name: part.kind for part in blocks}
    model = Model("sampled")
    for part in blocks:
        model.add_block(makers[part.kind](part.name, part.numbers))
    for part in blocks:
        several = part.kind in ("weighted", "thrust", "mux")
        for index, (source, port) in enumerate(part.inputs):
            output = f"out{port + 1}" if kinds[source] == "demux" else "out"
            model.connect(source, output, part.name, f"in{index + 1}" if several else "in")
    return model
