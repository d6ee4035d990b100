"""The properties of a target: their names in xPC Target and here, and how they are shown."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from quadvis.errors import QuadvisError, quoted, sentence, suggestion
from quadvis.host.logs import PARTS
from quadvis.units import Unit, format_quantity

SECOND = Unit.parse("s")
# What `status` says, by the names of xPC Target, with the names that Python's style wants.
PROPERTIES: Mapping[str, str] = {
    "Application": "application", "Mode": "mode", "Status": "state", "CPUOverload": "cpu_overload",
    "ExecTime": "exec_time", "SessionTime": "session_time", "StopTime": "stop_time",
    "SampleTime": "sample_time", "MinTET": "min_tet", "AvgTET": "avg_tet", "MaxTET": "max_tet",
    "MaxLogSamples": "max_log_samples", "LogMode": "log_mode", "NumLogWraps": "num_log_wraps",
    "ViewMode": "view_mode",
    "NumSignals": "num_signals", "NumParameters": "num_parameters", "Scopes": "scope_numbers",
    "Tasks": "tasks", "Problem": "problem", "Passed": "passed", "Verdicts": "verdicts", "Log": "log_name",
    "Variant": "variant", "Hash": "hash", "DefaultParamSet": "default_param_set",
}  # fmt: skip
_BY_ALIAS = {alias: name for name, alias in PROPERTIES.items()} | {name: name for name in PROPERTIES}
PART_NAMES = {alias: name for name, alias in PARTS.items()} | {name: name for name in PARTS}
_TIMES = ("ExecTime", "SessionTime", "StopTime", "SampleTime", "MinTET", "AvgTET", "MaxTET")


def known(name: str) -> str:
    """Return the property that a name means, which may be the beginning of one, as in xPC Target."""
    if name in _BY_ALIAS:
        return _BY_ALIAS[name]
    found = dict.fromkeys(full for each, full in _BY_ALIAS.items() if each.lower().startswith(name.lower()))
    if len(found) == 1:
        return next(iter(found))
    problem = f"a target has no '{name}'"
    remedy = f"write one of {', '.join(found)}" if found else suggestion(name, _BY_ALIAS)
    raise AttributeError(sentence(problem, remedy))


def number_of(name: str, value: Any) -> float:
    """Return a number that a property is to have, which may be infinite; QuadvisError if it is none."""
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        raise QuadvisError(f"'{name}' cannot be {quoted(value)}; give a number") from None


def seconds(name: str, value: Any) -> float:
    """Return a time (s) that a property is to have: a number, or a text such as "30 s"."""
    try:
        return number_of(name, value)
    except QuadvisError:
        if not isinstance(value, str):
            raise
    from quadvis.diagram.times import read_duration
    from quadvis.document import YamlScalar

    return float(read_duration(YamlScalar(value, False, name, 0, 0)))


def shown(name: str, value: Any) -> str:
    """Return a value of a property as text."""
    if name in _TIMES and isinstance(value, float):
        return format_quantity(value, SECOND, 4)
    if name == "MaxLogSamples" and value is None:
        return "all"
    if name == "Verdicts":
        from quadvis.run.verdict import verdict_text

        return "; ".join(map(verdict_text, value))
    if isinstance(value, list):
        return "; ".join(map(str, value)) or "none"
    return "none" if value in ("", None) else str(value)
