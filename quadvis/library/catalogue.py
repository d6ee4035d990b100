"""Find the class of a block by its name, without a list to edit, importing only the blocks in use.

``signal.derivative`` is class ``Derivative`` in module ``quadvis_blocks.signal.derivative``. ``acme:slope``
is block ``slope`` of the library that another distribution registered as ``acme`` in the entry point group
``quadvis.libraries``. A folder ``blocks`` beside a diagram adds the user's own: ``blocks/wind/fan.py`` is
``wind.fan``. Of a diagram in a folder ``diagrams`` it may also stand beside that folder. The user's own
blocks are Python code that comes with the diagram, so the caller may be notified before they run, or refuse
them: see `OwnBlocks`.
"""

from __future__ import annotations

import importlib
import importlib.util
import os
import pkgutil
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from quadvis.errors import QuadvisError, sentence, suggestion
from quadvis.errors.caller import as_given
from quadvis.library.libraries import registered_libraries

if TYPE_CHECKING:
    from quadvis.block import Block
    from quadvis.library.own_package import OwnPackage

STANDARD = "quadvis_blocks"

OwnBlocks = bool | Callable[[Path], None]
"""Whether the code in the folder ``blocks`` beside a diagram may be run; a function is called with that
folder before any of it is run."""

NAME = re.compile(r"(?:(?P<library>[a-z]\w*):)?(?P<path>[a-z]\w*(?:\.[a-z]\w*)*)")


class CatalogueError(QuadvisError):
    """A block that cannot be loaded: ``problem`` and ``remedy`` are the two halves of the sentence."""

    def __init__(self, problem: str, remedy: str = "") -> None:
        super().__init__(sentence(problem, remedy))
        self.problem, self.remedy = problem, remedy


class Catalogue:
    """Finds blocks by name; ``folder`` is the folder of the diagram, whose own blocks may be refused."""

    def __init__(self, folder: Path | None = None, own_blocks: OwnBlocks = True) -> None:
        own = None if folder is None else _own_folder(folder)
        # In the repository of quadvis the folder of this name holds the standard library.
        self.own = None if own is None or (own / STANDARD).is_dir() else own
        self.own_blocks = own_blocks
        self._found: dict[str, type[Block]] = {}
        self._package: OwnPackage | None = None  # made when the first own block is loaded

    def find(self, name: str) -> type[Block]:
        """Return the class of a block; CatalogueError says what is wrong with the name or with its module."""
        if name not in self._found:
            self._found[name] = self._find(name)
        return self._found[name]

    def _find(self, name: str) -> type[Block]:
        match = NAME.fullmatch(name)
        if match is None:
            remedy = suggestion(name, self.names()) or "write group.block, such as signal.derivative"
            raise CatalogueError(f"'{name}' is not a block name", remedy)
        if match["library"]:
            return self._in_library(match["library"], match["path"], name)
        own, standard = self._own_file(match["path"]), f"{STANDARD}.{match['path']}"
        if own and _exists(standard):
            raise CatalogueError(f"'{name}' is in the standard library and in {own}", "rename the file")
        if own:
            return _block_class(self._load_own(own, name), name)
        module = _import(standard, name)
        if module is None:
            remedy = suggestion(name, self.names()) or "quadvis list shows all"
            raise CatalogueError(f"there is no block '{name}'", remedy)
        return _block_class(module, name)

    def load_all(self) -> tuple[dict[str, type[Block]], list[str]]:
        """Return the classes of all blocks by name, and a sentence for each that cannot be loaded."""
        found, failures = {}, []
        for name in self.names():
            try:
                found[name] = self.find(name)
            except CatalogueError as error:
                failures.append(str(error))
        return found, failures

    def names(self) -> list[str]:
        """Return the names of all blocks: the standard library's, the user's own, other libraries'."""
        found = sorted(_walk(STANDARD))
        if self.own is not None and self.own_blocks and self.own.is_dir():
            files = sorted(self.own.rglob("*.py"))
            paths = [file.relative_to(self.own).with_suffix("").parts for file in files]
            public = [parts for parts in paths if not any(part.startswith(("_", ".")) for part in parts)]
            found += [".".join(parts) for parts in public]
        for library, package in _libraries().items():
            found += [f"{library}:{path}" for path in sorted(_walk(package))]
        return found

    def standard_file(self, name: str) -> Path | None:
        """Return the file of a block of the standard library; None for all other blocks."""
        match = NAME.fullmatch(name)
        if match is None or match["library"] or self._own_file(name):
            return None
        folders = importlib.import_module(STANDARD).__path__
        files = [Path(folder, *name.split(".")).with_suffix(".py") for folder in folders]
        return next(filter(os.path.isfile, files), None)

    def _load_own(self, file: Path, name: str) -> ModuleType:
        """Run the module of an own block, if that is permitted, and return it."""
        self._permit(file, name)
        assert self.own is not None
        if self._package is None:
            from quadvis.library.own_package import OwnPackage  # it brings numpy, which a list does without

            self._package = OwnPackage(self.own)
        try:
            return self._package.module(file, name)
        except Exception as error:
            place = self._package.place(error) or file
            reason = error.msg if isinstance(error, SyntaxError) else error
            problem = f"block '{name}' cannot be loaded from {place}: {type(error).__name__}: {reason}"
            raise CatalogueError(problem) from error

    def _permit(self, file: Path, name: str) -> None:
        """Refuse to run the code of an own block, or announce that it will run."""
        if not self.own_blocks:
            problem = (
                f"block '{name}' is code of this diagram's own, in {str(file)!r}, and such code is refused"
            )
            refusal = as_given("--no-own-blocks", "own_blocks=False")
            raise CatalogueError(problem, f"read it, and leave out {refusal} if you trust it")
        if callable(self.own_blocks) and self.own is not None:
            self.own_blocks(self.own)

    def _own_file(self, path: str) -> Path | None:
        file = self.own.joinpath(*path.split(".")).with_suffix(".py") if self.own else None
        return file if file and os.path.isfile(file) else None

    def _in_library(self, library: str, path: str, name: str) -> type[Block]:
        packages = _libraries()
        if library not in packages:
            raise CatalogueError(f"there is no library '{library}'", suggestion(library, packages))
        module = _import(f"{packages[library]}.{path}", name)
        if module is None:
            names = [f"{library}:{known}" for known in _walk(packages[library])]
            raise CatalogueError(f"there is no block '{name}'", suggestion(name, names))
        return _block_class(module, name)


def _own_folder(folder: Path) -> Path:
    """Return the folder of own blocks: beside the diagram, or beside a folder ``diagrams`` around it."""
    beside = folder / "blocks"
    try:
        name = os.path.basename(os.path.abspath(folder))
    except OSError:  # the current folder is gone
        name = ""
    if name != "diagrams" or beside.is_dir():
        return beside
    return Path(os.path.normpath(folder / os.pardir / "blocks"))


def _libraries() -> dict[str, str]:
    """Return the packages of the other libraries, by the names under which they are registered."""
    return {name: value for name, value in registered_libraries().items() if value != STANDARD}


def _exists(module: str) -> bool:
    """Return whether a module exists, without importing it; its package may fail to import."""
    try:
        spec = importlib.util.find_spec(module)
        return spec is not None and spec.submodule_search_locations is None  # None: it is no package
    except ModuleNotFoundError as error:
        return not f"{module}.".startswith(f"{error.name}.")  # True if another module is missing
    except Exception:
        return True


def _walk(package: str, prefix: str = "") -> Iterator[str]:
    """Yield the paths of a library's blocks; modules with a leading underscore hold shared mathematics."""
    try:
        spec = importlib.util.find_spec(package)
    except Exception as error:
        problem = f"the library package '{package}' cannot be loaded: {type(error).__name__}: {error}"
        raise CatalogueError(problem) from error
    if spec is None or spec.submodule_search_locations is None:
        raise CatalogueError(f"the library package '{package}' cannot be found", "install it again")
    for module in pkgutil.iter_modules(spec.submodule_search_locations):
        if module.name.startswith("_"):
            continue
        if module.ispkg:
            yield from _walk(f"{package}.{module.name}", f"{prefix}{module.name}.")
        else:
            yield f"{prefix}{module.name}"


def _import(module: str, name: str) -> ModuleType | None:
    """Return the module of a block; None if there is none, or if it is a package."""
    try:
        found = importlib.import_module(module)
    except Exception as error:
        if not _exists(module):
            return None
        raise CatalogueError(f"block '{name}' cannot be loaded: {type(error).__name__}: {error}") from error
    return None if hasattr(found, "__path__") else found


def _block_class(module: ModuleType, name: str) -> type[Block]:
    from quadvis.block import Block

    found = dict.fromkeys(value for value in vars(module).values() if isinstance(value, type))
    own = [kind for kind in found if issubclass(kind, Block) and kind.__module__ == module.__name__]
    public = [block for block in own if not block.__name__.startswith("_")]
    if len(public) != 1:
        names = ", ".join(block.__name__ for block in public) or "none"
        raise CatalogueError(f"the module of block '{name}' must define one block, it defines {names}")
    return public[0]
