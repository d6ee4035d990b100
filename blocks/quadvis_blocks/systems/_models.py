"""Linear systems as matrices: dx/dt = A x + B u, or x[k+1] = A x[k] + B u[k], and y = C x + D u.

A system of higher order is a chain of sections of order 2 at most, whose poles rounding hardly moves; one
polynomial of high degree is sensitive to its coefficients.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[Any]
Section = tuple[Matrix, Matrix]  # numerator and denominator, of one length


class Model(NamedTuple):
    """The matrices A (n, n), B (n, m), C (p, n) and D (p, m) of a system; n is 1 at least."""

    a: Matrix
    b: Matrix
    c: Matrix
    d: Matrix

    @property
    def finite(self) -> bool:
        """Whether all numbers are."""
        return all(bool(np.isfinite(matrix).all()) for matrix in self)

    def rest(self, discrete: bool) -> Matrix | None:
        """Return the states (n, m) in the steady state of inputs of 1; None if there is no such state."""
        a = np.eye(len(self.a)) - self.a if discrete else -self.a
        found = np.zeros_like(self.b)
        # Section by section: of a long chain with low corners, all of it at once loses ten digits.
        ends = [end for end in range(1, len(a) + 1) if not a[:end, end:].any()]
        for begin, end in zip([0, *ends], ends, strict=False):
            section = a[begin:end, begin:end]
            if np.linalg.matrix_rank(section) < end - begin:
                return None if self.b.any() else found
            driven = self.b[begin:end] - a[begin:end, :begin] @ found[:begin]
            found[begin:end] = np.linalg.solve(section, driven)
        return found


def degree(polynomial: Any) -> int:
    """Return the degree of a polynomial, highest power first; -1 if all coefficients are 0."""
    used = np.flatnonzero(polynomial)
    return len(polynomial) - 1 - int(used[0]) if used.size else -1


def of_polynomials(numerator: Any, denominator: Any) -> Model:
    """Return a system (controller canonical form) from its polynomials, highest power first.

    The denominator is not 0, and the degree of the numerator not higher.
    """
    order = degree(denominator)
    den = np.asarray(denominator, float)[-order - 1 :]
    num = np.zeros(order + 1)
    if degree(numerator) >= 0:
        used = np.asarray(numerator, float)[-degree(numerator) - 1 :]
        num[order + 1 - len(used) :] = used
    num, den = num / den[0], den / den[0]
    if order == 0:
        return Model(np.zeros((1, 1)), np.zeros((1, 1)), np.zeros((1, 1)), num.reshape(1, 1))
    a = np.eye(order, k=-1)
    a[0] = -den[1:]
    b = np.zeros((order, 1))
    b[0] = 1.0
    return Model(a, b, (num[1:] - num[0] * den[1:]).reshape(1, order), num[:1].reshape(1, 1))


def of_sections(sections: Sequence[Section], gain: float = 1.0) -> Model:
    """Return the chain of sections, of one at least; the first one gets the input times the gain."""
    (num, den), *others = sections
    chain = of_polynomials(gain * np.asarray(num, float), den)
    for num, den in others:
        a, b, c, d = of_polynomials(num, den)
        chain = Model(
            np.block([[chain.a, np.zeros((len(chain.a), len(a)))], [b @ chain.c, a]]),
            np.vstack([chain.b, b @ chain.d]),
            np.hstack([d @ chain.c, c]),
            d @ chain.d,
        )
    return chain


def of_roots(zeros: Any, poles: Any, gain: float) -> Model:
    """Return a system from its zeros and poles, complex ones in conjugate pairs, and its gain.

    There are no more zeros than poles.
    """
    left = _groups(zeros)
    sections = []
    for group in _groups(poles):
        fitting = [other for other in left if len(other) <= len(group)]
        # The zeros of a section lie near its poles, so that no section has a large gain.
        near = min(fitting, key=lambda other: (-len(other), abs(other[0] - group[0])), default=None)
        if near is not None:
            left.remove(near)
        num = np.atleast_1d(np.poly(near or [])).real
        sections.append((np.pad(num, (len(group) + 1 - len(num), 0)), np.poly(group).real))
    return of_sections(sections or [(np.ones(1), np.ones(1))], gain)


def _groups(roots: Any) -> list[list[complex]]:
    """Return conjugate pairs, then real roots two by two, so that at most one is alone, at the end."""
    upper = [complex(root) for root in roots if complex(root).imag > 0.0]
    real = sorted((complex(root) for root in roots if complex(root).imag == 0.0), key=abs)
    pairs = [[root, root.conjugate()] for root in upper]
    return pairs + [real[place : place + 2] for place in range(0, len(real), 2)]


def paired(roots: Any) -> bool:
    """Return whether complex numbers come in conjugate pairs."""
    return sorted(map(_key, roots)) == sorted(_key(np.conj(root)) for root in roots)


def _key(root: Any) -> tuple[float, float]:
    return float(np.real(root)), float(np.imag(root)) + 0.0
