"""Runs a program of tools/ inside the test's own process: a new interpreter for each costs most of the time.

What needs a process of its own (options of Python, a closed standard output) starts one; see the tests.
"""

from __future__ import annotations

import contextlib
import functools
import io
import subprocess
import sys
import traceback
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path
from types import ModuleType
from typing import Any
from unittest import mock


@functools.cache
def loaded(program: Path) -> ModuleType:
    """Return a program without a suffix as a module."""
    loader = SourceFileLoader(f"tool_{program.name}", str(program))
    spec = spec_from_loader(loader.name, loader)
    assert spec is not None
    module = sys.modules[loader.name] = module_from_spec(spec)  # dataclasses look there
    loader.exec_module(module)
    return module


def run_script(
    program: Path, *arguments: Any, folder: Path | None = None
) -> subprocess.CompletedProcess[str]:
    """Return how a program ends and what it prints, as `subprocess.run` does; a traceback is printed."""
    words = [str(program), *map(str, arguments)]
    out, error = io.StringIO(), io.StringIO()
    with (
        mock.patch.object(sys, "argv", words),
        contextlib.chdir(folder or Path.cwd()),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(error),
    ):
        try:
            code = loaded(program).main()
        except SystemExit as end:
            code = end.code or 0
        except Exception:
            traceback.print_exc()
            code = 1
    return subprocess.CompletedProcess(words, code, out.getvalue(), error.getvalue())
