"""The layout engine for drawings: the Eclipse Layout Kernel's layered algorithm, run inside QuickJS."""

from __future__ import annotations

import importlib
import json
from collections.abc import Mapping
from importlib import resources
from typing import Any

from quadvis.errors import QuadvisError


class LayoutError(QuadvisError):
    """The layout engine gave up: the diagram needs too much stack, time or memory."""


TIME_LIMIT = 120.0
"""Processor time (s) after which a layout is given up; 100 blocks take about 4 s."""

# The engine is written for a browser's worker: it listens for messages and posts its answers.
_WORKER = """
globalThis.self = globalThis;
globalThis.setTimeout = (work) => work();
globalThis.postMessage = (message) => { globalThis.answer = message; };
"""
_REQUEST = """
onmessage({data: {id: 0, cmd: "register", algorithms: ["layered"]}});
onmessage({data: {id: 1, cmd: "layout", graph: JSON.parse(request)}});
if (!answer.data) throw new Error(String(answer.error && answer.error.message));
JSON.stringify(answer.data)
"""


def layout(graph: Mapping[str, Any]) -> dict[str, Any]:
    """Return a graph in ELK's JSON format with positions filled in; equal graphs get equal positions.

    Raises `QuadvisError` if QuickJS is not installed, `LayoutError` if the engine fails.
    """
    try:
        quickjs = importlib.import_module("quickjs")
    except ImportError as error:
        raise QuadvisError(
            "drawing needs the package quickjs-ng, which is missing; install it: pip install quickjs-ng"
        ) from error
    engine = resources.files(__package__).joinpath("elk-worker.min.js").read_text("utf-8")
    context = quickjs.Context()
    context.set_time_limit(TIME_LIMIT)
    try:
        context.eval(_WORKER)
        context.eval(engine)
        context.set("request", json.dumps(graph))
        placed: dict[str, Any] = json.loads(context.eval(_REQUEST))
    except (quickjs.JSException, quickjs.StackOverflow) as error:
        reason = str(error).partition("\n")[0]
        raise LayoutError(f"the diagram could not be laid out ({reason})") from error
    return placed
