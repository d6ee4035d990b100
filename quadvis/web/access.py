"""Who gets an answer: the page of this very gateway, in a browser on this computer, with its token.

- A foreign page whose name leads to this computer (DNS rebinding) sends its own name as `Host`.
- A foreign page that reaches for the gateway sends its own name as `Origin`, or says "cross-site".
- Another user of this computer does not know the token, which is in no request line and in no file of others.
"""

from __future__ import annotations

import hmac
import secrets
import time
from collections import Counter
from collections.abc import Callable, Mapping

LOOPBACK = "127.0.0.1"
NAMES = (LOOPBACK, "localhost")
QUIET = 10.0  # s between two lines about refusals for one reason
HEADERS = {
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cache-Control": "no-store",
}


class Access:
    """The rules of one gateway on one port. Refusals are counted by reason, and announced now and then."""

    def __init__(self, port: int, announce: Callable[[str], None] = lambda _: None) -> None:
        self.token = secrets.token_urlsafe(24)
        self.refusals: Counter[str] = Counter()
        self._hosts = {f"{name}:{port}" for name in NAMES}
        self._announce = announce
        self._announced: dict[str, float] = {}

    def refuse(self, reason: str, what: str = "") -> str:
        """Count a refusal; return the reason."""
        self.refusals[reason] += 1
        now = time.monotonic()
        if now - self._announced.get(reason, -QUIET) >= QUIET:
            self._announced[reason] = now
            count = self.refusals[reason]
            self._announce(
                f"refused: {reason}{f', {what!r}' if what else ''}{f' ({count} so far)' if count > 1 else ''}"
            )
        return reason

    def objection(self, headers: Mapping[str, list[str]], upgrade: bool) -> str:
        """Return why a request is refused, given all values of its headers by lower-case name; else ""."""
        hosts = headers.get("host", [])
        if len(hosts) != 1 or hosts[0] not in self._hosts:
            return self.refuse("a request for another host", ", ".join(hosts)[:80])
        origins = headers.get("origin", [])
        own = f"http://{hosts[0]}"
        if any(origin != own for origin in origins) or (upgrade and len(origins) != 1):
            return self.refuse("a request from another page", ", ".join(origins)[:80])
        site = headers.get("sec-fetch-site", ["none"])
        if site[0] in ("cross-site", "same-site") and headers.get("sec-fetch-mode") != ["navigate"]:
            return self.refuse("a request from another page", site[0])
        return ""

    def knows(self, token: object) -> bool:
        """Whether a token is the right one; it takes as long for a wrong one."""
        right = isinstance(token, str) and hmac.compare_digest(token.encode(), self.token.encode())
        if not right:
            self.refuse("a page without the token")
        return right


def policy(host: str) -> str:
    """Return the content security policy of the page: nothing but its own files and its own socket."""
    return (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; "
        f"connect-src 'self' ws://{host}; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )
