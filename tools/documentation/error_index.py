"""The index of errors: the sentences that stand in the code, with what each says would be right.

They are found in the syntax tree: the first halves are what faults, warnings and errors are made with, also
by way of a name; the second halves are their remedies. What differs from case to case is "…".
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from documentation.markdown import escaped, table
from documentation.site_map import ROOT

SOURCES = ("quadvis", "blocks/quadvis_blocks", "blocks/quadvis_vision")
COLLECTED = {"add", "warn", "Fault", "Doubt"}  # those of `quadvis.errors.faults`: place, then problem, remedy
NO_SENTENCES = {"TypeError", "ValueError", "AttributeError", "AssertionError", "IndexError", "KeyError"}
SHORTEST = 12  # letters of a sentence; what is shorter is a part of one
Texts = Mapping[str, list[str]]


class Message(NamedTuple):
    """What is wrong, and what would be right; "" if the code says no more, or makes it from the case."""

    problem: str
    remedy: str


def messages(text: str) -> list[Message]:
    """Return the sentences of a module, in their order."""
    found: dict[Message, None] = {}
    tree = ast.parse(text)
    functions = (ast.FunctionDef, ast.AsyncFunctionDef)
    for scope in [tree, *(node for node in ast.walk(tree) if isinstance(node, functions))]:
        named = _named_texts(scope)
        for call in (node for node in _inside(scope) if isinstance(node, ast.Call)):
            found |= dict.fromkeys(_of_call(call, named))
    return list(found)


def _inside(scope: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes of a function, without those of functions in it."""
    for child in ast.iter_child_nodes(scope):
        if not isinstance(child, (ast.FunctionDef, ast.AsyncFunctionDef)):
            yield child
            yield from _inside(child)


def _named_texts(scope: ast.AST) -> Texts:
    """Return the texts that a function gives a name."""
    found: dict[str, list[str]] = {}
    for node in _inside(scope):
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            found.setdefault(node.targets[0].id, []).extend(_texts(node.value, {}))
    return found


def _of_call(call: ast.Call, named: Texts) -> Iterator[Message]:
    """Yield the sentences of a call, if it makes a fault, a warning or an error."""
    function = call.func
    name = function.attr if isinstance(function, ast.Attribute) else getattr(function, "id", "")
    if name in COLLECTED and len(call.args) >= 2:
        first = 2 if name in {"Fault", "Doubt"} else 1  # after the place; of a fault after its subject, too
    elif (name.endswith("Error") and name not in NO_SENTENCES) or name in {"sentence", "OutOfRange"}:
        first = 1 if name == "ParameterError" else 0  # after the name of the parameter
    else:
        return
    problems, remedies = ([], [])
    if len(call.args) > first:
        problems = _texts(call.args[first], named)
    if len(call.args) > first + 1:
        remedies = _texts(call.args[first + 1], named)
    for problem in problems:
        head, _, tail = problem.partition("; ")
        if len(head.replace("…", "").strip()) >= SHORTEST:
            yield Message(head, tail or " / ".join(dict.fromkeys(remedies)))


def _texts(node: ast.expr, named: Texts) -> list[str]:
    """Return the texts that an expression can be."""
    if isinstance(node, ast.Constant):
        return [node.value] if isinstance(node.value, str) and node.value else []
    if isinstance(node, ast.JoinedStr):
        parts = (part.value if isinstance(part, ast.Constant) else "…" for part in node.values)
        return ["".join(map(str, parts))]
    if isinstance(node, ast.IfExp):
        return [*_texts(node.body, named), *_texts(node.orelse, named)]
    if isinstance(node, ast.BoolOp):
        return [text for value in node.values for text in _texts(value, named)]
    if isinstance(node, ast.Name):
        return list(named.get(node.id, ()))
    return []


def rooms() -> dict[str, list[Message]]:
    """Return the sentences of each room and each group of blocks, by its name."""
    found: dict[str, dict[Message, None]] = {}
    for source in SOURCES:
        for file in sorted((ROOT / source).rglob("*.py")):
            inner = file.relative_to(ROOT / source).parts
            name = f"{Path(source).name}.{inner[0].removesuffix('.py')}"
            found.setdefault(name, {}).update(dict.fromkeys(messages(file.read_text(encoding="utf-8"))))
    return {name: sorted(every) for name, every in found.items() if every}


def error_page() -> str:
    """Return the index as a page."""
    parts = [
        "# Errors",
        "Every error is a sentence: what is wrong, and after a semicolon what would be right. Search this "
        "page for a few words of yours; names and numbers of your case are … here. The sentences are read "
        "from the code, so the index has those that stand there as texts. What is put together from parts "
        "is missing, as are suggestions such as \"did you mean 'rate'?\". Exit code 2 means that the input "
        "is wrong, 1 that a run failed or missed an expectation.",
    ]
    for name, every in rooms().items():
        rows = [(escaped(message.problem), escaped(message.remedy)) for message in every]
        parts.append(f"## {name}\n\n{table(('what is wrong', 'what would be right'), rows)}")
    return "\n\n".join(parts) + "\n"
