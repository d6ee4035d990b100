"""The order of the keys of a diagram in the house style; those of one group stay as they are written."""

from __future__ import annotations

from collections.abc import Sequence

from quadvis.diagram.requirements import EXPECTATIONS
from quadvis.diagram.sections.figures import PANEL_KEYS
from quadvis.document.style import ELEMENT, Path, Ranks, as_written

Groups = tuple[tuple[str, ...], ...]


def _singly(*keys: str) -> Groups:
    return tuple((key,) for key in keys)


FILE = _singly(
    "quadvis", "name", "doc", "base", "without", "params", "set", "rates", "solver", "tasking", "stop_time",
    "seed", "overload", "on_host_loss", "computers", "links", "files", "ports", "blocks", "variants", "log",
    "expect", "summary", "figures", "analyse",
)  # fmt: skip
CONDITIONS = ("when", "triggered", "reset", "initial", "condition")
BLOCK: Groups = (
    ("slot",),
    ("block", "part"),
    ("group", "at", "rate", "stream"),
    CONDITIONS,
    ("with",),
    ("in",),
)
WIRE = _singly("from", "across", "over", "initial")
QUANTITY = _singly("value", "unit")
STRETCH = ("of", "after", "before")
JUDGED = ("signal", "margin", "limit", "age", "transfer", "sensitivity", "complementary_sensitivity")
EXPECTATION: Groups = (JUDGED, STRETCH, tuple(EXPECTATIONS))
ENTRY: Groups = (("signal",), STRETCH, ("show", "unit"))
PANEL: Groups = (
    ("title",),
    ("signals",),
    tuple(key for key in PANEL_KEYS if key not in ("title", "signals")),
)
FIGURE: Groups = (("title",), ("from", "to"), ("panels", "signals"), *PANEL[2:])

ANY = "*"
ORDERS: dict[Path, Groups] = {
    (): FILE,
    ("base",): _singly("file", "variant"),
    ("ports",): _singly("in", "out"),
    ("solver",): _singly("method", "step", "rtol", "atol"),
    ("rates", ANY): _singly("rate", "offset"),
    ("blocks", ANY): BLOCK,
    ("blocks", ANY, "in", ANY): WIRE,
    ("blocks", ANY, "in", ANY, ELEMENT): WIRE,
    ("variants", ANY): (("doc",), ("base",)),
    ("variants", ANY, "slots", ANY): BLOCK,
    ("variants", ANY, "slots", ANY, "in", ANY): WIRE,
    ("variants", ANY, "slots", ANY, "in", ANY, ELEMENT): WIRE,
    ("log",): _singly("signals", "every"),
    ("expect", ELEMENT): EXPECTATION,
    ("summary", ANY): ENTRY,
    ("figures", ELEMENT): FIGURE,
    ("figures", ELEMENT, "panels", ELEMENT): PANEL,
    ("figures", ELEMENT, "panels", ELEMENT, "signals", ELEMENT): _singly("signal", "label"),
    ("figures", ELEMENT, "signals", ELEMENT): _singly("signal", "label"),
    ("analyse",): _singly("at", "cuts", "transfer", "limits"),
    ("analyse", "transfer", ANY): _singly("from", "to", "open"),
    ("analyse", "limits", ANY): _singly("vary", "from", "to"),
}  # fmt: skip


def key_ranks(path: Path, keys: Sequence[str]) -> Sequence[int]:
    """Return the place of each key of the map at a path; keys that are not known come last of all."""
    groups = _groups(path)
    if not groups and set(keys) == {"value", "unit"}:
        groups = QUANTITY
    place = {key: number for number, group in enumerate(groups) for key in group}
    return [place.get(key, len(groups)) for key in keys]


def _groups(path: Path) -> Groups:
    for pattern, groups in ORDERS.items():
        fits = (each in (ANY, found) for each, found in zip(pattern, path, strict=False))
        if len(pattern) == len(path) and all(fits):
            return groups
    return ()


def ranks_of(keys: Sequence[str]) -> Ranks:
    """Return the order for a file with these keys at its top: that of diagrams, or none for other files."""
    return key_ranks if "quadvis" in keys else as_written
