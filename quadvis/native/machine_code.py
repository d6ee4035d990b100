"""Machine code: from LLVM's text to an object file, and from an object file to addresses.

It needs llvmlite alone, so that code which was kept on disk is loaded without numba.

Every function has one form, ``int32 f(int64 *places)``: ``places`` has the addresses of all that it reads and
writes; the result is 0, or the status with which numba's function failed.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

from quadvis.native.runtime import RUNTIME

STATUS = re.compile(r"ret i32 (\S+)")
CALLED = re.compile(r'call [^@\n]*@(?:"([^"]+)"|([\w.$]+))\(')
OUTSIDE = ("Py", "_Py", "numba_", "NRT_")


class Unlinkable(Exception):
    """The code needs something that is neither in the C library nor in quadvis's own runtime."""


@dataclass(frozen=True)
class Compiled:
    """A function as numba has compiled it: LLVM's text, its name there, and how many pointers it takes."""

    text: str
    name: str
    pointers: int


def emit(functions: Mapping[str, Compiled]) -> tuple[bytes, frozenset[str]]:
    """Return the object file that has the functions by these names, and those of them that can fail.

    Unlinkable if one needs more than the C library.
    """
    import llvmlite.binding as llvm

    machine = target_machine()
    modules = [llvm.parse_assembly(function.text) for function in functions.values()]
    whole = modules[0]
    for module in modules[1:]:
        whole.link_in(module)
    calls = "\n".join(_entry(name, function) for name, function in functions.items())
    for text in (calls, RUNTIME):
        part = llvm.parse_assembly(text)
        part.triple, part.data_layout = whole.triple, whole.data_layout
        whole.link_in(part)
    for value in (*whole.functions, *whole.global_variables):
        if not value.is_declaration and value.name not in functions:
            value.linkage = "internal"
    _optimise(llvm, whole, machine)
    _check_called(llvm, whole, functions)
    fallible = frozenset(
        function.name
        for function in whole.functions
        if function.name in functions and set(STATUS.findall(str(function))) != {"0"}
    )
    return machine.emit_object(whole), fallible


def _entry(name: str, function: Compiled) -> str:
    """Return LLVM's text of the function of one form that calls numba's."""
    pointers = range(function.pointers)
    loads = "".join(
        f"  %a{index} = getelementptr i64, ptr %places, i64 {index}\n  %p{index} = load ptr, ptr %a{index}\n"
        for index in pointers
    )
    taken = "".join(f", ptr %p{index}" for index in pointers)
    declared = f'declare i32 @"{function.name}"(ptr, ptr{", ptr" * function.pointers})\n'
    return (
        f"{declared}define i32 @{name}(ptr %places) {{\n"
        f"  %result = alloca i64\n  %error = alloca ptr\n{loads}"
        f'  %status = call i32 @"{function.name}"(ptr %result, ptr %error{taken})\n  ret i32 %status\n}}\n'
    )


def _optimise(llvm: Any, module: Any, machine: Any) -> None:
    builder = llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options(speed_level=2))
    builder.getModulePassManager().run(module, builder)


def _check_called(llvm: Any, module: Any, entries: Collection[str]) -> None:
    """Refuse code that calls Python or numba's runtime: it runs where neither is.

    numba also leaves functions here that only Python would call, to make an exception; they do not matter.
    """
    llvm.load_library_permanently("")
    functions = {function.name: function for function in module.functions}
    waiting = list(entries)
    seen = set(waiting)
    while waiting:
        function = functions[waiting.pop()]
        name = function.name
        outside = function.is_declaration and not name.startswith("llvm.")
        if outside and (name.startswith(OUTSIDE) or not llvm.address_of_symbol(name)):
            raise Unlinkable(f"it needs '{name}'")
        called = {quoted or plain for quoted, plain in CALLED.findall(str(function))}
        new = called & functions.keys() - seen
        seen |= new
        waiting += new


def target_machine() -> Any:
    """Return LLVM's description of this processor, a new one each time: who loads code with it owns it."""
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    target = llvm.Target.from_default_triple()
    return target.create_target_machine(
        cpu=llvm.get_host_cpu_name(),
        features=llvm.get_host_cpu_features().flatten(),
        opt=3,
        reloc="default",
        codemodel="jitdefault",
        jit=True,
    )


def processor() -> str:
    """Return the name and the features of this processor, on which machine code depends."""
    import llvmlite.binding as llvm

    return f"{llvm.get_host_cpu_name()} {llvm.get_host_cpu_features().flatten()}"


class Loaded:
    """The functions of object files in memory; it must live as long as they are called."""

    def __init__(self) -> None:
        import llvmlite.binding as llvm

        machine = target_machine()
        llvm.load_library_permanently("")
        empty = llvm.parse_assembly("")
        empty.triple = machine.triple
        self._llvm = llvm
        self._engine = llvm.create_mcjit_compiler(empty, machine)

    def add(self, content: bytes) -> None:
        """Add an object file; RuntimeError if it is none."""
        self._engine.add_object_file(self._llvm.ObjectFileRef.from_data(content))

    def address(self, name: str) -> int:
        """Return the address of a function."""
        return int(self._engine.get_function_address(name))
