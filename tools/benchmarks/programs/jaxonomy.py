"""Jaxonomy: XLA compiles the whole run, in each process again."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from benchmarks.tasks import (
    GRAVITY,
    HEIGHT,
    HEIGHT_GAIN,
    LIMITS,
    MASS,
    PERIOD,
    START,
    STEP,
    YAW_GAIN,
    Task,
    Values,
    front,
    parts,
)

MOST = 200  # blocks: the time to compile grows faster than their square


def load() -> str:
    """Return the version."""
    from importlib.metadata import version

    import jax
    import jaxonomy.library  # noqa: F401

    jax.config.update("jax_enable_x64", True)
    return version("jaxonomy")


def build(task: Task) -> Callable[[int], Callable[[], Values]]:
    """Make the diagram, and compile it by a first step."""
    import jax
    import jaxonomy

    diagram, blocks = _hybrid() if task.letter == "a" else _sampled(task)
    context = diagram.create_context()
    options = jaxonomy.SimulatorOptions(
        math_backend="jax", save_time_series=False, ode_solver_method="rk4", max_minor_step_size=STEP
    )
    simulator = jaxonomy.Simulator(diagram, options=options)

    def prepare(steps: int) -> Callable[[], Values]:
        # The updates that are due at the end are done if it comes half a step later.
        end = STEP * steps if task.letter == "a" else STEP * (steps + 0.5)

        def run() -> Values:
            found = jax.block_until_ready(simulator.advance_to(end, context).context)
            if task.letter == "a":
                return found[blocks["plant"].system_id].continuous_state
            names = front(task.count, steps) if task.count else ["plant"]
            values = [found[blocks[name].system_id].discrete_state for name in names]
            return values if task.count else values[0]

        return run

    prepare(1)()
    return prepare


def _slopes(s: Any, u: Any) -> Any:
    import jax.numpy as jnp

    theta, phi = s[4], s[5]
    pull = u[0] / MASS
    level = pull * jnp.cos(theta)
    pulls = jnp.array([-pull * jnp.sin(theta), level * jnp.sin(phi), level * jnp.cos(phi) - GRAVITY])
    return jnp.concatenate([s[6:], pulls, u[1:]])


def _law(s: Any) -> Any:
    import jax.numpy as jnp

    x, y, z, psi, theta, phi, vx, vy, vz, wpsi, wtheta, wphi = s

    def nested(rate: Any, angle: Any, speed: Any, place: Any) -> Any:
        outer, third, second, inner = LIMITS
        part = jnp.clip(rate + 3.0 * angle + 3.0 * speed / GRAVITY + place / GRAVITY, -inner, inner)
        part = jnp.clip(rate + 2.0 * angle + speed / GRAVITY + part, -second, second)
        part = jnp.clip(rate + angle + part, -third, third)
        return -jnp.clip(rate + part, -outer, outer)

    force = -HEIGHT_GAIN * vz - HEIGHT_GAIN * (z - HEIGHT) + MASS * GRAVITY
    yaw = -YAW_GAIN * wpsi - YAW_GAIN * psi
    torques = nested(wtheta, theta, -vx, -x), nested(wphi, phi, vy, y)
    return jnp.array([force / (jnp.cos(theta) * jnp.cos(phi)), yaw, *torques])


def _hybrid() -> tuple[Any, dict[str, Any]]:
    import jax.numpy as jnp
    import jaxonomy
    from jaxonomy import library

    class Plant(jaxonomy.LeafSystem):
        def __init__(self, **given: Any) -> None:
            super().__init__(**given)
            self.declare_input_port(name="u")
            self.declare_continuous_state(default_value=jnp.array(START), ode=self.rates)
            self.declare_continuous_state_output(name="s")

        def rates(self, _: Any, state: Any, u: Any, **__: Any) -> Any:
            return _slopes(state.continuous_state, u)

    builder = jaxonomy.DiagramBuilder()
    plant = builder.add(Plant(name="plant"))
    control = builder.add(library.FeedthroughBlock(_law, name="law"))
    hold = builder.add(library.ZeroOrderHold(PERIOD, name="hold"))
    for source, target in ((plant, control), (control, hold), (hold, plant)):
        builder.connect(source.output_ports[0], target.input_ports[0])
    return builder.build(), {"plant": plant}


def _sampled(task: Task) -> tuple[Any, dict[str, Any]]:
    import jax.numpy as jnp
    import jaxonomy
    from jaxonomy import library

    class Plant(jaxonomy.LeafSystem):
        def __init__(self, **given: Any) -> None:
            super().__init__(**given)
            self.declare_input_port(name="u")
            self.declare_discrete_state(default_value=jnp.array(START))
            self.declare_periodic_update(self.move, period=STEP, offset=STEP)
            self.declare_output_port(
                lambda _, state, *__, **___: state.discrete_state,
                period=STEP, offset=0.0, requires_inputs=False, default_value=jnp.array(START),
            )  # fmt: skip

        def move(self, _: Any, state: Any, u: Any, **__: Any) -> Any:
            return state.discrete_state + STEP * _slopes(state.discrete_state, u)

    def weighted(name: str, *weights: float) -> Any:
        def summed(inputs: Any) -> Any:
            return sum(a * b for a, b in zip(weights, inputs, strict=True))

        return library.ReduceBlock(len(weights), summed, name=name)

    def thrust(name: str, weight: float) -> Any:
        def formula(inputs: Any) -> Any:
            return (inputs[0] + weight) / (jnp.cos(inputs[1]) * jnp.cos(inputs[2]))

        return library.ReduceBlock(3, formula, name=name)

    def saturation(name: str, limit: float) -> Any:
        return library.FeedthroughBlock(lambda value: jnp.clip(value, -limit, limit), name=name)

    makers: dict[str, Callable[..., Any]] = {
        "plant": lambda name: Plant(name=name),
        "demux": lambda name, count: library.Demultiplexer(count, name=name),
        "mux": lambda name, count: library.Multiplexer(count, name=name),
        "weighted": weighted,
        "saturation": saturation,
        "gain": lambda name, factor: library.Gain(factor, name=name),
        "constant": lambda name, value: library.Constant(value, name=name),
        "thrust": thrust,
        "delay": lambda name, start: library.UnitDelay(STEP, start, name=name),
    }
    builder = jaxonomy.DiagramBuilder()
    blocks = {part.name: builder.add(makers[part.kind](part.name, *part.numbers)) for part in parts(task)}
    for part in parts(task):
        for index, (source, port) in enumerate(part.inputs):
            builder.connect(blocks[source].output_ports[port], blocks[part.name].input_ports[index])
    return builder.build(), blocks
