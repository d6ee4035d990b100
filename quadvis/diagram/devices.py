"""The ports of a diagram's devices: each port has one device, and the ends of a cable have one setting."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from quadvis.block import CABLE, Device, LineDevice, Output
from quadvis.diagram.draft import Draft
from quadvis.errors import Faults, Place
from quadvis.machine.files import file_key
from quadvis.machine.serial_port import Line


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
        keys = list(_keys(device))
        with faults.about(f"block '{draft.path}'"):
            if other := next((taken[key] for key in keys if key in taken), ""):
                ends = "; a cable has one end for an output and one for an input" if is_cable else ""
                faults.add(place, f"port '{port}' is that of block '{other}'", f"name another one{ends}")
            if is_cable and isinstance(device, LineDevice) and isinstance(device.settings, Line):
                _check_ends(cables.setdefault(port, device), device, place, faults)
            elif is_cable:
                faults.add(place, f"'{port}' is a cable for bytes", f"write such as {device.port_example}")
        for key in keys:
            taken.setdefault(key, draft.path)


def _keys(device: Device) -> Iterable[object]:
    """Return what a device has for itself alone."""
    port = device.port_given
    if port.startswith(CABLE):
        return [(port, isinstance(device, Output))]
    return device.settings.claims(port) if isinstance(device, LineDevice) else [file_key(port)]


def _check_ends(one: LineDevice, other: LineDevice, place: Place, faults: Faults) -> None:
    """Report two devices at one cable with unlike settings."""
    if str(one.settings) != str(other.settings):
        problem = f"the two ends of '{one.port_given}' are set to {one.settings} and {other.settings}"
        faults.add(place, problem, "give both one setting")
