"""Units and quantities against the definitions of the SI, and against the laws of arithmetic."""

from __future__ import annotations

import math
import re
from decimal import Decimal
from fractions import Fraction

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from quadvis.errors import QuadvisError
from quadvis.units import (
    Unit,
    UnitError,
    format_quantity,
    format_ratio,
    parse_number,
    parse_period,
    parse_quantity,
    parse_rational,
    parse_units,
    read_quantity,
    read_ratio,
    require_unit,
    split_quantity,
    unify,
)

# SI brochure (9th edition), tables 2, 4, 7 and 8; rev and rpm by their meaning.
IN_SI = {
    "km": 1e3, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "ms": 1e-3, "us": 1e-6, "min": 60.0, "h": 3600.0,
    "deg": math.pi / 180, "rev": 2 * math.pi, "rpm": 2 * math.pi / 60, "kHz": 1e3, "mV": 1e-3, "%": 0.01,
    "km/h": 1 / 3.6, "deg/s": math.pi / 180, "mm^2": 1e-6, "1/ms": 1e3, "kW/cm^3": 1e9, "hPa": 100.0,
    "g": 1e-3, "mg": 1e-6, "l": 1e-3, "ml": 1e-6, "bar": 1e5, "mbar": 100.0, "kPa": 1e3, "ppm": 1e-6,
    "mA*h": 3.6,
    "W*h": 3600.0, "uF": 1e-6, "mH": 1e-3, "kohm": 1e3, "MW": 1e6, "l/min": 1e-3 / 60,
    # Exact by the agreement of 1959, and the nautical mile of 1929.
    "in": 0.0254, "ft": 0.3048, "mi": 1609.344, "nmi": 1852.0, "mph": 0.44704, "kn": 1852 / 3600,
    "lb": 0.45359237, "oz": 0.45359237 / 16,
}  # fmt: skip
SAME = [
    ("Hz", "1/s"), ("N", "kg*m/s^2"), ("J", "N*m"), ("W", "J/s"), ("W", "V*A"), ("Pa", "N/m^2"),
    ("ohm", "V/A"),
    ("T", "V*s/m^2"), ("m/s^2", "m/s/s"), ("m*s^-2", "m/s^2"), ("W/(m*K)", "W/m/K"), ("min", "1/(1/min)"),
    ("Hz^0.5", "1/s^(1/2)"), ("1", "m/m"), ("m·s", "m*s"), ("m²", "m^2"), ("°/s", "deg/s"), ("µs", "us"),
    ("C", "A*s"), ("F", "C/V"), ("H", "V*s/A"), ("H", "ohm*s"), ("F", "s/ohm"), ("Wb", "V*s"), ("Ω", "ohm"),
    ("kΩ", "kohm"), ("m·s⁻²", "m/s^2"), ("l", "dm^3"), ("g", "mg*km/m"),
    ("m / s", "m/s"), ("rev/min", "rpm"), ("mm*km", "m^2"),
]  # fmt: skip
NAMES = "m kg s rad px A K N J W V Hz ms min deg rpm % km mV ohm a b c"

exponents = st.fractions(-2, 2, max_denominator=4)
units = st.lists(st.tuples(st.sampled_from(NAMES.split()), exponents), max_size=3).map(
    lambda powers: math.prod((Unit.parse(name) ** power for name, power in powers), start=Unit())
)
fixed_units = units.filter(lambda unit: not unit.variables)


@pytest.mark.parametrize(("text", "scale"), IN_SI.items())
def test_scales_are_those_of_the_si(text, scale):
    assert Unit.parse(text).scale == pytest.approx(scale, rel=1e-15)


@pytest.mark.parametrize(("one", "other"), SAME)
def test_equal_units_are_equal_however_written(one, other):
    assert Unit.parse(one) == Unit.parse(other)
    assert hash(Unit.parse(one)) == hash(Unit.parse(other))


@pytest.mark.parametrize(
    ("one", "other"),
    [("Hz", "rad/s"), ("m", "mm"), ("1", "%"), ("rad", "1"), ("px", "1"), ("a", "b"), ("J", "W")],
)
def test_different_units_differ(one, other):
    assert Unit.parse(one) != Unit.parse(other)


def test_dimensions_compare_without_the_scale():
    assert Unit.parse("km/h").dimension_equals(Unit.parse("mm/s"))
    assert Unit.parse("%").dimension_equals(Unit.parse("1"))
    assert not Unit.parse("rad").dimension_equals(Unit.parse("1"))


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("kg*m^2/s^3", "kg*m^2/s^3"), ("W/(m*K)", "W/m/K"), ("s^-1", "1/s"), ("m·m", "m^2"), ("m/m", "1"),
        ("Hz^0.5", "Hz^(1/2)"), ("°/s²", "deg/s^2"), ("1", "1"), ("a / s", "a/s"), ("%", "%"),
    ],
)  # fmt: skip
def test_units_are_shown_as_they_were_written(text, shown):
    assert str(Unit.parse(text)) == shown


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("s*N/kg/m", "1/s"), ("V*s^2*N/rad/kg/m", "V/rad"), ("N*m*rad/kg/m^2", "rad/s^2"),
        ("N*m/kg/m^2", "1/s^2"),
        ("kg*m/s^2", "N"), ("A*V*s/kg/m^2", "1/s^2"), ("N*m*s/rad*A/N/m", "A*s/rad"), ("kg*m^2/s^3/A", "V"),
        ("V*N/m/N*m", "V"), ("m*kg/s^2*s/m", "kg/s"), ("s*m", "m*s"), ("V/A", "ohm"), ("J/s", "W"),
        ("s*a", "a*s"), ("m/s*s", "m"),
        # These are as short as they get, and stay.
        ("N*m", "N*m"), ("N*s/m", "N*s/m"), ("kg*m^2", "kg*m^2"),
        ("rad/kg/m^2", "rad/kg/m^2"),
        ("N*m*s/rad", "N*m*s/rad"), ("m/s^2", "m/s^2"), ("km/h", "km/h"), ("rad/s^2", "rad/s^2"), ("1", "1"),
    ],
)  # fmt: skip
def test_a_unit_that_wires_put_together_is_shown_in_few_names(text, shown):
    assert str(Unit.parse(text).reduced) == shown


@given(units)
def test_a_reduced_unit_is_the_same(unit):
    assert unit.reduced == unit
    assert Unit.parse(str(unit.reduced)) == unit


@given(units)
def test_a_shown_unit_reads_back_the_same(unit):
    assert Unit.parse(str(unit)) == unit
    assert str(Unit.parse(str(unit))) == str(unit)


@given(units, units, units)
def test_units_multiply_like_numbers(one, two, three):
    assert one * two == two * one
    assert (one * two) * three == one * (two * three)
    assert one / one == Unit()
    assert (one * two) / two == one
    assert (one**2) ** Fraction(1, 2) == one
    assert (one * two).scale == pytest.approx(one.scale * two.scale, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("sec", "'sec' is not a unit; did you mean 's'?"),
        ("hz", "'hz' is not a unit; did you mean 'Hz'?"),
        ("Metre/s", "'Metre/s' is not a unit; did you mean 'm/s'?"),
        ("m2", "'m2' is not a unit; did you mean 'm^2'?"),
        ("N m", "'N m' holds a space; write 'N*m' for a product"),
        ("", "the unit is empty; write '1' for a number without unit"),
        ("m/", "'m/' is not a unit; a unit is missing at its end"),
        ("m**2", "'m**2' is not a unit; did you mean 'm^2'?"),
        ("m*/s", "'m*/s' is not a unit; '/' stands where it cannot"),
        ("(m", "'(m' lacks a ')'"),
        ("m^", "'m^' has no exponent after '^'; write such as 's^2' or 's^-1'"),
        ("m^99", "a unit has an exponent beyond 60"),
        ("m^(1/0)", "'m^(1/0)' divides by zero"),
        ("m$", "'m$' is not a unit; '$' is no part of one"),
        ("xyzzy", "'xyzzy' is not a unit; use m, s, rad, kg, N, V, Hz, px ..."),
    ],
)
def test_what_is_no_unit_is_refused_with_advice(text, message):
    with pytest.raises(UnitError) as caught:
        Unit.parse(text)
    assert str(caught.value) == message


# What people write, and the unit that is meant.
MEANT = {
    "Nm": "N*m", "N.m": "N*m", "N-m": "N*m", "kNm": "kN*m", "Nms": "N*m*s", "Nms/rad": "N*m*s/rad",
    "Vs": "V*s",
    "Vs/rad": "V*s/rad", "As": "A*s", "Ah": "A*h", "mAh": "mA*h", "Wh": "W*h", "kWh": "kW*h", "VA": "V*A",
    "kgm2": "kg*m^2", "kgm^2": "kg*m^2", "kg.m2": "kg*m^2", "1/kgm2": "1/(kg*m^2)", "W/mK": "W/(m*K)",
    "m2": "m^2", "m/s2": "m/s^2", "rad/s2": "rad/s^2", "s-1": "s^-1", "m s-2": "m*s^-2", "kg m2": "kg*m^2",
    "m**2": "m^2", "meter": "m", "metres": "m", "Meters": "m", "seconds": "s", "secs": "s", "sec": "s",
    "milliseconds": "ms", "microseconds": "us", "kilometres": "km", "millimeter": "mm", "minutes": "min",
    "hours": "h", "degrees": "deg", "degs": "deg", "radians": "rad", "radian/sec": "rad/s",
    "deg/sec": "deg/s",
    "hertz": "Hz", "Herz": "Hz", "kilohertz": "kHz", "HZ": "Hz", "mhz": "MHz", "volts": "V",
    "millivolts": "mV",
    "amps": "A", "amperes": "A", "milliamps": "mA", "newtons": "N", "Newton": "N", "newton metres": "N*m",
    "watts": "W", "kilowatts": "kW", "joules": "J", "Joule": "J", "pascal": "Pa", "kilopascals": "kPa",
    "Ohm": "ohm", "ohms": "ohm", "kOhm": "kohm", "farads": "F", "henry": "H", "henries": "H", "coulombs": "C",
    "kelvin": "K", "tesla": "T", "grams": "g", "kilograms": "kg", "KG": "kg", "litres": "l", "liter": "l",
    "percent": "%", "pixels": "px", "feet": "ft", "foot": "ft", "inches": "in", "pounds": "lb", "lbs": "lb",
    "ounces": "oz", "knots": "kn", "miles": "mi", "kph": "km/h", "kmh": "km/h", "mps": "m/s", "S": "s",
    "meter per second": "m/s", "revolutions": "rev", "turns/min": "rev/min", "bars": "bar", "RPM": "rpm",
}  # fmt: skip


@pytest.mark.parametrize(("text", "unit"), MEANT.items())
def test_the_usual_names_of_a_unit_get_its_right_spelling(text, unit):
    assert Unit.parse(unit)
    for wanted in ((), (Unit.parse(unit),)):
        with pytest.raises(UnitError) as caught:
            Unit.parse(text, *wanted)
        assert f"'{unit}'" in caught.value.remedy


@pytest.mark.parametrize(
    ("text", "wanted", "remedy"),
    [
        ("Nm", "N*m", "did you mean 'N*m'?"), ("Nm", "nm", "did you mean 'nm'?"),
        ("rads", "rad", "did you mean 'rad'?"),
        ("rads", "rad/s", "did you mean 'rad/s'?"), ("MS", "s", "did you mean 'ms'?"),
        ("hm", "m", "did you mean 'm'?"),
        ("metres", "s", "write it in s"), ("Nm", "V", "write it in V"),
        ("m/s2", "rad/s^2", "write it in rad/s^2"),
        ("xyz", "N*s/m", "write it in N*s/m"), ("volt", "A", "write it in A"), ("Herz", "s", "write it in s"),
    ],
)  # fmt: skip
def test_what_is_suggested_has_the_dimension_that_is_wanted(text, wanted, remedy):
    with pytest.raises(UnitError) as caught:
        Unit.parse(text, Unit.parse(wanted))
    assert caught.value.remedy == remedy


@given(st.text("abcABCdBgNmsHF", min_size=1, max_size=4), st.sampled_from(["", "s", "m/s", "A", "N*m"]))
def test_a_unit_variable_is_never_suggested(text, wanted):
    try:
        Unit.parse(text, *([Unit.parse(wanted)] if wanted else []))
    except UnitError as error:
        for name in re.findall(r"'([^']*)'", error.remedy):
            assert not Unit.parse(name).variables
            assert not wanted or Unit.parse(name).dimension_equals(Unit.parse(wanted))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("3 dB", "'dB' is not a unit here, since it is a logarithm; "
         "write the ratio, such as 10 for an amplitude of 20 dB"),
        ("20 degC", "'degC' is not a unit here, since its zero is not 0; "
         "write 20 degC as 293.15 K, and a difference of 1 degC as 1 K"),
        ("1 W/degC", "'degC' is not a unit here, since its zero is not 0; "
         "write 20 degC as 293.15 K, and a difference of 1 degC as 1 K"),
        ("20 °C", "'degC' is not a unit here, since its zero is not 0; "
         "write 20 degC as 293.15 K, and a difference of 1 degC as 1 K"),
        ("2 gauss", "'gauss' is not a unit here; write it in T: 1 gauss is 1e-4 T"),
        ("3 psi", "'psi' is not a unit here; write it in Pa: 1 psi is 6894.757 Pa"),
    ],
)  # fmt: skip
def test_names_that_cannot_be_units_say_what_to_write(text, message):
    with pytest.raises(UnitError) as caught:
        parse_quantity(text)
    assert str(caught.value) == message


@pytest.mark.parametrize(
    ("text", "value", "unit"),
    [
        ("1 ohm", 1.0, "ohm"), ("2 bar", 2e5, "bar"), ("3 oz", 3 * 0.45359237 / 16, "oz"),
        ("0 ohm", 0.0, "ohm"),
        ("0ohm", 0.0, "ohm"), ("0bar", 0.0, "bar"), ("0.5 bar", 5e4, "bar"), ("2ohm", 2.0, "ohm"),
        ("0 oz", 0.0, "oz"), ("10 ohm", 10.0, "ohm"), ("0oz", 0.0, "oz"), ("-0 bar", 0.0, "bar"),
    ],
)  # fmt: skip
def test_units_that_begin_with_a_letter_of_other_bases_are_units(text, value, unit):
    assert parse_quantity(text) == (pytest.approx(value, rel=1e-15), Unit.parse(unit))


@pytest.mark.parametrize(
    "text", ["0x10", "0X1f m", "0o17", "0b1", "0b101 s", "-0x3", "+0o7", "0B0", "0O1", "0xfa"]
)
def test_numbers_of_other_bases_are_refused(text):
    with pytest.raises(UnitError, match=r"is not a number; write it as in 0\.5, -2 or 1e-3$"):
        parse_quantity(text)


@pytest.mark.parametrize("text", ["1 a", "2 b", "3 c", "4 a/s", "5 m*b"])
def test_a_unit_variable_is_no_unit_of_a_number(text):
    for read in (parse_quantity, parse_rational, lambda text: read_quantity(text, Unit.parse("m"))):
        with pytest.raises(UnitError, match="is not a unit"):
            read(text)


def test_gravity_is_told_from_the_gram():
    assert read_quantity("50 g", Unit.parse("kg")) == 0.05
    with pytest.raises(
        UnitError, match=r"^'2 g' is in grams, not in m/s\^2; write gravity as 9\.80665 m/s\^2$"
    ):
        read_quantity("2 g", Unit.parse("m/s^2"))


def test_a_port_has_one_unit_or_one_for_each_element():
    assert parse_units("m m m rad") == (*[Unit.parse("m")] * 3, Unit.parse("rad"))
    assert parse_units("rad / s") == (Unit.parse("rad/s"),)
    with pytest.raises(UnitError):
        parse_units("  ")


def test_unification_binds_the_variable_that_is_settled():
    bindings: dict[str, Unit] = {}
    assert unify(Unit.parse("a/s"), Unit.parse("m/s"), bindings)
    assert bindings == {"a": Unit.parse("m")}
    assert unify(Unit.parse("a"), Unit.parse("m"), bindings)
    assert not unify(Unit.parse("a"), Unit.parse("mm"), bindings)
    assert unify(Unit.parse("a*b^2"), Unit.parse("m/s"), bindings)
    assert bindings["b"] == Unit.parse("Hz^0.5")


def test_two_unknown_variables_settle_nothing():
    bindings: dict[str, Unit] = {}
    assert unify(Unit.parse("a*b"), Unit.parse("N*m"), bindings)
    assert bindings == {}


def test_units_without_variables_unify_only_with_their_equals():
    assert unify(Unit.parse("Hz"), Unit.parse("1/s"), {})
    assert not unify(Unit.parse("deg"), Unit.parse("rad"), {})


@given(units, fixed_units)
def test_unification_makes_pattern_and_unit_the_same(pattern, actual):
    bindings: dict[str, Unit] = {}
    try:
        agreed = unify(pattern, actual, bindings)
    except UnitError:
        pytest.fail("unify must not raise")
    if not agreed:
        assert bindings == {}
    elif len(pattern.variables) <= 1:
        assert pattern.substitute(bindings) == actual


@given(units, st.fixed_dictionaries({name: fixed_units for name in "abc"}))
def test_a_pattern_unifies_with_what_it_becomes(pattern, bindings):
    try:
        actual = pattern.substitute(bindings)
    except UnitError:
        assume(False)
    first = {name: bindings[name] for name in sorted(pattern.variables)[1:]}
    assert unify(pattern, actual, first)
    assert all(first[name] == bindings[name] for name in pattern.variables)


@pytest.mark.parametrize(
    ("text", "value", "unit"),
    [
        ("50 ms", 0.05, "ms"), ("33.3 ms", 0.0333, "ms"), ("0.24 m", 0.24, "m"), ("24cm", 0.24, "cm"),
        ("1e-3", 1e-3, "1"), ("-.5 V", -0.5, "V"), ("1e3 px", 1000.0, "px"), ("2.5 rad/s", 2.5, "rad/s"),
        ("90 %", 0.9, "%"), ("20 Hz", 20.0, "Hz"), ("180 deg", math.pi, "deg"), ("5/s", 5.0, "1/s"),
        ("1/30 s", 1 / 30, "s"), ("36 km/h", 10.0, "km/h"), ("60 rpm", 2 * math.pi, "rpm"),
        ("+3 m", 3.0, "m"),
    ],
)  # fmt: skip
def test_quantities_are_read_in_si_units(text, value, unit):
    read, written = parse_quantity(text)
    assert read == pytest.approx(value, rel=1e-15)
    assert written == Unit.parse(unit)


@given(
    st.decimals(-1_000_000, 1_000_000, places=6),
    st.sampled_from(["s", "ms", "us", "min", "m", "mm", "kHz"]),
)
def test_decimal_quantities_are_rounded_once(number, unit):
    scale = {"s": 1, "ms": "0.001", "us": "0.000001", "min": 60, "m": 1, "mm": "0.001", "kHz": 1000}[unit]
    assert parse_quantity(f"{number:f} {unit}")[0] == float(Decimal(scale) * number)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("50 ms", Fraction(1, 20)), ("0.05 s", Fraction(1, 20)), ("10 Hz", Fraction(10)),
        ("1/30 s", Fraction(1, 30)),
        ("33.3 ms", Fraction(333, 10_000)), ("2 min", Fraction(120)), ("1e-3 s", Fraction(1, 1000)),
        ("7", Fraction(7)),
    ],
)  # fmt: skip
def test_rates_and_times_are_exact(text, value):
    assert parse_rational(text) == value


@pytest.mark.parametrize(
    ("text", "period"),
    [("10 Hz", "1/10"), ("50 ms", "1/20"), ("1/30 s", "1/30"), ("30 Hz", "1/30"), ("3 kHz", "1/3000")],
)
def test_a_rate_and_its_period_are_the_same(text, period):
    assert parse_period(text) == Fraction(period)


@pytest.mark.parametrize(
    "text", ["0 s", "-1 Hz", "50", "0", "1 m", "1 rad/s", "", "fast", "0 Hz", "30 deg", "1/0 s"]
)
def test_what_is_no_rate_is_refused(text):
    with pytest.raises(UnitError):
        parse_period(text)


def test_exact_values_demand_their_dimension():
    second = Unit.parse("s")
    assert parse_rational("50 ms", second) == Fraction(1, 20)
    assert parse_rational("0", second) == 0
    with pytest.raises(UnitError, match=r"^'50 Hz' is in Hz, not in s; write it in ms or s$"):
        parse_rational("50 Hz", second)
    with pytest.raises(UnitError, match=r"^'30 deg' has no exact value; write it in an SI unit$"):
        parse_rational("30 deg", Unit.parse("rad"))


@pytest.mark.parametrize(
    ("text", "unit", "message"),
    [
        ("50", "s", "'50' has no unit; did you mean '50 ms'?"),
        ("2", "s", "'2' has no unit; did you mean '2 s'?"),
        ("240", "m", "'240' has no unit; did you mean '240 mm'?"),
        ("90", "rad", "'90' has no unit; did you mean '90 deg'?"),
        ("20", "Hz", "'20' has no unit; did you mean '20 Hz'?"),
        ("3", "m/s", "'3' has no unit; did you mean '3 m/s'?"),
    ],
)
def test_a_missing_unit_is_guessed_from_the_size(text, unit, message):
    with pytest.raises(UnitError) as caught:
        require_unit(text, Unit.parse(unit))
    assert str(caught.value) == message


@pytest.mark.parametrize(("text", "unit"), [("0", "s"), ("5", "1"), ("50 %", "1"), ("5 ms", "s")])
def test_a_unit_is_not_demanded_where_none_is_needed(text, unit):
    require_unit(text, Unit.parse(unit))


def test_a_quantity_is_read_as_a_number_of_the_declared_unit():
    assert read_quantity("50 ms", Unit.parse("s")) == 0.05
    assert read_quantity("0.05 s", Unit.parse("ms")) == 50.0
    assert read_quantity("50", Unit.parse("ms")) == 50.0
    assert read_quantity("90 %", Unit()) == 0.9
    assert read_quantity("180 deg", Unit.parse("rad")) == math.pi
    assert read_quantity("3 cm", Unit.parse("a")) == 0.03
    assert read_quantity("90 deg", Unit.parse("deg")) == pytest.approx(90, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "unit", "message"),
    [
        ("50 ms", "m", "'50 ms' is in ms, not in m; write it in mm or cm or m or km"),
        ("5 m", "1", "'5 m' has a unit where none belongs; write a number without unit"),
        ("2 rad/s", "rad/s^2", "'2 rad/s' is in rad/s, not in rad/s^2; write it in rad/s^2"),
        ("2 m", "mm^2", "'2 m' is in m, not in mm^2; write it in mm^2"),
        ("soon", "s", "'soon' does not begin with a number; write it as in '50 ms'"),
        ("5 sec", "s", "'sec' is not a unit; did you mean 's'?"),
        ("1e308 km", "m", "'1e308 km' is outside the range of numbers"),
    ],
)
def test_a_wrong_quantity_is_refused_with_advice(text, unit, message):
    with pytest.raises(UnitError) as caught:
        read_quantity(text, Unit.parse(unit))
    assert str(caught.value) == message


def test_a_bare_number_can_be_refused():
    with pytest.raises(UnitError, match=r"^'50' has no unit; did you mean '50 ms'\?$"):
        read_quantity("50", Unit.parse("s"), bare=False)
    assert read_quantity("50", Unit(), bare=False) == 50.0


@pytest.mark.parametrize(
    ("text", "remedy"),
    [
        ("010", "write '10'"), ("-007.5", "write '-7.5'"), ("00.5", "write '0.5'"), ("00", "write '0'"),
        ("1_000", "write '1000'"), ("1,5", "write '1.5'"), ("0x10", "write it as in 0.5, -2 or 1e-3"),
        ("1:30", "write it as in 0.5, -2 or 1e-3"), ("0o17", "write it as in 0.5, -2 or 1e-3"),
        ("nan", "write it as in 0.5, -2 or 1e-3"), (".inf", "write it as in 0.5, -2 or 1e-3"),
        ("1e999", "stay between 1e-300 and 1e300"), ("1e-999", "stay between 1e-300 and 1e300"),
        ("", "write it as in 0.5, -2 or 1e-3"), ("9" * 400, "write it as in 0.5, -2 or 1e-3"),
        ("2*3", "write it as in 0.5, -2 or 1e-3"), ("\u0661", "write it as in 0.5, -2 or 1e-3"),
    ],
)  # fmt: skip
def test_only_plain_decimal_numbers_are_numbers(text, remedy):
    with pytest.raises(UnitError) as caught:
        parse_number(text)
    assert caught.value.remedy == remedy


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_every_float_that_python_writes_is_read_back(value):
    assert parse_number(repr(value)) == value


@pytest.mark.parametrize("text", ["1e999999999 s", "1e-999999999 Hz", "9" * 500, "1/" + "9" * 500 + " s"])
def test_huge_exponents_are_refused_before_they_cost(text):
    with pytest.raises(UnitError):
        parse_rational(text)


@pytest.mark.parametrize(
    ("value", "unit", "shown"),
    [
        (0.05, "s", "50 ms"), (0.032, "m", "3.2 cm"), (0.24, "m", "24 cm"), (1.5, "m", "1.5 m"),
        (2500, "m", "2.5 km"),
        (0.004, "m", "4 mm"), (-0.032, "m", "-3.2 cm"), (0.0, "m", "0 m"), (20, "Hz", "20 Hz"),
        (1e4, "Hz", "10 kHz"),
        (math.pi / 6, "deg", "30 deg"), (0.9, "%", "90 %"), (2.0, "1", "2"),
        (5.0, "1/s", "5 1/s"), (9.81, "m/s^2", "9.81 m/s^2"),
        (0.99999, "s", "1 s"), (0.9996, "s", "999.6 ms"), (math.nan, "s", "nan s"), (math.inf, "m", "inf m"),
        (0.012, "rad", "0.012 rad"), (1.25e-5, "s", "12.5 us"),
    ],
)  # fmt: skip
def test_quantities_are_shown_for_people(value, unit, shown):
    assert format_quantity(value, Unit.parse(unit)) == shown


@given(
    st.floats(-1e9, 1e9).filter(lambda value: value == 0 or abs(value) > 1e-9),
    st.sampled_from(["s", "m", "rad", "deg", "Hz", "1", "%", "m/s", "rad/s^2", "V", "W", "N", "Pa", "km/h"]),
)
def test_a_shown_quantity_reads_back_as_the_same(value, name):
    unit = Unit.parse(name)
    read, written = parse_quantity(format_quantity(value, unit, digits=17))
    assert read == pytest.approx(value, rel=1e-14)
    assert written.dimension_equals(unit)


@given(st.one_of(st.text(), st.text("0123456789.eE+-/*^() msradHz%", max_size=20)))
def test_any_text_is_read_or_refused(text):
    split_quantity(text)
    for read in (Unit.parse, parse_units, parse_number, parse_quantity, parse_rational, parse_period):
        try:
            read(text)
        except QuadvisError as error:
            assert str(error).isprintable()
    for unit in ("s", "1", "a"):
        try:
            read_quantity(text, Unit.parse(unit), bare=False)
        except QuadvisError as error:
            assert str(error).isprintable()


@pytest.mark.parametrize(
    ("text", "value"),
    [("2", 2.0), ("200 %", 2.0), ("20 dB", 10.0), ("40dB", 100.0), ("0 dB", 1.0), ("-20 dB", 0.1)],
)
def test_a_ratio_of_amplitudes_is_a_number_or_its_decibels(text: str, value: float) -> None:
    assert read_ratio(text) == value  # exactly: these powers of ten are


@pytest.mark.parametrize("text", ["2 m", "dB", "6 db", "1e5 dB", "x dB", "6 dB/s"])
def test_what_is_no_ratio_is_refused(text: str) -> None:
    with pytest.raises(UnitError):
        read_ratio(text)


@given(st.floats(1e-9, 1e9))
def test_a_ratio_is_shown_as_it_is_read(value: float) -> None:
    assert float(format_ratio(value).removeprefix("x ")) == pytest.approx(value, rel=1e-3)
    shown = format_ratio(value, "dB")
    assert read_ratio(shown) == pytest.approx(value, rel=0.02)
    assert format_ratio(0.0, "dB") == "-inf dB"


@pytest.mark.parametrize(
    ("text", "si"),
    [("deg/s", "rad/s"), ("mV", "V"), ("1", "1"), ("%", "1"), ("km/h", "m/s"), ("uT", "T"), ("rpm", "rad/s")],
)
def test_a_unit_has_an_si_unit_of_its_dimension(text: str, si: str) -> None:
    assert str(Unit.parse(text).si) == si
    assert Unit.parse(text).si.scale == 1.0
