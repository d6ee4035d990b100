"""Where a log goes if nothing is said: none takes the place of another diagram's, also side by side."""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Mapping
from pathlib import Path

from quadvis.machine.files import LONGEST
from quadvis.output.log_reader import log_facts

SAME = ("name", "variant", "params")  # what the runs share whose logs replace each other


def claim_log(folder: Path, name: str, facts: Mapping[str, str]) -> Path:
    """Return where the log of a run with such facts goes: `name`, as far as files can be called so.

    If that is, or is about to be, the log of another diagram, variant or parameter set whose name comes to
    the same, a few digits of a hash follow.
    """
    plain = re.sub(r"[^A-Za-z0-9_.-]+", "-", name).strip("-.")[:LONGEST] or "run"
    path = folder / f"{plain}.mcap"
    mine = {key: facts[key] for key in SAME}
    if _is_new(path) or {key: log_facts(path).get(key) for key in SAME} == mine:
        return path
    digest = hashlib.sha256("\0".join(mine.values()).encode(errors="backslashreplace")).hexdigest()
    return path.with_stem(f"{plain}-{digest[:6]}")


def _is_new(path: Path) -> bool:
    """Take a name that nothing has, before another run can; whoever writes the log tells if it cannot be."""
    try:
        os.close(os.open(path, os.O_CREAT | os.O_EXCL, 0o666))
    except FileExistsError:
        return False
    except OSError:
        pass
    return True
