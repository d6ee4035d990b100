"""How an FMU is run: by which of its interfaces, with which signals, over which exchange."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from typing import Any

from quadvis.errors import QuadvisError, sentence, suggestion
from quadvis.fmi.archive import refused
from quadvis.fmi.description import REALS, FmuDescription, FmuInterface, FmuVariable
from quadvis.fmi.exchange import SLOT, FixedValues, FmuSetup, Room
from quadvis.fmi.packing import laid_out
from quadvis.fmi.reading import one_interface, read_fmu
from quadvis.fmi.running import IsolatedFmu, LocalFmu, formatter
from quadvis.fmi.signals import FmuSignal, converted, plain_name, settable, signals
from quadvis.fmi.started import FmuLayout, StartedFmu
from quadvis.fmi.units import Units
from quadvis.fmi.unpacked import UnpackedFmu, library_name
from quadvis.machine.inputs import read_once

AUTO, COSIMULATION, EXCHANGE = range(3)
OURS = "quadvis"  # how the generation tool of our own FMUs begins
START = "_start"  # behind the name of an output or a state: the parameter that is its start value


@dataclass(frozen=True)
class FmuPlan:
    """An FMU and how it is to be run. ``states`` is None for co-simulation.

    ``starts`` are start values of outputs and states; their names end in ``_start``. ``direct`` has the names
    of the inputs that outputs may follow at the same instant.
    """

    path: str
    description: FmuDescription
    interface: FmuInterface
    inputs: tuple[FmuSignal, ...]
    outputs: tuple[FmuSignal, ...]
    parameters: tuple[FmuSignal, ...]
    starts: tuple[FmuSignal, ...]
    direct: frozenset[str]
    states: int | None

    @staticmethod
    def of(path: str, kind: int, units_text: str, taken: Collection[str]) -> FmuPlan:
        """Return the plan for a file; QuadvisError, in a sentence, if the FMU cannot be run so.

        ``kind`` is one of AUTO, COSIMULATION, EXCHANGE; ``taken`` are names that no signal may have.
        """
        description, names = read_once(read_fmu, path)
        exchange = kind == EXCHANGE or (kind == AUTO and description.cosimulation is None)
        interface = _interface(path, description, exchange=exchange)
        library_name(path, names, description.version, interface.identifier)
        try:
            units = Units(description.units, units_text)
            return _planned(path, description, interface, units, set(taken), exchange=exchange)
        except QuadvisError as error:
            raise refused(path, str(error)) from None

    @property
    def tunable(self) -> tuple[FmuSignal, ...]:
        """The parameters that may change during a run: in co-simulation, and where the FMU says so."""
        if self.states is not None:
            return ()
        return tuple(
            each for each in self.parameters if each.first.variability == "tunable" and each.scalar != "str"
        )

    @property
    def ours(self) -> bool:
        """Whether quadvis has made the FMU, whose outputs follow the inputs as soon as they are set."""
        return self.description.generator.startswith(OURS)

    @property
    def lacks(self) -> str:
        """Why the FMU cannot go back to an earlier state; "" if it can."""
        return "" if self.interface.saves_state else "the FMU cannot save its state"

    def start(
        self,
        values: Mapping[str, Any],
        *,
        start_time: float,
        deadline: float | None,
        warnings: bool,
    ) -> StartedFmu:
        """Load and initialise the FMU: in its own process, or in this one if there is no ``deadline`` (s).

        ``values`` has the parameters and start values in SI units, by name. QuadvisError, in a sentence, if
        the FMU does not start.
        """
        unpacked = UnpackedFmu(self.path, self.description.version, self.interface.identifier)
        layout = self._layout
        setup = FmuSetup(
            self.description.version,
            self.interface.identifier,
            self.description.token,
            unpacked.library,
            unpacked.resources,
            start_time,
            tuple(self._fixed(values)),
            layout.inputs.sections,
            layout.outputs.sections,
            layout.tunable.sections,
            self.states,
            layout.states_at,
            layout.slopes_at,
            layout.size,
            self.interface.serialises,
            self.interface.completed_step,
            warnings,
            formatter() if self.description.version == 2 else "",
        )
        folder = unpacked.folder
        fmu = LocalFmu(setup, folder) if deadline is None else IsolatedFmu(setup, folder, deadline)
        signals_of = (self.inputs, self.outputs, self.tunable, self._direct)
        return StartedFmu(self.description.version, signals_of, layout, unpacked, fmu, values)

    @property
    def _direct(self) -> tuple[FmuSignal, ...]:
        return tuple(signal for signal in self.inputs if signal.name in self.direct)

    @cached_property
    def _layout(self) -> FmuLayout:
        room, version = Room(), self.description.version
        inputs = laid_out(room, version, self.inputs)
        places = dict(zip((signal.name for signal in self.inputs), inputs.places, strict=True))
        size = SLOT * (self.states or 0)
        return FmuLayout(
            inputs,
            laid_out(room, version, self.outputs),
            laid_out(room, version, self.tunable),
            [places[signal.name] for signal in self._direct],
            room.take(size),
            room.take(size),
            room.size,
        )

    def _fixed(self, values: Mapping[str, Any]) -> list[FixedValues]:
        """Return the values that are set once: those that are not the FMU's own."""
        tunable = {signal.name for signal in self.tunable}
        found = []
        for signal in (*self.parameters, *self.starts):
            given = converted(signal, values[signal.name])
            own = tuple(value for variable in signal.variables for value in variable.start or ())
            if signal.name not in tunable and given != own:
                found.append(FixedValues(signal.first.kind, signal.references, given))
        return found


def _interface(path: str, description: FmuDescription, *, exchange: bool) -> FmuInterface:
    """Return the interface that is used; QuadvisError if the FMU does not have it."""
    found = description.exchange if exchange else description.cosimulation
    if found is not None:
        return found
    if description.exchange is None and description.cosimulation is None:
        raise one_interface(path, description)
    has, lacks = ("model exchange", "co-simulation")[:: -1 if exchange else 1]
    raise refused(path, f"it offers {has}, not {lacks}")


def _planned(
    path: str,
    description: FmuDescription,
    interface: FmuInterface,
    units: Units,
    taken: set[str],
    *,
    exchange: bool,
) -> FmuPlan:
    variables = description.variables
    names = {*description.units, *(each.unit for each in variables), *(each.name for each in variables)}
    if unused := sorted(units.confirmed.keys() - names):
        problem = f"it has no unit and no variable '{unused[0]}', for which 'units' has a meaning"
        raise QuadvisError(sentence(problem, suggestion(unused[0], sorted(names))))
    if not exchange and any(variable.kind == "Clock" for variable in variables):
        raise QuadvisError("it has clocks, which quadvis does not know")

    def made(chosen: Sequence[FmuVariable]) -> tuple[FmuSignal, ...]:
        found = tuple(signals(chosen, units, taken))
        taken.update(signal.name for signal in found)
        return found

    def wires(causality: str) -> tuple[FmuSignal, ...]:
        kinds = [each for each in variables if each.causality == causality and each.kind != "String"]
        return made(kinds)

    inputs, outputs = wires("input"), wires("output")
    parameters, own_starts = settable(description, exchange=exchange)
    found = made(parameters)
    named = {signal.references: signal.name for signal in outputs}
    starts = []
    for signal in signals(own_starts, units, ()):
        name = plain_name(f"{named.get(signal.references, signal.name)}{START}", taken)
        taken.add(name)
        starts.append(replace(signal, name=name))
    if exchange:
        _refuse_events(description, inputs)
    direct = frozenset(
        signal.name
        for signal in inputs
        if any(
            description.depends(output, variable)
            for each in outputs
            for output in each.variables
            for variable in signal.variables
        )
    )
    count = _state_count(description) if exchange else None
    return FmuPlan(path, description, interface, inputs, outputs, found, tuple(starts), direct, count)


def _state_count(description: FmuDescription) -> int:
    """Return the number of continuous states."""
    variables = {description.key(variable): variable for variable in description.variables}
    total = 0
    for key in description.states:
        size = 1
        for dimension in variables[key].dimensions:
            size *= dimension
        total += size
    return total


def _refuse_events(description: FmuDescription, inputs: Sequence[FmuSignal]) -> None:
    """Refuse, for model exchange, what needs events."""
    remedy = "take its co-simulation" if description.cosimulation is not None else ""
    if description.indicators:
        problem = "model exchange with state events is not possible here"
        raise QuadvisError(sentence(f"{problem}, and it has {description.indicators}", remedy))
    for signal in inputs:
        if signal.first.kind not in REALS or signal.first.variability != "continuous":
            problem = f"its input '{signal.stated}' is discrete, which in model exchange needs events"
            raise QuadvisError(sentence(problem, remedy))


def instants(start: float, period: float) -> tuple[int, int, int]:
    """Return a, b and d: the communication point k is (a + k b) / d, exactly, of decimal times (s)."""
    first, step = Fraction(str(start)), _exact(period)
    denominator = first.denominator * step.denominator
    return first.numerator * step.denominator, step.numerator * first.denominator, denominator


def _exact(period: float) -> Fraction:
    """Return the period of a rate, such as 1/30 s, of which a block knows the nearest float."""
    near = Fraction(period).limit_denominator(1_000_000_000)
    return near if float(near) == period else Fraction(period)
