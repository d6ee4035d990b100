"""Checks of the source of a block: its file, its texts, and a use for every declaration."""

from __future__ import annotations

import inspect
import sys
import types
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from quadvis.block import Block, Device
from quadvis.native.source import names_in
from quadvis.testing.rig import Subject


def one_block_in_its_module(subject: Subject) -> None:
    """Check that the module defines no other public block, and that its file is named after the class."""
    module = sys.modules[subject.block.__module__]
    kinds = [kind for kind in vars(module).values() if isinstance(kind, type) and issubclass(kind, Block)]
    own = {kind.__name__ for kind in kinds if kind.__module__ == module.__name__}
    public = sorted(name for name in own if not name.startswith("_"))
    assert public == [subject.block.__name__], f"the module defines {', '.join(public)}; move the others"
    file = Path(str(module.__file__)).stem
    wanted = "".join(part.capitalize() for part in file.split("_"))
    assert subject.block.__name__ == wanted, f"the class in {file}.py must be called {wanted}"


def documented(subject: Subject) -> None:
    """Check that the docstring begins with a sentence, and that every port and parameter has a ``doc``."""
    first, _, rest = inspect.cleandoc(vars(subject.block).get("__doc__") or "").partition("\n")
    assert first.endswith("."), "the docstring's first line must be a sentence that ends in a full stop"
    assert not rest or rest.startswith("\n"), "the docstring's second line must be empty"
    interface = subject.block.interface
    declared = (*interface.inputs.values(), *interface.outputs.values(), *interface.params.values())
    bare = [item.name for item in declared if not item.doc]
    assert not bare, f"these need a doc: {', '.join(bare)}"


def tested(subject: Subject) -> None:
    """Check that the test file of the block exists."""
    assert subject.test is None or subject.test.is_file(), f"there is no test at {subject.test}; write one"


def all_declarations_used(subject: Subject) -> None:
    """Check that some method asks for every input, and that every other declaration is named somewhere.

    It may be named in a method, or in a function of the block's own library that a method calls. What a file
    declares has no name in the code.
    """
    interface = subject.block.interface
    from_file = vars(subject.block) if subject.block.made_for is not None else {}
    asked = {name for names in interface.arguments.values() for name in names}
    idle = [name for name in interface.inputs if name not in asked]
    assert not idle, f"no method asks for {', '.join(idle)}; take it away"
    classes = [kind for kind in subject.block.__mro__ if kind not in Block.__mro__]
    values = [_plain(value) for kind in classes for value in vars(kind).values()]
    functions = [value for value in values if inspect.isfunction(value)]
    names = {name for function in _reached(functions) for name in _named(function.__code__)}
    names |= {item.name for item in interface.safe.values()}  # `Block.write_safe` uses them
    names.update(subject.block.ports_from())
    if issubclass(subject.block, Device):
        names |= subject.block.used_outside()
    groups = (interface.params, interface.derived, interface.states, interface.work)
    idle = [name for group in groups for name in group if name not in names and name not in from_file]
    assert not idle, f"no method uses {', '.join(idle)}; take it away"


def _plain(value: Any) -> Any:
    """Return the function of a property or a class method; any other value as it is."""
    for name in ("fget", "func", "__func__"):
        value = getattr(value, name, value)
    return value


def _reached(functions: Iterable[Any]) -> set[types.FunctionType]:
    """Return plain functions and those that they call, as far as these are of the same library."""
    found: set[types.FunctionType] = set()
    waiting = [inspect.unwrap(function) for function in functions]
    while waiting:
        function = waiting.pop()
        if function not in found:
            found.add(function)
            library = function.__module__.partition(".")[0]
            called = (function.__globals__.get(name) for name in names_in(function.__code__))
            waiting += [
                each for each in called
                if isinstance(each, types.FunctionType) and each.__module__.partition(".")[0] == library
            ]  # fmt: skip
    return found


def _named(code: types.CodeType) -> Iterator[str]:
    yield from names_in(code)
    if "read_file" in code.co_names:  # read_file("calibration", ...)
        yield from (constant for constant in code.co_consts if isinstance(constant, str))
