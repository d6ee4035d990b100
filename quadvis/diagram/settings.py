"""Parameters replaced from outside the diagram: by settings of the command line, and by parameter files.

A parameter file keeps settings under a name of their own, and may build on another:

    quadvis: 1
    name: S1
    doc: S0, and an IMU that is not level
    base: s0.yaml                                        # applied first; relative to this file
    set:
      imu.angle_bias: {value: [0.5, -0.5], unit: deg}    # block.parameter
      bandwidth: 1 rad/s                                 # a parameter of the diagram
"""

from __future__ import annotations

import enum
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from quadvis.diagram.parameters import read_constant
from quadvis.diagram.sections.forms import TEXT, Schema, map_of, ref
from quadvis.diagram.sections.header import is_version
from quadvis.document import YamlList, YamlMap, YamlNode, parse_yaml, read_yaml
from quadvis.errors import UNKNOWN, DiagramError, Faults, Odd, Place, Unknown, known
from quadvis.errors.caller import as_given
from quadvis.errors.characters import first_odd
from quadvis.machine.missing_file import base_trouble
from quadvis.machine.shipped import named_file

PARAMETERS_REQUIRED = ("quadvis", "name", "set")
PARAMETERS_KEYS = ("doc", "base")
SETTING: Schema = {"pattern": r"^([A-Za-z_][A-Za-z0-9_/]*\.)?[A-Za-z_][A-Za-z0-9_]*$"}


class Setting(NamedTuple):
    """A value given from outside, and where its name stands."""

    place: Place
    value: YamlNode | Unknown


class ParameterFile(NamedTuple):
    """A file of settings that a diagram was loaded with."""

    name: str
    path: Path
    bases: tuple[Path, ...] = ()  # the files that it builds on


Settings = Mapping[str, Mapping[str, Setting]]  # block path, "" for the diagram -> parameter -> setting
Files = Sequence[str | os.PathLike[str]] | str | os.PathLike[str]
Given = Mapping[str, Any] | Sequence[str]


def read_settings(given: Given, params: Files, faults: Faults) -> tuple[Settings, tuple[ParameterFile, ...]]:
    """Return the replaced values by block ("" for the diagram's own parameters) and name, and the files read.

    The files apply in their order, then ``given``: the last value of a parameter counts.
    """
    paths = [params] if isinstance(params, str | os.PathLike) else params
    found: dict[str, dict[str, Setting]] = {}
    files = []
    for path in map(named_file, paths):
        bases: list[Path] = []
        name = _read_file(path, (), found, bases, faults)
        files.append(ParameterFile(name or path.stem, path, tuple(bases)))
    for path_and_name, setting in _from_texts(setting_texts(given), faults):
        _put(found, path_and_name, setting)
    return found, tuple(files)


def parameters_schema() -> dict[str, Schema]:
    """Return the schema of the keys that only parameter files have."""
    words = "values of parameters, by block.parameter or by the diagram's names"
    return {
        "set": {**map_of(ref("value"), words), "propertyNames": SETTING},
        "base": {**TEXT, "description": "parameter file that this one builds on, relative to this file"},
    }


def setting_texts(given: Given) -> tuple[str, ...]:
    """Return settings as the command line writes them: ``block.parameter=value``."""
    if isinstance(given, Mapping):
        return tuple(f"{name}={value_text(value)}" for name, value in given.items())
    return tuple(given)


def _put(found: dict[str, dict[str, Setting]], name: str, setting: Setting) -> None:
    path, _, parameter = name.rpartition(".")
    found.setdefault(path, {})[parameter] = setting


def _read_file(
    path: Path,
    users: tuple[str, ...],
    found: dict[str, dict[str, Setting]],
    bases: list[Path],
    faults: Faults,
) -> str | None:
    """Add the settings of a file, after those of the file that it builds on; return its name."""
    node = faults.collect(read_yaml, path, faults)
    root = faults.collect(node.mapping) if node is not None else None
    if root is None or not is_version(root, faults) or not _is_parameters(root, faults):
        return None
    root = root.fields(PARAMETERS_REQUIRED, PARAMETERS_KEYS, faults)
    texts = {key: faults.collect(root[key].text) for key in ("name", "doc", "base") if key in root}
    base = texts.get("base")
    if base is not None:
        inner = named_file(base, path)
        problem, remedy = base_trouble(inner, base, (*users, os.path.realpath(path)))
        if problem:
            faults.add(root["base"].place, problem, remedy)
        else:
            bases.append(inner)
            _read_file(inner, (*users, os.path.realpath(path)), found, bases, faults)
    settings = faults.collect(root["set"].mapping) if "set" in root else None
    for key, value in settings.pairs() if settings is not None else ():
        with faults.about(f"'{key.value}'"):
            if not key.value.rpartition(".")[2]:
                remedy = "write block.parameter, or the name of a parameter of the diagram"
                faults.add(key.place, "this cannot name a parameter", remedy)
            else:
                _put(found, key.value, Setting(key.place, read_constant(value, faults)))
    return texts.get("name")


def _is_parameters(root: YamlMap, faults: Faults) -> bool:
    """Report a diagram or a part in one sentence, not by all that is odd in it."""
    if "set" in root or "blocks" not in root:
        return True
    problem = "this is a diagram or a part of one, since it has 'blocks'"
    faults.add(root.keys["blocks"].place, problem, "give a file with 'set: {block.parameter: value}'")
    return False


def settings_origin() -> str:
    """Return the file name in the places of settings that stand in no file."""
    return as_given("--set", "settings")


def _from_texts(texts: Iterable[str], faults: Faults) -> Iterator[tuple[str, Setting]]:
    """Yield the names and values of ``block.parameter=value``; report their faults."""
    for number, setting in enumerate(texts, 1):
        name, _, text = (part.strip(" \r\n") for part in setting.partition("="))
        place = Place(settings_origin(), 0, number, _odd(name))
        parameter = name.rpartition(".")[2]
        with faults.about(f"'{name}'"):
            if not text or not parameter:
                problem = "there is no value" if parameter else "there is no parameter"
                example = as_given(
                    "block.parameter=value, such as control/roll.bandwidth='2 rad/s'",
                    "block.parameter and value, such as {'control/roll.bandwidth': '2 rad/s'}",
                )
                faults.add(place, problem, f"write {example}")
                continue
            node = faults.read(read_setting, text, parameter, place)
            yield name, Setting(place, read_constant(node, faults) if known(node) else UNKNOWN)


def _odd(name: str) -> Odd | None:
    char = first_odd(name)
    return Odd(0, 0, char) if char is not None else None


def read_setting(text: str, parameter: str, place: Place) -> YamlNode:
    """Read a value that stands in no file. A file named there is relative to the working directory."""
    try:
        node = parse_yaml(text, place.file)
    except DiagramError as error:
        raise DiagramError(replace(fault, place=place) for fault in error.faults) from None
    node.key = parameter
    _put_at(node, place.column)
    return node


def _put_at(node: YamlNode, number: int) -> None:
    """Give a value and all that is in it the place of the setting."""
    node.line, node.column = 0, number
    if isinstance(node, YamlList):
        children = node.values
    else:
        children = list(node.values.values()) if isinstance(node, YamlMap) else []
    for child in children:
        _put_at(child, number)
    for key in node.keys.values() if isinstance(node, YamlMap) else ():
        _put_at(key, number)


def value_text(value: Any) -> str:
    """Return a Python value as the command line writes it."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, enum.Enum):
        return value.name
    tolist = getattr(value, "tolist", None)
    return str(tolist() if tolist else value)
