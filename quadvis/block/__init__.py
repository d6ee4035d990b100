"""The contract of blocks: all names that the author of a block imports."""

from quadvis.block.block import OWN_MODULES, Block
from quadvis.block.captured_input import CapturedInput, SourceRecord
from quadvis.block.declare import (
    Declared,
    Derived,
    FixedInput,
    In,
    Initial,
    Out,
    Param,
    ParameterError,
    Random,
    Safe,
    State,
    Work,
    entry_name,
)
from quadvis.block.device import CABLE, Device, LineDevice
from quadvis.block.elements import all_finite, clip, copied, element, inward, saturated, zeros_like
from quadvis.block.input import Counted, Input
from quadvis.block.instants import INSTANT, passed, reached
from quadvis.block.interface import METHODS, OUTSIDE, TAGS, Interface
from quadvis.block.news import NewsDevice, NewsOutput
from quadvis.block.output import Output, Sealer
from quadvis.block.random import fill_normal, fill_uniform, normal, normal_like, random_signs, uniform
from quadvis.block.signals import ANY, NO_FRAME, SCALARS, Frame, Shape, SignalType, Sizes
from quadvis.block.sizes import parameter_sizes, units_of
from quadvis.block.unlike import unlike_sizes
from quadvis.errors import OutOfRange
from quadvis.machine.capture import CaptureRequest
from quadvis.machine.ports import Card, ChannelError, OpenPort, PortError, PortSettings, Waiting
from quadvis.machine.serial_port import Line

__all__ = [
    "ANY", "CABLE", "INSTANT", "METHODS", "NO_FRAME", "OUTSIDE", "OWN_MODULES", "SCALARS", "TAGS", "Block",
    "CaptureRequest", "CapturedInput", "Card", "ChannelError", "Counted", "Declared", "Derived", "Device",
    "FixedInput", "Frame", "In", "Initial", "Input", "Interface", "Line", "LineDevice", "NewsDevice",
    "NewsOutput", "OpenPort", "Out", "OutOfRange", "Output", "Param", "ParameterError", "PortError",
    "PortSettings", "Random", "Safe", "Sealer", "Shape", "SignalType", "Sizes", "SourceRecord", "State",
    "Waiting", "Work", "all_finite", "clip", "copied", "element", "entry_name", "fill_normal",
    "fill_uniform", "inward", "normal", "normal_like", "parameter_sizes", "passed", "random_signs",
    "reached", "saturated", "uniform",
    "units_of", "unlike_sizes", "zeros_like",
]  # fmt: skip
