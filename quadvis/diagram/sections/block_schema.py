"""The JSON schema of an entry under `blocks`: common keys, and the ports and parameters of each block."""

from __future__ import annotations

import inspect
from collections.abc import Mapping

from quadvis.block import Block, Declared, In, Param
from quadvis.diagram.group import GROUP_KEY
from quadvis.diagram.sections.forms import CONSTANT, NAME, SIGNAL, TEXT, VALUES, Schema, closed, map_of, ref
from quadvis.graph.graph import CONTINUOUS, CROSSINGS
from quadvis.graph.names import PATTERN
from quadvis.library.describe import default_text, first_line

CONDITION_KEYS = ("when", "triggered", "reset", "initial")  # when a part or a block runs
BLOCK_KEYS = (
    "block", "part", "rate", "at", "slot", "stream", GROUP_KEY, "with", "in", *CONDITION_KEYS, "condition",
)  # fmt: skip
WIRE_KEYS = ("from", "across", "over", "initial")
WHEN_KEYS = ("states", "outputs")  # beside those of a wire
EDGES = ("rising", "falling", "either")
GROUP_NAME: Schema = {"type": "string", "pattern": r"^\$[A-Za-z_][A-Za-z0-9_]*$"}
MAPS: Schema = {"type": "object", "additionalProperties": {"type": "object"}}  # states and their values
LIBRARY_BLOCK: Schema = {
    "type": "string",
    "pattern": "^[a-z][a-z0-9_]*:",
    "description": "a block of another library",
}


def block_definitions(blocks: Mapping[str, type[Block]]) -> dict[str, Schema]:
    """Return the forms of an input, of any block, and of each block by its name."""
    wire: dict[str, Schema] = {"from": ref("signal"), "across": {"oneOf": [
        {"const": name, "description": words} for name, words in CROSSINGS.items()
    ]}}  # fmt: skip
    wire |= {
        "over": {**TEXT, "description": "the link that carries it to another computer"},
        "initial": {**ref("value"), "description": "its value there before the first message"},
    }
    held = {"enum": ["held", "reset"]}
    when = wire | {
        "states": {**held, "description": "what enabling does to the states"},
        "outputs": {**held, "description": "what the outputs are while it is disabled"},
    }
    edge = wire | {"edge": {"enum": [*EDGES]}}
    return {
        "when": {"anyOf": [SIGNAL, CONSTANT, *VALUES[1:], closed((*WIRE_KEYS, *WHEN_KEYS), when, ["from"])]},
        "edge": {
            "anyOf": [
                {**TEXT, "pattern": rf"^(({'|'.join(EDGES)}) +)?{PATTERN}$"},
                closed((*WIRE_KEYS, "edge"), edge, ["from"]),
            ]
        },
        "input": {"anyOf": [SIGNAL, CONSTANT, *VALUES[1:], closed(WIRE_KEYS, wire, ["from"])]},
        "block": _any_block(blocks),
        **{f"block:{name}": _one_block(block) for name, block in blocks.items()},
    }


def _any_block(blocks: Mapping[str, type[Block]]) -> Schema:
    """Return the schema of an entry under ``blocks``: common keys, then those of the block that it names."""
    known: list[Schema] = [
        {"const": name, "description": first_line(block)} for name, block in blocks.items()
    ]
    common: dict[str, Schema] = {
        "block": {"anyOf": [*known, LIBRARY_BLOCK]},
        "part": {**TEXT, "description": "file of a subsystem, relative to this one"},
        "rate": {
            **TEXT,
            "description": f"one of the diagram's rates, or '{CONTINUOUS}'; not needed without rates",
        },
        "at": {**TEXT, "description": "the computer that runs it, or its inner blocks"},
        "slot": {"type": "boolean", "description": "variants may put another block here"},
        "stream": {**NAME, **TEXT, "description": "name of its noise in place of its path"},
        GROUP_KEY: {
            "anyOf": [GROUP_NAME, {"type": "array", "items": GROUP_NAME}],
            "description": "groups whose values it takes for its parameters of the same names",
        },
        "with": map_of({"anyOf": [ref("value"), MAPS]}, "parameters"),
        "in": map_of(ref("input"), "inputs: block.port, a constant, or {from: block.port, across: hold}"),
        "when": {**ref("when"), "description": "it runs only while this signal is true"},
        "triggered": {**ref("edge"), "description": "it runs only at the edges of this signal"},
        "reset": {**ref("edge"), "description": "its edges set the states back"},
        "initial": map_of(ref("value"), "outputs while it has not run yet"),
        "condition": {**TEXT, "description": "the block that says when this one runs, a logic.run_condition"},
    }
    cases = [
        {
            "if": {"required": ["block"], "properties": {"block": {"const": name}}},
            "then": ref(f"block:{name}"),
        }
        for name in blocks
    ]
    return {
        **closed(BLOCK_KEYS, common),
        "oneOf": [{"required": ["block"]}, {"required": ["part"]}],
        "allOf": cases,
    }


def _one_block(block: type[Block]) -> Schema:
    interface, is_open = block.interface, bool(block.ports_from() or block.free_names)
    required = [name for name, param in interface.params.items() if param.required]
    parameters: Schema = {
        "additionalProperties": ref("value") if is_open else False,
        "properties": {
            name: {"description": _words(param)} if block.free_names else _parameter(param)
            for name, param in interface.params.items()
        },
    }
    inputs: Schema = {
        "additionalProperties": ref("input") if is_open else False,
        "properties": {name: _input(port) for name, port in interface.inputs.items()},
        "required": [
            name for name, port in interface.inputs.items() if port.default is None and not block.free_names
        ],
    }
    found: Schema = {
        "description": inspect.getdoc(block) or "",
        "properties": {"with": parameters, "in": inputs},
    }
    if required:
        # A block in a slot may have the slot's wires, but has its own parameters; a group may have them all.
        given = {"required": ["with"], "properties": {"with": {"required": required}}}
        found["anyOf"] = [{"required": [GROUP_KEY]}, given]
    return found


def _input(port: In) -> Schema:
    form = ref("input")
    if port.many:
        form = {"if": {"type": "array"}, "then": {"items": form, "minItems": 1}, "else": form}
    return {**form, "description": _words(port)}


def _parameter(param: Param) -> Schema:
    found: Schema = {"description": _words(param)}
    if param.choices:
        # A parameter of the diagram may stand in for the word.
        found["anyOf"] = [{"enum": list(param.choices)}, {"type": "string", "pattern": r"^\$"}]
    elif param.is_map:
        found |= {"type": ["object", "array", "string"]}
    elif param.is_text:
        found |= TEXT
    else:
        found |= ref("value")
    default = default_text(param)
    return found if default is None else {**found, "default": default}


def _words(item: Declared) -> str:
    unit = "" if item.unit == "1" else f", {item.unit}"
    kind = "choice" if isinstance(item, Param) and item.choices else item.type
    many = ", any number" if isinstance(item, In) and item.many else ""
    return f"{item.doc} ({kind}{unit}{many})"
