"""Describe blocks from their declarations: `quadvis list` and `quadvis describe`."""

from __future__ import annotations

import inspect
import math
import textwrap
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from quadvis.block import (
    TAGS,
    Block,
    Declared,
    Device,
    FixedInput,
    In,
    Input,
    LineDevice,
    NewsDevice,
    Out,
    Output,
    Param,
    State,
)
from quadvis.machine.columns import table

WIDEST = 30  # characters of a default value
MANY = 60  # characters of choices on one line
LINE = 90  # characters of a line of an example


def first_line(block: type[Block]) -> str:
    """Return the first sentence of a block's docstring."""
    return (inspect.getdoc(block) or "").partition("\n")[0]


def description(name: str, block: type[Block], width: int | None = None) -> str:
    """Return a block's docstring, ports, parameters and states as text, with an example of its use."""
    lines = [name, "", *(inspect.getdoc(block) or "").splitlines(), ""]
    if unlike := tags(block):
        lines += [*(f"{tag}: {reason}" for tag, reason in unlike.items()), ""]
    for title, rows in declarations(block).items():
        if rows:
            lines += [title, *(f"  {line}" for line in table(rows, width and width - 2)), ""]
    lines += ["in a diagram", *(f"  {line}" for line in example(name, block))]
    return "\n".join(lines)


def declarations(block: type[Block]) -> dict[str, list[tuple[str, ...]]]:
    """Return a block's inputs, outputs, parameters and states as rows of texts, the name first."""
    interface = block.interface
    feedthrough = interface.feedthrough
    return {
        "inputs": [_input_row(port, port.name in feedthrough) for port in interface.inputs.values()],
        "outputs": [_output_row(port) for port in interface.outputs.values()],
        "parameters": [_param_row(param) for param in interface.params.values()],
        "states": [_state_row(state) for state in interface.states.values()],
    }


def tags(block: type[Block]) -> dict[str, str]:
    """Return what makes the block unlike others, in words, and why."""
    found = {tag.replace("_", " "): reason for tag in TAGS if (reason := getattr(block, tag))}
    names = block.ports_from()
    found |= {"ports": f"they depend on {', '.join(names)}"} if names else {}
    found |= {"names": f"a diagram gives those of {block.free_names}"} if block.free_names else {}
    found |= {"events": "located between two ticks at 'rate: continuous'"} if block.interface.events else {}
    return found | ({"device": _device(block)} if issubclass(block, Device) else {})


def _device(block: type[Device]) -> str:
    """Say what a device does with its port."""
    rate = f", a frame every '{block.rate}'" if issubclass(block, Output) else ""
    if issubclass(block, LineDevice):
        serial = block.serial_line()
        line = f", {serial}" if serial is not None else ""
    else:
        line = ", read by a process of its own"
    sends = bool(rate) or (issubclass(block, NewsDevice) and not issubclass(block, Input))
    return f"{'output' if sends else 'input'} by the port of '{block.port_parameter}'{line}{rate}"


def _input_row(port: In, direct: bool) -> tuple[str, ...]:
    words = [] if direct else ["no direct feedthrough"]
    words += ["any number"] if port.many else []
    if port.default is not None:
        default = "" if _is_nan(port.default) else f", {_short(value_text(port, port.default))}"
        words.append(f"optional{default}")
    return port.name, _kind(port), "; ".join(words), port.doc


def _output_row(port: Out) -> tuple[str, ...]:
    return port.name, _kind(port), "NaN means missing" if port.nan else "", port.doc


def _param_row(param: Param) -> tuple[str, ...]:
    default = default_text(param)
    given = "required" if default is None else f"= {default}"
    choices = " | ".join(param.choices)
    doc = param.doc
    if len(choices) > MANY:  # they go into the column that wraps
        choices, doc = f"{len(param.choices)} choices", f"{doc}: {', '.join(param.choices)}"
    words = [choices, bounds(param), "tunable" if param.tune else ""]
    words += (
        [f"{type(param).__name__.lower()} value of {param.input}"] if isinstance(param, FixedInput) else []
    )
    kind = "" if param.choices else _kind(param)
    return param.name, kind, _short(given), "; ".join(filter(None, words)), doc


def _state_row(state: State) -> tuple[str, ...]:
    return state.name, _kind(state), "continuous" if state.continuous else "", state.doc


def _short(text: str) -> str:
    return text if len(text) <= WIDEST else f"{text[: WIDEST - 3]}..."


def _kind(item: Declared) -> str:
    """Return a short text for the type of a port: "m", "[3] m", "bool"."""
    kind = item.type.removeprefix("float64")
    unit = textwrap.shorten(item.unit, WIDEST, placeholder=" ...") if item.unit != "1" else ""
    return " ".join(filter(None, (kind, unit))) or "number"


RATES = {"fast": "100 Hz", "slow": "10 Hz", "inner": "1 kHz"}  # for the blocks of examples
EXAMPLE = """\
quadvis: 1
name: {name}
rates: {{{rates}}}
solver: {{method: ode4, step: 10 ms}}
stop_time: 1 s
blocks:
{blocks}"""  # a diagram of the example of a block


def example_diagram(name: str, block: type[Block]) -> str:
    """Return a diagram that has the example of a block; "" if the block has none."""
    entries = inspect.cleandoc(block.example)
    if not entries:
        return ""
    used = {rate: period for rate, period in RATES.items() if f"rate: {rate}" in entries} or {
        "fast": RATES["fast"]
    }
    rates = ", ".join(f"{rate}: {period}" for rate, period in used.items())
    blocks = textwrap.indent(entries, "  ") + "\n"
    return EXAMPLE.format(name=name.rpartition(".")[2], rates=rates, blocks=blocks)


def only_checked(block: type[Block]) -> str:
    """Return why the example of a block is checked and not run in a simulation; "" if it runs."""
    if block.example_needs:
        return f"it needs {block.example_needs}"
    return "only a real-time run reaches a port" if issubclass(block, Device) else ""


def example(name: str, block: type[Block]) -> list[str]:
    """Return entries of a diagram that show the use of a block: its example, or what it requires."""
    return inspect.cleandoc(block.example).splitlines() if block.example else skeleton_entry(name, block)


def skeleton_entry(name: str, block: type[Block]) -> list[str]:
    """Return the entry of a diagram that a block requires at least, with words to be filled in."""
    interface = block.interface
    lines = [f"{name.rpartition('.')[2].rpartition(':')[2]}:", f"  block: {name}"]
    lines += [] if interface.continuous else ["  rate: ..."]
    needed = [param for param in interface.params.values() if param.required or _gives_ports(param, block)]
    required = {param.name: _sample(param, block) for param in needed}
    wired = {
        port.name: "[block.port, block.port]" if port.many else "block.port"
        for port in interface.inputs.values()
        if port.default is None
    }
    for key, values in (("with", required), ("in", wired)):
        lines += keyed(key, [f"{item}: {text}" for item, text in values.items()])
    return lines


def keyed(key: str, entries: Sequence[str]) -> list[str]:
    """Return the lines of a key with a map in an entry of a diagram: one line, unless it is too long."""
    line = f"  {key}: {{{', '.join(entries)}}}"
    if not entries:
        return []
    return [line] if len(line) <= LINE else [f"  {key}:", *(f"    {entry}" for entry in entries)]


def _gives_ports(param: Param, block: type[Block]) -> bool:
    """Return whether a parameter names a file from which the ports of a block follow."""
    return param.is_file and param.name in block.ports_from()


def _sample(param: Param, block: type[Block]) -> str:
    if param.is_port and issubclass(block, Device):
        return block.port_example
    if param.is_file or param.is_port:
        return "path"
    return param.choices[0] if param.choices else "..."


def facts(name: str, block: type[Block]) -> dict[str, Any]:
    """Return a block's declarations as plain data."""

    def plain(items: Iterable[Declared]) -> dict[str, Any]:
        return {item.name: {"type": item.type, "unit": item.unit, "doc": item.doc} for item in items}

    interface = block.interface
    params = plain(interface.params.values())
    for param in interface.params.values():
        params[param.name] |= {"default": default_text(param), "bounds": bounds(param), "tune": param.tune}
        if param.choices:
            params[param.name] |= {"type": "choice", "choices": list(param.choices)}
    inputs = plain(interface.inputs.values())
    for port in interface.inputs.values():
        inputs[port.name] |= {"optional": port.default is not None, "many": port.many}
    return {
        "block": name,
        "doc": inspect.getdoc(block) or "",
        "inputs": inputs,
        "outputs": plain(interface.outputs.values()),
        "params": params,
        "states": plain(interface.states.values()),
        "feedthrough": sorted(interface.feedthrough),
        "numeric": block.numeric,
        "tags": tags(block),
        "safe": {name: param.name for name, param in interface.safe.items()},
    }


def default_text(param: Param) -> str | None:
    """Return a parameter's default as written in a diagram; None if the parameter is required."""
    if param.required:
        return None
    if param.is_text or param.choices:
        return str(param.default)
    return value_text(param, param.default)


def value_text(declared: Declared, value: Any) -> str:
    """Return a value as written in a diagram; open units are left out."""
    text = _plain_text(np.asarray(value).tolist())
    unit = declared.unit
    if unit == "1" or any(each.variables for each in declared.units) or not np.any(value):
        return text
    return f"{{value: {text}, unit: {unit}}}" if text.startswith("[") else f"{text} {unit}"


def _plain_text(value: Any) -> str:
    if isinstance(value, list):
        return f"[{', '.join(map(_plain_text, value))}]"
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:g}" if isinstance(value, float) else str(value)


def _is_nan(value: Any) -> bool:
    return isinstance(value, float) and math.isnan(value)


def bounds(param: Param) -> str:
    """Return the limits and choices of a parameter as text."""
    marks = ((param.min, ">="), (param.above, ">"), (param.max, "<="), (param.below, "<"))
    return ", ".join(f"{mark} {bound:g}" for bound, mark in marks if bound is not None)
