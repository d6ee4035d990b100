import numpy as np
import pytest

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.systems.spectrum import Spectrum


def test_it_has_the_numbers_of_the_closed_form() -> None:
    t = np.arange(1001) / 1000
    x = 1.5 + 2.0 * np.sin(2 * np.pi * 50 * t + 0.3) + 0.5 * np.cos(2 * np.pi * 120 * t)
    found = drive(Spectrum(frequencies=[0, 50, 120, 77], samples=1000), u=x, rate="1 kHz")
    assert found.amplitude[-1] == pytest.approx([1.5, 2.0, 0.5, 0.0], abs=1e-10)
    assert found.phase[-1][1:3] == pytest.approx([-1.2707963267948965, 0.0], abs=1e-10)
    assert not found.amplitude[:-1].any()


@pytest.mark.parametrize("window", ["none", "hann"])
def test_it_is_numpy_s_fft(window: str) -> None:
    n = 16
    x = np.random.default_rng(1).normal(size=2 * n + 1)
    weights = np.ones(n) if window == "none" else 1.0 - np.cos(2 * np.pi * np.arange(n) / n)
    lines = np.arange(n // 2 + 1) * 100.0 / n
    found = drive(Spectrum(frequencies=lines, samples=n, window=window), u=x, rate="100 Hz")
    for end in (n, 2 * n):
        wanted = np.fft.rfft(weights * x[end - n : end]) / n
        scale = np.array([1.0, *np.full(n // 2 - 1, 2.0), 1.0])
        assert found.amplitude[end] == pytest.approx(scale * np.abs(wanted), abs=1e-12)
        assert np.exp(1j * found.phase[end]) == pytest.approx(wanted / np.abs(wanted), abs=1e-9)


def test_frequencies_that_no_sample_shows_are_refused() -> None:
    with pytest.raises(ParameterError, match="at most half the sample rate, 50 Hz, got 60 Hz"):
        Spectrum(frequencies=[60.0], period=0.01)
