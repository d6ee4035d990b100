"""Drake: its C++ blocks, and formulas where it has none. Its fixed steps are of order 3, not 4."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from benchmarks.tasks import (
    COMMANDS,
    GRAVITY,
    HEIGHT,
    HEIGHT_GAIN,
    LIMITS,
    MASS,
    PERIOD,
    START,
    STATES,
    STEP,
    YAW_GAIN,
    Task,
    Values,
    front,
    parts,
)


def load() -> str:
    """Return the version."""
    from importlib.metadata import version

    import pydrake.symbolic
    import pydrake.systems.all  # noqa: F401

    return version("drake")


def build(task: Task) -> Callable[[int], Callable[[], Values]]:
    """Make the diagram; each run has a simulator of its own."""
    diagram, blocks = _hybrid() if task.letter == "a" else _sampled(task)

    def prepare(steps: int) -> Callable[[], Values]:
        import numpy as np
        from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator

        simulator = Simulator(diagram)
        context = simulator.get_mutable_context()
        if task.letter == "a":
            ResetIntegratorFromFlags(simulator, "runge_kutta3", STEP)
            simulator.get_mutable_integrator().set_fixed_step_mode(True)
            own = blocks["plant"].GetMyMutableContextFromRoot(context)
            own.SetContinuousState(np.array(START))
        elif task.letter == "b":
            own = blocks["plant"].GetMyMutableContextFromRoot(context)
            own.SetDiscreteState(np.array(START))
        simulator.Initialize()

        def run() -> Values:
            # The updates that are due at the end of a run are not done: it ends half a step later.
            simulator.AdvanceTo(STEP * steps if task.letter == "a" else STEP * (steps - 0.5))
            if task.letter == "a":
                return own.get_continuous_state_vector().CopyToVector()
            if task.letter == "b":
                return own.get_discrete_state_vector().CopyToVector()
            found = [blocks[name] for name in front(task.count, steps)]
            return [each.get_output_port(0).Eval(each.GetMyContextFromRoot(context))[0] for each in found]

        return run

    return prepare


def _formulas() -> tuple[list[Any], list[Any], list[Any], list[Any]]:
    """Return the symbols of states and commands, the slopes and the control law."""
    from pydrake import symbolic

    s = [symbolic.Variable(name) for name in STATES]
    u = [symbolic.Variable(name) for name in COMMANDS]
    sin, cos = symbolic.sin, symbolic.cos
    x, y, z, psi, theta, phi, vx, vy, vz, wpsi, wtheta, wphi = s

    def limited(value: Any, limit: float) -> Any:
        return symbolic.max(-limit, symbolic.min(limit, value))

    def nested(rate: Any, angle: Any, speed: Any, place: Any) -> Any:
        outer, third, second, inner = LIMITS
        part = limited(rate + 3.0 * angle + 3.0 * speed / GRAVITY + place / GRAVITY, inner)
        part = limited(rate + 2.0 * angle + speed / GRAVITY + part, second)
        return -limited(rate + limited(rate + angle + part, third), outer)

    pull = u[0] / MASS
    level = pull * cos(theta)
    rates = [*s[6:], -pull * sin(theta), level * sin(phi), level * cos(phi) - GRAVITY, *u[1:]]
    force = -HEIGHT_GAIN * vz - HEIGHT_GAIN * (z - HEIGHT) + MASS * GRAVITY
    yaw = -YAW_GAIN * wpsi - YAW_GAIN * psi
    law = [
        force / (cos(theta) * cos(phi)), yaw, nested(wtheta, theta, -vx, -x), nested(wphi, phi, vy, y),
    ]  # fmt: skip
    return s, u, rates, law


def _hybrid() -> tuple[Any, dict[str, Any]]:
    from pydrake import symbolic
    from pydrake.systems.framework import DiagramBuilder
    from pydrake.systems.primitives import SymbolicVectorSystem, ZeroOrderHold

    s, u, rates, law = _formulas()
    builder = DiagramBuilder()
    plant = builder.AddSystem(SymbolicVectorSystem(state=s, input=u, dynamics=rates, output=s))
    # Beside a plant with continuous states, a system of formulas without any ends the process.
    idle = {"state": [symbolic.Variable("idle")], "dynamics": [symbolic.Expression(0.0)]}
    control = builder.AddSystem(SymbolicVectorSystem(input=s, output=law, **idle))
    hold = builder.AddSystem(ZeroOrderHold(PERIOD, 4))
    for source, target in ((plant, control), (control, hold), (hold, plant)):
        builder.Connect(source.get_output_port(0), target.get_input_port(0))
    return builder.Build(), {"plant": plant}


def _sampled(task: Task) -> tuple[Any, dict[str, Any]]:
    import numpy as np
    from pydrake import symbolic
    from pydrake.systems import primitives
    from pydrake.systems.framework import DiagramBuilder

    s, u, rates, _ = _formulas()
    moved = [state + STEP * rate for state, rate in zip(s, rates, strict=True)]
    force, theta, phi = (symbolic.Variable(name) for name in ("force", "theta", "phi"))
    formula = primitives.SymbolicVectorSystem
    makers: dict[str, Callable[..., Any]] = {
        "plant": lambda: formula(state=s, input=u, dynamics=moved, output=s, time_period=STEP),
        "demux": primitives.Demultiplexer,
        "mux": primitives.Multiplexer,
        "weighted": lambda *weights: primitives.MatrixGain(np.array([weights])),
        "saturation": lambda limit: primitives.Saturation([-limit], [limit]),
        "gain": lambda factor: primitives.Gain(factor, 1),
        "constant": lambda value: primitives.ConstantVectorSource([value]),
        "thrust": lambda weight: formula(
            input=[force, theta, phi],
            output=[(force + weight) / (symbolic.cos(theta) * symbolic.cos(phi))],
        ),
        # `DiscreteTimeDelay` with one step delays by one sample more.
        "delay": lambda _: primitives.ZeroOrderHold(STEP, 1),
    }
    builder = DiagramBuilder()
    blocks = {
        part.name: builder.AddNamedSystem(part.name, makers[part.kind](*part.numbers)) for part in parts(task)
    }
    for part in parts(task):
        target = blocks[part.name]
        if part.kind in ("weighted", "thrust"):  # these take one vector
            target = builder.AddSystem(primitives.Multiplexer(len(part.inputs)))
            builder.Connect(target.get_output_port(0), blocks[part.name].get_input_port(0))
        for index, (source, port) in enumerate(part.inputs):
            builder.Connect(blocks[source].get_output_port(port), target.get_input_port(index))
    return builder.Build(), blocks
