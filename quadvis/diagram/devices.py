"""The ports of a diagram's devices: each port has one device, and the ends of a cable have one setting."""

from __future__ import annotations

from collections.abc import Sequence

from quadvis.block import CABLE, Device, LineDevice, Output
from quadvis.diagram.draft import Draft
from quadvis.diagram.outputs import file_key
from quadvis.errors import Faults, Place


def check_devices(drafts: Sequence[Draft], faults: Faults) -> None:
    """Report ports that two devices have, and cables with unlike ends."""
    taken: dict[object, str] = {}
    cables: dict[str, LineDevice] = {}
    for draft in drafts:
        device = draft.block
        if not isinstance(device, Device):
            continue
        port, place = device.port_given, draft.places.get(device.port_parameter, draft.place)
        is_cable = port.startswith(CABLE)
        key = (port, isinstance(device, Output)) if is_cable else file_key(port)
        with faults.about(f"block '{draft.path}'"):
            if key in taken:
                ends = "; a cable has one end for an output and one for an input" if is_cable else ""
                faults.add(place, f"port '{port}' is that of block '{taken[key]}'", f"name another one{ends}")
            if is_cable and isinstance(device, LineDevice):
                _check_ends(cables.setdefault(port, device), device, place, faults)
            elif is_cable:
                faults.add(place, f"'{port}' is a cable for bytes", f"write such as {device.port_example}")
        taken.setdefault(key, draft.path)


def _check_ends(one: LineDevice, other: LineDevice, place: Place, faults: Faults) -> None:
    """Report two devices at one cable with unlike settings."""
    if str(one.settings) != str(other.settings):
        problem = f"the two ends of '{one.port_given}' are set to {one.settings} and {other.settings}"
        faults.add(place, problem, "give both one setting")
