"""What the inputs of radio control have in common: the link to the pilot, and commands from channels."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, ClassVar

import numpy as np

from quadvis.block import Counted, Input, Out, Param, ParameterError, passed
from quadvis_blocks.hardware._counts import CHANNELS, LONGEST, SHORTEST, width_of
from quadvis_blocks.hardware._loss import ON_LOSS_DOC, ROLES_DOC, loss_doubts, loss_values
from quadvis_blocks.hardware._pulses import check_channels

IN_A_ROW = 5  # valid frames before a link counts as good
MARGIN = 0.05  # of the range, beyond its ends; a channel farther out was spoilt on its way


class RadioLink:
    """Whether the link to a pilot is good: lost after a silence, good again after some frames in a row."""

    def __init__(self, lost_after: float) -> None:
        self._lost_after = lost_after
        self.good = self.heard = False
        self._row, self._last = 0, -math.inf

    def silence(self, time: float) -> None:
        """Take the time (s) before the frames that have come by then."""
        if passed(time - self._last, self._lost_after):
            self.lose()

    def frame(self, time: float) -> bool:
        """Take a valid frame; return whether it counts."""
        self._last = time
        self._row += 1
        if self._row >= IN_A_ROW:
            self.good = self.heard = True
        return self.good

    def spoilt(self) -> None:
        """Take a frame that is not valid: it ends a row, and does not renew the link."""
        self._row = IN_A_ROW if self.good else 0

    def lose(self) -> None:
        """Lose the link now."""
        self.good, self._row = False, 0


class ReceiverInput(Input):
    """Commands of a pilot from 16 channels, the newest valid frame at each step.

    987.5 to 2011.875 us (172 to 1811 on the wire) is ``lowest`` to ``highest`` of a command. A frame in which
    one of the ``channels`` is more than 5 % beyond these ends is refused and does not renew ``age``: around a
    failsafe some receivers send zeros without any flag (ardupilot #9400). Between the last valid frame and
    ``lost_after`` the command stays as it is; then the link is lost, and each element becomes what
    ``on_loss`` or its role says. So it is at the start, too. A link is good after 5 valid frames in a row.

    A subclass finds the counts of whole frames, see `frames`, and may have outputs of its own, see `more`.
    ``begin`` is a byte with which a frame begins: a datagram is whole, as if another one followed it.
    """

    begin: ClassVar[int]

    channels = Param(type="int64[n]", min=1, doc="channel of each element, from 1")
    lowest = Param(type="float64[n]", unit="a", doc="command of the shortest pulse, for each element")
    highest = Param(type="float64[n]", unit="a", doc="command of the longest pulse, for each element")
    roles = Param(type="str", doc=ROLES_DOC)
    on_loss = Param("", type="str", doc=ON_LOSS_DOC)
    lost_after = Param(0.5, unit="s", above=0.0, max=1.0, doc="silence (inclusive) until the link is lost")
    shortest = Param(SHORTEST, unit="us", min=880.0, doc="pulse of lowest; 987.5 us is 172 on the wire")
    longest = Param(LONGEST, unit="us", max=2159.375, doc="pulse of highest; 2011.875 us is 1811 on the wire")
    command = Out("float64[n]", unit="a", doc="the commands; those of a loss while the link is not good")
    good = Out("bool", doc="whether the link is good: these are the pilot's commands")
    heard = Out("bool", doc="whether the link has been good at any time of the run")

    def check(self) -> None:
        """Refuse wrong channels, pulses and words."""
        check_channels(self.channels, self.lowest, self.highest, CHANNELS)
        if self.longest <= self.shortest:
            raise ParameterError("longest", "longest must be above shortest")
        loss_values(self.roles, self.on_loss, self.lowest, self.highest)

    def doubts(self) -> list[ParameterError]:
        """Warn of a throttle that does not go to its minimum on a loss."""
        return loss_doubts(self.roles, self.on_loss, self.lowest, self.highest)

    def open(self) -> None:
        """Open the port; the link is not good yet."""
        super().open()
        self._link, self._now = RadioLink(self.lost_after), 0.0
        self._loss = loss_values(self.roles, self.on_loss, self.lowest, self.highest)
        self._places = self.channels - 1

    def read(self, time: float) -> None:
        """Take all frames that have come."""
        self._now = time
        self._link.silence(time)
        super().read(time)

    def decode(self, received: bytearray) -> Iterator[Any]:
        """Take whole frames off the beginning, and judge them."""
        if self._port.whole:
            received.append(self.begin)
        for found in self.frames(received):
            yield self._refused(found) if isinstance(found, Counted) else self._judged(found)

    def frames(self, received: bytearray) -> Iterator[Sequence[int] | Counted]:
        """Take whole frames off the beginning of ``received``; yield the counts of each, or `Counted`."""
        raise NotImplementedError

    def more(self) -> tuple[Any, ...]:
        """Return the subclass's own outputs."""
        return ()

    def valid(self, counts: Sequence[int]) -> bool:
        """Return whether all channels in use lie in their range."""
        widths, beyond = self._used(counts), MARGIN * (self.longest - self.shortest)
        return bool(((widths >= self.shortest - beyond) & (widths <= self.longest + beyond)).all())

    def output(self) -> Any:
        """Return age, counts, the commands, and how the link is."""
        age, lost, refused, command = super().output()[:4]
        link = self._link
        if not link.good:
            command = self._loss.after(command if link.heard else None)
        return age, lost, refused, command, link.good, link.heard, *self.more()

    def _used(self, counts: Sequence[int]) -> Any:
        return width_of(np.array(counts)[self._places])

    def _refused(self, counted: Counted) -> Counted:
        self._link.spoilt()
        return counted

    def _judged(self, counts: Sequence[int]) -> Any:
        if not self.valid(counts):
            return self._refused(Counted.REFUSED)
        if self._late:  # from before a pause: it says nothing of the link now
            return Counted.LOST
        if not self._link.frame(self._now):
            return Counted.LOST
        shares = (self._used(counts) - self.shortest) / (self.longest - self.shortest)
        command = self.lowest + shares * (self.highest - self.lowest)
        return command, self._link.good, self._link.heard, *self.more()
