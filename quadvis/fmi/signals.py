"""The variables of an FMU as signals: arrays put together, plain names, units, start values."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from quadvis.fmi.description import INTEGERS, REALS, FmuDescription, FmuVariable, Number
from quadvis.fmi.units import Conversion, Units

SCALARS = {
    **dict.fromkeys(REALS, "float64"), **dict.fromkeys(INTEGERS, "int64"), "Enumeration": "int64",
    "Boolean": "bool", "String": "str",
}  # fmt: skip
SINGLE = 3.4e38  # the largest number of a Float32, about
_ELEMENT = re.compile(r"(.+)\[(\d{1,6}(?:,\s*\d{1,6}){0,3})\]", re.ASCII | re.DOTALL)


@dataclass(frozen=True)
class FmuSignal:
    """A variable, or several that are the elements of one array, row by row.

    ``name`` is what a diagram writes; ``stated`` is the FMU's own name.
    """

    name: str
    stated: str
    variables: tuple[FmuVariable, ...]
    shape: tuple[int, ...]
    conversion: Conversion

    @property
    def first(self) -> FmuVariable:
        """The first variable, which stands for all."""
        return self.variables[0]

    @property
    def scalar(self) -> str:
        """The kind of the signal on a wire: float64, int64, bool; str of a text."""
        return SCALARS[self.first.kind]

    @property
    def type(self) -> str:
        """The type of the signal in a declaration."""
        return self.scalar + (f"[{','.join(map(str, self.shape))}]" if self.shape else "")

    @property
    def references(self) -> tuple[int, ...]:
        """The value references of its variables."""
        return tuple(variable.reference for variable in self.variables)

    @property
    def count(self) -> int:
        """How many values it has."""
        return math.prod(self.shape)

    @property
    def doc(self) -> str:
        """What it is: the FMU's text, and its name if a diagram cannot write that."""
        text = " ".join(self.first.text.split()) or f"{self.first.causality} of the FMU"
        return text if self.name == self.stated else f"{text} ({self.stated})"

    @property
    def start(self) -> object:
        """The start value in SI units: a number, an array, a text; None if one of its values has none."""
        starts = [variable.start for variable in self.variables]
        if any(start is None for start in starts):
            return None
        values = [value for start in starts if start is not None for value in start]
        if self.scalar == "str":
            return str(values[0])
        if self.scalar == "float64":
            values = [self.conversion.to_si(float(value)) for value in values]
        elif self.scalar == "bool":
            values = [bool(value) for value in values]
        return np.reshape(np.array(values), self.shape).tolist() if self.shape else values[0]


def signals(variables: Iterable[FmuVariable], units: Units, taken: Collection[str]) -> list[FmuSignal]:
    """Return the signals of variables whose type a wire or a parameter can have.

    No name is one of those that are ``taken``, and no two are alike.
    """
    usable = [variable for variable in variables if variable.kind in SCALARS]
    names = set(taken)
    found = []
    for stated, members, shape in _arrays(usable):
        first = members[0]
        sizes = shape or first.dimensions
        name = plain_name(stated, names)
        names.add(name)
        found.append(FmuSignal(name, stated, tuple(members), sizes, units.of(first)))
    return found


def plain_name(stated: str, taken: Collection[str]) -> str:
    """Return a name that a diagram can write for one of an FMU, such as body_frame_r for body.frame.r."""
    words = re.sub(r"\W+", "_", stated, flags=re.ASCII).strip("_")
    base = words if words[:1].isalpha() else f"v_{words}" if words else "v"
    if base not in taken:
        return base
    return next(name for number in range(2, 1_000_000) if (name := f"{base}_{number}") not in taken)


def _arrays(
    variables: Sequence[FmuVariable],
) -> Iterator[tuple[str, list[FmuVariable], tuple[int, ...]]]:
    """Yield a name, variables and sizes: elements such as u[1], u[2] together if they fill an array."""
    groups: dict[str, dict[tuple[int, ...], FmuVariable]] = {}
    for variable in variables:
        match = _ELEMENT.fullmatch(variable.name)
        if match and not variable.dimensions:
            place = tuple(int(index) for index in match[2].split(","))
            groups.setdefault(match[1], {})[place] = variable
    names = {variable.name for variable in variables}
    shapes = {name: _sizes(group) for name, group in groups.items() if name not in names}
    done = set[str]()
    for variable in variables:
        match = _ELEMENT.fullmatch(variable.name)
        base = match[1] if match and not variable.dimensions else ""
        if not (base and shapes.get(base)):
            yield variable.name, [variable], ()
        elif base not in done:
            done.add(base)
            group = groups[base]
            yield base, [group[place] for place in sorted(group)], shapes[base]


def _sizes(group: dict[tuple[int, ...], FmuVariable]) -> tuple[int, ...]:
    """Return the sizes of the array whose elements these are; () if they are unlike, or some are missing."""
    alike = {
        (each.kind, each.causality, each.variability, each.unit, each.relative, len(place))
        for place, each in group.items()
    }
    if len(alike) != 1:
        return ()
    axes = list(zip(*group, strict=True))
    firsts = [min(axis) for axis in axes]
    sizes = tuple(max(axis) - first + 1 for axis, first in zip(axes, firsts, strict=True))
    if any(first > 1 for first in firsts) or math.prod(sizes) != len(group):
        return ()
    whole = product(*(range(first, first + size) for first, size in zip(firsts, sizes, strict=True)))
    return sizes if all(place in group for place in whole) else ()


def settable(description: FmuDescription, *, exchange: bool) -> tuple[list[FmuVariable], list[FmuVariable]]:
    """Return the parameters of an FMU, and the outputs and states that have a start value of their own.

    Structural parameters, which change sizes, are not among them.
    """
    parameters = [
        variable
        for variable in description.variables
        if variable.causality == "parameter" and variable.start is not None
    ]
    keys = set(description.outputs)
    derivatives = {description.key(each): each for each in description.variables}
    keys |= {derivatives[key].derivative_of for key in description.states if key in derivatives}
    starts = [
        variable
        for variable in description.variables
        if description.key(variable) in keys
        and variable.initial in ("exact", "approx")
        and variable.start is not None
        and variable.variability != "constant"
        and variable.causality in ("output", "local")
    ]
    return parameters, starts


def converted(signal: FmuSignal, value: object) -> tuple[Number, ...]:
    """Return the values that an FMU takes for a value in SI units."""
    if signal.scalar == "str":
        return (str(value),)
    flat = np.ravel(np.asarray(value))
    if signal.scalar == "float64":
        same = signal.conversion.same
        return tuple(float(each) if same else signal.conversion.from_si(float(each)) for each in flat)
    return tuple(bool(each) if signal.scalar == "bool" else int(each) for each in flat)


def bounds(signal: FmuSignal) -> tuple[float | None, float | None]:
    """Return the least and the most of a value in SI units, as the FMU and its types say."""
    least, most = signal.first.least, signal.first.most
    if signal.scalar == "float64":
        ends = [None if each is None else signal.conversion.to_si(each) for each in (least, most)]
        if signal.conversion.factor < 0.0:
            ends.reverse()
        if signal.first.kind == "Float32":
            ends = [-SINGLE if ends[0] is None else ends[0], SINGLE if ends[1] is None else ends[1]]
        return ends[0], ends[1]
    if signal.scalar != "int64":
        return None, None
    bits = int(re.sub(r"\D", "", signal.first.kind) or 32)
    low, high = (
        (0, 2**bits - 1) if signal.first.kind.startswith("U") else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    )
    return max(low, least if least is not None else low), min(high, most if most is not None else high)
