"""Characters that look like others, and other slips of people who come from word processors or Windows."""

from __future__ import annotations

import unicodedata
from pathlib import Path

import pytest

from quadvis.api import load_text
from quadvis.document import parse_yaml
from quadvis.errors import DiagramError, Fault
from quadvis.errors.characters import advice, cleaned, meant, odd_characters

DIAGRAM = """\
quadvis: 1
name: skel
doc: What this is for.
rates: {fast: 100 Hz, slow: 10 Hz}
stop_time: 5 s
params: {size: 1 m}
blocks:
  source:
    block: sources.step
    rate: fast
    with: {before: 0 m, after: $size, at: 1 s}
  lag:
    block: signal.low_pass
    rate: fast
    with: {time_constant: 0.5 s}
    in: {u: source.y}
  wide: {block: sources.constant, rate: fast, with: {value: [1 m, 2 m, 3 m]}}
expect:
  - {signal: lag.y, after: 4 s, within: 1 cm, of: 1 m}
"""


def faults(old: str, new: str, folder: Path) -> list[Fault]:
    """Return the faults of the diagram with one text replaced."""
    assert old in DIAGRAM
    with pytest.raises(DiagramError) as caught:
        load_text(DIAGRAM.replace(old, new, 1), folder)
    return caught.value.faults


def where(fault: Fault) -> str:
    return f"{fault.place.line}:{fault.place.column}"


# What is replaced, by what, and where the odd character then stands; it is the first one of the new text.
BLANKS = [
    ('    rate: fast\n    with: {b', '\xa0   rate: fast\n    with: {b', "10:1"),
    ('time_constant: ', 'time_constant:\xa0 ', "15:26"),
    ('time_constant: ', 'time_constant:\xa0', "15:26"),
    ('0.5 s', '0.5\xa0s', "15:30"),
    ('0.5 s', '0.5\u202fs', "15:30"),
    ('0.5 s', '0.5\u3000s', "15:30"),
    ('0.5 s', '0.5\ts', "15:30"),
    ('  - {signal', '  -\xa0{signal', "19:4"),
    ('  - {signal', '\u3000 - {signal', "19:1"),
    ('    in: {u', '    in:\u2003{u', "16:8"),
    ('rate: fast\n    with: {t', 'rate\xa0: fast\n    with: {t', "14:9"),
    ('100 Hz', '100\u2009Hz', "4:18"),
    ('{u: source.y}', '{u: source.y\xa0}', "16:21"),
    ('    block: signal.low_pass\n    rate: fast\n',
     '\xa0\xa0\xa0\xa0block: signal.low_pass\n\xa0\xa0\xa0\xa0rate: fast\n', "14:1"),
    ('signal.low_pass', 'signal.low_pass\xa0', "13:27"),
]  # fmt: skip
HIDDEN = [
    ('source.y', 'source\u200b.y', "16:19"),
    ('time_constant', 'time_\xadconstant', "15:17"),
    ('0.5 s', '0.5\u200b s', "15:30"),
    ('0.5 s', '0.5 s\u200d', "15:32"),
    ('rate: fast\n    with: {t', 'ra\u200cte: fast\n    with: {t', "14:7"),
    ('rate: fast\n    with: {t', 'rate: fa\u2060st\n    with: {t', "14:13"),
    ('  lag:', '  la\xadg:', "12:5"),
    ('signal.low_pass', 'signal.\u200blow_pass', "13:19"),
    ('within', 'with\xadin', "19:37"),
    ('$size', '$si\u200bze', "11:35"),
    ('1 cm', '1 c\u200bm', "19:44"),
    ('{fast:', '{\u200bfast:', "4:9"),
]  # fmt: skip
DASHES = [
    ('0.5 s', '\u22120.5 s', "15:27"),
    ('0 m', '\u22122 m', "11:20"),
    ('0 m', '1e\u22122 m', "11:22"),
    ('0 m', '\u20132 m', "11:20"),
    ('0 m', '\u20142 m', "11:20"),
    ('  - {signal', '  \u2013 {signal', "19:3"),
    ('  - {signal', '  \u2014 {signal', "19:3"),
    ('  - {signal', '  \u2212 {signal', "19:3"),
    ('0 m', '2 m\u22121', "11:23"),
    ('0 m', '2 m^\u22121', "11:24"),
    ('0 m', '2\u20113 m', "11:21"),
    ('1 cm', '\uff0d1 cm', "19:41"),
]  # fmt: skip
LETTERS = [
    ('rate: fast\n    with: {t', 'r\u0430te: fast\n    with: {t', "14:6"),
    ('rate: fast\n    with: {t', 'rate: f\u0430st\n    with: {t', "14:12"),
    ('source.y', 's\u043eurce.y', "16:14"),
    ('source.y', 'source.\u0443', "16:20"),
    ('0.5 s', '0.5 \u0455', "15:31"),
    ('1 cm', '1 \u0441m', "19:43"),
    ('100 Hz', '100 \u041dz', "4:19"),
    ('  source:', '  s\u03bfurce:', "8:4"),
    ('time_constant', 'time_c\u043enstant', "15:18"),
    ('signal.low_pass', 'signal.low_p\u0430ss', "13:24"),
    ('$size', '$s\u0456ze', "11:34"),
    ('params', 'p\u0430rams', "6:2"),
]  # fmt: skip
QUOTES = [
    ('0.5 s', '\u201c0.5 s\u201d', "15:27"),
    ('fast\n    with: {t', '\u201cfast\u201d\n    with: {t', "14:11"),
    ('source.y', '\u2018source.y\u2019', "16:13"),
    ('lag.y', '\u201clag.y\u201d', "19:14"),
    ('1 cm', '\u201e1 cm\u201c', "19:41"),
    ('1 cm', '\xab1 cm\xbb', "19:41"),
    ('block: signal.low_pass', 'block: \u2018signal.low_pass\u2019', "13:12"),
    ('5 s\npar', '\u201c5 s\u201d\npar', "5:12"),
    ('source.y', '\u201csource.y[0]\u201d', "16:13"),
    ('{time_constant', '{\u201ctime_constant\u201d', "15:12"),
]  # fmt: skip
FULL_WIDTH = [
    ('0.5 s', '\uff10.5 s', "15:27"),
    ('0.5 s', '0\uff0e5 s', "15:28"),
    ('rate: fast\n    with: {t', 'rate\uff1a fast\n    with: {t', "14:9"),
    ('rate: fast\n    with: {t', 'rate\uff1afast\n    with: {t', "14:9"),
    ('0 m, after', '0 m\uff0c after', "11:23"),
    ('1 cm', '1 \uff43m', "19:43"),
    ('{u: source.y}', '\uff5bu: source.y\uff5d', "16:9"),
    ('source.y', 'source\uff0ey', "16:19"),
    ('  lag:', '  \uff4cag:', "12:3"),
    ('{u: ', '{\uff55: ', "16:10"),
    ('{u: ', '{u\uff1a ', "16:11"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "place"), [*BLANKS, *HIDDEN, *DASHES, *LETTERS, *QUOTES, *FULL_WIDTH])
def test_a_character_that_looks_like_another_is_named_at_its_place(
    old: str, new: str, place: str, tmp_path: Path
) -> None:
    (fault,) = faults(old, new, tmp_path)
    _, odd = next(odd_characters(new))
    name = "tab" if odd == "\t" else unicodedata.name(odd).lower()
    said = str(fault)
    assert where(fault) == place
    assert f"(U+{ord(odd):04X})" in said and name in said.lower()
    assert ("remove" if not meant(odd) else "write") in fault.remedy
    assert said.isprintable()


@pytest.mark.parametrize("sign", [
                                  "\u00a0", "\u200b",
                                  "\u200d", "\u00ad", "\u2212", "\u2013", "\u2014", "\u201c",
                                  "\u2019", "\u0430", "\u03bf", "\uff10", "\u3000", "\uff1a"])  # fmt: skip
def test_a_text_for_people_may_hold_any_sign(sign: str, tmp_path: Path) -> None:
    text = DIAGRAM.replace("What this is for.", f"What{sign} is {sign} this")
    text = text.replace("expect:", f"summary: {{a{sign}b: lag.y}}\nexpect:")
    text += f"figures:\n  - {{title: 'a {sign} b', signals: lag.y}}\n"
    assert load_text(text, tmp_path).name == "skel"


def test_signs_with_a_meaning_of_their_own_are_no_slips() -> None:
    assert all(
        meant(sign) is None for sign in "a~\u00e4\u00b2\u00b3\u00b5\u03bc\u00b0\u00b7\u00d7\u4e2d\U0001f642"
    )
    assert cleaned("\u2212\uff11\u00a0m\u00b2") == "-1 m\u00b2"
    assert advice("\u2019") == 'write "\'" for the right single quotation mark (U+2019)'


def test_places_in_texts_of_several_lines_and_with_escapes_are_those_of_the_file() -> None:
    text = 'a: "b \\\n\n   c\u200bd"\ne: f\n  \u00a0g\n'
    root = parse_yaml(text, "d.yaml").mapping()
    assert [str(root[key].fault("x").faults[0].place) for key in root] == ["d.yaml:3:5", "d.yaml:5:3"]


COMMAS = [
    ('{time_constant: 0.5 s}', '{time_constant: 0,5 s}', ["15:27: write '0.5 s'"]),
    ('    with: {time_constant: 0.5 s}', '    with:\n      time_constant: 0,5 s', ["16:22: write '0.5 s'"]),
    ('1 cm', '1,5 cm', ["19:41: write '1.5 cm'"]),
    ('0 m,', '-0,5 m,', ["11:20: write '-0.5 m'"]),
    ('at: 1 s', 'at: 1,25 s', ["11:43: write '1.25 s'"]),
    ('stop_time: 5 s', 'stop_time: 5,5 s', ["5:12: write '5.5 s'"]),
    ('100 Hz', '33,3 Hz', ["4:15: write '33.3 Hz'"]),
    ('of: 1 m', 'of: 0,1 m', ["19:51: write '0.1 m'"]),
    ('size: 1 m', 'size: 1,0 m', ["6:16: write '1.0 m'"]),
    ('[1 m, 2 m, 3 m]', "'1,5 m'", ["17:61: write '1.5 m'"]),
    ('1 cm', "'0,5 cm'", ["19:41: write '0.5 cm'"]),
    ('0.5 s', '0,5e-1 s', ["15:27: write '0.5e-1 s'"]),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "said"), COMMAS)
def test_a_decimal_comma_is_refused_with_the_right_number(
    old: str, new: str, said: list[str], tmp_path: Path
) -> None:
    assert [f"{where(fault)}: {fault.remedy}" for fault in faults(old, new, tmp_path)] == said


RUN_ON = [
    ('{u: source.y}', '{u:source.y}', ["16:10: write 'u: source.y'"]),
    ('{time_constant: ', '{time_constant:', ["15:12: write 'time_constant: 0.5 s'"]),
    ('{fast: 100 Hz, ', '{fast:100 Hz, ', ["4:9: write 'fast: 100 Hz'"]),
    ('slow: 10 Hz', 'slow:10 Hz', ["4:23: write 'slow: 10 Hz'"]),
    ('    rate: fast\n    with: {t', '    rate:fast\n    with: {t', ["14:10: write 'rate: fast'"]),
    ('stop_time: 5 s', 'stop_time:5 s', ["5:11: write 'stop_time: 5 s'"]),
    ('within: 1 cm', 'within:1 cm', ["19:33: write 'within: 1 cm'"]),
    ('at: 1 s', 'at:1 s', ["11:39: write 'at: 1 s'"]),
    ('name: skel', 'name:skel', ["2:6: write 'name: skel'"]),
    ('    in: {u: source.y}', '    in:{u: source.y}', ["16:8: write ': {'"]),
    ('{size: 1 m}', '{size:1 m}', ["6:10: write 'size: 1 m'"]),
    ('block: signal.low_pass', 'block:signal.low_pass', ["13:11: write 'block: signal.low_pass'"]),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "said"), RUN_ON)
def test_a_missing_blank_behind_a_colon_is_named(old: str, new: str, said: list[str], tmp_path: Path) -> None:
    assert [f"{where(fault)}: {fault.remedy}" for fault in faults(old, new, tmp_path)] == said


ELEMENTS = [
    ('u: source.y}', 'u: wide.value[0]}', ['16:13: write "wide.value[0]"', "16:13: use 'y'"]),
    ('u: source.y}', 'u: wide.y[0]}', ['16:13: write "wide.y[0]"']),
    ('lag.y, ', 'wide.y[2], ', ['19:14: write "wide.y[2]"']),
    ('u: source.y}', 'u: wide.y[0:1]}', ['16:13: write "wide.y[0:1]"']),
    (
        'u: source.y}', 'u: wide.y[-1]}',
        ['16:13: write "wide.y[-1]"',
         '16:13: write block.port, block.port[0] or part/block.port[0:2]'],
    ),
    ('u: source.y}', 'u: wide.y[ 0 ]}', ['16:13: write "wide.y[ 0 ]"']),
    (
        'u: source.y}', 'u: wide.y[]}',
        ['16:13: write "wide.y[]"',
         '16:13: write block.port, block.port[0] or part/block.port[0:2]'],
    ),
    ('u: source.y}', 'u: {from: wide.y[1], across: sample}}', ['16:20: write "wide.y[1]"']),
    (
        'u: source.y}', 'u: source.z[0], v: 3}',
        ['16:13: write "source.z[0]"',
         "16:13: use 'y'",
         "16:29: use 'u'"],
    ),
    ('[1 m, 2 m, 3 m]', '[$size, $size[0], 3 m]', ['17:69: write "$size[0]"', '17:69: count from 0']),
    ('lag.y, ', 'wide.y[0,1], ', ['19:14: write "wide.y[0,1]"', '19:14: count from 0']),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "said"), ELEMENTS)
def test_an_element_without_quotes_hides_no_other_fault(
    old: str, new: str, said: list[str], tmp_path: Path
) -> None:
    assert [f"{where(fault)}: {fault.remedy}" for fault in faults(old, new, tmp_path)] == said
