"""The model description of an exported FMU, in XML.

Sources: Functional Mock-up Interface 2.0.4, chapters 2.2 and 4.3; 3.0.2, chapters 2.4 and 4.3.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from xml.sax.saxutils import quoteattr

from quadvis.export.variables import INPUT, OUTPUT, PARAMETER, ExportedVariable
from quadvis.units import Unit
from quadvis.version import __version__

TYPES = {
    2: {"float64": "Real", "int64": "Integer", "bool": "Boolean"},
    3: {"float64": "Float64", "int64": "Int64", "bool": "Boolean"},
}
SOURCES = {2: ("steps.c", "fmi2.c"), 3: ("steps.c", "fmi3.c")}
BASES = ("kg", "m", "s", "A", "K", "rad")


@dataclass(frozen=True)
class Facts:
    """What a description says beside the variables; times in s."""

    version: int
    name: str
    doc: str
    identifier: str
    token: str
    step: float
    stop: float


def model_description(facts: Facts, variables: Sequence[ExportedVariable]) -> str:
    """Return modelDescription.xml. In FMI 2.0 all variables are scalars."""
    lines = _lines_2(facts, variables) if facts.version == 2 else _lines_3(facts, variables)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + "\n".join(lines) + "\n"


def build_description(facts: Facts) -> str:
    """Return sources/buildDescription.xml of FMI 3.0."""
    files = "".join(f'<SourceFile name="{name}"/>' for name in SOURCES[3])
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n<fmiBuildDescription fmiVersion="3.0">\n'
        f'  <BuildConfiguration modelIdentifier="{facts.identifier}">\n'
        f'    <SourceFileSet language="C99">{files}</SourceFileSet>\n'
        "  </BuildConfiguration>\n</fmiBuildDescription>\n"
    )


def _lines_2(facts: Facts, variables: Sequence[ExportedVariable]) -> Iterator[str]:
    yield (
        f'<fmiModelDescription fmiVersion="2.0" modelName={quoteattr(facts.name)} guid="{facts.token}"'
        f' description={quoteattr(facts.doc)} generationTool="quadvis {__version__}"'
        ' variableNamingConvention="structured">'
    )
    files = "".join(f'<File name="{name}"/>' for name in SOURCES[2])
    yield (
        f'  <CoSimulation modelIdentifier="{facts.identifier}" canHandleVariableCommunicationStepSize="true"'
        f' canGetAndSetFMUstate="true" canSerializeFMUstate="true">'
        f"<SourceFiles>{files}</SourceFiles></CoSimulation>"
    )
    yield from _units(variables)
    yield '  <LogCategories><Category name="logStatusError"/></LogCategories>'
    yield _experiment(facts)
    yield "  <ModelVariables>"
    for number, each in enumerate(variables):
        attributes = f'{_name(each)} valueReference="{number}" {_causality(each)}'
        kind = f"<{TYPES[2][each.scalar]}{_values(each)}/>"
        yield f"    <ScalarVariable {attributes}>{kind}</ScalarVariable>"
    yield "  </ModelVariables>"
    yield "  <ModelStructure>"
    indices = {each.name: number for number, each in enumerate(variables, 1)}
    outputs = [each for each in variables if each.role == OUTPUT]
    if outputs:
        yield "    <Outputs>"
        yield from (
            f'      <Unknown index="{indices[each.name]}"{_depends(each, variables, 1)}/>' for each in outputs
        )
        yield "    </Outputs>"
        yield "    <InitialUnknowns>"
        yield from (f'      <Unknown index="{indices[each.name]}"/>' for each in outputs)
        yield "    </InitialUnknowns>"
    yield "  </ModelStructure>"
    yield "</fmiModelDescription>"


def _lines_3(facts: Facts, variables: Sequence[ExportedVariable]) -> Iterator[str]:
    yield (
        f'<fmiModelDescription fmiVersion="3.0" modelName={quoteattr(facts.name)}'
        f' instantiationToken="{facts.token}" description={quoteattr(facts.doc)}'
        f' generationTool="quadvis {__version__}" variableNamingConvention="structured">'
    )
    yield (
        f'  <CoSimulation modelIdentifier="{facts.identifier}" canHandleVariableCommunicationStepSize="true"'
        ' canGetAndSetFMUState="true" canSerializeFMUState="true"/>'
    )
    yield from _units(variables)
    yield '  <LogCategories><Category name="logStatusError"/></LogCategories>'
    yield _experiment(facts)
    yield "  <ModelVariables>"
    time = len(variables)
    facts_of_time = 'causality="independent" variability="continuous" unit="s"'
    yield f'    <Float64 name="time" valueReference="{time}" {facts_of_time}/>'
    for number, each in enumerate(variables):
        kind = TYPES[3][each.scalar]
        sizes = "".join(f'<Dimension start="{size}"/>' for size in each.shape)
        head = f'<{kind} {_name(each)} valueReference="{number}" {_causality(each)}{_values(each)}'
        yield f"    {head}>{sizes}</{kind}>" if sizes else f"    {head}/>"
    yield "  </ModelVariables>"
    yield "  <ModelStructure>"
    for number, each in enumerate(variables):
        if each.role == OUTPUT:
            yield f'    <Output valueReference="{number}"{_depends(each, variables, 0)}/>'
    for number, each in enumerate(variables):
        if each.role == OUTPUT:
            yield f'    <InitialUnknown valueReference="{number}"/>'
    yield "  </ModelStructure>"
    yield "</fmiModelDescription>"


def _experiment(facts: Facts) -> str:
    return f'  <DefaultExperiment startTime="0.0" stopTime="{facts.stop!r}" stepSize="{facts.step!r}"/>'


def _units(variables: Sequence[ExportedVariable]) -> Iterator[str]:
    """Yield the definitions of all units: what SI makes of them."""
    names = {each.unit for each in variables if each.unit} | {"s"}
    if names:
        yield "  <UnitDefinitions>"
        for name in sorted(names):
            unit = Unit.parse(name)
            powers = {symbol: power for symbol, power in unit.dimension}
            plain = all(symbol in BASES and power.denominator == 1 for symbol, power in powers.items())
            base = "".join(f' {symbol}="{int(powers[symbol])}"' for symbol in BASES if symbol in powers)
            factor = f' factor="{unit.scale!r}"' if unit.scale != 1.0 else ""
            yield f"    <Unit name={quoteattr(name)}>" + (
                f"<BaseUnit{base}{factor}/></Unit>" if plain else "</Unit>"
            )
        yield "  </UnitDefinitions>"


def _name(each: ExportedVariable) -> str:
    doc = " ".join(each.doc.split())
    return f"name={quoteattr(each.name)}" + (f" description={quoteattr(doc)}" if doc else "")


def _causality(each: ExportedVariable) -> str:
    if each.role == PARAMETER:
        return 'causality="parameter" variability="tunable" initial="exact"'
    variability = "continuous" if each.scalar == "float64" else "discrete"
    initial = ' initial="calculated"' if each.role == OUTPUT else ""
    return f'causality="{each.role}" variability="{variability}"{initial}'


def _values(each: ExportedVariable) -> str:
    """Return unit, limits and start value as attributes."""
    found = f" unit={quoteattr(each.unit)}" if each.unit else ""
    if each.role == PARAMETER and each.scalar != "bool":
        limits = (("min", each.least), ("max", each.most))
        found += "".join(
            f' {name}="{_number(each, value)}"' for name, value in limits if math.isfinite(value)
        )
    if each.role in (INPUT, PARAMETER):
        found += f' start="{" ".join(_number(each, value) for value in each.start)}"'
    return found


def _number(each: ExportedVariable, value: float) -> str:
    if each.scalar == "bool":
        return "true" if value else "false"
    if math.isinf(value):
        return "INF" if value > 0 else "-INF"
    return str(int(value)) if each.scalar == "int64" else repr(float(value))


def _depends(each: ExportedVariable, variables: Sequence[ExportedVariable], first: int) -> str:
    """Return what an output follows at the same instant, by places among the variables from ``first`` on."""
    bases = set(each.follows)
    places = [
        str(place)
        for place, other in enumerate(variables, first)
        if other.role == INPUT and other.name.partition("[")[0] in bases
    ]
    return f' dependencies="{" ".join(places)}"'
