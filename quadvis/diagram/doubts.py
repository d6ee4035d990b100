"""Warnings: what can be run, and is surely not what was meant."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from fractions import Fraction

from quadvis.diagram.expand import Parts
from quadvis.diagram.loader import BlockSpec, FileSpec, InputSpec
from quadvis.diagram.times import read_duration, time_text
from quadvis.diagram.values import named_parameters
from quadvis.document import YamlList, YamlMap, YamlNode
from quadvis.errors import Faults

# The sections with windows, and the keys of a window's begin and end.
WINDOWS = {"expect": ("after", "before"), "summary": ("after", "before"), "figures": ("from", "to")}


def warn(spec: FileSpec, parts: Parts, stop: Fraction, faults: Faults) -> None:
    """Keep the warnings about a diagram whose faults have been told, and about the parts that it has read."""
    for section, keys in WINDOWS.items():
        for node in _entries(spec.sections.get(section)):
            with faults.about(section):
                _warn_window(node, keys, stop, faults)
    for file in (spec, *parts.specs()):
        _warn_parameters(file, faults)


def _entries(section: YamlNode | None) -> Iterator[YamlMap]:
    entries: Iterable[YamlNode] = ()
    if isinstance(section, YamlList):
        entries = section
    elif isinstance(section, YamlMap):
        entries = section.values.values()
    yield from (entry for entry in entries if isinstance(entry, YamlMap))


def _warn_window(entry: YamlMap, keys: tuple[str, str], stop: Fraction, faults: Faults) -> None:
    """Warn of a window that holds no instant of the run, or none at all."""
    silent = Faults()
    begin, end = (silent.collect(read_duration, entry[key]) if key in entry else None for key in keys)
    if begin is not None and begin > stop:
        problem = f"'{keys[0]}' is {time_text(begin)}, but the run ends at {time_text(stop)}"
        faults.warn(entry[keys[0]].place, problem, "begin earlier, or choose a longer stop time")
    elif begin is not None and end is not None and end < begin:
        problem = f"'{keys[1]}' is {time_text(end)}, which is before {time_text(begin)}"
        faults.warn(entry[keys[1]].place, problem, f"end later than '{keys[0]}'")


def _blocks(spec: FileSpec) -> Iterator[BlockSpec]:
    """Yield what stands under the blocks of a file and of its variants."""
    yield from spec.blocks.values()
    for slots in spec.variants.values():
        yield from (block for block in slots.values() if block is not None)


def _warn_parameters(spec: FileSpec, faults: Faults) -> None:
    """Warn of parameters that no block of their file uses."""
    used: set[str] = set()
    for block in _blocks(spec):
        inputs = (block.inputs or {}).values()
        sources = (given.source for given in inputs if isinstance(given, InputSpec))
        for node in (*block.parameters.values(), *sources):
            if isinstance(node, YamlNode):
                used |= named_parameters(node)
    for name, value in spec.params.items():
        if name not in used and value is not None:
            faults.warn(value.place, f"parameter '{name}' is not used", f"write '${name}' where it belongs")


def warn_rates(spec: FileSpec, parts: Parts, faults: Faults) -> None:
    """Warn of rates at which no block of a diagram runs; `parts` has read those of all its variants."""
    if not parts.whole:
        return  # what could not be read may use any of them
    used = {block.rate[0] for file in (spec, *parts.specs()) for block in _blocks(file) if block.rate}
    for name, rate in spec.rates.items():
        if rate is not None and name not in used:
            faults.warn(
                rate.place, f"no block runs at the rate '{name}'", "leave it out, or give it to a block"
            )
