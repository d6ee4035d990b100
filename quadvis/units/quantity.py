"""Quantities in text: "50 ms", "1/30 s", "2.5 rad/s", "90 %", and arithmetic: "2 pi rad/s"."""

from __future__ import annotations

import math
import re
from fractions import Fraction
from functools import lru_cache

from quadvis.errors import quoted
from quadvis.errors.rules import ANGLES, ruled
from quadvis.units.grammar import LONGEST, UnitError
from quadvis.units.unit import Unit, advised

DECIBEL = "dB"  # of ratios alone: a logarithm is no unit, since products of it mean nothing
_NUMBER = re.compile(r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_OTHER_BASE = re.compile(r"[+-]?0(?:[xX][0-9a-fA-F]|[oO][0-7]|[bB][01])")  # 0x10, but not 0 ohm
_RATIO = re.compile(r"([+-]?[0-9]+) */ *([0-9]+)(?![0-9.])")
_LONGEST_ARITHMETIC = 1000  # characters
# What only arithmetic has: pi, a function or brackets at its beginning, a sign between numbers behind one.
_ARITHMETIC = re.compile(
    r"[-+(\s]*(?:pi\b|[A-Za-z]\w*\()|[-+\s]*\(|[-+\s]*(?=[0-9.]).*"
    r"(?:\bpi\b|[A-Za-z]\w*\(|[0-9A-Za-z%).]\s*(?:[-+*/^]|\*\*)\s*\(*[-+]?[0-9.]|\)\s*[-+*/^])",
    re.ASCII,
)


def _exact(number: str, text: str) -> Fraction:
    """Return a decimal number or ratio exactly; a number beyond the range of floats is refused."""
    ratio = _RATIO.fullmatch(number)
    if ratio is not None:
        if len(number) > LONGEST or not int(ratio[2]):
            raise UnitError(f"{quoted(text)} is not a number", "write a ratio such as 1/30")
        return Fraction(int(ratio[1]), int(ratio[2]))
    parse_number(number)
    return Fraction(number)


def parse_number(text: str) -> float:
    """Return a decimal number: 2, -0.5, .5, 1e-3; refuse what YAML or Python read as another number."""
    match = _NUMBER.fullmatch(text)
    if match is None or len(text) > LONGEST:
        raise _not_a_number(text)
    digits = text.lstrip("+-")
    if digits[:1] == "0" and digits[1:2].isdigit():
        plain = digits.lstrip("0")
        plain = plain if plain[:1].isdigit() else f"0{plain}"
        raise UnitError(f"{quoted(text)} begins with a zero", f"write '{text[: -len(digits)]}{plain}'")
    value = float(text)
    if math.isinf(value) or (value == 0.0 and digits.lower().partition("e")[0].strip("0.")):
        raise UnitError(f"{quoted(text)} is outside the range of numbers", "stay between 1e-300 and 1e300")
    return value


def _not_a_number(text: str) -> UnitError:
    remedy = "write it as in 0.5, -2 or 1e-3"
    plain = text.lower().lstrip("+-.")
    if plain in ("nan", "inf", "infinity"):
        return UnitError(f"{quoted(text)} is not a finite number", remedy)
    for wrong, right in (("_", ""), (",", ".")):
        better = text.replace(wrong, right)
        if wrong in text and _NUMBER.fullmatch(better) and len(better) < LONGEST:
            remedy = f"write '{better}'"
    return UnitError(f"{quoted(text)} is not a number", remedy)


@lru_cache(maxsize=4096)
def split_quantity(text: str) -> tuple[str, str]:
    """Return the number and the unit of "50 ms", "50ms", "1/30 s" or "5/s", as texts; either may be empty.

    Arithmetic has those of its value: "2 * 5 mm" gives 1/100 and m.
    """
    plain = plain_text(text).strip()
    match = _RATIO.match(plain) or _NUMBER.match(plain)
    if match is None:
        return "", plain
    unit = plain[match.end() :].strip()
    return match.group(), f"1{unit}" if unit[:1] == "/" else unit


@lru_cache(maxsize=4096)
def plain_text(text: str) -> str:
    """Return a quantity without arithmetic: "pi/2 rad" is "1.5707963267948966 rad"; others as they are."""
    if not _is_arithmetic(text):
        return text
    from quadvis.units.arithmetic import arithmetic  # most commands need none

    try:
        return arithmetic(text).text
    except UnitError:
        return text


def arithmetic_fault(text: str) -> UnitError | None:
    """Return what is wrong with a text that is surely meant as arithmetic, if anything."""
    if not _is_arithmetic(text):
        return None
    from quadvis.units.arithmetic import arithmetic

    try:
        arithmetic(text)
    except UnitError as error:
        return error
    return None


def _is_arithmetic(text: str) -> bool:
    """Say whether a text is meant as arithmetic, and is no plain quantity."""
    if len(text) > _LONGEST_ARITHMETIC or _ARITHMETIC.match(text) is None:
        return False
    plain = text.strip()
    match = _RATIO.match(plain) or _NUMBER.match(plain)
    if match is None:
        return True
    unit = plain[match.end() :].strip()
    try:
        Unit.parse(f"1{unit}" if unit[:1] == "/" else unit or "1")
    except UnitError:
        return True
    return False


def parse_quantity(text: str) -> tuple[float, Unit]:
    """Return the SI value and the unit as written: "50 ms" gives 0.05 and ms, a bare number has unit 1."""
    number, unit = _parts(text)
    return _to_si(number, unit, text), unit


def parse_rational(text: str, unit: Unit | None = None) -> Fraction:
    """Return the exact SI value of "33.3 ms", "10 Hz" or "1/30 s".

    With `unit`, the text must have its dimension, and a number other than 0 must have a unit. Units with an
    irrational scale (deg) are refused.
    """
    number, written = _parts(text, unit)
    ratio, rest = written.exact_scale
    if rest != 1.0:
        raise UnitError(f"{quoted(text)} has no exact value", "write it in an SI unit")
    if unit is not None:
        require_unit(text, unit)
        if number or split_quantity(text)[1]:
            _require_dimension(text, written, unit)
    return number * ratio


def parse_period(text: str) -> Fraction:
    """Return the exact period in seconds of a rate ("10 Hz") or a period ("50 ms"); it is above zero."""
    second, hertz = Unit.parse("s"), Unit.parse("Hz")
    _, unit = _parts(text, second, hertz)
    rate = unit.dimension_equals(hertz)
    value = parse_rational(text, hertz if rate or not split_quantity(text)[1] else second)
    if value <= 0:
        raise UnitError(f"{quoted(text)} is no rate", "write one above zero, such as '20 Hz' or '50 ms'")
    return 1 / value if rate else value


def read_quantity(text: str, unit: Unit, *, bare: bool = True) -> float:
    """Return a quantity as a number of `unit`; a bare number counts as such, unless `bare` is false."""
    if bare and _NUMBER.fullmatch(text):
        return parse_number(text)
    number, written = _parts(text, None if unit.variables else unit)
    if not split_quantity(text)[1]:
        require_unit(text, unit)
        return float(number)
    if unit.variables:
        return _to_si(number, written, text)
    _require_dimension(text, written, unit)
    return _to_si(number, _quotient(written, unit), text)


def read_ratio(text: str) -> float:
    """Return a ratio of amplitudes: "2", "200 %", or its logarithm, "6 dB"."""
    number, unit = split_quantity(text)
    if unit != DECIBEL or not number:
        return read_quantity(text, Unit())
    try:
        return float(10.0 ** float(_exact(number, text) / 20))
    except OverflowError:
        raise UnitError(f"{quoted(text)} is outside the range of numbers") from None


def format_ratio(value: float, unit: str = "") -> str:
    """Return a ratio as text: "x 1.995", or "6 dB" if this is the unit."""
    if unit != DECIBEL:
        return f"x {value:.4g}"
    return f"{20.0 * math.log10(value):.4g} dB" if value else "-inf dB"


@lru_cache(maxsize=1024)
def _quotient(written: Unit, unit: Unit) -> Unit:
    """Return the quotient of two units, cached: a diagram has few pairs of units and many quantities."""
    return written / unit


def require_unit(text: str, unit: Unit) -> None:
    """Refuse a bare number, 0 excepted, if `unit` has a dimension: "did you mean '50 ms'?"."""
    number, written = split_quantity(text)
    if written or not number or not unit.dimension:
        return
    value = float(_exact(number, text))
    if value:
        likely = _likely(abs(value), unit)
        raise UnitError(f"{quoted(text)} has no unit", f"did you mean {quoted(f'{number} {likely}')}?")


def format_quantity(value: float, unit: Unit, digits: int = 4) -> str:
    """Return an SI value as text: (0.05, s) gives "50 ms", (0.032, m) "3.2 cm", (0.5236, deg) "30 deg"."""
    rounded = float(f"{value:.{digits}g}")
    if unit.scale == 1.0 and rounded and math.isfinite(rounded):
        for name in reversed(_ladder(str(unit))):
            step = Unit.parse(name)
            if abs(rounded) >= step.scale * (1 - 1e-12):
                unit = step
                break
    number = f"{value / unit.scale:.{digits}g}"
    return number if not unit.symbols else f"{number} {unit}"


# Usual units of each dimension, smallest first.
_LADDERS = ("us ms s", "um mm cm m km", "Hz kHz MHz", "mV V kV", "mA A", "mN N kN", "mW W kW", "Pa kPa")


@lru_cache(maxsize=64)
def _ladder(unit: str) -> tuple[str, ...]:
    """Return the usual units of its kind, small to large (mm, cm, m, km); () if it has none."""
    for names in map(str.split, _LADDERS):
        if unit in names:
            return tuple(names)
    return ()


def _likely(value: float, unit: Unit) -> str:
    """Guess the missing unit from the size of the number."""
    small = {"s": ("ms", 10.0), "m": ("mm", 20.0), "rad": ("deg", 6.3)}.get(str(unit))
    return small[0] if small and value >= small[1] else str(unit)


@lru_cache(maxsize=4096)
def _parts(text: str, *wanted: Unit | None) -> tuple[Fraction, Unit]:
    """Return the number and the unit of a text; advice on a wrong text depends on the wanted units."""
    wrong = arithmetic_fault(text)
    if wrong is not None:
        raise wrong
    number, unit = split_quantity(text)
    if not number:
        raise UnitError(f"{quoted(text)} does not begin with a number", "write it as in '50 ms'")
    if _OTHER_BASE.match(text.strip()) or unit[:1] in tuple("_,.:"):
        raise _not_a_number(text)
    known = [each for each in wanted if each is not None]
    written = Unit.parse(unit or "1", *known)
    if written.variables:
        raise advised(
            UnitError(f"{quoted(unit)} is not a unit", "use m, s, rad, kg, N, V, Hz, px ..."), unit, known
        )
    return _exact(number, text), written


def _require_dimension(text: str, written: Unit, unit: Unit) -> None:
    if written.dimension_equals(unit):
        return
    if str(written) == "g" and unit == Unit.parse("m/s^2"):
        raise UnitError(f"{quoted(text)} is in grams, not in {unit}", "write gravity as 9.80665 m/s^2")
    if not unit.dimension:
        raise UnitError(f"{quoted(text)} has a unit where none belongs", "write a number without unit")
    usual = [name for name in _ladder(str(unit)) if Unit.parse(name).scale >= 1e-3]
    remedy = f"write it in {' or '.join(usual or [str(unit)])}"
    if (written / unit).is_angle:
        number, _ = split_quantity(text)
        turns = f"write it as '{number} / (2 * pi) Hz'" if str(unit) == "Hz" else ""
        remedy = turns or ruled(remedy, ANGLES)
    raise UnitError(f"{quoted(text)} is in {written}, not in {unit}", remedy)


def _to_si(number: Fraction, unit: Unit, text: str) -> float:
    """Return the SI value as the nearest float, rounded only once if the scale is rational."""
    ratio, rest = unit.exact_scale
    try:
        value = float(number * ratio) * rest
    except OverflowError:
        value = math.inf
    if math.isinf(value):
        raise UnitError(f"{quoted(text)} is outside the range of numbers")
    return value
