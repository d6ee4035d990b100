"""What a block is, from the blocks that are installed here; the target has the same ones or refuses them."""

from __future__ import annotations

from functools import lru_cache
from typing import Any


@lru_cache(256)
def described(kind: str) -> dict[str, Any]:
    """Return docstring and ports of a block by its name in a diagram; QuadvisError if there is none."""
    from quadvis.library.catalogue import Catalogue
    from quadvis.library.describe import facts

    found = facts(kind, Catalogue(None, own_blocks=False).find(kind))
    return {key: found[key] for key in ("block", "doc", "inputs", "outputs")}
