"""Characters that look like others: a no-break space for a space, a Cyrillic letter for a Latin one.

Names, numbers, units and the signs of YAML are ASCII. A `doc` or a title may contain any character, so a text
is searched for odd characters only after it was found to be wrong.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterator

# Characters that people type, or that word processors insert, by the ASCII that was meant.
_MEANT = {
    "-": "\u2010\u2011\u2012\u2013\u2014\u2015\u2212\u207b\u2043\u02d7\ufe58\ufe63",
    "'": "\u2018\u2019\u201a\u201b\u2032\u2039\u203a\u02b9\u02bc\u0060\u00b4",
    '"': "\u201c\u201d\u201e\u201f\u2033\u00ab\u00bb\u300c\u300d",
    "/": "\u2044\u2215\u29f8",
    "\\": "\u2216\u29f5",
    ":": "\u2236\ua789\u02d0",
    ",": "\u060c\u3001\u066b\u201a",
    ".": "\u3002\u06d4\u2024",
    "*": "\u2217\u22c6\u066d",
    "#": "\u266f",
    "$": "\ufe69",
    # Cyrillic, Greek, Armenian and Latin letters that look like ASCII letters.
    "a": "\u0430\u03b1\u0251", "b": "\u044c", "c": "\u0441\u03f2", "d": "\u0501", "e": "\u0435\u0454",
    "g": "\u0261", "h": "\u04bb\u0570", "i": "\u0456\u03b9\u0131", "j": "\u0458\u03f3", "k": "\u043a\u03ba",
    "l": "\u04cf", "m": "\u043c", "n": "\u0578\u03b7", "o": "\u043e\u03bf\u0585", "p": "\u0440\u03c1",
    "q": "\u051b\u0566", "r": "\u0433", "s": "\u0455", "t": "\u0442\u03c4", "u": "\u03c5\u057d",
    "v": "\u03bd\u0475", "w": "\u051d\u0461\u03c9", "x": "\u0445\u03c7", "y": "\u0443\u03b3\u04af",
    "z": "\u0437",
    "A": "\u0410\u0391", "B": "\u0412\u0392", "C": "\u0421\u03f9", "E": "\u0415\u0395", "F": "\u03dc",
    "G": "\u050c", "H": "\u041d\u0397", "I": "\u0406\u0399\u04c0", "J": "\u0408", "K": "\u041a\u039a",
    "M": "\u041c\u039c", "N": "\u039d", "O": "\u041e\u039f", "P": "\u0420\u03a1", "Q": "\u051a",
    "S": "\u0405", "T": "\u0422\u03a4", "V": "\u0474", "W": "\u051c", "X": "\u0425\u03a7",
    "Y": "\u04ae\u03a5", "Z": "\u0396",
}  # fmt: skip
_ASCII = {odd: plain for plain, odds in _MEANT.items() for odd in odds if odd != "`"}
# Signs with a meaning of their own in a unit: m², µs, °C.
_WELCOME = frozenset("·⋅\u00d7²³µμ°Ω")
NAMELESS = "character without a name"
_CANDIDATE = re.compile(r"[^\x00-\x08\x0a-\x7f]")  # a tab is a candidate, too


def meant(character: str) -> str | None:
    """Return the ASCII text that a character looks like ("" if it is invisible), or None."""
    if character in _ASCII:
        return _ASCII[character]
    if character == "\t" or unicodedata.category(character) == "Zs":
        return " "
    if unicodedata.category(character) == "Cf" or character == "\u115f":
        return ""
    if character in _WELCOME or character.isascii():
        return None
    plain = unicodedata.normalize("NFKC", character)
    return plain if plain.isascii() and plain != character else None


def odd_characters(text: str, start: int = 0, end: int | None = None) -> Iterator[tuple[int, str]]:
    """Yield the offset of each character of a text that looks like ASCII, and the character."""
    if _is_plain(text):
        return
    for match in _CANDIDATE.finditer(text, start, len(text) if end is None else end):
        if meant(match.group()) is not None:
            yield match.start(), match.group()


def _is_plain(text: str) -> bool:
    return text.isascii() and "\t" not in text


def cleaned(text: str) -> str:
    """Return a text with every odd character replaced by the ASCII that was meant."""
    if text.isascii():
        return text
    return "".join(char if (plain := meant(char)) is None else plain for char in text).strip()


def first_odd(text: str) -> str | None:
    """Return the first odd character of a text, or None."""
    if _is_plain(text):
        return None
    return next((char for _, char in odd_characters(text)), None)


def character_name(character: str) -> str:
    """Return "no-break space (U+00A0)"."""
    name = "tab" if character == "\t" else unicodedata.name(character, NAMELESS).lower()
    name = re.sub(r"\b(latin|greek|cyrillic|armenian|arabic|georgian)\b", lambda word: word[0].title(), name)
    return f"{name} (U+{ord(character):04X})"


def with_article(character: str) -> str:
    """Return "a no-break space (U+00A0)"."""
    name = character_name(character)
    return f"{'an' if name[0] in 'aeiou' else 'a'} {name}"


def replacement(character: str) -> str:
    """Return the remedy if the problem already names the character: "write a space"."""
    plain = meant(character)
    if not plain:
        return "remove it, it does not show"
    return f"write {_shown(plain)}"


def advice(character: str) -> str:
    """Return the remedy: "write a space for the no-break space (U+00A0)"."""
    plain, name = meant(character), character_name(character)
    if not plain:
        return f"remove the {name}, which does not show"
    return f"write {_shown(plain)} for the {name}"


def _shown(plain: str) -> str:
    return "a space" if plain == " " else f"'{plain}'" if plain != "'" else '"\'"'
