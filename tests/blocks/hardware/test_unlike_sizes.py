from typing import Any

import pytest

from quadvis.block import Block, Param, ParameterError, unlike_sizes
from quadvis_blocks.hardware.adc_in import AdcIn
from quadvis_blocks.hardware.crsf_out import CrsfOut
from quadvis_blocks.hardware.dac_out import DacOut
from quadvis_blocks.hardware.ppm_out import PpmOut
from quadvis_blocks.hardware.sbus_out import SbusOut

RADIO: dict[str, Any] = {
    "port": "pty:rc", "channels": [1, 2, 3, 4], "lowest": [-1] * 4, "highest": [1] * 4, "initial": [0] * 4,
    "safe": [-1] * 4,
}  # fmt: skip
CARD: dict[str, Any] = {
    "port": "comedi:/dev/comedi0", "channels": [1, 2], "ranges": [3, 3], "lowest": [-10] * 2,
    "highest": [10] * 2, "initial": [0] * 2, "safe": [0] * 2,
}  # fmt: skip


@pytest.mark.parametrize("kind", [SbusOut, CrsfOut, PpmOut])
@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            {"channels": [1, 2, 3]},
            "lowest has 4 values, and channels has 3 values; give as many of one as of",
        ),
        ({"channels": []}, "lowest has 4 values, and channels has 0 values"),
        ({"safe": [1, 2]}, "safe has 2 values, and channels has 4 values"),
        ({"initial": [0] * 5}, "initial has 5 values, and channels has 4 values"),
    ],
)
def test_a_radio_with_values_of_unlike_sizes_is_refused(
    kind: type[Block], change: dict[str, Any], words: str
) -> None:
    with pytest.raises(ParameterError) as caught:
        kind(**RADIO | change)
    assert str(caught.value).startswith(words)
    assert caught.value.parameter == words.split()[0]


@pytest.mark.parametrize(
    ("kind", "given", "words"),
    [
        (DacOut, CARD | {"ranges": [3]}, "ranges has 1 value, and channels has 2 values"),
        (DacOut, CARD | {"ranges": []}, "ranges has 0 values, and channels has 2 values"),
        (DacOut, CARD | {"channels": [1, 2, 4]}, "ranges has 2 values, and channels has 3 values"),
        (
            AdcIn,
            {"port": CARD["port"], "channels": [1, 2], "ranges": [-10]},
            "ranges has 1 value, and channels has 2 values",
        ),
    ],
)
def test_a_card_with_values_of_unlike_sizes_is_refused(
    kind: type[Block], given: dict[str, Any], words: str
) -> None:
    with pytest.raises(ParameterError) as caught:
        kind(**given)
    assert str(caught.value).startswith(words)


class Careless(Block):
    """Fails on values that do not fit together, and on others."""

    a = Param(type="float64[n]")
    b = Param(type="float64[n]")

    def check(self) -> None:
        (self.a + self.b).item()


def test_another_failure_of_a_check_stays_what_it_is() -> None:
    assert unlike_sizes(Careless(a=[1.0], b=[2.0])) is None
    with pytest.raises(ParameterError, match="b has 2 values, and a has 3 values"):
        Careless(a=[1.0, 2.0, 3.0], b=[1.0, 2.0])
    with pytest.raises(ValueError, match="can only convert an array of size 1"):
        Careless(a=[1.0, 2.0], b=[1.0, 2.0])
