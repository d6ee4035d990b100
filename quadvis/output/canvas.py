"""Blank sheets for figures, independent of the settings of matplotlib around them.

Neither MPLBACKEND of a notebook, nor a user's matplotlibrc, nor styles that the caller has set change or
prevent a figure, and no figure changes them. Agg draws sheets directly, without a backend.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import lru_cache
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RESOLUTION = 120  # dots an inch
POINTS = 72.0  # an inch
SAVED: Mapping[Any, Any] = {"savefig.dpi": RESOLUTION, "svg.hashsalt": "quadvis"}  # equal sheets, equal files
TYPEFACE = "DejaVu Sans"  # it comes with matplotlib
_BACKEND = ("backend", "backend_fallback")  # reading or setting these would load a backend


@contextmanager
def blank_sheet(width: float, height: float, style: Mapping[Any, Any], **more: Any) -> Iterator[Figure]:
    """Yield a white sheet (inches) in matplotlib's own style changed by ``style``, to draw on and to save.

    ``more`` goes to `matplotlib.figure.Figure`, such as ``layout="constrained"``.
    """
    with _quiet():
        library = _matplotlib()
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        own = {key: value for key, value in library.rcParamsDefault.items() if key not in _BACKEND}
        with library.rc_context({**own, **SAVED, **style}):
            sheet = Figure(figsize=(width, height), dpi=RESOLUTION, **more)
            FigureCanvasAgg(sheet)
            yield sheet


@lru_cache(4096)
def text_width(text: str, size: float, *, bold: bool = False) -> float:
    """Return the width (inches) of a text of a size (points) on such a sheet."""
    with _quiet():
        _matplotlib()
        from matplotlib.font_manager import FontProperties
        from matplotlib.textpath import text_to_path

        face = FontProperties(family=TYPEFACE, size=size, weight="bold" if bold else "normal")
        return float(text_to_path.get_text_width_height_descent(text, face, ismath=False)[0]) / POINTS


@contextmanager
def _quiet() -> Iterator[None]:
    """Drop matplotlib's warnings about its settings and about letters that its typeface lacks."""
    import logging  # imported here, because a check of a diagram draws no figure
    import warnings

    logger = logging.getLogger("matplotlib")
    level = logger.level
    logger.setLevel(logging.CRITICAL)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        logger.setLevel(level)


def _matplotlib() -> ModuleType:
    """Import matplotlib with its usual settings, for its other users; if this fails, without an rc file."""
    if "matplotlib" not in sys.modules and not any(map(_is_no_file, _rc_files())):
        try:
            import matplotlib
        except ImportError:
            raise
        except Exception:  # a broken rc file or an unknown backend raises whatever Python raises then
            _forget()
    if "matplotlib" not in sys.modules:
        with _without_surroundings():
            import matplotlib
    import matplotlib

    return matplotlib


def _forget() -> None:
    """Remove the modules of a failed import, except compiled modules, which load only once."""
    for name, module in list(sys.modules.items()):
        if f"{name}.".startswith("matplotlib.") and str(getattr(module, "__file__", "")).endswith(".py"):
            del sys.modules[name]


def _rc_files() -> Iterator[str]:
    yield "matplotlibrc"
    for name in ("MATPLOTLIBRC", "MPLCONFIGDIR"):
        if folder := os.environ.get(name):
            yield folder
            yield os.path.join(folder, "matplotlibrc")


def _is_no_file(path: str) -> bool:
    """Return whether a path is a pipe or a device, which may never end."""
    return os.path.exists(path) and not os.path.isfile(path) and not os.path.isdir(path)


@contextmanager
def _without_surroundings() -> Iterator[None]:
    """Hide rc files and the choice of a backend."""
    hidden = {name: os.environ.pop(name, None) for name in ("MPLBACKEND", "MATPLOTLIBRC")}
    os.environ["MATPLOTLIBRC"] = os.devnull
    folder = os.open(".", os.O_RDONLY) if os.path.exists("matplotlibrc") else None
    try:
        if folder is not None:  # a file in the current folder has precedence
            os.chdir(os.path.dirname(os.path.abspath(__file__)))
        yield
    finally:
        if folder is not None:
            os.fchdir(folder)
            os.close(folder)
        del os.environ["MATPLOTLIBRC"]
        os.environ.update({name: value for name, value in hidden.items() if value is not None})
