"""Read YAML files that may be wrong or hostile, within limits, as untyped nodes with their places."""

from quadvis.document.nodes import YamlList, YamlMap, YamlNode, YamlScalar, measure
from quadvis.document.reader import MAX_BYTES, dump_yaml, parse_yaml, read_yaml

__all__ = [
    "MAX_BYTES",
    "YamlList",
    "YamlMap",
    "YamlNode",
    "YamlScalar",
    "dump_yaml",
    "measure",
    "parse_yaml",
    "read_yaml",
]  # fmt: skip
