"""The contract of blocks: all names that the author of a block imports."""

from quadvis.block.block import METHODS, OUTSIDE, OWN_MODULES, TAGS, Block, Interface, units_of
from quadvis.block.declare import Declared, Derived, In, Out, Param, ParameterError, Random, Safe, State, Work
from quadvis.block.elements import all_finite, clip, copied, inward, saturated, zeros_like
from quadvis.block.instants import INSTANT, passed, reached
from quadvis.block.random import fill_normal, fill_uniform, normal, normal_like, random_signs, uniform
from quadvis.block.signals import NO_FRAME, SCALARS, Frame, Shape, SignalType, Sizes

__all__ = [
    "INSTANT", "METHODS", "NO_FRAME", "OUTSIDE", "OWN_MODULES", "SCALARS", "TAGS", "Block", "Declared",
    "Derived", "Frame", "In", "Interface", "Out", "Param", "ParameterError", "Random", "Safe", "Shape",
    "SignalType", "Sizes", "State", "Work", "all_finite", "clip", "copied", "fill_normal", "fill_uniform",
    "inward", "normal", "normal_like", "passed", "random_signs", "reached", "saturated", "uniform",
    "units_of", "zeros_like",
]  # fmt: skip
