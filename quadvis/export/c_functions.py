"""Functions of LLVM's text written in C, instruction by instruction.

Every value is a variable; where two blocks meet, each gives its own value before it jumps (phi). So the C has
the operations of the machine code in their order, and gives its bits. It can be compiled for other machines.
"""

from __future__ import annotations

import pickle
import re
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence

from quadvis.export.assembly_text import TextBlock, TextFunction, constants, functions, plain, split
from quadvis.export.c_operations import (
    ARITHMETIC,
    FLAGS,
    LIBRARY,
    LOOSE,
    arithmetic,
    comparison,
    comparison_of_reals,
    conversion,
    intrinsic,
)
from quadvis.export.c_types import (
    INTEGER,
    Unexportable,
    c_type,
    content,
    element,
    fields,
    leaves,
    number,
    offset,
    place_of,
    signed,
    size,
    suffix,
    typed,
)
from quadvis.machine import failures

_NOTHING = (
    "llvm.lifetime", "llvm.assume", "llvm.dbg", "llvm.experimental.noalias", "llvm.prefetch",
    "llvm.invariant",
)  # fmt: skip
_OVERFLOW = re.compile(r"llvm\.([su](?:add|sub|mul))\.with\.overflow\.i64")
_CALL = re.compile(r'^(?:(?:tail|musttail|notail) )?call (.*?)([@%])("(?:[^"\\]|\\.)*"|[\w.$-]+)\((.*)\)$')
_PYTHON = re.compile(r"call [^@]*@(?:_?Py\w|numba_(?:un)?pickle|numba_runtime)")
_RESULT = re.compile(r'^%("(?:[^"\\]|\\.)*"|[\w.$-]+) = (.*)$')
SENTENCE = re.compile(r"^static const char (\w+)\[\]", re.MULTILINE)  # of an exception
_PICKLED = re.compile(r"@([\w.]*pickledata[\w.]*)")
_PHI = re.compile(r"\[ (.*?), %(\"[^\"]*\"|[\w.$-]+) \]")


def translated(text: str, entries: Collection[str], prefix: str) -> str:
    """Return, in C, the functions of a module that are named, with all that they call and read.

    All other names begin with the prefix. Unexportable, in a sentence, for what has no translation.
    """
    known = {each.name: each for each in functions(text)}
    names = {name: name if name in entries else f"{prefix}_part{number}" for number, name in enumerate(known)}
    data = _Constants(constants(text), prefix)
    pythons = {name for name, each in known.items() if _calls_python(each)}
    made: dict[str, str] = {}
    waiting = list(entries)
    while waiting:
        name = waiting.pop()
        if name not in made:
            writer = _Writer(known[name], names, data, pythons)
            made[name] = writer.text()
            waiting += sorted(writer.called - made.keys())
    heads = [_head(known[name], names) + ";" for name in sorted(made)]
    return "\n".join([*data.lines, *heads, *(made[name] for name in sorted(made))])


def _calls_python(function: TextFunction) -> bool:
    return any(_PYTHON.search(line) for block in function.blocks for line in block.lines)


def _head(function: TextFunction, names: Mapping[str, str]) -> str:
    types = ", ".join(f"{c_type(kind)} a{number}" for number, (kind, _) in enumerate(function.parameters))
    kind = "void" if function.returns == "void" else c_type(function.returns)
    return f"static {kind} {names[function.name]}({types or 'void'})"


class _Constants:
    """The constants that functions read, as arrays of C."""

    def __init__(self, known: Mapping[str, str], prefix: str) -> None:
        self._known, self._prefix = known, prefix
        self._names: dict[str, str] = {}
        self.lines: list[str] = []

    def address(self, name: str) -> str:
        """Return an expression for a constant's address; that of an exception is its sentence, or none."""
        if "picklebuf" in name:
            return self._exception(name)
        if "pickledata" in name:
            return "(char *)0"
        if name not in self._known:
            raise Unexportable(f"'{name}' is no constant")
        if name not in self._names:
            data = content(*typed(self._known[name]))
            data += bytes(-len(data) % 8)
            words = ", ".join(
                f"UINT64_C({int.from_bytes(data[k : k + 8], 'little')})" for k in range(0, len(data), 8)
            )
            self._names[name] = f"{self._prefix}_constant{len(self._names)}"
            self.lines.append(f"static const uint64_t {self._names[name]}[] = {{{words}}};")
        return f"(char *){self._names[name]}"

    def _exception(self, name: str) -> str:
        """Return an expression for the address of what a person reads of an exception."""
        if name not in self._names:
            match = _PICKLED.search(self._known.get(name, ""))
            sentence = _sentence(content(*typed(self._known[match[1]]))) if match else ""
            self._names[name] = f"{self._prefix}_sentence{len(self._names)}" if sentence else "0"
            if sentence:
                self.lines.append(f"static const char {self._names[name]}[] = {_text(sentence)};")
        return f"(char *){self._names[name]}"


def _sentence(pickled: bytes) -> str:
    """Return what a person reads of an exception: numba keeps its class and its arguments; "" if of a bug."""
    kind, arguments, _place = pickle.loads(pickled)
    try:
        return failures.arithmetic(kind(*(arguments or ())))
    except TypeError:  # a class of somebody else's, which takes other arguments
        return ""


def _text(sentence: str) -> str:
    """Return a sentence as a text of C."""
    letters = (
        chr(byte) if 32 <= byte < 127 and chr(byte) not in '"\\?' else f"\\{byte:03o}"
        for byte in sentence.encode()
    )
    return f'"{"".join(letters)}"'


class _Writer:
    """Writes one function."""

    def __init__(
        self,
        function: TextFunction,
        names: Mapping[str, str],
        data: _Constants,
        pythons: Collection[str],
    ) -> None:
        self._function, self._names, self._data, self._pythons = function, names, data, pythons
        self._values = {name: f"a{number}" for number, (_, name) in enumerate(function.parameters)}
        self._labels = {block.label: f"l{number}" for number, block in enumerate(function.blocks)}
        self._declared: list[str] = []
        self._lines: list[str] = []
        self._phis = {block.label: list(self._phis_of(block)) for block in function.blocks}
        self.called: set[str] = set()

    def text(self) -> str:
        """Return the function."""
        for block in self._function.blocks:
            self._lines.append(f"{self._labels[block.label]}:;")
            for line in block.lines:
                self._instruction(block, line)
        unused = [f"(void)a{number};" for number in range(len(self._function.parameters))]
        lines = [
            *unused,
            *self._declared,
            f"goto {self._labels[self._function.blocks[0].label]};",
            *self._lines,
        ]
        return "\n".join([_head(self._function, self._names) + " {", *(f"    {line}" for line in lines), "}"])

    def _phis_of(self, block: TextBlock) -> Iterable[tuple[str, str, dict[str, str]]]:
        """Yield the name, the type and the values by the label of the block before, of each phi."""
        for line in block.lines:
            match = _RESULT.match(line)
            if match is None or not match[2].startswith("phi "):
                continue
            kind, rest = typed(match[2].removeprefix("phi "))
            values = {plain(label): value for value, label in _PHI.findall(rest)}
            yield plain(match[1]), kind, values

    def _variable(self, name: str, kind: str) -> str:
        """Return the variable of a value, declared once."""
        if name not in self._values:
            self._values[name] = f"v{len(self._values)}"
            self._declared.append(f"{c_type(kind)} {self._values[name]} = 0;")
        return self._values[name]

    def _parts(self, kind: str, text: str) -> list[str]:
        """Return expressions for the scalar parts of an operand."""
        if kind[:1] not in "[{":
            return [self._value(kind, text)]
        if text.startswith("%"):
            return [self._variable(_part(plain(text), path), leaf) for path, leaf in leaves(kind)]
        if text[:1] in "[{":
            return [part for each in split(text[1:-1]) for part in self._parts(*typed(each))]
        return [number(leaf, text) for _, leaf in leaves(kind)]

    def _put_parts(self, name: str, kind: str, values: Sequence[str]) -> None:
        for (path, leaf), value in zip(leaves(kind), values, strict=True):
            self._put(_part(name, path), leaf, value)

    def _value(self, kind: str, text: str) -> str:
        """Return an expression for an operand."""
        text = text.strip()
        if text.startswith("%"):
            name = plain(text)
            if name not in self._values:  # it is defined further below
                return self._variable(name, kind)
            return self._values[name]
        if text.startswith("@") and plain(text) in self._names:
            if plain(text) in self._pythons:  # it makes an exception for Python
                return "(char *)0"
            self.called.add(plain(text))
            return f"(char *)(uintptr_t){self._names[plain(text)]}"
        if text.startswith("@"):
            return self._data.address(plain(text))
        if text.startswith("getelementptr"):
            return self._address(text.removeprefix("getelementptr").replace("(", " ", 1).rstrip(")"))
        if text.startswith("inttoptr"):
            inner = text[text.index("(") + 1 : text.rindex(" to ")].split()
            return f"(char *)(uintptr_t){number(inner[0], inner[-1])}"
        return number(kind, text)

    def _instruction(self, block: TextBlock, line: str) -> None:
        match = _RESULT.match(line)
        result, body = (plain(match[1]), match[2]) if match else ("", line)
        opcode, _, rest = body.partition(" ")
        if opcode == "phi":
            return
        if opcode in ("tail", "musttail", "notail", "call"):
            self._call(result, body)
            return
        words = rest.split(" ")
        if LOOSE & set(words[:4]):
            raise Unexportable("sums in another order have no translation into C")
        while words and (words[0] in FLAGS or words[0].startswith("nofpclass")):
            words.pop(0)
        rest = " ".join(words)
        method: Callable[..., None] | None = getattr(self, f"_do_{opcode}", None)
        if method is not None:
            method(block, result, rest)
        elif opcode in ARITHMETIC:
            kind, a, b = self._pair(rest)
            self._put(result, kind, arithmetic(opcode, kind, a, b))
        elif " to " in rest:
            self._convert(opcode, result, rest)
        else:
            raise Unexportable(f"the instruction '{opcode}' has no translation into C")

    def _put(self, name: str, kind: str, expression: str) -> None:
        self._lines.append(f"{self._variable(name, kind)} = {expression};")

    def _pair(self, rest: str) -> tuple[str, str, str]:
        """Return the type and the expressions of two operands: "double %a, %b"."""
        kind, operands = typed(rest)
        one, other = split(operands)
        return kind, self._value(kind, one), self._value(kind, other)

    def _convert(self, opcode: str, result: str, rest: str) -> None:
        source, target = rest.rsplit(" to ", 1)
        kind, operand = typed(source)
        self._put(result, target, conversion(opcode, kind, target, self._value(kind, operand)))

    def _do_fneg(self, _block: TextBlock, result: str, rest: str) -> None:
        kind, operand = typed(rest)
        self._put(result, kind, f"-{self._value(kind, operand)}")

    def _do_freeze(self, _block: TextBlock, result: str, rest: str) -> None:
        kind, operand = typed(rest)
        self._put_parts(result, kind, self._parts(kind, operand))

    def _do_icmp(self, _block: TextBlock, result: str, rest: str) -> None:
        predicate, _, rest = rest.partition(" ")
        kind, a, b = self._pair(rest)
        self._put(result, "i1", comparison(predicate, kind, a, b))

    def _do_fcmp(self, _block: TextBlock, result: str, rest: str) -> None:
        predicate, _, rest = rest.partition(" ")
        _, a, b = self._pair(rest)
        self._put(result, "i1", comparison_of_reals(predicate, a, b))

    def _do_select(self, _block: TextBlock, result: str, rest: str) -> None:
        condition, one, other = split(rest)
        kind, a = typed(one)
        chosen, pairs = (
            self._value("i1", condition.removeprefix("i1 ")),
            [self._parts(kind, each) for each in (a, typed(other)[1])],
        )
        self._put_parts(
            result, kind, [f"{chosen} ? {one} : {other}" for one, other in zip(*pairs, strict=True)]
        )

    def _do_load(self, _block: TextBlock, result: str, rest: str) -> None:
        kind, pointer, *_more = split(rest)
        place = self._value("ptr", pointer.removeprefix("ptr "))
        for path, leaf in leaves(kind):
            loaded = f"ld_{suffix(leaf)}({place} + {place_of(kind, path)})" + (" & 1" if leaf == "i1" else "")
            self._put(_part(result, path), leaf, loaded)

    def _do_store(self, _block: TextBlock, _result: str, rest: str) -> None:
        given, pointer, *_more = split(rest)
        kind, operand = typed(given)
        place = self._value("ptr", pointer.removeprefix("ptr "))
        for (path, leaf), value in zip(leaves(kind), self._parts(kind, operand), strict=True):
            self._lines.append(f"st_{suffix(leaf)}({place} + {place_of(kind, path)}, {value});")

    def _do_getelementptr(self, _block: TextBlock, result: str, rest: str) -> None:
        self._put(result, "ptr", self._address(rest))

    def _address(self, text: str) -> str:
        """Return the expression for a place: "i8, ptr %p, i64 8"."""
        words = text.split(" ")
        while words and (words[0] in FLAGS or not words[0]):
            words.pop(0)
        kind, base, *indices = split(" ".join(words))
        place = self._value("ptr", base.removeprefix("ptr "))
        for level, index in enumerate(indices):
            whole, _, operand = index.partition(" ")
            value = self._value(whole, operand)
            step = f"(int64_t)({signed(whole)}){value}"
            if level == 0:
                place += f" + {step} * {size(kind)}"
            elif kind.startswith("{"):
                place += f" + {offset(kind, int(operand))}"
                kind = fields(kind)[int(operand)]
            else:
                kind = element(kind)
                place += f" + {step} * {size(kind)}"
        return f"({place})"

    def _do_alloca(self, _block: TextBlock, result: str, rest: str) -> None:
        kind, *more = split(rest)
        count = int(more[0].split()[1]) if more and not more[0].startswith("align") else 1
        name = self._variable(result, "ptr")
        self._declared.append(f"uint64_t {name}room[{max(1, -(-size(kind) * count // 8))}];")
        self._lines.append(f"{name} = (char *){name}room;")

    def _do_extractvalue(self, _block: TextBlock, result: str, rest: str) -> None:
        aggregate, *indices = split(rest)
        kind, operand = typed(aggregate)
        path = tuple(map(int, indices))
        parts = zip(leaves(kind), self._parts(kind, operand), strict=True)
        for (place, leaf), value in parts:
            if place[: len(path)] == path:
                self._put(_part(result, place[len(path) :]), leaf, value)

    def _do_insertvalue(self, _block: TextBlock, result: str, rest: str) -> None:
        aggregate, given, *indices = split(rest)
        kind, operand = typed(aggregate)
        path = tuple(map(int, indices))
        values = dict(zip((place for place, _ in leaves(kind)), self._parts(kind, operand), strict=True))
        inner, value = typed(given)
        for (place, _), part in zip(leaves(inner), self._parts(inner, value), strict=True):
            values[(*path, *place)] = part
        self._put_parts(result, kind, [*values.values()])

    def _do_fence(self, *_: object) -> None:
        """Write nothing: an instance is used by one thread at a time."""

    def _do_atomicrmw(self, _block: TextBlock, result: str, rest: str) -> None:
        operation, _, rest = rest.partition(" ")
        pointer, given, *_more = split(rest)
        kind, operand = given.split(" ")[:2]
        if operation not in ("add", "sub"):
            raise Unexportable(f"the instruction 'atomicrmw {operation}' has no translation into C")
        place = self._value("ptr", pointer.removeprefix("ptr "))
        before = self._variable(result or f"{len(self._lines)}.before", kind)
        sign = "+" if operation == "add" else "-"
        self._lines.append(f"{before} = ld_{suffix(kind)}({place});")
        self._lines.append(f"st_{suffix(kind)}({place}, {before} {sign} {self._value(kind, operand)});")

    def _do_br(self, block: TextBlock, _result: str, rest: str) -> None:
        parts = split(rest)
        if len(parts) == 1:
            self._lines.append(self._jump(block, parts[0]))
            return
        condition = self._value("i1", parts[0].removeprefix("i1 "))
        self._lines.append(
            f"if ({condition}) {{ {self._jump(block, parts[1])} }} else {{ {self._jump(block, parts[2])} }}"
        )

    def _do_switch(self, block: TextBlock, _result: str, rest: str) -> None:
        head, _, cases = rest.partition("[")
        given, default = split(head)
        kind, _, operand = given.partition(" ")
        value = self._value(kind, operand)
        for constant, label in re.findall(
            r"i\d+ (-?\d+|true|false), (label %(?:\"[^\"]*\"|[\w.$-]+))", cases
        ):
            self._lines.append(f"if ({value} == {number(kind, constant)}) {{ {self._jump(block, label)} }}")
        self._lines.append(self._jump(block, default))

    def _jump(self, block: TextBlock, label: str) -> str:
        """Return the jump from a block to another one, with the values that this takes from there."""
        target = plain(label.removeprefix("label "))
        takes: list[str] = []
        gives: list[str] = []
        for name, kind, values in self._phis[target]:
            given = values.get(block.label)
            if given is None:  # the first block has a number in place of a name
                given = next(value for before, value in values.items() if before not in self._labels)
            for (path, leaf), value in zip(leaves(kind), self._parts(kind, given), strict=True):
                takes.append(f"{c_type(leaf)} t{len(takes)} = {value};")
                gives.append(f"{self._variable(_part(name, path), leaf)} = t{len(gives)};")
        return (
            f"{{ {' '.join([*takes, *gives])} goto {self._labels[target]}; }}"
            if takes
            else f"goto {self._labels[target]};"
        )

    def _do_ret(self, _block: TextBlock, _result: str, rest: str) -> None:
        kind, operand = typed(rest)
        self._lines.append("return;" if kind == "void" else f"return {self._value(kind, operand)};")

    def _do_unreachable(self, *_: object) -> None:
        self._lines.append("abort();")

    def _call(self, result: str, text: str) -> None:
        match = _CALL.match(text)
        assert match is not None, text
        kind = next((word for word in re.split(r" (?![^{]*\})", match[1]) if _is_type(word)), "void")
        name = plain(match[3])
        arguments = [_argument(each) for each in split(match[4])]
        if name.startswith(_NOTHING):
            return
        values = [self._value(each, operand) for each, operand in arguments]
        if overflow := _OVERFLOW.fullmatch(name):
            sum_name = self._variable(f"{result}.0", "i64")
            self._put(f"{result}.1", "i1", f"{overflow[1]}_over({', '.join(values)}, &{sum_name})")
            return
        if match[2] == "%":  # by address
            types = ", ".join(c_type(each) for each, _ in arguments)
            form = f"({'void' if kind == 'void' else c_type(kind)} (*)({types}))"
            expression = f"({form}(uintptr_t){self._value('ptr', f'%{name}')})({', '.join(values)})"
        else:
            expression = self._called(name, arguments, values)
        if kind == "void":
            self._lines.append(f"{expression};")
        else:
            self._put(result or f"{len(self._lines)}.unused", kind, f"{expression}")

    def _called(self, name: str, arguments: list[tuple[str, str]], values: list[str]) -> str:
        """Return the expression of a call."""
        listed = ", ".join(values)
        if name in self._names:
            self.called.add(name)
            return f"{self._names[name]}({listed})"
        if not name.startswith("llvm."):
            if name not in LIBRARY:
                raise Unexportable(f"'{name}' is not a function of C's library")
            return f"{name}({self._for_library(name, arguments, values)})"
        if name.startswith("llvm.x86.atomic.sub.cc.") and arguments[2][1] in ("4", "5"):
            kind, place = arguments[1][0], values[0]
            before = self._variable(f"{len(self._lines)}.before", kind)
            self._lines.append(f"{before} = ld_{suffix(kind)}({place});")
            self._lines.append(f"st_{suffix(kind)}({place}, {before} - {values[1]});")
            return f"({before} {'==' if arguments[2][1] == '4' else '!='} {values[1]})"
        return intrinsic(name, arguments[0][0] if arguments else "", values)

    def _for_library(self, name: str, arguments: list[tuple[str, str]], values: list[str]) -> str:
        """Return the arguments as C's library takes them."""
        if name == "frexp":
            return f"{values[0]}, (int *){values[1]}"
        return ", ".join(
            f"(int32_t){value}" if kind == "i32" and name == "ldexp" else value
            for (kind, _), value in zip(arguments, values, strict=True)
        )


def _part(name: str, path: tuple[int, ...]) -> str:
    """Return the name of a scalar part of a value; that of a scalar itself is its own."""
    return ".".join([name, *map(str, path)])


def _argument(text: str) -> tuple[str, str]:
    """Return the type and the operand of an argument, without its attributes."""
    kind, _, rest = text.partition(" ")
    if "getelementptr" in rest:
        return kind, rest[rest.index("getelementptr") :]
    return kind, rest.rsplit(" ", 1)[-1]


def _is_type(word: str) -> bool:
    return bool(word in ("void", "double", "float", "ptr") or INTEGER.fullmatch(word) or word.startswith("{"))
