"""What a page can ask for: the verbs and topics that the gateway forwards, and nothing else.

The target checks levels and arguments again. The gateway looks at the level, too, so that the page shows no
button in vain and the target is not asked for what it refuses anyway.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

from quadvis.errors import QuadvisError, quoted
from quadvis.wire.verbs import VERBS, check_level

FORWARDED = (
    "load", "setparam", "start", "stop", "logs", "getlog", "parameters", "getparam", "addscope", "remscope",
    "applications", "signals", "getsignal", "drawing", "picture", "scopes", "setscope", "startscope",
    "stopscope", "trigger", "status", "startprofiler", "stopprofiler", "getprofilerdata",
)  # fmt: skip
OWN: Mapping[str, str] = {"describe": "signals", "watch": "watch", "listen": "scopes"}
"""The gateway's own verbs, each with the verb of the target whose level it has."""

COMMANDS = frozenset(("load", "setparam", "start"))
"""What nobody may do who looks at old data. Whoever wants to stop may."""

PATIENCE: Mapping[str, float] = {"load": 120.0, "start": 120.0, "stop": 20.0, "drawing": 60.0}
"""How long the target may take (s), where it may take longer than usual."""

SCOPE = re.compile(r"scope/[1-9][0-9]{0,3}", re.ASCII)


def check_verb(verb: str, level: int) -> None:
    """Raise QuadvisError if a page may not use a verb."""
    if verb not in FORWARDED and verb not in OWN:
        raise QuadvisError(f"the page cannot ask for {quoted(verb)}")
    check_level(VERBS[OWN.get(verb, verb)], level)


def permitted(level: int) -> list[str]:
    """Return all verbs that a level may use."""
    return [verb for verb in (*FORWARDED, *OWN) if level <= VERBS[OWN.get(verb, verb)].level]
