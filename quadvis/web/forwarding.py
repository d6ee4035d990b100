"""What a page can ask for: the verbs and topics that the gateway forwards, and nothing else.

The target checks levels and arguments again. The gateway knows levels so that the page shows no button in
vain, and so that nothing that is refused anyway costs the target a request.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

from quadvis.errors import QuadvisError, quoted

FORWARDED: Mapping[str, int] = {
    "load": 0, "setparam": 0,
    "start": 1, "stop": 1, "logs": 1, "getlog": 1,
    "parameters": 2, "getparam": 2, "addscope": 2, "remscope": 2,
    "applications": 3, "signals": 3, "getsignal": 3, "drawing": 3, "picture": 3,
    "scopes": 3, "setscope": 3, "startscope": 3, "stopscope": 3, "trigger": 3,
    "status": 4,
}  # fmt: skip
"""The highest level that may use each verb of the target."""

OWN: Mapping[str, int] = {"describe": 3, "watch": 3, "listen": 3}
"""The verbs of the gateway itself."""

COMMANDS = frozenset(("load", "setparam", "start"))
"""What nobody may do who looks at old data. Whoever wants to stop may."""

SCOPE = re.compile(r"scope/[1-9][0-9]{0,3}", re.ASCII)


def check_verb(verb: str, level: int) -> None:
    """Raise QuadvisError if a page may not use a verb."""
    highest = FORWARDED.get(verb, OWN.get(verb))
    if highest is None:
        raise QuadvisError(f"the page cannot ask for {quoted(verb)}")
    if level > highest:
        raise QuadvisError(f"'{verb}' needs a key of level {highest} or lower; this one has level {level}")


def permitted(level: int) -> list[str]:
    """Return all verbs that a level may use."""
    return [verb for verb, highest in {**FORWARDED, **OWN}.items() if level <= highest]
