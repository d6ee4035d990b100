"""When the blocks of a part run: the condition of an enabled, triggered or resettable part."""

from __future__ import annotations

from quadvis.block import Block, In, Out, Param, State
from quadvis_blocks._edges import NAMES, fires

HELD, RESET = range(2)
NEVER = 3  # in the place of an edge
NAMES_OR_NEVER = (*NAMES[:3], "never")


class RunCondition(Block):
    """When the blocks run that name it under ``condition``: those of a part with ``when`` or ``triggered``.

    They run while ``active`` is true; otherwise their states stand still and their outputs stay as they are.
    While ``restart`` is true, their states are set back to their initial values before they run. True at the
    start is no edge. In a part inside of another one, the two inputs ``around`` say when that one runs.
    """

    states = Param("held", choices=("held", "reset"), doc="what enabling does to the states")
    outputs = Param("held", choices=("held", "reset"), doc="what the outputs are while it is disabled")
    trigger_on = Param("never", choices=NAMES_OR_NEVER, doc="at which edges of ``trigger`` they run")
    reset_on = Param("never", choices=NAMES_OR_NEVER, doc="which edges of ``reset`` set the states back")
    when = In("bool", default=True, doc="whether the part is enabled")
    trigger = In("bool", default=False, doc="the blocks run at its edges only")
    reset = In("bool", default=False, doc="sets the states back at an edge, enabled or not")
    around_enabled = In("bool", default=True, doc="whether the part around it is enabled")
    around_active = In("bool", default=True, doc="whether the part around it runs now")
    enabled = Out("bool", doc="whether it is enabled")
    active = Out("bool", doc="whether the blocks run now")
    restart = Out("bool", doc="whether the states are set back now")
    shown = Out("bool", doc="whether the outputs are those of the blocks, not their initial values")
    was_enabled = State("bool")
    ran = State("bool", doc="whether the blocks have ever run")
    last_trigger = State("bool")
    last_reset = State("bool")
    seen = State("bool", doc="whether there were such values")
    fixed = State("bool", doc="whether it stays as it is, for an analysis at an operating point")
    stepwise = True

    example = """
        wave: {block: sources.sine, rate: fast, with: {amplitude: 2 m, frequency: 1 Hz}}
        high: {block: logic.compare, rate: fast, with: {operator: ">"}, in: {a: wave.y, b: 1 m}}
        runs: {block: logic.run_condition, rate: fast, with: {states: reset}, in: {when: high.y}}
        path: {block: signal.discrete_integrator, rate: fast, condition: runs, in: {u: wave.y}}
    """

    def picture_lines(self) -> tuple[str, ...]:
        """Return the choices that are not the usual ones."""
        lines = [f"runs at {NAMES_OR_NEVER[self.trigger_on]} edges"] if self.trigger_on != NEVER else []
        lines += [f"set back at {NAMES_OR_NEVER[self.reset_on]} edges"] if self.reset_on != NEVER else []
        lines += ["states set back when enabled"] if self.states == RESET else []
        lines += ["initial outputs while disabled"] if self.outputs == RESET else []
        return tuple(lines)

    def output(
        self, when: bool, trigger: bool, reset: bool, around_enabled: bool, around_active: bool
    ) -> tuple[bool, bool, bool, bool]:
        """Return whether it is enabled, runs, sets its states back, and shows its outputs."""
        if self.fixed:
            enabled = self.was_enabled
            active = enabled and self.trigger_on == NEVER
            restart = False
        else:
            enabled = _enabled(when, around_enabled, around_active, self.was_enabled)
            fired = _fired(self.trigger_on, trigger, self.last_trigger, self.seen)
            active = around_active and enabled and fired
            renewed = self.states == RESET and enabled and not self.was_enabled
            cleared = self.reset_on != NEVER and fires(self.reset_on, reset, self.last_reset, self.seen)
            restart = around_active and (renewed or cleared)
        shown = (self.ran or active) and (enabled or self.outputs == HELD)
        return enabled, active, restart, shown

    def update(
        self, when: bool, trigger: bool, reset: bool, around_enabled: bool, around_active: bool
    ) -> None:
        """Keep what was."""
        if self.fixed:
            return
        enabled = _enabled(when, around_enabled, around_active, self.was_enabled)
        if around_active:
            fired = _fired(self.trigger_on, trigger, self.last_trigger, self.seen)
            self.ran = self.ran or (enabled and fired)
            self.last_trigger = trigger
            self.last_reset = reset
            self.seen = True
        self.was_enabled = enabled


def _enabled(when: bool, around_enabled: bool, around_active: bool, before: bool) -> bool:
    """Return whether a part is enabled; between two triggers of the part around it nothing changes."""
    return when if around_active else before and around_enabled


def _fired(edge: int, now: bool, before: bool, seen: bool) -> bool:
    """Return whether the trigger has come, or there is none."""
    return True if edge == NEVER else fires(edge, now, before, seen)
