"""A functional mock-up unit as a block."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from quadvis.block import Block, In, Out, Param, ParameterError, State, passed
from quadvis.errors import QuadvisError
from quadvis.fmi.plan import FmuPlan, instants
from quadvis.fmi.signals import FmuSignal, bounds
from quadvis.fmi.started import StartedFmu

KINDS = ("auto", "cosimulation", "model_exchange")  # as `FmuPlan.of` counts them
PROCESS, NONE = range(2)
AUTO, NEVER, ALWAYS = range(3)  # of ``direct``


class Fmu(Block, numeric=False):
    """A functional mock-up unit (FMU): another tool's model, from a file of FMI 2.0 or 3.0.

    Inputs, outputs, units and start values are those of the file; its parameters are parameters here, and
    those that are tunable can be tuned. A start value of an output or a state is the parameter
    ``NAME_start``. ``u[1]``, ``u[2]`` of FMI 2.0 are one input ``u`` of two elements. Names that a diagram
    cannot write have "_" in place of other characters. Texts and binary data cannot travel on wires. Values
    are in SI units on wires: 5 of an absolute temperature in degC is 278.15 K, of a difference 5 K.

    In co-simulation the FMU steps by one period at each tick, from the instant k periods after
    ``start_time``, exactly. Its inputs are held over the step, and its outputs are those that it had at the
    end of the step before: they do not follow the inputs of the same tick, unless ``direct`` says so. The
    last step ends at the stop time at the latest. In model exchange the states are integrated by the solver
    of the diagram, and inputs follow their wires; this is for FMUs without events.

    An FMU is machine code of somebody else. It runs in a process of its own, and a crash, a hang or an end of
    that process ends the run with a sentence, and safe values are written; with ``isolation: none`` it would
    take the run with it. A status other than OK ends the run with the FMU's own message.

    Errors: ParameterError if the file is not usable. Source: Functional Mock-up Interface 2.0.4 and 3.0.2.
    """

    file = Param(type="file", doc="the FMU")
    kind = Param("auto", choices=KINDS, doc="how the FMU is run; auto: by co-simulation if it offers it")
    isolation = Param(
        "process",
        choices=("process", "none"),
        doc="process: the FMU runs in one of its own; none: in the run's",
    )
    deadline = Param(2.0, unit="s", above=0.0, doc="how long a step may take in a process of its own")
    start_time = Param(0.0, unit="s", doc="the FMU's time at the first tick")
    units = Param("", type="str", doc="what units or variables of the FMU are: 'furlong = 201.168 m, h = m'")
    direct = Param(
        "auto",
        choices=("auto", "never", "always"),
        doc="whether outputs follow inputs of the same tick; auto: where FMI promises it",
    )
    warnings = Param(False, type="bool", doc="whether the status Warning is no reason to end the run")

    brings_code = "file"

    steps = State("int64", doc="steps that were done")

    plan: ClassVar[FmuPlan]

    example = """
        ball: {block: fmi.fmu, rate: fast, with: {file: BouncingBall.fmu}}
    """
    example_needs = "an FMU of this name"

    @classmethod
    def ports(cls, file: str, kind: int, units: str, direct: int) -> Mapping[str, Any]:
        """Return ports and parameters as the file has them."""
        if not file:
            raise ParameterError("file", "file must be a path, got none")
        try:
            plan = FmuPlan.of(file, kind, units, {*dir(Block), *vars(Fmu), *_NAMES})
        except QuadvisError as error:
            raise ParameterError("file", str(error)) from None
        follows = plan.states is not None or direct == ALWAYS or (direct == AUTO and plan.ours)
        members: dict[str, Any] = {"plan": plan}
        for signal in plan.inputs:
            members[signal.name] = _input(signal, direct=follows and signal.name in plan.direct)
        for signal in plan.outputs:
            members[signal.name] = Out(signal.type, _unit(signal), doc=signal.doc)
        tunable = {signal.name for signal in plan.tunable}
        for signal in (*plan.parameters, *plan.starts):
            members[signal.name] = _parameter(signal, tune=signal.name in tunable)
        if plan.states is not None:
            return members | _exchanged(plan.states)
        if follows and plan.direct:
            members["output"] = _following
        return members | {"not_restorable": plan.lacks}

    def doubts(self) -> list[ParameterError]:
        """Return that the FMU steps by itself in a way that does not fit the period."""
        step, period = self.plan.interface.step, self.period
        if (
            self.plan.states is None
            and step > 0.0
            and abs(round(period / step) * step - period) > 1e-9 * period
        ):
            problem = f"the FMU steps by {step:g} s inside, which does not divide its period, {period:g} s"
            return [ParameterError("file", problem)]
        return []

    def open(self) -> None:
        """Load and initialise the FMU."""
        plan = self.plan
        self._instants = instants(self.start_time, self.period)
        self._tunable = [signal.name for signal in plan.tunable]
        values = {signal.name: getattr(self, signal.name) for signal in (*plan.parameters, *plan.starts)}
        self._tuned = self._wanted()
        self._fmu: StartedFmu | None = plan.start(
            values,
            start_time=self.start_time,
            deadline=self.deadline if self.isolation == PROCESS else None,
            warnings=self.warnings,
        )
        self._done = 0  # steps of the FMU; those in memory may be of another instant, after a restore

    def close(self) -> None:
        """End the FMU."""
        fmu, self._fmu = getattr(self, "_fmu", None), None
        if fmu is not None:
            fmu.close()

    def output(self) -> Any:
        """Return the outputs at the end of the last step."""
        return self._fmu.outputs()  # type: ignore[union-attr]

    def update(self, time: float, *inputs: Any) -> None:
        """Begin the step of a period; the next output waits for its end."""
        if passed(time + self.period, self.until):
            return
        fmu = self._running()
        if self._tunable and (wanted := self._wanted()) != self._tuned:
            self._tuned = wanted
            fmu.tune([getattr(self, name) for name in self._tunable])
        k, (first, each, denominator) = self.steps, self._instants
        fmu.step((first + k * each) / denominator, self.period, inputs)
        self.steps = self._done = k + 1

    def _running(self) -> StartedFmu:
        fmu = self._fmu
        assert fmu is not None
        return fmu

    def _wanted(self) -> list[Any]:
        """Return the values of the parameters that can be tuned."""
        values = [getattr(self, name) for name in self._tunable]
        return [value.tolist() if hasattr(value, "tolist") else value for value in values]

    def keep(self) -> Any:
        """Return the FMU's own state, and after how many steps it has it; the states of a solver are ours."""
        if getattr(self, "_fmu", None) is None or self.plan.states is not None:
            return None
        return self._done, None if self.plan.lacks else self._running().save()

    def put_back(self, kept: Any) -> None:
        """Bring the FMU back to its own state of then."""
        if getattr(self, "_fmu", None) is None or self.plan.states is not None:
            return
        done, saved = kept or (0, None)
        if saved is not None:
            self._running().restore(saved)
        elif not done and self._done:
            self.close()
            self.open()
        elif done != self._done:
            raise QuadvisError(self.plan.lacks)
        self._done = done


_NAMES = ("time", "self", "states", "deriv", "start")  # that no signal may have besides


def _following(self: Any, *inputs: Any) -> Any:
    """Return the outputs, which follow the inputs of this tick."""
    return self._fmu.following(inputs)


def _exchanged(states: int) -> dict[str, Any]:
    """Return what is different in model exchange: the solver has the states."""

    def output(self: Any, time: float, *inputs: Any) -> Any:
        """Return the outputs at the states."""
        return self._fmu.at(self.start_time + time, self.states if states else (), inputs)

    def update(self: Any, time: float, *inputs: Any) -> None:
        """Say that a step of the solver is complete."""
        if self.plan.interface.completed_step:
            self._fmu.complete(self.start_time + time, self.states if states else (), inputs)
        self.steps += 1

    def start(self: Any) -> None:
        """Begin at the states of the FMU."""
        self.states = self._fmu.first

    def deriv(self: Any, time: float, *inputs: Any) -> Any:
        """Return the derivatives of the states."""
        return self._fmu.slopes(self.start_time + time, self.states, inputs)

    members: dict[str, Any] = {"output": output, "update": update}
    if states:
        state = State(f"float64[{states}]", continuous=True, doc="the states of the FMU")
        members |= {"states": state, "start": start, "deriv": deriv}
    return members


def _unit(signal: FmuSignal) -> str:
    return str(signal.conversion.unit)


def _input(signal: FmuSignal, *, direct: bool) -> In:
    return In(signal.type, _unit(signal), default=signal.start, direct=direct, doc=signal.doc)


def _parameter(signal: FmuSignal, *, tune: bool) -> Param:
    if signal.scalar == "str":
        return Param(signal.start, "str", doc=signal.doc)
    least, most = bounds(signal)
    return Param(signal.start, signal.type, _unit(signal), min=least, max=most, tune=tune, doc=signal.doc)
