"""Reading files: types of values, places of faults, and no file can crash or stall the reader."""

from __future__ import annotations

import errno
import os
import re
import subprocess
import sys
import tempfile
from fractions import Fraction
from pathlib import Path

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from quadvis.document import YamlList, YamlMap, YamlNode, YamlScalar, dump_yaml, parse_yaml, read_yaml, reader
from quadvis.errors import DiagramError, Faults, Place, QuadvisError
from quadvis.units import Unit, parse_units

REPOSITORY = Path(__file__).resolve().parents[2]
SECOND = Unit.parse("s")

DIAGRAM = """\
quadvis: 1
# a comment
rates: {vision: 10 Hz, control: 50 ms}
blocks:
  roll:
    block: control.nested_saturation
    with: {levels: [2.0, 1, .4, 1e-1], "on": yes}
"""


def value(text: str) -> YamlNode:
    """Return the node under the key `x`."""
    return parse_yaml(f"x: {text}\n", "d.yaml").mapping()["x"]


def refusal(text: str, reading: str, *args: object) -> str:
    """Return the message, without the place, of a reading that fails."""
    with pytest.raises(DiagramError) as caught:
        getattr(value(text), reading)(*args)
    (fault,) = caught.value.faults
    return re.sub(r"^d\.yaml:1:[34]: ", "", str(fault))


def faults_of(text: str) -> list[str]:
    with pytest.raises(DiagramError) as caught:
        parse_yaml(text, "d.yaml")
    return [str(fault) for fault in caught.value.faults]


def test_nodes_know_their_places():
    root = parse_yaml(DIAGRAM, "hover.yaml").mapping()
    assert root.place == Place("hover.yaml", 1, 1)
    assert root["rates"].mapping()["control"].place == Place("hover.yaml", 3, 33)
    assert root.keys["blocks"].place == Place("hover.yaml", 4, 1)
    roll = root["blocks"].mapping()["roll"].mapping()
    levels = roll["with"].mapping()["levels"]
    assert [item.place.column for item in levels.items()] == [21, 26, 29, 33]
    assert [item.key for item in levels.items()] == ["levels[0]", "levels[1]", "levels[2]", "levels[3]"]


def test_nothing_is_typed_before_it_is_asked_for():
    root = parse_yaml(DIAGRAM, "hover.yaml").mapping()
    given_ = root["blocks"].mapping()["roll"].mapping()["with"].mapping()
    assert list(given_) == ["levels", "on"]
    assert given_["on"].text() == "yes"
    assert given_["levels"].array((4,)) == [2.0, 1.0, 0.4, 0.1]


def test_maps_lists_and_texts_are_told_apart():
    root = parse_yaml("a: {b: 1}\nc: [1]\nd: e", "d.yaml").mapping()
    assert [type(root[key]) for key in root] == [YamlMap, YamlList, YamlScalar]
    assert ("a" in root, "z" in root, root.get("z"), len(root)) == (True, False, None, 3)
    assert [(key.value, node.place.line) for key, node in root.pairs()] == [("a", 1), ("c", 2), ("d", 3)]


@pytest.mark.parametrize(
    ("text", "reading", "result"),
    [
        ("hover", "text", "hover"), ('""', "text", ""), ("12:30", "text", "12:30"), ("~", "text", "~"),
        ("roll_2", "name", "roll_2"), ("true", "boolean", True), ("false", "boolean", False),
        ("12", "integer", 12), ("-3", "integer", -3), ("'7'", "integer", 7),
        ("9223372036854775807", "integer", 2**63 - 1),
        ("1e-3", "number", 1e-3), ("1e3", "number", 1000.0), (".5", "number", 0.5), ("-2", "number", -2.0),
        ("50 ms", "period", Fraction(1, 20)), ("10 Hz", "period", Fraction(1, 10)),
        ("rad/s^2", "unit", Unit.parse("rad/s^2")), ('"m m rad"', "units", parse_units("m m rad")),
    ],
)  # fmt: skip
def test_readings_return_what_stands_there(text, reading, result):
    assert getattr(value(text), reading)() == result


@pytest.mark.parametrize(
    ("text", "reading", "message"),
    [
        ("", "text", "'x' must be a text, not empty; write one, or leave the key out"),
        ("[a]", "text", "'x' must be a text, not a list"),
        ("2nd", "name",
         "'x' must be a name, not '2nd'; use letters, digits and '_', and begin with a letter"),
        ("on", "boolean", "'x' must be true or false, not 'on'; write true"),
        ("No", "boolean", "'x' must be true or false, not 'No'; write false"),
        ("maybe", "boolean", "'x' must be true or false, not 'maybe'"),
        ("1.5", "integer", "'x' must be a whole number, not '1.5'"),
        ("1e3", "integer", "'x' must be a whole number, not '1e3'; write 1000"),
        ("10 Hz", "integer", "'x' must be a whole number, not '10 Hz'; leave out the unit 'Hz'"),
        ("9223372036854775808", "integer",
         "'x' must be a whole number of at most 64 bits, not '9223372036854775808'"),
        ("fast", "number", "'x' must be a number, not 'fast'; write it as in 0.5, -2 or 1e-3"),
        ("010", "number", "'x' must be a number, not '010'; write '10'"),
        ("1_000", "number", "'x' must be a number, not '1_000'; write '1000'"),
        (".nan", "number", "'x' must be a number, not '.nan'; write it as in 0.5, -2 or 1e-3"),
        ("1e999", "number", "'x' must be a number, not '1e999'; stay between 1e-300 and 1e300"),
        ("{a: 1}", "number", "'x' must be a number, not a map"),
        ("20", "period", "'x': '20' has no unit; did you mean '20 Hz'?"),
        ("5 m", "period", "'x': '5 m' is in m, not in s; write it in ms or s"),
        ("m2", "unit", "'x': 'm2' is not a unit; did you mean 'm^2'?"),
        ("5", "mapping", "'x' must be a map, not '5'; write 'name: value' lines below it"),
        ("5", "items", "'x' must be a list, not '5'"),
    ],
)  # fmt: skip
def test_readings_refuse_with_advice(text, reading, message):
    assert refusal(text, reading) == message


def test_quantities_come_as_numbers_of_the_declared_unit():
    assert value("50 ms").quantity(SECOND) == 0.05
    assert value("0.05").quantity(SECOND) == 0.05
    assert value("0.24 m").quantity(Unit.parse("cm")) == 24.0
    assert value("90 %").quantity() == 0.9
    assert value("1/30 s").exact(SECOND) == Fraction(1, 30)
    with pytest.raises(DiagramError, match="'x': '50' has no unit; did you mean '50 ms'"):
        value("50").quantity(SECOND, bare=False)


def test_choices_name_the_near_one_or_all():
    crossings = ("sample", "hold", "delay", "newest")
    assert value("hold").choice(crossings) == "hold"
    expected = "'x' must be one of 'sample', 'hold', 'delay', 'newest', not "
    assert refusal("hodl", "choice", crossings) == f"{expected}'hodl'; did you mean 'hold'?"
    assert refusal("zzz", "choice", crossings) == f"{expected}'zzz'"


def test_arrays_have_shapes():
    assert value("[1, 20 %, 1e-3]").array((3,)) == [1.0, 0.2, 0.001]
    assert value("[[1, 2], [3, 4]]").array((2, None)) == [[1.0, 2.0], [3.0, 4.0]]
    assert value("7").array(()) == 7.0


@pytest.mark.parametrize(
    ("text", "shape", "message"),
    [
        ("[1, 2]", (3,), "'x' must be a list of 3 numbers, not a list of 2 numbers"),
        ("5", (3,), "'x' must be a list of 3 numbers, not '5'"),
        ("[1]", (), "'x' must be a number, not a list of 1 number"),
        ("[[1, 2]]", (2, None), "'x' must be a 2 x any list of numbers, not a 1 x 2 list of numbers"),
        ("{a: 1}", (1,), "'x' must be a list of 1 number, not a map"),
    ],
)
def test_arrays_of_another_shape_are_refused(text, shape, message):
    assert refusal(text, "array", shape) == message


def test_ragged_lists_and_wrong_elements_are_located():
    with pytest.raises(DiagramError, match=r"d.yaml:1:13: 'x\[1\]' must be a list of 2 numbers like"):
        value("[[1, 2], [3]]").array((2, None))
    with pytest.raises(DiagramError) as caught:
        value("[1, two, 3 s]").array((3,))
    assert [str(fault.place) for fault in caught.value.faults] == ["d.yaml:1:8", "d.yaml:1:13"]


def test_fields_report_unknown_and_missing_keys():
    node = value("{blok: a, rate: b, extra: c}")
    with pytest.raises(DiagramError) as caught:
        node.fields(required=("block", "at"), optional=("rate",))
    assert [str(fault) for fault in caught.value.faults] == [
        "d.yaml:1:4: key 'at' is missing; add 'at: ...'",
        "d.yaml:1:5: key 'blok' is unknown; did you mean 'block'?",
        "d.yaml:1:23: key 'extra' is unknown; choose from 'block', 'at'",
    ]
    faults = Faults()
    with faults.about("block 'roll'"):
        assert node.fields(("block", "at"), ("rate",), faults)["rate"].text() == "b"
    assert len(faults) == 3 and {fault.subject for fault in faults} == {"block 'roll'"}
    assert list(value("{block: a}").fields({"block"})) == ["block"]


def test_a_check_goes_on_after_a_fault():
    faults = Faults()
    root = parse_yaml("a: one\nb: 2\nc: [1, x]\n", "d.yaml").mapping()
    assert faults.collect(root["a"].number) is None
    assert faults.collect(root["b"].number) == 2.0
    assert faults.collect(root["c"].array, (2,)) is None
    assert [fault.place.line for fault in faults] == [1, 3]


def test_what_is_refused_in_readable_files_comes_all_at_once():
    text = "a: 1\na: 2\nb: &x 3\nc: *x\n<<: {d: 1}\n[1]: 2\ne: !!int 3\nf: 4\n"
    assert faults_of(text) == [
        "d.yaml:2:1: key 'a' is already in line 1; keep one of them",
        "d.yaml:3:4: the anchor '&x' is not allowed; leave it out",
        "d.yaml:4:4: the alias '*x' is not allowed; write it out",
        "d.yaml:5:1: the merge key '<<' is not allowed; write the values out",
        "d.yaml:6:1: a key must be a text; put a text that begins with '{' or '[' in quotes",
        "d.yaml:7:4: the tag '!!int' is not allowed; "
        "leave it out, or put a text that begins with '!' in quotes",
    ]
    faults = Faults()
    root = parse_yaml(text, "d.yaml", faults)
    assert len(faults) == 6
    assert root.to_python() == {"a": 1, "b": 3, "c": None, "e": 3, "f": 4}


SYNTAX = [
    ("a: b: c", "1:5: a ':' stands where none can"),
    ("a: 'x\n", "1:4: the quotes opened in line 1 are never closed"),
    ('a:\n  b: "x\n', "2:6: the quotes opened in line 2 are never closed"),
    ("a: [1, 2\n", "1:4: the list opened in line 1 lacks"),
    ("a: {b: 1\n", "1:4: the map opened in line 1 lacks"),
    ("a: [b, c}\n", "1:9: the list opened in line 1 lacks"),
    ("a:\n\tb: 1", "2:1: a tab cannot indent a line; use spaces"),
    ("a:\n  b: 1\n c: 2", "3:2: this does not belong to"),
    ("a: @x", "1:4: a text cannot begin with this character; put the text in quotes"),
    ("a: *\n", "1:5: a text cannot begin with '*' or '&'; put the text in quotes"),
    ("a: 1\nb\n", "2:1: a key has no ':' after it"),
    ('a: "\\q"', "1:5: the text in double quotes holds an unknown escape after '\\'"),
    ("%TAG ! x\n---\na: 1", "1:1: a line that begins with '%' is not allowed"),
    ("a: 1\n---\nb: 2", "2:1: a second document begins here; keep one document in a file"),
    ("# nothing\n", "1:1: the file is empty"),
    ("a: \x07", "1:4: the control character U+0007 is not allowed"),
    ('a: "\\0"', "1:4: the control character U+0000 is not allowed"),
    ("a: 1\r\nb: \u202e", "2:4: the control character U+202E is not allowed"),
    (": x", "1:1: "),
    ("a: {name}_x", "1:10: this does not belong to"),
]


@pytest.mark.parametrize(("text", "message"), SYNTAX)
def test_yaml_errors_are_located_and_in_plain_words(text, message):
    (fault,) = faults_of(text)
    assert fault.startswith(f"d.yaml:{message}")


@pytest.mark.parametrize("text", [text for text, _ in SYNTAX])
def test_the_parser_in_python_serves_where_libyaml_is_missing(text, monkeypatch):
    monkeypatch.setattr(reader, "_Loader", yaml.SafeLoader)
    assert re.match(r"d\.yaml:\d+:\d+: ", faults_of(text)[0])
    assert parse_yaml(DIAGRAM).mapping()["quadvis"].integer() == 1


def test_a_byte_order_mark_and_other_line_ends_are_accepted(tmp_path):
    path = tmp_path / "d.yaml"
    path.write_bytes(b"\xef\xbb\xbfa: 1\r\nb: two\r\n")
    root = read_yaml(path).mapping()
    assert root["b"].text() == "two"
    assert root["b"].place == Place(str(path), 2, 4)


def test_files_that_are_none_are_refused(tmp_path):
    (tmp_path / "hover.yaml").write_text("a: 1")
    for name, message in [
        ("hovr.yaml", f"hovr.yaml: there is no such file; did you mean '{tmp_path}/hover.yaml'?"),
        ("nowhere/x.yaml", "nowhere/x.yaml: there is no such file"),
        ("", "this is not a file; name a YAML file"),
        ("hover.yaml/x", f"hover.yaml/x: the file cannot be read: {os.strerror(errno.ENOTDIR).lower()}"),
        ("\0", "the file cannot be read: no file can have this name"),
    ]:
        with pytest.raises(DiagramError) as caught:
            read_yaml(f"{tmp_path}/{name}")
        assert str(caught.value).endswith(message)


LAUGHS = "a0: &a0 [lol]\n" + "".join(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]\n" for i in range(1, 9))
MERGES = "a0: &a0 {x: 1}\n" + "".join(f"a{i}: &a{i}\n  <<: [{f'*a{i - 1}, ' * 9}]\n" for i in range(1, 8))
HOSTILE: dict[str, str | bytes] = {
    "laughs": LAUGHS, "merges": MERGES, "cycle": "&a [*a]", "own_key": "&a {*a : 1}",
    "anchors": "- &a b\n" * 50_000,
    "undefined_alias": "a: *b", "anchor_only": "a: &b", "merge": "a: {<<: {b: 1}}",
    "python_object": "!!python/object/apply:os.system ['true']", "python_name": "a: !!python/name:os.system",
    "python_module": "a: !!python/module:this", "binary": "a: !!binary aGVsbG8=", "set": "!!set {a, b}",
    "local_tag": "a: !include /etc/passwd", "own_tag": "!<tag:yaml.org,2002:str> a",
    "tag_noise": "!" * 100_000,
    "duplicate": "a: 1\na: 2", "duplicates": "a: 1\n" * 100_000, "deep_duplicate": "a: {b: {c: 1, c: 2}}",
    "quoted_duplicate": "a: 1\n'a': 2", "list_key": "[a, b]: 1", "map_key": "{a: b}: 1", "empty_key": "'': 1",
    "long_key": "? " + "k" * 5000 + "\n: 1", "longer_key": "k" * 5000 + ": 1", "brackets": "[" * 100_000,
    "braces": "{" * 100_000, "dashes": "- " * 100_000, "questions": "? " * 100_000, "mixed": "[{a: " * 50_000,
    "indented": "".join(" " * i + "a:\n" for i in range(1000)), "nul": b"a: \0", "bell": b"a: \a",
    "latin_1": "a: \xe9".encode("latin-1"), "utf_16": "a: 1".encode("utf-16"),
    "utf_32": "a: 1".encode("utf-32"),
    "surrogate": b"a: \xed\xa0\x80", "overlong": b"a: \xc0\x80", "noise": bytes(range(256)) * 100,
    "inner_mark": "a: \ufeffb", "next_line": "a: \x85b", "large": "a: b\n" * 250_000,
    "wide": "[" + "a," * 200_000 + "]", "long": "-\n" * 150_000,
    "empty": "", "blank": " \n" * 1000, "comments": "# x\n" * 100_000, "null": "---\n...\n",
    "two": "--- a\n--- b",
    "many": "---\n" * 100_000, "directives": "".join(f"%TAG !a{i}! b\n" for i in range(50_000)),
    "version": "%YAML 9\n---\na",
    "open_quote": 'a: "' + "x\n" * 100_000, "open_list": "a: [b", "open_map": "a: {b",
    "open_apostrophe": "a: 'b",
    "tab": "a:\n\t- b", "colons": "a: b: c", "at": "a: @b", "percent": "a: %b", "backtick": "a: `b`",
    "escape": 'a: "\\q"',
    "dedent": "a:\n    b: 1\n  c: 2", "list_in_map": "a: 1\n- b", "map_in_list": "- a\nb: 1",
    "closing": "a: ]",
    "block_mark": "a: |x\n  b", "escaped_nul": 'a: "\\0"', "escaped_surrogate": 'a: "\\ud800"',
    "bidi": "a: \u202eb",
}  # fmt: skip


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_files_are_refused_with_a_place(name, tmp_path):
    text = HOSTILE[name]
    path = tmp_path / f"{name}.yaml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(DiagramError) as caught:
        read_yaml(path)
    assert 0 < len(caught.value.faults) <= 1 + Faults.LIMIT
    for line in str(caught.value).split("\n"):
        assert re.match(rf"{re.escape(str(path))}:\d+:\d+: .", line) and line.isprintable()


TYPED = {
    "1e999": "number", "9" * 400: "integer", "0x7fffffff": "integer", "0o17": "integer", "0b1": "integer",
    "1:30:00": "number", ".inf": "number", "-.NaN": "number", "1e99999999999": "quantity", "on": "boolean",
    "1e-99999999999 s": "period", "2001-01-01": "number", "=": "number", "${HOME}": "number",
    "__import__('os')": "number", "1/0 s": "period", "9" * 400 + " Hz": "period", "m^999999999": "unit",
    "((((((((((m))))))))))^9999": "unit", "a/../../b": "name", "\u0663": "integer", "\uff11": "number",
}  # fmt: skip


@pytest.mark.faults
@pytest.mark.parametrize("text", TYPED)
def test_hostile_values_are_refused_when_they_are_typed(text):
    node = YamlScalar(text, True, "d.yaml", 3, 7, "x")
    with pytest.raises(DiagramError, match=r"^d\.yaml:3:7: "):
        getattr(node, TYPED[text])()


def test_bombs_cost_little_time_and_memory(tmp_path):
    names = ["laughs", "merges", "cycle", "brackets", "braces", "mixed", "directives", "noise", "wide"]
    for name in names:
        text = HOSTILE[name]
        (tmp_path / f"{name}.yaml").write_bytes(text if isinstance(text, bytes) else text.encode())
    program = (
        "import resource, sys\n"
        "resource.setrlimit(resource.RLIMIT_AS, (400_000_000, 400_000_000))\n"
        "from quadvis.document import read_yaml\n"
        "from quadvis.errors import DiagramError\n"
        "for path in sys.argv[1:]:\n"
        "    try:\n"
        "        read_yaml(path)\n"
        "    except DiagramError:\n"
        "        print('refused')\n"
    )
    paths = [str(tmp_path / f"{name}.yaml") for name in names]
    command = [sys.executable, "-c", program, *paths]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, cwd=REPOSITORY, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.split() == ["refused"] * len(names)


def read_all(node: YamlNode) -> None:
    """Try every reading on every node; only faults with a place may come out."""
    readings = [
        node.text, node.name, node.boolean, node.integer, node.number, node.period, node.unit, node.units,
        node.items, node.mapping, node.shape, lambda: node.exact(SECOND),
        lambda: node.quantity(SECOND, bare=False),
        lambda: node.array((2, None)), lambda: node.choice(["a", "b"]), lambda: node.fields({"a"}, {"b"}),
    ]  # fmt: skip
    for reading in readings:
        try:
            reading()
        except DiagramError as error:
            assert all(fault.place.line > 0 for fault in error.faults)
    if isinstance(node, YamlList):
        children = node.values
    else:
        children = list(node.values.values()) if isinstance(node, YamlMap) else []
    for child in children:
        read_all(child)


pieces = st.sampled_from(
    ["a", "b: ", "- ", "\n", "  ", "[", "]", "{", "}", ", ", "'", '"', "&a ", "*a", "!!str ", "? ", ": ",
    "|\n", ">-\n",
     "# ", "---\n", "...\n", "%", "<<: ", "1e3", "50 ms", "\\", "\t", "\r\n", "\ufeff", "\u2028", "\x00",
     "~", "@", "`"]
)  # fmt: skip


@pytest.mark.faults
@given(st.one_of(st.text(), st.lists(pieces, max_size=25).map("".join)))
def test_any_text_is_read_or_refused(text):
    faults = Faults()
    try:
        root = parse_yaml(text, "d.yaml", faults)
    except DiagramError as error:
        assert all(fault.place.line > 0 and str(fault).isprintable() for fault in error.faults)
    else:
        read_all(root)


@pytest.mark.faults
@given(st.binary(max_size=200))
def test_any_bytes_are_read_or_refused(data):
    with tempfile.NamedTemporaryFile() as file:
        Path(file.name).write_bytes(data)
        try:
            read_all(read_yaml(file.name))
        except DiagramError as error:
            assert all(fault.place.line > 0 for fault in error.faults)


scalars = st.one_of(
    st.none(), st.booleans(), st.integers(-(10**15), 10**15),
    st.floats(allow_nan=False, allow_infinity=False),
    st.text(st.characters(codec="utf-8", exclude_categories=["C", "Z"], include_characters=" \n")),
    st.sampled_from(["1e-3", "on", "yes", "true", "null", "~", "", "12:30", "010", "<<", "=", "1_000"]),
    st.sampled_from(["- a", "a: b", "0x1", "# x", "&a", "*a", "!a", "@", "%", "[", "{", "'", '"', "|", "?"]),
)  # fmt: skip
keys = st.from_regex(r"[a-z_]{1,9}", fullmatch=True) | st.sampled_from(["on", "<<", "1", "a b", "y", "null"])
data = st.recursive(
    scalars.filter(lambda item: item is not None),
    lambda inner: st.one_of(st.lists(inner, max_size=4), st.dictionaries(keys, inner, max_size=4)),
    max_leaves=12,
)


@given(data)
def test_dumped_data_read_back_the_same(plain):
    assert parse_yaml(dump_yaml({"data": plain})).to_python() == {"data": plain}


def test_repeated_data_are_written_out():
    shared = [1, 2]
    assert "&" not in dump_yaml({"a": shared, "b": shared})


def test_data_that_yaml_cannot_hold_are_refused():
    with pytest.raises(QuadvisError, match="cannot be written as YAML"):
        dump_yaml({"a": object()})


@given(st.integers(0, 40), st.integers(1, 30))
def test_places_agree_with_the_text(blank, indent):
    text = "\n" * blank + "a:\n" + " " * indent + "bad: x\n"
    node = parse_yaml(text, "d.yaml").mapping()["a"].mapping()["bad"]
    line = text.split("\n")[node.line - 1]
    assert line[node.column - 1 :] == "x"
