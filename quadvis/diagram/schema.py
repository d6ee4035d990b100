"""The JSON schema of diagrams, parts and parameter files: completion, hover and checks in editors.

It is made from the declarations. An editor checks the form as one types; `quadvis check` knows more: units,
shapes, rates, loops.
"""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Mapping
from typing import Any

from quadvis.block import Block, Declared, Param
from quadvis.diagram.loader import (
    BLOCK_KEYS,
    CONTINUOUS,
    DIAGRAM_KEYS,
    PART_KEYS,
    PORT_KEYS,
    REQUIRED_KEYS,
    SOLVER_KEYS,
    VARIANT_KEYS,
    VERSION,
    WIRE_KEYS,
)
from quadvis.diagram.observe import LOG_KEYS, STRETCH_KEYS, SUMMARY_KEYS
from quadvis.diagram.questions import ANALYSE_KEYS, LIMIT_KEYS
from quadvis.diagram.settings import PARAMETERS_KEYS, PARAMETERS_REQUIRED
from quadvis.diagram.times import RATE_KEYS
from quadvis.diagram.values import QUANTITY_KEYS
from quadvis.engine.graph import CROSSINGS, SOLVERS
from quadvis.library.describe import default_text, first_line
from quadvis.output.plot import FIGURE_KEYS, PANEL_KEYS, TRACE_KEYS
from quadvis.output.statistics import STATISTICS
from quadvis.output.verdict import EXPECTATIONS

Schema = dict[str, Any]

TEXT: Schema = {"type": ["string", "number", "boolean"]}  # any scalar is a text where one is wanted
QUANTITY: Schema = {"type": ["string", "number"]}
CONSTANT: Schema = {"anyOf": [{"type": "number"}, {"type": "string", "pattern": r"^[-+.$\d]"}]}
NAME: Schema = {"pattern": "^[A-Za-z_][A-Za-z0-9_/]*$"}
SETTING: Schema = {"pattern": r"^([A-Za-z_][A-Za-z0-9_/]*\.)?[A-Za-z_][A-Za-z0-9_]*$"}
LIBRARY_BLOCK: Schema = {
    "type": "string",
    "pattern": "^[a-z][a-z0-9_]*:",
    "description": "a block of another library",
}


def diagram_schema(blocks: Mapping[str, type[Block]]) -> Schema:
    """Return the schema of all files, with the ports and parameters of the blocks, given by name."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "quadvis diagram",
        "type": "object",
        "if": {"required": ["set"]},
        "then": _closed((*PARAMETERS_REQUIRED, *PARAMETERS_KEYS), _top(), PARAMETERS_REQUIRED),
        "else": {
            "required": list(REQUIRED_KEYS),
            "if": {"required": ["ports"]},
            "then": _closed((*REQUIRED_KEYS, *PART_KEYS), _top()),
            "else": _closed((*REQUIRED_KEYS, *DIAGRAM_KEYS), _top()),
        },
        "$defs": _definitions(blocks),
    }


def _closed(keys: Iterable[str], properties: Mapping[str, Schema], required: Iterable[str] = ()) -> Schema:
    """Return an object that has these keys and no others."""
    found: Schema = {"type": "object", "properties": {key: properties[key] for key in keys}}
    found["additionalProperties"] = False
    if required:
        found["required"] = list(required)
    return found


def _map_of(value: Schema, words: str) -> Schema:
    return {"type": "object", "propertyNames": NAME, "additionalProperties": value, "description": words}


def _list_of(value: Schema, words: str) -> Schema:
    return {"type": "array", "items": value, "description": words}


def _ref(name: str) -> Schema:
    return {"$ref": f"#/$defs/{name}"}


def _top() -> dict[str, Schema]:
    return {
        "quadvis": {"const": VERSION, "description": "version of the format"},
        "name": {**TEXT, "description": "name of the diagram, and of its log"},
        "doc": {**TEXT, "description": "what it is for"},
        "params": _map_of(_ref("value"), "named values, used as $name or $name[2]"),
        "rates": _map_of(_ref("rate"), "named rates, such as 20 Hz or 50 ms"),
        "solver": _closed(SOLVER_KEYS, {
            "method": {"enum": list(SOLVERS), "description": "fixed-step solver, named as in Simulink"},
            "step": {**QUANTITY, "description": "such as 5 ms; it divides every period"},
        }),
        "stop_time": {**QUANTITY, "description": "length of a run, such as 20 s"},
        "seed": {"type": "integer", "description": "seed of all noise"},
        "files": {"type": "object", "description": "SHA-256 of the files that blocks read"},
        "blocks": _map_of(_ref("block"), "all blocks by name"),
        "variants": _map_of(_closed(VARIANT_KEYS, {
            "doc": TEXT,
            "base": {"type": "string", "description": "the variant on which this one builds"},
            "slots": _map_of(_ref("block"), "by slot"),
        }),
                            "other blocks for those marked 'slot: true'"),
        "ports": _closed(PORT_KEYS, {
            "in": _list_of(TEXT, "names of what comes in; inside the part 'in.name'"),
            "out": _map_of(_ref("signal"), "what goes out"),
        }),
        "log": _closed(LOG_KEYS, {
            "signals": _list_of(TEXT, "blocks to log, or patterns such as 'vision/*'"),
            "every": _map_of({"type": "integer", "minimum": 1}, "by rate: one row in so many"),
        }),
        "expect": _list_of(_ref("expectation"), "what a run must show"),
        "summary": {
            "type": "object",
            "additionalProperties": {"anyOf": [_ref("signal"), _ref("entry")]},
            "description": "lines of the summary by their labels",
        },
        "figures": _list_of(_ref("figure"), "what `quadvis plot` draws"),
        "analyse": _closed(ANALYSE_KEYS, {
            "at": {**QUANTITY, "description": "run so long before the operating point is sought"},
            "cuts": {
                "type": "object",
                "additionalProperties": {
                    "anyOf": [_ref("signal"), _list_of(_ref("signal"), "opened at once")]
                },
                "description": "where `quadvis analyse` opens the loop, by name",
            },
            "limits": {
                "type": "object",
                "additionalProperties": _ref("limit"),
                "description": "how far a parameter can go before the loop is unstable, by name",
            },
        }),
        "set": {
            **_map_of(_ref("value"), "values of parameters, by block.parameter or by the diagram's names"),
            "propertyNames": SETTING,
        },
        "base": {**TEXT, "description": "parameter file that this one builds on, relative to this file"},
    }  # fmt: skip


def _definitions(blocks: Mapping[str, type[Block]]) -> dict[str, Schema]:
    stretch: dict[str, Schema] = {key: QUANTITY for key in STRETCH_KEYS}
    kinds: dict[str, Schema] = {
        key: {**QUANTITY, "description": kind.words} for key, kind in EXPECTATIONS.items()
    }
    shown = _list_of({"enum": list(STATISTICS)}, "statistics to show")
    signal = {
        **TEXT,
        "pattern": r"^[A-Za-z_][\w/]*\.[A-Za-z_]\w*(\[[0-9:, ]*\])?$",
        "description": "block.port",
    }
    wire = {"from": _ref("signal"), "across": {"oneOf": [
        {"const": name, "description": words} for name, words in CROSSINGS.items()
    ]}}  # fmt: skip
    quantity = {"value": {}, "unit": TEXT}
    values = [QUANTITY, {"type": "boolean"}, {"type": "array"}, _closed(QUANTITY_KEYS, quantity, ["value"])]
    return {
        "signal": signal,
        "value": {"anyOf": values},
        "input": {"anyOf": [signal, CONSTANT, *values[1:], _closed(WIRE_KEYS, wire, ["from"])]},
        "rate": {"anyOf": [QUANTITY, _closed(RATE_KEYS, {"rate": QUANTITY, "offset": QUANTITY}, ["rate"])]},
        "expectation": _closed(
            ("signal", *STRETCH_KEYS, *EXPECTATIONS), {"signal": signal, **stretch, **kinds}, ["signal"]
        ),
        "entry": _closed(
            ("signal", *SUMMARY_KEYS), {"signal": signal, **stretch, "show": shown, "unit": TEXT}, ["signal"]
        ),
        "limit": _closed(
            LIMIT_KEYS,
            {
                "vary": {**TEXT, "description": "block.parameter, a parameter of the diagram, or an element"},
                "from": {**QUANTITY, "description": "where the search begins; the loop is stable there"},
                "to": {**QUANTITY, "description": "where it ends"},
            },
            LIMIT_KEYS,
        ),
        **_figures(signal),
        "block": _any_block(blocks),
        **{f"block:{name}": _one_block(block) for name, block in blocks.items()},
    }  # fmt: skip


def _figures(signal: Schema) -> dict[str, Schema]:
    trace = _closed(
        TRACE_KEYS, {"signal": signal, "label": {**TEXT, "description": "in the legend"}}, ["signal"]
    )
    signals = {"anyOf": [signal, _list_of({"anyOf": [signal, trace]}, "curves of the panel")]}
    panel: dict[str, Schema] = {
        "signals": signals,
        "title": TEXT,
        "unit": {**TEXT, "description": "of the axis; that of the first signal if absent"},
        "reference": {**QUANTITY, "description": "dashed line from which the RMS in the legend counts"},
    }
    figure = panel | {
        "from": {**QUANTITY, "description": "stretch of the run, such as 40 s"},
        "to": QUANTITY,
        "panels": _list_of(_ref("panel"), "side by side, three in a row"),
    }
    either = {"oneOf": [{"required": ["panels"]}, {"required": ["signals"]}]}
    return {
        "panel": _closed(PANEL_KEYS, panel, ["signals"]),
        "figure": {**_closed(FIGURE_KEYS, figure, ["title"]), **either},
    }


def _any_block(blocks: Mapping[str, type[Block]]) -> Schema:
    """Return the schema of an entry under ``blocks``: common keys, then those of the block that it names."""
    known: list[Schema] = [
        {"const": name, "description": first_line(block)} for name, block in blocks.items()
    ]
    common: dict[str, Schema] = {
        "block": {"anyOf": [*known, LIBRARY_BLOCK]},
        "part": {**TEXT, "description": "file of a subsystem, relative to this one"},
        "rate": {**TEXT, "description": f"one of the diagram's rates, or '{CONTINUOUS}'"},
        "slot": {"type": "boolean", "description": "variants may put another block here"},
        "with": _map_of(_ref("value"), "parameters"),
        "in": _map_of(_ref("input"), "inputs: block.port, a constant, or {from: block.port, across: hold}"),
    }
    cases = [
        {
            "if": {"required": ["block"], "properties": {"block": {"const": name}}},
            "then": _ref(f"block:{name}"),
        }
        for name in blocks
    ]
    return {
        **_closed(BLOCK_KEYS, common),
        "oneOf": [{"required": ["block"]}, {"required": ["part"]}],
        "allOf": cases,
    }


def _one_block(block: type[Block]) -> Schema:
    interface = block.interface
    required = [name for name, param in interface.params.items() if param.required]
    parameters: Schema = {
        "additionalProperties": False,
        "properties": {name: _parameter(param) for name, param in interface.params.items()},
        "required": required,
    }
    inputs: Schema = {
        "additionalProperties": False,
        "properties": {
            name: {**_ref("input"), "description": _words(port)} for name, port in interface.inputs.items()
        },
        "required": [name for name, port in interface.inputs.items() if port.default is None],
    }
    return {
        "description": inspect.getdoc(block) or "",
        "properties": {"with": parameters, "in": inputs},
        # What stands in a slot may take its wires from there, but brings its own parameters.
        "required": ["with"] if required else [],
    }


def _parameter(param: Param) -> Schema:
    found: Schema = {"description": _words(param)}
    if param.choices:
        # A parameter of the diagram may stand in for the word.
        found["anyOf"] = [{"enum": list(param.choices)}, {"type": "string", "pattern": r"^\$"}]
    elif param.is_text:
        found |= TEXT
    else:
        found |= _ref("value")
    default = default_text(param)
    return found if default is None else {**found, "default": default}


def _words(item: Declared) -> str:
    unit = "" if item.unit == "1" else f", {item.unit}"
    kind = "choice" if isinstance(item, Param) and item.choices else item.type
    return f"{item.doc} ({kind}{unit})"
