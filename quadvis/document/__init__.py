"""Read YAML files that may be wrong or hostile, within limits, as untyped nodes with their places."""

from quadvis.document.fields_file import read_fields
from quadvis.document.node import YamlNode
from quadvis.document.reader import MAX_BYTES, dump_yaml, parse_yaml, read_yaml
from quadvis.document.tree import YamlList, YamlMap, YamlScalar

__all__ = [
    "MAX_BYTES",
    "YamlList",
    "YamlMap",
    "YamlNode",
    "YamlScalar",
    "dump_yaml",
    "parse_yaml",
    "read_fields",
    "read_yaml",
]  # fmt: skip
