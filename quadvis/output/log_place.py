"""The default place of a log: no log replaces that of another diagram, even if both run at the same time."""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Mapping
from pathlib import Path

from quadvis.machine.files import LONGEST
from quadvis.output.log_reader import log_facts

SAME = ("name", "variant", "params")  # facts that are equal for runs whose logs replace each other


def claim_log(folder: Path, name: str, facts: Mapping[str, str]) -> Path:
    """Return the path of the log of a run with these facts: `name`, as far as a file can have this name.

    If the path is, or is about to be, the log of another diagram, variant or parameter set, a few digits of a
    hash follow the name.
    """
    plain = re.sub(r"[^A-Za-z0-9_.-]+", "-", name).strip("-.")[:LONGEST] or "run"
    path = folder / f"{plain}.mcap"
    mine = {key: facts[key] for key in SAME}
    if _is_new(path) or {key: log_facts(path).get(key) for key in SAME} == mine:
        return path
    digest = hashlib.sha256("\0".join(mine.values()).encode(errors="backslashreplace")).hexdigest()
    return path.with_stem(f"{plain}-{digest[:6]}")


def _is_new(path: Path) -> bool:
    """Claim an unused name before another run can; the writer of the log reports if this is impossible."""
    try:
        os.close(os.open(path, os.O_CREAT | os.O_EXCL, 0o666))
    except FileExistsError:
        return False
    except OSError:
        pass
    return True
