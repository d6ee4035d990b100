"""Operations of LLVM's text as expressions of C: arithmetic, comparisons, conversions, functions."""

from __future__ import annotations

import re
from collections.abc import Sequence

from quadvis.export.c_types import Unexportable, c_type, signed

FLAGS = {
    "nsw", "nuw", "exact", "disjoint", "nneg", "samesign", "inbounds", "nusw", "volatile", "atomic",
    "inrange", "nofpclass", "ninf", "nsz", "arcp", "nnan", "afn", "contract",
}  # fmt: skip
LOOSE = {"fast", "reassoc"}  # sums in another order
_WHOLE = {
    "add": "+", "sub": "-", "mul": "*", "and": "&", "or": "|", "xor": "^", "udiv": "/", "urem": "%",
    "shl": "<<", "lshr": ">>",
}  # fmt: skip
_SIGNED = {"sdiv": "/", "srem": "%", "ashr": ">>"}
_REAL = {"fadd": "+", "fsub": "-", "fmul": "*", "fdiv": "/"}
ARITHMETIC = {*_WHOLE, *_SIGNED, *_REAL, "frem"}
_COMPARED = {"eq": "==", "ne": "!=", "ugt": ">", "uge": ">=", "ult": "<", "ule": "<="}
_COMPARED_SIGNED = {"sgt": ">", "sge": ">=", "slt": "<", "sle": "<="}
_COMPARED_REALS = {
    "oeq": "{a} == {b}", "ogt": "{a} > {b}", "oge": "{a} >= {b}", "olt": "{a} < {b}", "ole": "{a} <= {b}",
    "one": "{a} < {b} || {a} > {b}", "ord": "{a} == {a} && {b} == {b}", "uno": "{a} != {a} || {b} != {b}",
    "ueq": "!({a} < {b} || {a} > {b})", "ugt": "!({a} <= {b})", "uge": "!({a} < {b})", "ult": "!({a} >= {b})",
    "ule": "!({a} > {b})", "une": "{a} != {b}", "true": "1", "false": "0",
}  # fmt: skip
# Functions of C's library that may be called, and LLVM's own that have the same meaning.
LIBRARY = {
    "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "asinh", "acosh", "atanh",
    "exp", "exp2", "expm1", "log", "log2", "log10", "log1p", "pow", "sqrt", "cbrt", "fmod", "remainder",
    "floor", "ceil", "trunc", "rint", "nearbyint", "round", "fabs", "copysign", "fma", "hypot", "erf",
    "erfc", "ldexp", "frexp", "malloc", "realloc", "free", "memcpy", "memmove", "memset",
}  # fmt: skip
_RENAMED = {"minnum": "least", "maxnum": "most", "roundeven": "to_even"}
_INTRINSIC = re.compile(r"llvm\.(\w+)(?:\.[\w.]+)?$")


def arithmetic(opcode: str, kind: str, a: str, b: str) -> str:
    """Return the expression of an operation on two values of a type."""
    if opcode == "frem":
        return f"fmod({a}, {b})"
    if opcode in _REAL:
        return f"{a} {_REAL[opcode]} {b}"
    if opcode in _SIGNED:
        return f"({c_type(kind)})(({signed(kind)}){a} {_SIGNED[opcode]} ({signed(kind)}){b})"
    return f"({c_type(kind)})({a} {_WHOLE[opcode]} {b})" + (" & 1" if kind == "i1" else "")


def comparison(predicate: str, kind: str, a: str, b: str) -> str:
    """Return the expression of a comparison of whole numbers or addresses."""
    if kind == "ptr":
        a, b, kind = f"(uintptr_t){a}", f"(uintptr_t){b}", "i64"
    if predicate in _COMPARED:
        return f"{a} {_COMPARED[predicate]} {b}"
    return f"({signed(kind)}){a} {_COMPARED_SIGNED[predicate]} ({signed(kind)}){b}"


def comparison_of_reals(predicate: str, a: str, b: str) -> str:
    """Return the expression of a comparison of real numbers, of which either may be NaN."""
    return _COMPARED_REALS[predicate].format(a=a, b=b)


def conversion(opcode: str, kind: str, target: str, value: str) -> str:
    """Return the expression of a value as another type; Unexportable if there is none."""
    made = c_type(target)
    match opcode:
        case "zext" | "fpext" | "fptrunc" | "uitofp" | "fptoui":
            return f"({made}){value}"
        case "trunc":
            return f"({made}){value}" + (" & 1" if target == "i1" else "")
        case "sext" | "sitofp" if kind == "i1":
            return f"({made})-(int8_t){value}"
        case "sext":
            return f"({made})({signed(target)})({signed(kind)}){value}"
        case "sitofp":
            return f"({made})({signed(kind)}){value}"
        case "fptosi":
            return f"({made})({signed(target)}){value}"
        case "ptrtoint":
            return f"({made})(uintptr_t){value}"
        case "inttoptr":
            return f"(char *)(uintptr_t){value}"
        case "bitcast" if {kind, target} == {"double", "i64"}:
            return f"{'to_bits' if kind == 'double' else 'from_bits'}({value})"
        case "bitcast" if kind == target:
            return value
    raise Unexportable(f"the conversion '{opcode}' from {kind} to {target} has no translation into C")


def intrinsic(name: str, kind: str, values: Sequence[str]) -> str:
    """Return the expression of a call of one of LLVM's own functions; Unexportable if there is none."""
    match = _INTRINSIC.match(name)
    function = match[1] if match else ""
    a, b = (*values, "", "")[:2]
    if function in ("memcpy", "memmove", "memset"):
        return f"{function}({', '.join(values[:3])})"
    if function in _RENAMED or function in LIBRARY:
        return f"{_RENAMED.get(function, function)}({', '.join(values)})"
    if function in ("smax", "smin", "umax", "umin"):
        sign, cast = (
            ">" if function.endswith("max") else "<",
            f"({signed(kind)})" if function[0] == "s" else "",
        )
        return f"({cast}{a} {sign} {cast}{b} ? {a} : {b})"
    if function == "abs":
        return f"(({signed(kind)}){a} < 0 ? ({c_type(kind)})(0 - {a}) : {a})"
    if name.startswith("llvm.usub.sat."):
        return f"({a} > {b} ? ({c_type(kind)})({a} - {b}) : 0)"
    if function in ("ctlz", "cttz"):
        return f"({c_type(kind)})zeros_{'above' if function == 'ctlz' else 'below'}({a}, {kind[1:]})"
    if function == "ctpop":
        return f"({c_type(kind)})bit_count({a})"
    if name == "llvm.is.fpclass.f64":
        return f"((class_of({a}) & {b}) != 0)"
    if function == "fmuladd":
        return f"({a} * {b} + {values[2]})"
    raise Unexportable(f"'{name}' has no translation into C")
