"""Write a block type in C in a process of its own, which has compiled nothing yet.

The block type goes there as cloudpickle of numba writes it: classes that exist in this process alone, such as
those of own blocks, by their contents. Nothing of it comes from outside.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from types import ModuleType
from typing import Any

from quadvis.block import OWN_MODULES
from quadvis.errors import QuadvisError
from quadvis.native.block_type import BlockType

REFUSED = 2  # exit code; the sentence is on standard error


def written_apart(kind: BlockType, prefix: str, path: str) -> str:
    """Return what `quadvis.export.blocks.written` gives in another process; QuadvisError as there."""
    cloudpickle: Any = import_module("numba.cloudpickle")
    with _by_value(cloudpickle):
        data: bytes = cloudpickle.dumps((sys.path, kind, prefix, path))
    done = subprocess.run(
        [sys.executable, "-m", __name__], input=data, capture_output=True, env=_surroundings()
    )
    if done.returncode == REFUSED:
        raise QuadvisError(done.stderr.decode().strip())
    if done.returncode:
        raise QuadvisError(f"block '{path}' cannot be written in C: {done.stderr.decode()[-300:].strip()}")
    return done.stdout.decode()


def _surroundings() -> dict[str, str]:
    return os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}


@contextmanager
def _by_value(cloudpickle: Any) -> Iterator[None]:
    """Have modules of own blocks written with their contents: the other process cannot import them."""
    own: list[ModuleType] = [module for name, module in sys.modules.items() if name.startswith(OWN_MODULES)]
    for module in own:
        cloudpickle.register_pickle_by_value(module)
    try:
        yield
    finally:
        for module in own:
            cloudpickle.unregister_pickle_by_value(module)


def main() -> int:
    """Write what standard input asks for."""
    from quadvis.export.blocks import written

    cloudpickle: Any = import_module("numba.cloudpickle")

    sys.path[:], kind, prefix, path = cloudpickle.load(sys.stdin.buffer)
    try:
        text = written(kind, prefix, path)
    except QuadvisError as error:
        print(error, file=sys.stderr)
        return REFUSED
    sys.stdout.write(text)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
