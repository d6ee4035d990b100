import numpy as np
import pytest

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.signal.outage import Outage


def test_a_signal_stands_still_from_begin_to_end_and_says_so() -> None:
    found = drive(Outage(during=[[0.2, 0.4], [0.6, 0.7]]), u=np.arange(8.0), rate="10 Hz")
    assert found.y.tolist() == [0.0, 1.0, 1.0, 1.0, 4.0, 5.0, 5.0, 7.0]
    assert found.ok.tolist() == [True, True, False, False, True, True, False, True]


def test_what_was_not_good_before_is_not_good_without_an_outage_either() -> None:
    found = drive(Outage(during=[[9.0, 10.0]]), u=[[1.0, 2.0]] * 2, valid=[True, False], rate="10 Hz")
    assert found.ok.tolist() == [True, False]
    assert (found.y == [1.0, 2.0]).all()


@pytest.mark.parametrize("during", [[[2.0, 2.0]], [[0.0, 1.0], [3.0, 2.0]]])
def test_an_outage_that_ends_before_it_begins_is_refused(during: list[list[float]]) -> None:
    with pytest.raises(ParameterError, match="during must be rows of a begin and a later end"):
        Outage(during=during)
