"""Explain in our own words the fault at which a YAML parser stopped, and repair it to read on.

Parsers differ in their words and change them, so only places are taken from them. `Scan` examines the text at
such a place. If the intention is clear, a repair of the same length lets the rest be read: the fault is kept,
no place moves, and the other faults of the file are reported in the same run.

The file is long because it holds one look for each way in which a text is no YAML, in the order of `explain`.
"""

from __future__ import annotations

import re
from typing import NamedTuple

from quadvis.document.scan import Scan
from quadvis.errors import counted
from quadvis.errors.characters import meant, odd_characters, replacement, with_article
from quadvis.units import Unit, UnitError

# The index of a signal, whose bracket ends a text inside {...} and [...].
_INDEX = re.compile(r"\[[^\[\]{}'\"\r\n]*+\]")
_NAME_END = re.compile(r"[^\s{}\[\],:'\"]")
# Characters that may precede the first word of a line in place of plain spaces.
_LEAD = re.compile("[ \t\u00a0\u00ad\u1680\u2000-\u200d\u202f\u205f\u2060\u3000]*")
_PATH = re.compile(r"[\w.~ -]+(?:\\[\w.~ -]+)+")
_NO_BLANK = re.compile(r"[ ]*(?:- +)*(?P<key>[A-Za-z_]\w*):(?P<value>[^\s:/\\].*)", re.ASCII)
_ESCAPE = re.compile(
    r"""\\(?:[0abt\tnvfre "/\\N_LP\r\n]|x[0-9a-fA-F]{2}|u[0-9a-fA-F]{4}|U[0-9a-fA-F]{8}|(?P<bad>))"""
)
_CLOSING = {"[": "]", "{": "}"}
_NAMES = {"[": "list", "{": "map"}
# One of these replaces a sign that the parser must not see; the composer puts the sign back.
STAND_INS = {":": "\ue001", "[": "\ue002", "]": "\ue003", ",": "\ue004", "@": "\ue005", "`": "\ue006",
             "%": "\ue007", "*": "\ue008", "&": "\ue009", "!": "\ue00a", "\\": "\ue00b"}  # fmt: skip
ORIGINALS = str.maketrans({stand_in: sign for sign, stand_in in STAND_INS.items()})


class Trouble(NamedTuple):
    """A fault at an offset of the text; ``repaired`` is the text for reading on, None if no repair exists."""

    at: int
    problem: str
    remedy: str = ""
    repaired: str | None = None
    blank: int | None = None  # the offset of a blank that the repair inserted; it moves the rest of its line


def explain(text: str, at: int, opened: int | None, limit: int) -> Trouble:
    """Return the fault of a text that was refused at an offset, in a part that was opened before it."""
    scan = Scan(text, at, limit)
    for look in (
        _depth,
        _tab,
        _odd,
        _quotes,
        _unit,
        _brackets,
        _start,
        _block_text,
        _no_blank,
        _no_colon,
        _behind,
        _signs,
    ):
        found = look(scan, at, opened)
        if found is not None:
            return found
    return _indentation(scan, at, opened)


def run_on(text: str, at: int) -> Trouble:
    """Return the fault of a key that goes on after its ':', because no blank follows the ':'."""
    char = text[at]
    if char in "[{":
        remedy = f"write ': {char}'"
        return Trouble(at, "a blank is missing behind ':'", remedy, f"{text[:at]} {text[at:]}", at)
    repaired = f"{text[:at]} {text[at + 1 :]}"
    return Trouble(at, f"this is {with_article(char)}", replacement(char), repaired)


def _replaced(text: str, start: int, end: int) -> str:
    """Return the text with all signs from ``start`` to ``end`` hidden from the parser."""
    hidden = "".join(STAND_INS.get(char, char) for char in text[start:end])
    return text[:start] + hidden + text[end:]


def _depth(scan: Scan, at: int, opened: int | None) -> Trouble | None:
    if scan.deep is None or scan.deep > at:
        return None
    return Trouble(scan.deep, f"this is nested deeper than {scan.limit} levels", "write it flatter")


def _tab(scan: Scan, at: int, opened: int | None) -> Trouble | None:
    start, line = scan.starts[scan.line(at)], scan.line_text(scan.line(at))
    lead = line[: len(line) - len(line.lstrip(" \t"))]
    if "\t" in lead:
        return Trouble(start + lead.index("\t"), "a tab cannot indent a line", "use spaces")
    if scan.text[at : at + 1] == "\t":
        repaired = f"{scan.text[:at]} {scan.text[at + 1 :]}"
        return Trouble(at, "a tab stands between the words", "use a space", repaired)
    return None


def _odd(scan: Scan, at: int, opened: int | None) -> Trouble | None:
    """Look for a character that looks like a sign of YAML, in this line or in the line above it."""
    text, line = scan.text, scan.line(at)
    above = line - 1
    while above > 0 and not scan.line_text(above).strip(" \t"):
        above -= 1
    first = scan.starts[max(above, 0)]
    end = scan.starts[line] + len(scan.line_text(line))
    leads = {number: _lead_end(scan, number) for number in (line, above)}
    whole = {line} if re.search(r":\s|:$", scan.line_text(max(above, 0))) else {line, above}
    found = [
        (where, char) for where, char in odd_characters(text, first, end)
        if char != "\t" and not scan.is_hidden(where)
        and (scan.line(where) in whole or where < leads.get(scan.line(where), 0))
    ]  # fmt: skip
    if not found:
        return None
    where, char = next(((w, c) for w, c in reversed(found) if w <= at), found[0])
    if where < leads[scan.line(where)]:
        where, char = next((w, c) for w, c in found if scan.line(w) == scan.line(where))
        repaired, more = _indent_repaired(scan)
        lines = f"; so in {counted(more, 'more line')}" if more else ""
        problem = f"{with_article(char)} cannot indent a line"
        return Trouble(where, problem, replacement(char) + lines, repaired)
    plain = meant(char)
    repaired = text[:where] + plain + text[where + 1 :] if plain in (" ", "-", ":", ",") else None
    blank = None
    if plain == ":" and text[where + 1 : where + 2].strip():
        repaired, blank = f"{text[:where]}: {text[where + 1 :]}", where + 1
    return Trouble(where, f"this is {with_article(char)}", replacement(char), repaired, blank)


def _lead_end(scan: Scan, number: int) -> int:
    match = _LEAD.match(scan.text, scan.starts[max(number, 0)])
    return match.end() if match is not None else 0


def _indent_repaired(scan: Scan) -> tuple[str | None, int]:
    """Return the text with plain spaces in all indentations, and the number of further repaired lines."""
    pieces, last, lines = [], 0, 0
    for number, start in enumerate(scan.starts):
        end = _lead_end(scan, number)
        lead = scan.text[start:end]
        if not lead.isascii() and not scan.is_hidden(start):
            if not all(char == " " or meant(char) == " " for char in lead):
                return None, 0
            pieces += [scan.text[last:start], " " * len(lead)]
            last, lines = end, lines + 1
    return "".join([*pieces, scan.text[last:]]), lines - 1


def _quotes(scan: Scan, at: int, opened: int | None) -> Trouble | None:
    text = scan.text
    last = len(text[:at].rstrip(" \t"))
    for start, end in scan.quotes:
        if start < at <= end and text[start] == '"':
            bad = [
                match.start()
                for match in _ESCAPE.finditer(text, start + 1, end - 1)
                if match["bad"] is not None
            ]
            if bad:
                return _bad_escape(text, start, end, bad)
        if start < at < end:
            return Trouble(
                start, f"the quotes opened in line {scan.line(start) + 1} are never closed", "close them"
            )
        if end == last and scan.line(start) != scan.line(end):
            problem = f"the quotes opened here are closed only in line {scan.line(end) + 1}"
            return Trouble(start, problem, "close them where the text ends")
    if scan.open_quote is not None and at > scan.open_quote:
        start = scan.open_quote
        bad = [match.start() for match in _ESCAPE.finditer(text, start + 1) if match["bad"] is not None]
        if text[start] == '"' and bad and at <= bad[0] + 2:
            return _bad_escape(text, start, len(text), bad[:1])
        return Trouble(
            start, f"the quotes opened in line {scan.line(start) + 1} are never closed", "close them"
        )
    return None


def _bad_escape(text: str, start: int, end: int, bad: list[int]) -> Trouble:
    inner = text[start + 1 : end - 1]
    signs = list(text)
    if _PATH.fullmatch(inner):
        remedy = f"write '/' between folders: '{inner.replace(chr(92), '/')}'"
        for where in range(start, end):
            signs[where] = "/" if signs[where] == "\\" else signs[where]
    else:
        remedy = "write '\\\\', or use single quotes"
        for where in bad:
            signs[where] = STAND_INS["\\"]
    problem = "the text in double quotes holds an unknown escape after '\\'"
    return Trouble(bad[0], problem, remedy, "".join(signs))


def _brackets(scan: Scan, at: int, opened: int | None) -> Trouble | None:
    """Look at a bracket around the place, for a text where a ',' or the closing bracket should be."""
    if not scan.open:
        return None
    text, start = scan.text, scan.open[-1]
    line = scan.line(at)
    if text[at : at + 1] == "[":
        index, first = _INDEX.match(text, at), at
        while first > scan.starts[line] and _NAME_END.match(text, first - 1):
            first -= 1
        if index is not None and first < at:
            repaired = _replaced(text, at, index.end())
            return Trouble(
                first, "a text with '[' needs quotes here", f'write "{text[first : index.end()]}"', repaired
            )
    begun = text[_word_start(text, at)]
    if begun in "@`%*&!" or any(end == at for _, end in scan.quotes):
        return None
    name, closing = _NAMES[text[start]], _CLOSING[text[start]]
    if text[at : at + 1] == ":":
        remedy = (
            f"put a ',' before the key, a '{closing}' behind the {name}, or a text that holds ': ' in quotes"
        )
        return Trouble(at, "a ':' stands where none can", remedy)
    place = start if not text[at:].strip() else at
    if text[at : at + 1] in ("-", "?") and not text[at + 1 : at + 2].strip():
        return Trouble(at, f"a '{text[at]} ' stands inside a {name} in brackets", "leave it out")
    return Trouble(
        place,
        f"the {name} opened in line {scan.line(start) + 1} lacks a ',' or its '{closing}' here",
        "add it",
    )


def _word_start(text: str, at: int) -> int:
    """Return the offset of the beginning of the text at an offset."""
    at = min(at, len(text) - 1)
    if at > 0 and text[at].isspace() and not text[at - 1].isspace():
        at -= 1
    while at > 0 and text[at - 1] not in " \t\r\n[{,":
        at -= 1
    return at


def _start(scan: Scan, at: int, opened: int | None) -> Trouble | None:
    """Look for a sign with which no text can begin."""
    text = scan.text
    for where in (at, opened if opened is not None else at, _word_start(text, at) if text else 0):
        sign = text[where : where + 1]
        if sign in ("@", "`", "%"):
            repaired = _replaced(text, where, where + 1)
            return Trouble(
                where, "a text cannot begin with this character", "put the text in quotes", repaired
            )
        if sign in ("*", "&") and where in (at, at - 1, opened):
            repaired = _replaced(text, where, where + 1)
            return Trouble(at, "a text cannot begin with '*' or '&'", "put the text in quotes", repaired)
        if sign == "!":
            repaired = _replaced(text, where, where + 1)
            remedy = "put a text that begins with '!' in quotes"
            return Trouble(where, "a tag ('!') is not allowed", remedy, repaired)
    return None


def _block_text(scan: Scan, at: int, opened: int | None) -> Trouble | None:
    if opened is None or scan.text[opened : opened + 1] not in ("|", ">"):
        return None
    if scan.line(at) == scan.line(opened):
        return Trouble(at, "this does not belong behind '|' or '>'", "begin the text on the next line")
    return Trouble(at, "the text behind '|' or '>' is indented in two ways", "indent its lines alike")


def _no_blank(scan: Scan, at: int, opened: int | None) -> Trouble | None:
    """Look for ``key:value``, in this line, in the line where the part began, or in the line above."""
    lines = {scan.line(at), scan.line(at) - 1, scan.line(opened) if opened is not None else scan.line(at)}
    for number in sorted(line for line in lines if line >= 0):
        match = _NO_BLANK.fullmatch(scan.line_text(number))
        where = scan.starts[number] + (match.start("value") if match else 0)
        if match is not None and not scan.is_hidden(where) and ": " not in match["value"]:
            problem = f"a blank is missing behind '{match['key']}:'"
            remedy = f"write '{match['key']}: {match['value'].strip()[:40]}'"
            return Trouble(where, problem, remedy, f"{scan.text[:where]} {scan.text[where:]}", where)
    return None


def _no_colon(scan: Scan, at: int, opened: int | None) -> Trouble | None:
    text = scan.text
    if (
        opened is not None
        and scan.line(opened) < scan.line(at)
        and text[opened : opened + 1] not in "'\"[{|>-?"
    ):
        stretch = text[opened:at]
        if not re.search(r":\s", f"{stretch} ") and stretch.strip():
            return Trouble(opened, "a key has no ':' after it", "write 'key: value'")
    line = scan.line(at)
    if text[at : at + 1] != ":" or line == 0 or ": " in scan.line_text(line)[: at - scan.starts[line]]:
        return None
    above = scan.line_text(line - 1)
    here = scan.line_text(line)
    if above.strip() and not re.search(r":(\s|$)", above) and _indent(above) == _indent(here):
        where = scan.starts[line - 1] + _indent(above)
        if not scan.is_hidden(where) and text[where] != "-":
            return Trouble(where, "a key has no ':' after it", "write 'key: value'")
    return None


def _indent(line: str) -> int:
    return len(line) - len(line.lstrip(" "))


def _unit(scan: Scan, at: int, opened: int | None) -> Trouble | None:
    """Look for a unit after a list: each number needs its own."""
    text = scan.text
    last = len(text[:at].rstrip(" \t"))
    start = next((start for start, end in scan.brackets if end == last and text[start] == "["), None)
    unit = re.match(r"[^\s,\]}#]*(?: *[*/] *[^\s,\]}#]+)*", text[at : at + 100])
    if start is None or unit is None or not _is_unit(unit.group()):
        return None
    shown = text[start:last] if last - start <= 40 else f"{text[start : start + 20]}...]"
    remedy = f"write {{value: {shown}, unit: {unit.group()}}}"
    return Trouble(at, f"the unit '{unit.group()}' stands behind a list", remedy)


def _behind(scan: Scan, at: int, opened: int | None) -> Trouble | None:
    """Look for a text after a complete list, map or text in quotes."""
    text = scan.text
    last = len(text[:at].rstrip(" \t"))
    for kind, spans in (("", scan.brackets), ("text in quotes", scan.quotes)):
        for start, end in spans:
            if end != last or at >= len(text):
                continue
            if text[at] == ":" or text[at] in "]}":
                continue
            name = kind or _NAMES[text[start]]
            return Trouble(
                at, f"this does not belong to the {name} before it", "put the whole text in quotes"
            )
    return None


def _is_unit(text: str) -> bool:
    try:
        return bool(text) and bool(Unit.parse(text).symbols)
    except UnitError:
        return False


def _signs(scan: Scan, at: int, opened: int | None) -> Trouble | None:
    """Look for a sign in an impossible place."""
    text = scan.text
    sign, line = text[at : at + 1], scan.line(at)
    before = text[scan.starts[line] : at]
    if sign == ":":
        if not before.strip(" -"):
            return Trouble(at, "a key is missing before ':'", "write 'key: value'")
        remedy = "put a text that holds ': ' in quotes, or check the indentation"
        has_key = re.search(r":\s+\S", before) is not None
        return Trouble(
            at, "a ':' stands where none can", remedy, _replaced(text, at, at + 1) if has_key else None
        )
    if sign in ("]", "}"):
        return Trouble(at, f"this '{sign}' closes nothing", "remove it, or put the text in quotes")
    if sign in ("-", "?") and not text[at + 1 : at + 2].strip() and before.strip(" -"):
        if sign == "-":
            return Trouble(at, "a '- ' stands where no list can begin", "begin the list on its own line")
        return Trouble(at, "a '? ' stands where none can", "put the text in quotes")
    if sign in (",", "|", ">"):
        return Trouble(at, f"a text cannot begin with '{sign}'", "put the text in quotes")
    return None


def _indentation(scan: Scan, at: int, opened: int | None) -> Trouble:
    text, line = scan.text, scan.line(at)
    in_front = not text[scan.starts[line] : at].strip()
    if opened is not None and scan.line(opened) < line and in_front:
        is_list = text[opened : opened + 1] == "-" and not text[opened + 1 : opened + 2].strip()
        what, extra = ("list", "begin it with '- ', or ") if is_list else ("map", "")
        remedy = f"{extra}check the indentation" + ("" if is_list else ", and that quotes are closed")
        return Trouble(
            at, f"this does not belong to the {what} that began in line {scan.line(opened) + 1}", remedy
        )
    if in_front and line:
        return Trouble(at, "this does not belong to the document", "check the indentation")
    return Trouble(
        at, "this cannot be read", "check quotes, brackets and indentation here and in the line above"
    )
