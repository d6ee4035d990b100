"""Maps whose keys are names: of blocks, parameters, rates, variants and ports."""

from __future__ import annotations

import re

from quadvis.document import YamlMap, YamlNode, YamlScalar
from quadvis.errors import Faults, quoted
from quadvis.errors.characters import cleaned, first_odd, replacement, with_article

NAME = re.compile(r"[A-Za-z_]\w{0,63}", re.ASCII)
PATH = re.compile(rf"{NAME.pattern}(?:/{NAME.pattern})*", re.ASCII)  # a resolved diagram has whole paths


def named_entries(node: YamlNode | None, what: str, faults: Faults) -> list[tuple[str, YamlNode]]:
    """Return the entries of a map from names of ``what``; keys that are no names are reported."""
    mapping = faults.collect(with_clean_names, node, faults) if node is not None else None
    if mapping is None:
        return []
    for name, written in mapping.keys.items():
        if NAME.fullmatch(name) is None:
            refuse_name(written, what, faults)
    return list(mapping.values.items())


def with_clean_names(node: YamlNode, faults: Faults) -> YamlMap:
    """Return a map of which the keys are names; those with odd characters are refused, and read as meant."""
    mapping = node.mapping()
    for key in list(mapping.keys.values()):
        char = first_odd(key.value)
        if char is None:
            continue
        name = cleaned(key.value)
        if PATH.fullmatch(name) and name not in mapping:
            problem = f"{quoted(key.value)} holds {with_article(char)}"
            faults.add(key.place, problem, replacement(char))
            mapping = mapping.renamed(key.value, name)
    return mapping


def refuse_name(key: YamlScalar, what: str, faults: Faults) -> None:
    """Report a key that cannot be the name of anything."""
    remedy = "use letters, digits and '_', and begin with a letter"
    faults.add(key.place, f"'{key.value}' cannot name a {what}", remedy)
