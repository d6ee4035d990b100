"""From the XML of a model description to plain data; everything is checked, and refused with its line."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping
from typing import TypeVar

from quadvis.errors import QuadvisError, quoted
from quadvis.fmi.archive import opened, refused
from quadvis.fmi.description import (
    INTEGERS,
    REALS,
    FmuDescription,
    FmuInterface,
    FmuUnit,
    FmuVariable,
    Number,
)
from quadvis.fmi.markup import Element, MarkupError, read_markup

ROOT = "fmiModelDescription"
KINDS2 = {
    "Real": "Float64",
    "Integer": "Int32",
    "Boolean": "Boolean",
    "String": "String",
    "Enumeration": "Enumeration",
}
KINDS3 = (*REALS, *INTEGERS, "Boolean", "String", "Binary", "Enumeration", "Clock")
BASES = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
MOST_VARIABLES = 500_000
MOST_ELEMENTS = 1_000_000  # of one array
MOST_DIMENSIONS = 8
_IDENTIFIER = re.compile(r"[A-Za-z_]\w{0,199}", re.ASCII)

_Value = TypeVar("_Value")


def read_fmu(path: str) -> tuple[FmuDescription, frozenset[str]]:
    """Return what the FMU in a file says about itself, and the names of its files.

    QuadvisError, in a sentence, if it is not usable.
    """
    with opened(path) as archive:
        data, names = archive.description(), frozenset(archive.names)
    try:
        return describe(read_markup(data)), names
    except MarkupError as error:
        raise refused(path, f"its model description: {error}") from None


def describe(root: Element) -> FmuDescription:
    """Return the data of a description; MarkupError for what is wrong with it."""
    if root.name != ROOT:
        raise wrong(root, f"the root is '{root.name}', not '{ROOT}'")
    version = required(root, "fmiVersion")
    if version != "2.0" and not re.fullmatch(r"3\.\d+(-[\w.]+)?", version, re.ASCII):
        raise wrong(root, f"FMI {quoted(version)} is not known here; 2.0 and 3.0 are")
    number = int(version[0])
    variables = _Variables(root, number).read()
    structure = _Structure(root, number, variables)
    experiment = root.child("DefaultExperiment")
    return FmuDescription(
        number,
        required(root, "modelName"),
        required(root, "guid" if number == 2 else "instantiationToken"),
        root.attributes.get("generationTool", ""),
        _interface(root, "CoSimulation", number),
        _interface(root, "ModelExchange", number),
        root.child("ScheduledExecution") is not None,
        {unit.name: unit for unit in map(_unit, root.all("UnitDefinitions", "Unit"))},
        variables,
        structure.dependencies,
        structure.outputs,
        structure.states,
        _indicators(root, number),
        _experiment(experiment, "startTime") or 0.0,
        _experiment(experiment, "stopTime"),
        _experiment(experiment, "stepSize"),
    )


def wrong(element: Element, why: str) -> MarkupError:
    """Return the fault of an element, with its line."""
    return MarkupError(f"line {element.line}: {why}")


def required(element: Element, name: str) -> str:
    """Return an attribute that must be there."""
    if name not in element.attributes:
        raise wrong(element, f"{element.name} has no '{name}'")
    return element.attributes[name]


def real(text: str) -> float:
    """Return a number of XML Schema's; ValueError if it is none."""
    if "_" in text:
        raise ValueError(text)
    return float(text)


def whole(text: str) -> int:
    """Return a whole number; ValueError if it is none."""
    if not re.fullmatch(r"\s*[+-]?[0-9]{1,30}\s*", text, re.ASCII):
        raise ValueError(text)
    return int(text)


def truth(text: str) -> bool:
    """Return a truth value; ValueError if it is none."""
    return {"true": True, "1": True, "false": False, "0": False}[text.strip()]


def _attribute(element: Element, name: str, read: Callable[[str], _Value], default: _Value) -> _Value:
    """Return an attribute, read; the default if it is not there."""
    if name not in element.attributes:
        return default
    text = element.attributes[name]
    try:
        return read(text)
    except (ValueError, KeyError, OverflowError):
        raise wrong(element, f"'{name}' of {element.name} cannot be {quoted(text)}") from None


def _interface(root: Element, name: str, version: int) -> FmuInterface | None:
    found = root.child(name)
    if found is None:
        return None
    identifier = required(found, "modelIdentifier")
    if not _IDENTIFIER.fullmatch(identifier):
        raise wrong(found, f"the model identifier {quoted(identifier)} is no name in C")
    state = "FMUstate" if version == 2 else "FMUState"
    return FmuInterface(
        identifier,
        _attribute(found, f"canGetAndSet{state}", truth, default=False),
        _attribute(found, f"canSerialize{state}", truth, default=False),
        _attribute(found, "needsExecutionTool", truth, default=False),
        _attribute(found, "canBeInstantiatedOnlyOncePerProcess", truth, default=False),
        _attribute(found, "fixedInternalStepSize", real, 0.0),
        not _attribute(found, "completedIntegratorStepNotNeeded", truth, default=False)
        if version == 2
        else _attribute(found, "needsCompletedIntegratorStep", truth, default=True),
    )


def _unit(element: Element) -> FmuUnit:
    name, base = required(element, "name"), element.child("BaseUnit")
    if base is None:
        return FmuUnit(name)
    exponents = {symbol: _attribute(base, symbol, whole, 0) for symbol in BASES}
    factor, offset = _attribute(base, "factor", real, 1.0), _attribute(base, "offset", real, 0.0)
    if not (math.isfinite(factor) and math.isfinite(offset) and factor):
        raise wrong(base, f"unit {quoted(name)} cannot have the factor {factor:g} and the offset {offset:g}")
    if any(abs(power) > 20 for power in exponents.values()):
        raise wrong(base, f"unit {quoted(name)} has an exponent beyond 20")
    return FmuUnit(name, {symbol: power for symbol, power in exponents.items() if power}, factor, offset)


def _indicators(root: Element, version: int) -> int:
    if version == 2:
        return _attribute(root, "numberOfEventIndicators", whole, 0)
    return len(root.all("ModelStructure", "EventIndicator"))


def _experiment(element: Element | None, name: str) -> float | None:
    found = None if element is None else _attribute(element, name, real, None)
    return found if found is not None and math.isfinite(found) else None


class _Variables:
    """Reads the variables."""

    def __init__(self, root: Element, version: int) -> None:
        self._root, self._version = root, version
        types = root.child("TypeDefinitions")
        self._types: dict[str, Element] = {}
        for each in types.children if types is not None else ():
            inner = each.children[0] if version == 2 and each.children else each
            self._types[each.attributes.get("name", "")] = inner

    def read(self) -> tuple[FmuVariable, ...]:
        """Return them in their order."""
        listed = self._root.child("ModelVariables")
        if listed is None:
            raise wrong(self._root, "there are no ModelVariables")
        elements = listed.children
        if len(elements) > MOST_VARIABLES:
            raise wrong(listed, f"there are {len(elements)} variables, {MOST_VARIABLES} are the most")
        found = [self._one(each, index) for index, each in enumerate(elements, 1)]
        names = set[str]()
        for variable, element in zip(found, elements, strict=True):
            if variable.name in names:
                raise wrong(element, f"the variable {quoted(variable.name)} stands there twice")
            names.add(variable.name)
        return tuple(self._sized(found)) if self._version == 3 else tuple(found)

    def _one(self, outer: Element, index: int) -> FmuVariable:
        if self._version == 2:
            inner = next((each for each in outer.children if each.name in KINDS2), None)
            if outer.name != "ScalarVariable" or inner is None:
                raise wrong(outer, f"this is no variable with a type: {outer.name}")
            kind = KINDS2[inner.name]
        else:
            inner, kind = outer, outer.name
            if kind not in KINDS3:
                raise wrong(outer, f"there is no type '{kind}' of variables")
        reference = _attribute(outer, "valueReference", whole, -1)
        if not 0 <= reference < 2**32:
            raise wrong(outer, f"the value reference {reference} is no 32-bit number")
        causality = outer.attributes.get("causality", "local")
        variability = outer.attributes.get("variability") or _variability(kind, causality)
        declared = self._types.get(inner.attributes.get("declaredType", ""))

        def taken(name: str, read: Callable[[str], _Value], default: _Value) -> _Value:
            found = _attribute(declared, name, read, default) if declared is not None else default
            return _attribute(inner, name, read, found)

        numeric = kind in REALS or kind in INTEGERS
        return FmuVariable(
            required(outer, "name"),
            index,
            reference,
            kind,
            causality,
            variability,
            outer.attributes.get("initial") or _initial(causality, variability),
            _start(inner, kind),
            taken("unit", str, "") if kind in REALS else "",
            taken("relativeQuantity", truth, False),
            taken("min", real, None) if numeric else None,
            taken("max", real, None) if numeric else None,
            outer.attributes.get("description", ""),
            (),
            _attribute(inner, "derivative", whole, 0),
            outer.line,
        )

    def _sized(self, found: list[FmuVariable]) -> Iterable[FmuVariable]:
        """Give arrays their sizes, which other variables may have."""
        listed = self._root.child("ModelVariables")
        assert listed is not None
        by_reference = {variable.reference: variable for variable in found}
        for variable, element in zip(found, listed.children, strict=True):
            sizes = []
            for dimension in element.all("Dimension"):
                size = _attribute(dimension, "start", whole, -1)
                if size < 0:
                    other = by_reference.get(_attribute(dimension, "valueReference", whole, -1))
                    if other is None or not other.start or not isinstance(other.start[0], int):
                        raise wrong(dimension, f"the size of {quoted(variable.name)} is not known")
                    size = other.start[0]
                sizes.append(size)
            if sizes and (len(sizes) > MOST_DIMENSIONS or not 0 < math.prod(sizes) <= MOST_ELEMENTS):
                raise wrong(element, f"{quoted(variable.name)} cannot have the sizes {sizes}")
            count, start = math.prod(sizes), variable.start
            if start is not None and len(start) == 1 < count:
                start = start * count
            if start is not None and len(start) != count:
                raise wrong(
                    element, f"{quoted(variable.name)} has {len(start)} start values for {count} elements"
                )
            yield _replaced(variable, start, tuple(sizes))


def _replaced(variable: FmuVariable, start: tuple[Number, ...] | None, sizes: tuple[int, ...]) -> FmuVariable:
    if not sizes and start is variable.start:
        return variable
    return FmuVariable(**{**vars(variable), "start": start, "dimensions": sizes})


def _variability(kind: str, causality: str) -> str:
    if causality in ("parameter", "calculatedParameter", "structuralParameter"):
        return "fixed"
    return "continuous" if kind in REALS else "discrete"


def _initial(causality: str, variability: str) -> str:
    """Return the default of ``initial``; source: FMI 2.0.4, table on page 51."""
    if causality in ("parameter", "structuralParameter") or variability == "constant":
        return "exact"
    if causality == "input":
        return "exact"  # FMI 2.0 has none for inputs, whose start values hold as such
    return "" if causality == "independent" else "calculated"


def _start(element: Element, kind: str) -> tuple[Number, ...] | None:
    """Return the start values."""
    if kind in ("Binary", "Clock"):
        return None
    if kind == "String":
        inner = [each.attributes.get("value", "") for each in element.all("Start")]
        given = [element.attributes["start"]] if "start" in element.attributes else inner
        return tuple(given) or None
    if "start" not in element.attributes:
        return None
    read: Callable[[str], Number] = real if kind in REALS else truth if kind == "Boolean" else whole
    words = element.attributes["start"].split()
    try:
        return tuple(read(word) for word in words) or None
    except (ValueError, KeyError, OverflowError):
        text = element.attributes["start"]
        raise wrong(element, f"a start value of type {kind} cannot be {quoted(text)}") from None


class _Structure:
    """What depends on what."""

    def __init__(self, root: Element, version: int, variables: tuple[FmuVariable, ...]) -> None:
        known = {variable.index if version == 2 else variable.reference for variable in variables}
        self._known, self._key = known, "index" if version == 2 else "valueReference"
        outputs = ("ModelStructure", "Outputs", "Unknown") if version == 2 else ("ModelStructure", "Output")
        states = (
            ("ModelStructure", "Derivatives", "Unknown")
            if version == 2
            else ("ModelStructure", "ContinuousStateDerivative")
        )
        self.dependencies: dict[int, frozenset[int] | None] = {}
        self.outputs = tuple(self._take(each) for each in root.all(*outputs))
        self.states = tuple(self._take(each) for each in root.all(*states))

    def _take(self, element: Element) -> int:
        key = _attribute(element, self._key, whole, -1)
        if key not in self._known:
            raise wrong(element, f"there is no variable with the {self._key} {key}")
        self.dependencies[key] = _attribute(element, "dependencies", _keys, None)
        return key


def _keys(text: str) -> frozenset[int] | None:
    return frozenset(map(whole, text.split()))


def variables_by_key(description: FmuDescription) -> Mapping[int, FmuVariable]:
    """Return the variables by what the structure names them."""
    return {description.key(variable): variable for variable in description.variables}


def one_interface(path: str, description: FmuDescription) -> QuadvisError:
    """Return why an FMU that offers neither interface cannot be run."""
    if description.scheduled:
        return refused(
            path, "it can only be scheduled by its clocks; quadvis runs co-simulation and model exchange"
        )
    return refused(path, "it offers neither co-simulation nor model exchange")
