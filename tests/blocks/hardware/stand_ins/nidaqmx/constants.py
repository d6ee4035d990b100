"""The constants of nidaqmx that are in use."""

from enum import Enum


class TerminalConfiguration(Enum):
    """How an analog input is wired."""

    RSE = 10083
    DIFF = 10106


class EncoderType(Enum):
    """How an encoder is counted."""

    X_4 = 10092


class AngleUnits(Enum):
    """What an encoder gives."""

    TICKS = 10304
