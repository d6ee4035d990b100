"""quadvis: block diagrams in YAML that fly a four-rotor craft from a camera."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from quadvis.version import __version__

if TYPE_CHECKING:
    from quadvis.analysis.identify import identify
    from quadvis.api import Diagram, load
    from quadvis.errors import QuadvisError
    from quadvis.host.target import Target
    from quadvis.output.log_reader import Log, read_log
    from quadvis.realtime.options import RealTime
    from quadvis.run.replay import replay
    from quadvis.sweeps.sweep import sweep
    from quadvis.sweeps.tune import tune

__all__ = [
    "Diagram",
    "Log",
    "QuadvisError",
    "RealTime",
    "Target",
    "__version__",
    "identify",
    "load",
    "read_log",
    "replay",
    "sweep",
    "tune",
]

_HOMES = {
    "Diagram": "api",
    "Target": "host.target",
    "identify": "analysis.identify",
    "load": "api",
    "Log": "output.log_reader",
    "QuadvisError": "errors",
    "read_log": "output.log_reader",
    "RealTime": "realtime.options",
    "replay": "run.replay",
    "sweep": "sweeps.sweep",
    "tune": "sweeps.tune",
}


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used, so that `quadvis --help` imports nothing of the engine."""
    if name not in _HOMES:
        raise AttributeError(f"module 'quadvis' has no attribute '{name}'")
    from importlib import import_module

    return getattr(import_module(f"quadvis.{_HOMES[name]}"), name)
