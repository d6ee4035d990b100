"""The modules in a folder ``blocks`` beside a diagram, as a package of its own for Python.

So own blocks import each other's code by relative imports: ``from .._curves import lift`` in
``blocks/wind/fan.py`` is ``blocks/_curves.py``, and ``from .._motors.curves import lift`` is a module of a
package there. Each folder has a package with another name, so equal names in two folders do not meet.
"""

from __future__ import annotations

import hashlib
import importlib
import importlib.util
import os
import sys
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType

from quadvis.block import OWN_MODULES
from quadvis.machine.source_line import source_line


class OwnPackage:
    """The package of a folder, read anew: what an earlier one of the same folder has read is forgotten."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.name = OWN_MODULES + hashlib.sha256(os.path.realpath(folder).encode()).hexdigest()[:16]
        for name in [name for name in sys.modules if f"{name}.".startswith(f"{self.name}.")]:
            del sys.modules[name]
        _make_package(OWN_MODULES.removesuffix("."), [])
        _make_package(self.name, [os.path.abspath(folder)])
        importlib.invalidate_caches()  # else files that were made a moment ago are not seen

    def module(self, file: Path, block: str) -> ModuleType:
        """Return the module of a block, run once; whatever its code raises is raised."""
        name = f"{self.name}.{block}"
        if name in sys.modules:
            return sys.modules[name]
        spec = importlib.util.spec_from_file_location(name, file)
        assert spec is not None and spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        sys.modules[name] = module
        try:
            spec.loader.exec_module(module)
        except BaseException:
            del sys.modules[name]
            raise
        return module

    def place(self, error: BaseException) -> str:
        """Return ``file:line`` of the innermost step of an error in the folder; "" if there is none."""
        return source_line(error, str(self.folder))


def _make_package(name: str, folders: list[str]) -> None:
    if name not in sys.modules:
        spec = ModuleSpec(name, None, is_package=True)
        spec.submodule_search_locations = folders
        sys.modules[name] = importlib.util.module_from_spec(spec)


def own_files(module: str) -> list[Path]:
    """Return the files of all modules in the package of an own block's module; [] for other modules."""
    if not module.startswith(OWN_MODULES):
        return []
    package = ".".join(module.split(".")[:2])
    found = [
        getattr(loaded, "__file__", None)
        for name, loaded in list(sys.modules.items())
        if name.startswith(f"{package}.")
    ]
    return [Path(file) for file in found if file]
