"""The tasks as diagrams of quadvis: texts in YAML, loaded and checked like any other."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from benchmarks.tasks import COMMANDS, PERIOD, STATES, STEP, Part, Task, Values, front, parts

FOLDER = Path(__file__).parents[1]  # beside the folder of the blocks

# Of a kind of block: quadvis's name, the parameters, the inputs and the outputs.
KINDS: dict[str, tuple[str, tuple[str, ...], tuple[str, ...], tuple[str, ...]]] = {
    "plant": ("bench.sampled_plant", (), ("u",), ("s",)),
    "demux": ("bench.demux", (), ("u",), tuple(f"y{index}" for index in range(12))),
    "mux": ("bench.mux", (), tuple(f"u{index}" for index in range(4)), ("y0",)),
    "weighted": (
        "bench.weighted", tuple(f"w{index}" for index in range(5)), tuple(f"u{index}" for index in range(5)),
        ("y0",),
    ),
    "saturation": ("signal.saturation", ("upper",), ("u",), ("y",)),
    "gain": ("signal.gain", ("factor",), ("u",), ("y",)),
    "constant": ("sources.constant", ("value",), (), ("y",)),
    "thrust": ("bench.thrust", ("weight",), ("force", "theta", "phi"), ("y0",)),
    "delay": ("signal.unit_delay", ("initial",), ("u",), ("y",)),
}  # fmt: skip


def load() -> str:
    """Return the version."""
    import quadvis
    import quadvis.api
    import quadvis.engine.engine
    import quadvis.native.choice

    return quadvis.__version__


def text(task: Task) -> str:
    """Return the diagram of a task as YAML."""
    return "\n".join((*(_hybrid() if task.letter == "a" else _sampled(list(parts(task)))), ""))


def _hybrid() -> Iterator[str]:
    commands = ", ".join(f"{name}: {{from: law.{name}, across: hold}}" for name in COMMANDS)
    states = ", ".join(f"{name}: {{from: plant.{name}, across: sample}}" for name in STATES)
    yield "quadvis: 1\nname: hybrid"
    yield f"rates: {{control: {1 / PERIOD:g} Hz}}"
    yield f"solver: {{method: ode4, step: {1000 * STEP:g} ms}}"
    yield "stop_time: 100 s\nblocks:"
    yield f"  plant: {{block: bench.plant, in: {{{commands}}}}}"
    yield f"  law: {{block: bench.law, rate: control, in: {{{states}}}}}"


def _sampled(blocks: list[Part]) -> Iterator[str]:
    outputs = {part.name: KINDS[part.kind][3] for part in blocks}
    yield f"quadvis: 1\nname: sampled\nrates: {{main: {1 / STEP:g} Hz}}\nstop_time: 100 s\nblocks:"
    for part in blocks:
        kind, params, inputs, _ = KINDS[part.kind]
        # A shorter sum takes the last places: what a diagram leaves open is zero.
        values = dict(zip(params[-len(part.numbers) :], part.numbers, strict=False))
        if part.kind == "saturation":
            values["lower"] = -values["upper"]
        with_ = ", ".join(f"{name}: {value!r}" for name, value in values.items())
        in_ = ", ".join(
            f"{name}: {block}.{outputs[block][port]}"
            for name, (block, port) in zip(inputs[-len(part.inputs) :], part.inputs, strict=False)
        )
        yield f"  {part.name}: {{block: {kind}, rate: main, with: {{{with_}}}, in: {{{in_}}}}}"


def builder(engine: str) -> Callable[[Task], Callable[[int], Callable[[], Values]]]:
    """Return the function that builds a task for one of quadvis's engines."""

    def build(task: Task) -> Callable[[int], Callable[[], Values]]:
        from quadvis.api import load_text
        from quadvis.engine.engine import Engine
        from quadvis.native.choice import choose, use

        diagram = load_text(text(task), FOLDER)

        def prepare(steps: int) -> Callable[[], Values]:
            running = Engine(diagram.graph, diagram.seed)
            use(running, choose(running, steps, engine))
            running.__enter__()  # it opens the blocks, none of which has to be closed
            start = running.snapshot()
            running.run(1)  # the first step belongs to the start
            running.restore(start)

            def run() -> Values:
                running.run(steps)
                return _values(running, task, steps)

            return run

        prepare(1)  # what is not kept as machine code is compiled
        return prepare

    return build


def _values(engine: Any, task: Task, steps: int) -> Values:
    """Return the states after a run; outputs are those of the last tick, before the last update."""
    if task.letter == "c":
        return [engine.memory.read(engine.program[name].field("last")) for name in front(task.count, steps)]
    plant = engine.program["plant"]
    if task.letter == "b":
        return list(engine.memory.read(plant.field("now")))
    return [engine.memory.read(plant.field(f"s{index}")) for index in range(12)]
