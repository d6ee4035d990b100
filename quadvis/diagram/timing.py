"""Rates, the solver's step and the stop time that are parameters, or that settings replace.

``rates: {control: $fs}``, ``solver: {step: 1 / (10 * $fs)}``, ``stop_time: $T``; as settings they are
``rates.control``, ``solver.step`` and ``stop_time``. The solver's method and tolerances are settings, too.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from fractions import Fraction
from typing import TypeVar

from quadvis.diagram.overrides import Overrides
from quadvis.diagram.parameters import Params, named_parameters, substitute
from quadvis.diagram.sections.blocks import BLOCKS
from quadvis.diagram.sections.params import PARAMS
from quadvis.diagram.sections.rates import RATES, Rate, read_rate
from quadvis.diagram.sections.solver import SOLVER, SOLVER_KEYS, SolverSpec, read_method, read_tolerances
from quadvis.diagram.sections.stop_time import STOP_TIME, OpenTime
from quadvis.diagram.spec import FileSpec
from quadvis.diagram.times import read_duration, read_step
from quadvis.document import YamlMap, YamlNode
from quadvis.errors import UNKNOWN, Faults, Unknown, known, suggestion
from quadvis.graph.graph import USUAL

METHOD, STEP = SOLVER_KEYS[:2]
_Read = TypeVar("_Read")


def timing_nodes(spec: FileSpec) -> Iterator[YamlNode]:
    """Yield the times of a file that name parameters."""
    for rate in spec[RATES].values():
        if known(rate) and rate.node is not None:
            yield rate.node
    nodes = (spec[SOLVER].node, _open(spec[STOP_TIME]))
    yield from (node for node in nodes if node is not None)


def timed(spec: FileSpec, params: Params, overrides: Overrides, faults: Faults) -> FileSpec:
    """Return a diagram whose times are known: settings in place, parameters by their values."""
    if not any(map(overrides.of, ("", RATES.key, SOLVER.key))) and not any(
        map(named_parameters, timing_nodes(spec))
    ):
        return spec
    timing = _Timing(spec, params, overrides, faults)
    values = spec.values.replaced(RATES, timing.rates())
    values = values.replaced(SOLVER, timing.solver()).replaced(STOP_TIME, timing.stop_time())
    return replace(spec, values=values)


def _open(stop_time: Fraction | Unknown | OpenTime | None) -> YamlNode | None:
    return stop_time.node if isinstance(stop_time, OpenTime) else None


class _Timing:
    def __init__(self, spec: FileSpec, params: Params, overrides: Overrides, faults: Faults) -> None:
        self.spec, self.params, self.overrides, self.faults = spec, params, overrides, faults

    def _is_free(self, key: str) -> bool:
        """Say whether settings under a key can only mean times: no block and no group has this name."""
        return key not in self.spec[BLOCKS] and key not in self.spec[PARAMS]

    def _node(self, path: str, name: str, own: YamlNode | None) -> YamlNode | Unknown | None:
        """Return the setting of a time if there is one, else its own node if that names parameters."""
        if self._is_free(path or name) and name in self.overrides.of(path):
            chosen = self.overrides.chosen(path, name, UNKNOWN if own is None else own)
            if chosen is not own:
                return chosen
        return own if own is not None and named_parameters(own) else None

    def _read(
        self, read: Callable[[YamlNode], _Read], node: YamlNode | Unknown, subject: str
    ) -> _Read | Unknown:
        with self.faults.about(subject):
            found = self._substituted(node) if known(node) else UNKNOWN
            return self.faults.read(read, found) if known(found) else UNKNOWN

    def _substituted(self, node: YamlNode) -> YamlNode | Unknown:
        if not isinstance(node, YamlMap):
            return substitute(node, self.params, self.faults)
        values = {key: substitute(value, self.params, self.faults) for key, value in node.values.items()}
        if not all(map(known, values.values())):
            return UNKNOWN
        whole = {key: value for key, value in values.items() if known(value)}
        return YamlMap(node.keys, whole, node.file, node.line, node.column, node.key)

    def rates(self) -> dict[str, Rate | Unknown]:
        """Return the rates."""
        found = dict(self.spec[RATES])
        for name, rate in found.items():
            node = self._node(RATES.key, name, rate.node if known(rate) else None)
            if node is not None:
                found[name] = self._read(read_rate, node, "")
        for name, setting in self.overrides.of(RATES.key).items() if self._is_free(RATES.key) else ():
            if name not in found:
                self.overrides.chosen(RATES.key, name, UNKNOWN)
                remedy = suggestion(name, found) if found else "the diagram has no rates"
                self.faults.add(setting.place, f"there is no rate '{name}'", remedy, subject="")
        return found

    def solver(self) -> SolverSpec:
        """Return the solver."""
        own = self._solver_method(self.spec[SOLVER])
        node = self._node(SOLVER.key, STEP, own.node)
        if node is None:
            return own
        place = node.place if known(node) else own.place
        return own._replace(step=self._read(read_step, node, ""), place=place)

    def _solver_method(self, own: SolverSpec) -> SolverSpec:
        """Return the solver with the method and the tolerances of settings."""
        given: dict[str, YamlNode] = {}
        for name, setting in self.overrides.of(SOLVER.key).items() if self._is_free(SOLVER.key) else ():
            value = self.overrides.chosen(SOLVER.key, name, UNKNOWN)
            if name not in SOLVER_KEYS:
                problem = f"the solver has no '{name}'"
                self.faults.add(setting.place, problem, suggestion(name, SOLVER_KEYS), subject="")
            elif name != STEP and known(value):
                found = self._substituted(value)
                given |= {name: found} if known(found) else {}
        with self.faults.about(""):
            read = self.faults.read(read_method, given[METHOD]) if METHOD in given else own.method
            method = read if known(read) else own.method
            tolerances = read_tolerances(given, method, self.faults, own.tolerances) if known(read) else USUAL
        return own._replace(method=method, tolerances=tolerances)

    def stop_time(self) -> Fraction | Unknown | None:
        """Return the stop time."""
        own = self.spec[STOP_TIME]
        node = self._node("", STOP_TIME.key, _open(own))
        if node is None:
            assert not isinstance(own, OpenTime)
            return own
        return self._read(read_duration, node, "")
