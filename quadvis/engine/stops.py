"""The sentence on why a run stopped: the block, the port, the time, the problem, and the remedy."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import OWN_MODULES, Block, ParameterError
from quadvis.block.returned import returned_wrongly
from quadvis.engine.events import Chatter
from quadvis.engine.interpreter import NOT_FINITE_OUTPUT, Stop
from quadvis.engine.layout import TIME, Placed
from quadvis.engine.memory import Memory
from quadvis.engine.program import Program
from quadvis.engine.stability import REMEDY, Marks
from quadvis.engine.variable_step import NoStep
from quadvis.errors import QuadvisError, RunError, sentence
from quadvis.graph.graph import Graph, Node
from quadvis.machine.failures import MEMORY, arithmetic, is_short_of_memory, surroundings
from quadvis.machine.source_line import file_of, source_line

SHOWN = 4  # numbers in a message
SMALLER_STEP = "a smaller solver step may help"


def explained(stop: Stop, graph: Graph, program: Program, memory: Memory, marks: Marks) -> QuadvisError:
    """Return the error that a stop means, to be raised; ``marks`` may know the cause."""
    time = float(stop.tick * program.period)
    if isinstance(stop.error, Chatter):
        problem = f"{stop.error} of {float(program.period):g} s"
        remedy = "it chatters; give it a hysteresis or a state of rest, or make the step smaller"
        return RunError(sentence(problem, remedy), block=program.blocks[stop.blocks[0]].path, time=time)
    if isinstance(stop.error, NoStep):
        problem = f"the solver {program.solver} cannot go on: {_lowered(str(stop.error))}"
        remedy = "a state may go to infinity or jump; a larger 'rtol' or 'atol' may help"
        return RunError(sentence(problem, remedy), time=time)
    if stop.error is not None:
        return _failed(stop.error, program.blocks[stop.blocks[0]], graph, memory, time, marks)
    if stop.found == NOT_FINITE_OUTPUT:
        return _not_finite(stop, graph, program, memory, time, marks)
    for block in program.blocks:
        for name in block.slopes:
            if not np.isfinite(memory.view(block.field(name))).all():
                problem = _with_cause(f"state '{name}' left the finite numbers", marks)
                return RunError(problem, block=block.path, time=time)
    raise AssertionError("a state that is not finite belongs to a block")


def _lowered(text: str) -> str:
    """Return another program's sentence as a part of one."""
    return text[:1].lower() + text[1:].rstrip(".")


def _with_cause(problem: str, marks: Marks) -> str:
    """Return the sentence on numbers that left the finite ones: why, if that is known, and the remedy."""
    cause = marks.cause()
    return sentence(problem, SMALLER_STEP) if cause is None else f"{problem}, as {cause.problem}; {REMEDY}"


def cannot(method: str, path: str, block: Block, error: Exception, time: float) -> QuadvisError:
    """Return the error of a method around the run, such as ``open``."""
    return _own(error, path) or RunError(f"cannot {method}: {_reason(error, block)}", block=path, time=time)


def _own(error: Exception, path: str) -> QuadvisError | None:
    """Return an error that names its place by itself; None for others."""
    if isinstance(error, RunError) and error.block:
        return error
    if isinstance(error, ParameterError):
        return ParameterError(error.parameter, f"block '{path}': {error}")
    return None


def _failed(
    error: Exception, block: Placed, graph: Graph, memory: Memory, time: float, marks: Marks
) -> QuadvisError:
    own = _own(error, block.path)
    if own is not None:
        return own
    node = graph[block.path]
    if not arithmetic(error):
        reason = _returned(error, node, block, memory) or _reason(error, node.block)
        return RunError(reason, block=block.path, time=time)
    outputs = list(block.outputs)
    own_code = node.block.__module__.startswith(OWN_MODULES)
    place = source_line(error, file_of(type(node.block))) if own_code else ""
    problem = f"{arithmetic(error)}{f' in {place}' if place else ''}{_inputs(block, memory)}"
    reason = _with_cause(problem, marks) if _is_integrated(graph, block.path) else problem
    return RunError(reason, block=block.path, port=outputs[0] if len(outputs) == 1 else "", time=time)


def _returned(error: Exception, node: Node, block: Placed, memory: Memory) -> str:
    """Return what is wrong with what ``output`` or ``deriv`` has returned; "" if it is something else."""
    for method, slots in (("output", block.outputs), ("deriv", block.slopes)):
        names = node.block.interface.arguments.get(method, ())
        sources = [TIME if name == "time" else block.inputs[name] for name in names]
        if wrong := returned_wrongly(error, method, [memory.read(slot) for slot in sources], slots):
            return wrong
    return ""


def _reason(error: Exception, block: Block) -> str:
    """Return what went wrong in a block, and in which line of its code if that says more."""
    if isinstance(error, QuadvisError):
        return str(error)
    if problem := arithmetic(error):
        return problem
    if is_short_of_memory(error):
        return MEMORY
    if isinstance(error, RecursionError):
        return surroundings(error)
    place = source_line(error, file_of(type(block)))
    return f"{type(error).__name__}: {error}{f' in {place}' if place else ''}"


def _inputs(block: Placed, memory: Memory) -> str:
    """Return the single numbers that a block reads now, a few of them."""
    slots = {port: slot for port, slot in block.inputs.items() if slot.scalar != "frame"}
    found = [f"{port} = {memory.read(slot):g}" for port, slot in slots.items() if not slot.shape]
    return f" ({', '.join(found[:SHOWN])}{', ...' if len(found) > SHOWN else ''})" if found else ""


def _is_integrated(graph: Graph, path: str) -> bool:
    """Return whether the solver integrates a state that has its share in a block."""
    waiting, seen = [path], {path}
    while waiting:
        node = graph[waiting.pop()]
        if node.block.interface.continuous:
            return True
        for _, wire in node.wires():
            if wire.block not in seen:
                seen.add(wire.block)
                waiting.append(wire.block)
    return False


def _not_finite(
    stop: Stop, graph: Graph, program: Program, memory: Memory, time: float, marks: Marks
) -> RunError:
    """Name the first port, in execution order, that is not finite."""
    for block in (program.blocks[number] for number in stop.blocks):
        for port, slot in block.outputs.items():
            if port not in block.nan and slot.scalar == "float64":
                value: Any = memory.read(slot)
                if not np.isfinite(value).all():
                    text = np.array2string(np.asarray(value), precision=4)
                    problem = f"the output became {text}"
                    if _is_integrated(graph, block.path):
                        problem = _with_cause(problem, marks)
                    return RunError(problem, block=block.path, port=port, time=time)
    raise AssertionError("a value that is not finite belongs to a port")
