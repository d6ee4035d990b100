"""The names of units, and names from elsewhere that people write in their place."""

from __future__ import annotations

VARIABLES = ("a", "b", "c")
NUMBERED = "_"  # in names of further variables, a_0, a_1, and so on
BASES = ("m", "kg", "s", "rad", "px", "A", "K", *VARIABLES)

# A scale is a product of powers of these numbers, so it is never rounded; the large ones are for the pound.
PRIMES = {str(prime): prime for prime in (2, 3, 5, 7, 11, 97, 127, 463, 6073)}
SCALES = frozenset((*PRIMES, "pi"))

# Every other unit, as a product; each line uses only names above it. Sources: SI brochure (9th edition),
# tables 4, 7 and 8; the international yard and pound of 1959: 0.3048 m and 0.45359237 kg.
DERIVED = {
    "%": "2^-2*5^-2", "ppm": "2^-6*5^-6", "Hz": "s^-1", "N": "kg*m/s^2", "J": "N*m", "W": "J/s", "V": "W/A",
    "ohm": "V/A", "C": "A*s", "F": "C/V", "H": "V*s/A", "Wb": "V*s", "Pa": "N/m^2", "T": "N/A/m",
    "bar": "2^5*5^5*Pa", "min": "2^2*3*5*s", "h": "2^2*3*5*min", "deg": "pi*2^-2*3^-2*5^-1*rad",
    "rev": "2*pi*rad", "rpm": "rev/min", "g": "2^-3*5^-3*kg", "l": "2^-3*5^-3*m^3", "in": "2^-3*5^-4*127*m",
    "ft": "2^2*3*in", "mi": "2^5*3*5*11*ft", "nmi": "2^2*463*m", "mph": "mi/h", "kn": "nmi/h",
    "lb": "2^-8*5^-8*7*11*97*6073*kg", "oz": "2^-4*lb",
}  # fmt: skip
PREFIXES = {"p": -12, "n": -9, "u": -6, "m": -3, "c": -2, "d": -1, "h": 2, "k": 3, "M": 6, "G": 9}
# fmt: off
PREFIXED = frozenset((
    "km", "dm", "cm", "mm", "um", "nm", "ms", "us", "ns", "mrad", "urad", "mg", "ml", "mA", "uA", "nA", "kA",
    "mV", "uV", "kV", "mN", "kN", "MN", "mW", "kW", "MW", "kHz", "MHz", "GHz", "hPa", "kPa", "MPa", "mbar",
    "mT", "uT", "nT", "mJ", "kJ", "MJ", "mohm", "kohm", "Mohm", "mF", "uF", "nF", "pF", "mH", "uH", "nH",
    "mC", "uC",
))
SPELLINGS = str.maketrans({
    "·": "*", "⋅": "*", "\u00d7": "*", "²": "^2", "³": "^3", "µ": "u", "μ": "u", "°": "deg",
    "\u03a9": "ohm", "\u2126": "ohm",
})
# fmt: on

# Names that people write, in any case, and their units.
WORDS = {
    "sec": "s", "secs": "s", "second": "s", "msec": "ms", "usec": "us", "hr": "h", "hrs": "h", "hour": "h",
    "minute": "min", "meter": "m", "metre": "m", "hertz": "Hz", "fps": "Hz", "degree": "deg",
    "radian": "rad", "rads": "rad/s", "pixel": "px", "volt": "V", "amp": "A", "ampere": "A",
    "newton": "N", "newtonmeter": "N*m", "newtonmetre": "N*m", "watt": "W", "joule": "J", "pascal": "Pa",
    "tesla": "T", "weber": "Wb", "kelvin": "K", "coulomb": "C", "farad": "F", "henry": "H", "henrie": "H",
    "percent": "%", "pct": "%", "gram": "g", "gramme": "g", "kilo": "kg", "litre": "l", "liter": "l",
    "revolution": "rev", "turn": "rev", "rps": "rev/s", "mps": "m/s", "kph": "km/h", "kmh": "km/h",
    "kmph": "km/h", "inch": "in", "inche": "in", "foot": "ft", "feet": "ft", "mile": "mi", "knot": "kn",
    "kt": "kn", "kts": "kn", "pound": "lb", "lbs": "lb", "ounce": "oz", "micron": "um",
}  # fmt: skip
PREFIX_WORDS = {"nano": "n", "micro": "u", "milli": "m", "centi": "c", "kilo": "k", "mega": "M", "giga": "G"}

# Names that are no units here: why, and the remedy. The case counts for names of one or two letters.
ELSEWHERE = {
    "dB": (", since it is a logarithm", "write the ratio, such as 10 for an amplitude of 20 dB"),
    "degC": (", since its zero is not 0", "write 20 degC as 293.15 K, and a difference of 1 degC as 1 K"),
    "degF": (", since its zero is not 0", "write 68 degF as 293.15 K, and a difference of 1 degF as 5/9 K"),
    "G": ("", "write it in T: 1 gauss is 1e-4 T, or in m/s^2: gravity is 9.80665 m/s^2"),
    "gauss": ("", "write it in T: 1 gauss is 1e-4 T"),
    "psi": ("", "write it in Pa: 1 psi is 6894.757 Pa"),
    "lbf": ("", "write it in N: 1 lbf is 4.448222 N"),
    "atm": ("", "write it in Pa: 1 atm is 101325 Pa"),
    "mmhg": ("", "write it in Pa: 1 mmHg is 133.3224 Pa"),
    "hp": ("", "write it in W: 1 hp is 745.6999 W"),
    "cal": ("", "write it in J: 1 cal is 4.184 J"),
    "day": ("", "write it in h: 1 day is 24 h"),
}
ELSEWHERE |= dict.fromkeys(("db", "decibel", "decibels"), ELSEWHERE["dB"])
ELSEWHERE |= dict.fromkeys(("degc", "celsius", "centigrade"), ELSEWHERE["degC"])
ELSEWHERE |= dict.fromkeys(("degf", "fahrenheit"), ELSEWHERE["degF"])
ELSEWHERE |= {"days": ELSEWHERE["day"], "horsepower": ELSEWHERE["hp"]}
