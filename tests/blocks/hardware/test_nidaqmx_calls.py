"""The names, arguments and numbers of nidaqmx that are in use are those of the package."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Any

import nidaqmx
import nidaqmx.constants
import nidaqmx.errors
import pytest
from nidaqmx.task import collections

from quadvis.block import PortError
from quadvis_blocks.hardware.adc_in import AdcIn
from quadvis_blocks.hardware.dac_out import DacOut
from tests.blocks.hardware.cards import standing_in

KINDS = {
    "AOChannelCollection": ("add_ao_voltage_chan", "add_ao_current_chan"),
    "AIChannelCollection": ("add_ai_voltage_chan",),
    "DOChannelCollection": ("add_do_chan",),
    "DIChannelCollection": ("add_di_chan",),
    "CIChannelCollection": ("add_ci_ang_encoder_chan",),
}


def arguments(function: Any) -> list[str]:
    """Return the names of the arguments of a function, in their order."""
    return [*inspect.signature(function).parameters]


def test_the_stand_in_has_the_calls_of_the_package(tmp_path: Path) -> None:
    theirs = {"Task": nidaqmx.Task, **{name: getattr(collections, name) for name in KINDS}}
    wanted = {"Task": ("start", "write", "read", "close"), **KINDS}
    found = {
        (kind, name): arguments(getattr(theirs[kind], name))
        for kind, names in wanted.items()
        for name in names
    }
    numbers = {
        (kind.__name__, member.name): member.value
        for kind in (
            nidaqmx.constants.TerminalConfiguration,
            nidaqmx.constants.EncoderType,
            nidaqmx.constants.AngleUnits,
        )
        for member in kind
    }
    attributes = {name for name in dir(nidaqmx.Task) if name.endswith("_channels")}
    with standing_in(tmp_path):
        import nidaqmx as stand_in

        assert stand_in.Task is not theirs["Task"]
        task = stand_in.Task()
        assert {name for name in vars(task) if name.endswith("_channels")} <= attributes
        for (kind, name), names in found.items():
            ours = arguments(getattr(type(task) if kind == "Task" else type(task.ao_channels), name))
            if name == "read":
                names.remove("number_of_samples_per_channel")  # which the block leaves as it is
            assert [each for each in names if each in ours] == ours, (kind, name)
        constants: Any = stand_in.constants
        for kind in (constants.TerminalConfiguration, constants.EncoderType, constants.AngleUnits):
            assert all(numbers[kind.__name__, member.name] == member.value for member in kind)


def has_driver() -> bool:
    """Return whether NI-DAQmx is installed."""
    try:
        nidaqmx.Task().close()
    except nidaqmx.errors.Error:
        return False
    return True


@pytest.mark.skipif(has_driver(), reason="NI-DAQmx is installed")
def test_where_ni_daqmx_is_missing_the_package_says_so() -> None:
    ends = {"lowest": [0.0], "highest": [5.0], "initial": [0.0], "safe": [0.0]}
    for made in (
        DacOut(port="nidaqmx:Dev1", channels=[1], ranges=[0], **ends),
        AdcIn(port="nidaqmx:Dev1", channels=[1], ranges=[5.0]),
    ):
        assert made.missing() == ""
        with pytest.raises(PortError, match=r"Could not find an installation of NI-DAQmx\. Please ensure"):
            made.settings.open(made.port_given)
