from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy.signal

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.systems.butterworth import Butterworth

U = np.random.default_rng(1).normal(size=80)
KINDS = {"low": ("lowpass", [5.0]), "high": ("highpass", [5.0]), "band": ("bandpass", [4.0, 11.0]),
         "stop": ("bandstop", [4.0, 11.0])}  # fmt: skip


def given(corner: list[float]) -> dict[str, float]:
    """Return the corners as parameters."""
    return dict(zip(("corner", "upper_corner"), corner, strict=False))


@pytest.mark.parametrize("band", KINDS)
@pytest.mark.parametrize("order", [1, 2, 3, 5, 8])
def test_at_a_rate_it_is_scipy_s(order: int, band: str) -> None:
    kind, corner = KINDS[band]
    sections = scipy.signal.butter(
        order, corner if len(corner) > 1 else corner[0], kind, fs=100.0, output="sos"
    )
    found = drive(Butterworth(order=order, band=band, **given(corner)), u=U, rate="100 Hz").y
    assert found == pytest.approx(scipy.signal.sosfilt(sections, U), rel=1e-9, abs=1e-10)


@pytest.mark.parametrize("band", KINDS)
@pytest.mark.parametrize("order", [1, 2, 3, 5])
def test_continuous_it_has_the_response_of_scipy_s(order: int, band: str) -> None:
    kind, corner = KINDS[band]
    edges = 2.0 * np.pi * np.array(corner)
    zeros, poles, gain = scipy.signal.butter(
        order, edges if len(corner) > 1 else edges[0], kind, analog=True, output="zpk"
    )
    block = Butterworth(order=order, band=band, **given(corner), method="continuous")
    for w in (1.0, 20.0, 31.4, 50.0, 300.0):
        found = block.c @ np.linalg.solve(1j * w * np.eye(len(block.a)) - block.a, block.b) + block.d
        wanted = gain * np.prod(1j * w - zeros) / np.prod(1j * w - poles)
        assert found == pytest.approx(wanted, rel=1e-9, abs=1e-12)


def test_continuous_its_step_is_the_solver_s() -> None:
    _, wanted = scipy.signal.step(scipy.signal.butter(2, 2 * np.pi, analog=True), T=0.002 * np.arange(501))
    found = drive(Butterworth(corner=1.0, method="continuous"), u=1.0, steps=501, rate="2 ms").y
    assert found == pytest.approx(wanted, abs=1e-9)


def test_order_2_has_the_numbers_of_the_bilinear_transform() -> None:
    wanted = [
        0.02008336556421124, 0.09160059336128115, 0.2104431468538969, 0.35009083698492, 0.4918635510540872,
        0.6236100595196664, 0.7383425924352124, 0.8329463243606675, 0.9070405734838831, 0.9620287867017281,
        1.0003459208543735, 1.0248928847572318,
    ]  # fmt: skip
    assert drive(Butterworth(corner=5.0), u=np.ones(12), rate="100 Hz").y == pytest.approx(wanted, rel=1e-9)


def test_a_high_order_at_a_low_corner_stays_accurate() -> None:
    block = Butterworth(order=8, corner=0.5, period=1e-3)
    sections = [block.a[place : place + 2, place : place + 2] for place in range(0, 8, 2)]
    assert (np.abs(np.linalg.eigvals(sections)) < 1.0).all()
    z = np.exp(2j * np.pi * 0.5e-3)
    gain = abs(block.c @ np.linalg.solve(z * np.eye(8) - block.a, block.b) + block.d)
    assert gain == pytest.approx(np.sqrt(0.5), abs=1e-4)
    assert block.d + block.c @ block.rest == pytest.approx(1.0, abs=1e-9)
    held = Butterworth(order=8, corner=0.5, initial_input=1.0)
    assert drive(held, u=1.0, steps=200, rate="1 kHz").y == pytest.approx(np.ones(200), abs=1e-9)


def test_it_may_begin_in_the_steady_state() -> None:
    block = Butterworth(order=4, corner=2.0, initial_input=3.0)
    assert drive(block, u=3.0, steps=30, rate="50 Hz").y == pytest.approx(np.full(30, 3.0), rel=1e-9)


@pytest.mark.parametrize(
    ("wrong", "problem"),
    [
        ({"corner": 50.0, "period": 0.01}, "corner must be below half the sample rate, 50 Hz, got 50 Hz"),
        ({"corner": 5.0, "upper_corner": 9.0}, "upper_corner must be 0 for band low"),
        (
            {"corner": 9.0, "upper_corner": 5.0, "band": "band"},
            "upper_corner must be above corner, 9 Hz, got 5 Hz",
        ),
        ({"corner": 9.0, "band": "stop"}, "upper_corner must be above corner, 9 Hz, got 0 Hz"),
    ],
)
def test_corners_that_cannot_be_are_refused(wrong: dict[str, Any], problem: str) -> None:
    with pytest.raises(ParameterError, match=problem):
        Butterworth(**wrong)
