"""Small FMUs for the tests, compiled from C of our own with gcc and the headers that come with fmpy."""

from __future__ import annotations

import hashlib
import importlib.util
import os
import platform
import shutil
import subprocess
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from xml.sax.saxutils import quoteattr

import pytest

HERE = Path(__file__).parent
KEPT = HERE.parents[1] / ".pytest_cache" / "fmus"
TOKEN = "{8f1d4a62-trial}"
HEADERS = Path(next(iter(importlib.util.find_spec("fmpy").submodule_search_locations))) / "c-code"  # type: ignore[union-attr, arg-type]
_FITS = platform.system() == "Linux" and platform.machine() == "x86_64"
COMPILER = shutil.which("gcc") if _FITS else None
needs_gcc = pytest.mark.skipif(
    COMPILER is None,
    reason="compiles FMUs with gcc for Linux on x86-64",
)
FOLDERS = {2: "linux64", 3: "x86_64-linux"}


@dataclass(frozen=True)
class Var:
    """A variable: its array (r, i, b, s) and first place there in C follow from the order.

    ``size`` is that of an array (FMI 3.0), or 0. ``more`` are further attributes of the type's element.
    """

    name: str
    kind: str = "Float64"
    causality: str = "local"
    start: object = None
    size: int = 0
    unit: str = ""
    variability: str = ""
    initial: str = ""
    derivative: str = ""  # the state of which it is the derivative
    depends: Sequence[str] | None = None  # of an output; None: not stated
    more: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Model:
    """A model: variables, and the C text of start, update and step, which see them by ``NAME`` macros."""

    name: str
    variables: Sequence[Var]
    start: str = ""
    update: str = ""
    step: str = ""
    head: str = ""
    completed: str = "return 0;"
    ended: str = ""
    ends: str = "0"
    near: str = "1e-5"
    time_event: str = "0"
    units: str = ""
    types: str = ""
    attributes: str = 'canGetAndSetFMU{s}="true" canSerializeFMU{s}="true"'
    root: str = ""
    interfaces: Sequence[str] = ("CoSimulation", "ModelExchange")
    resources: Mapping[str, bytes] = field(default_factory=dict)


ARRAYS = {"Float64": "r", "Float32": "r", "Boolean": "b", "String": "s", "Clock": "i"}
KINDS2 = {
    "Float64": "Real",
    "Int32": "Integer",
    "Boolean": "Boolean",
    "String": "String",
    "Enumeration": "Enumeration",
}


def _places(model: Model) -> dict[str, tuple[str, int]]:
    """Return the array and the first place of each variable."""
    used = dict.fromkeys("ribs", 0)
    found = {}
    for var in model.variables:
        array = ARRAYS.get(var.kind, "i")
        found[var.name] = array, used[array]
        used[array] += max(1, var.size)
    return found


def _references(model: Model, version: int) -> dict[str, int]:
    places = _places(model)
    return {
        var.name: places[var.name][1] if version == 2 else number
        for number, var in enumerate(model.variables)
    }


def _macro(name: str) -> str:
    return "".join(letter if letter.isalnum() else "_" for letter in name).strip("_")


def source(model: Model, version: int) -> str:
    """Return the C of a model."""
    places = _places(model)
    letters = {"r": "R", "i": "I", "b": "B", "s": "S"}
    lines, starts = ['#include "framework.h"'], []
    for var in model.variables:
        array, place = places[var.name]
        argument = f"{letters[array]}({place})" if var.size == 0 else f"(&{letters[array]}({place}))"
        lines.append(f"#define v_{_macro(var.name)} {argument}")
        values = var.start if isinstance(var.start, list | tuple) else [var.start]
        for number, value in enumerate(values if var.start is not None else ()):
            if array == "s":
                starts.append(f'strcpy(S({place}), "{value}");')
            else:
                number_text = float(value) if array == "r" else int(value)  # type: ignore[arg-type]
                starts.append(f"{letters[array]}({place + number}) = {number_text};")
    pairs = [(places[var.derivative][1], places[var.name][1]) for var in model.variables if var.derivative]
    rows = [(places[var.name][1], max(1, var.size)) for var in model.variables]
    lines += [
        f'const char *const model_token = "{TOKEN}";',
        f"const double model_near = {model.near};",
        f"const int model_ends = {model.ends}, model_time_event = {model.time_event};",
        f"const int model_states[][2] = {{{_pairs(pairs)}}}, model_places[][2] = {{{_pairs(rows)}}};",
        model.head,
        f"int model_start(Model *m) {{ {' '.join(starts)} {model.start} (void)m; return 0; }}",
        f"int model_update(Model *m) {{ {model.update} (void)m; return 0; }}",
        f"int model_completed(Model *m) {{ (void)m; {model.completed} }}",
        f"void model_ended(Model *m) {{ (void)m; {model.ended} }}",
        f"int model_step(Model *m, double h) {{ (void)h; {model.step} (void)m; return 0; }}",
    ]
    return "\n".join(lines) + f"\n/* of FMI {version} */\n"


def _pairs(pairs: Sequence[tuple[int, int]]) -> str:
    return ", ".join(f"{{{one}, {other}}}" for one, other in pairs) or "{0, 0}"


def _variability(var: Var) -> str:
    return var.variability or ("" if var.kind in ("Float64", "Float32", "Clock") else "discrete")


def _attributes(pairs: Mapping[str, object]) -> str:
    return "".join(
        f" {name}={quoteattr(str(value))}" for name, value in pairs.items() if value not in ("", None)
    )


def _text(value: object) -> str:
    if isinstance(value, list | tuple):
        return " ".join(map(_text, value))
    return str(value).lower() if isinstance(value, bool) else str(value)


def description(model: Model, version: int) -> str:
    """Return modelDescription.xml."""
    references = _references(model, version)
    indices = {var.name: number for number, var in enumerate(model.variables, 1)}
    keys = indices if version == 2 else references
    # One variable of FMI 3.0 must be the time; nobody asks for its value here.
    time = f'<Float64 name="time" valueReference="{len(model.variables)}" causality="independent"/>'
    rows = [time] if version == 3 else []
    for var in model.variables:
        outer = {
            "name": var.name, "valueReference": references[var.name], "causality": var.causality,
            "variability": _variability(var), "initial": var.initial,
        }  # fmt: skip
        inner: dict[str, object] = {"unit": var.unit, **var.more}
        if var.derivative:
            inner["derivative"] = keys[var.derivative]
        if var.start is not None and var.kind != "String":
            inner["start"] = _text(var.start)
        if version == 2:
            if var.kind == "String" and var.start is not None:
                inner["start"] = var.start
            rows.append(
                f"<ScalarVariable{_attributes(outer)}><{KINDS2[var.kind]}{_attributes(inner)}/></ScalarVariable>"
            )
            continue
        children = f'<Dimension start="{var.size}"/>' if var.size else ""
        if var.kind == "String" and var.start is not None:
            children += f"<Start value={quoteattr(str(var.start))}/>"
        rows.append(f"<{var.kind}{_attributes({**outer, **inner})}>{children}</{var.kind}>")

    def unknown(var: Var, tag: str) -> str:
        key = "index" if version == 2 else "valueReference"
        depends = (
            ""
            if var.depends is None
            else f' dependencies="{" ".join(str(keys[each]) for each in var.depends)}"'
        )
        return f'<{tag} {key}="{keys[var.name]}"{depends}/>'

    outputs = [var for var in model.variables if var.causality == "output" and var.kind != "Clock"]
    slopes = [var for var in model.variables if var.derivative]
    initial = [var for var in (*outputs, *slopes) if var.initial not in ("exact",)]
    if version == 2:
        structure = (
            f"<Outputs>{''.join(unknown(var, 'Unknown') for var in outputs)}</Outputs>" if outputs else ""
        )
        structure += (
            f"<Derivatives>{''.join(unknown(var, 'Unknown') for var in slopes)}</Derivatives>"
            if slopes
            else ""
        )
        first = sorted(initial, key=lambda var: keys[var.name])
        structure += (
            f"<InitialUnknowns>{''.join(unknown(var, 'Unknown') for var in first)}</InitialUnknowns>"
            if first
            else ""
        )
    else:
        structure = "".join(unknown(var, "Output") for var in outputs)
        structure += "".join(unknown(var, "ContinuousStateDerivative") for var in slopes)
        structure += "".join(unknown(var, "InitialUnknown") for var in initial)
    attributes = model.attributes.format(s="state" if version == 2 else "State")
    order = ("ModelExchange", "CoSimulation", "ScheduledExecution")
    interfaces = "".join(
        f'<{name} modelIdentifier="{model.name}" {attributes if name != "ScheduledExecution" else ""}/>'
        for name in order
        if name in model.interfaces
    )
    token = "guid" if version == 2 else "instantiationToken"
    units = f"<UnitDefinitions>{model.units}</UnitDefinitions>" if model.units else ""
    types = f"<TypeDefinitions>{model.types}</TypeDefinitions>" if model.types else ""
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        f'<fmiModelDescription fmiVersion="{version}.0" modelName="{model.name}" '
        f'{token}="{TOKEN}" {model.root}>'
        f"{interfaces}{units}{types}"
        f"<ModelVariables>{''.join(rows)}</ModelVariables><ModelStructure>{structure}</ModelStructure>"
        "</fmiModelDescription>\n"
    )


def _compiled(*arguments: str) -> None:
    subprocess.run(["gcc", "-fPIC", "-w", f"-I{HERE}", f"-I{HEADERS}", *arguments], check=True)


def _framework(version: int) -> list[str]:
    """Return the object files that all models of a version share; they are compiled once."""
    key = hashlib.sha256(b"".join(path.read_bytes() for path in sorted(HERE.glob("*.[ch]")))).hexdigest()[:12]
    found = []
    for name in ("framework.c", "unused.c")[: version - 1]:
        path = KEPT / f"{name}-{version}-{key}.o"
        if not path.is_file():
            KEPT.mkdir(parents=True, exist_ok=True)
            new = path.with_suffix(f".{os.getpid()}")
            _compiled("-O1", "-c", f"-DFMI={version}", str(HERE / name), "-o", str(new))
            os.replace(new, path)
        found.append(str(path))
    return found


def library(model: Model, version: int, folder: Path) -> Path:
    """Compile the library of a model; return its path."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "model.c").write_text(source(model, version))
    made = folder / f"{model.name}.so"
    _compiled("-shared", "-O1", str(folder / "model.c"), *_framework(version), "-o", str(made), "-lm")
    return made


def build(model: Model, version: int, path: Path) -> Path:
    """Write the FMU of a model; return its path."""
    made = library(model, version, path.parent / f"{path.stem}.build")
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("modelDescription.xml", description(model, version))
        archive.write(made, f"binaries/{FOLDERS[version]}/{model.name}.so")
        for name, data in model.resources.items():
            archive.writestr(f"resources/{name}", data)
    shutil.rmtree(made.parent)
    return path


def fmu(model: Model, version: int = 2) -> str:
    """Return the path of a model's FMU, which is compiled once for all tests, and for all runs of them."""
    parts = (source(model, version), description(model, version), _framework(version))
    key = hashlib.sha256(repr((parts, sorted(model.resources.items()), version)).encode()).hexdigest()[:20]
    path = KEPT / f"{model.name}-{key}.fmu"
    if not path.is_file():
        KEPT.mkdir(parents=True, exist_ok=True)
        made = build(model, version, KEPT / f"{model.name}-{os.getpid()}.new")
        os.replace(made, path)
    return str(path)


__all__ = ["Model", "Var", "build", "description", "fmu", "library", "needs_gcc", "replace"]
