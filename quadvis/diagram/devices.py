"""The ports of a diagram's devices: each port has one device, and the ends of a cable have one setting.

An input may have the port of an output: it reads what comes back there.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from quadvis.block import CABLE, Card, Device, LineDevice, Output
from quadvis.diagram.draft import Draft
from quadvis.errors import Faults, Place
from quadvis.machine.files import file_key
from quadvis.machine.serial_port import Line

Key = tuple[object, bool]  # what a device has for itself alone, and whether it sends there


def check_devices(drafts: Sequence[Draft], faults: Faults) -> None:
    """Report ports that two devices have, and ports with unlike ends."""
    taken: dict[Key, Draft] = {}
    ends: dict[str, LineDevice] = {}
    for draft in drafts:
        device = draft.block
        if not isinstance(device, Device):
            continue
        port, place = device.port_given, draft.places.get(device.port_parameter, draft.place)
        is_cable = port.startswith(CABLE)
        keys = list(_keys(device))
        with faults.about(f"block '{draft.path}'"):
            _check_taken(device, keys, taken, place, faults)
            if is_cable and not (isinstance(device, LineDevice) and isinstance(device.settings, Line)):
                faults.add(place, f"'{port}' is a cable for bytes", f"write such as {device.port_example}")
            elif isinstance(device, LineDevice):
                _check_ends(ends.setdefault(port, device), device, place, faults)
        for key in keys:
            taken.setdefault(key, draft)


def _keys(device: Device) -> Iterable[Key]:
    """Return what a device has for itself alone."""
    port, sends = device.port_given, isinstance(device, Output)
    if port.startswith(CABLE):
        return [(port, sends)]
    if not isinstance(device, LineDevice):
        return [(file_key(port), sends)]
    return [(claim, sends or isinstance(device.settings, Card)) for claim in device.settings.claims(port)]


def _check_taken(
    device: Device, keys: Sequence[Key], taken: dict[Key, Draft], place: Place, faults: Faults
) -> None:
    """Report that another device has the port, or has it under another name."""
    port = device.port_given
    if other := next((taken[key] for key in keys if key in taken), None):
        ends = "; a cable has one end for an output and one for an input" if port.startswith(CABLE) else ""
        faults.add(place, f"port '{port}' is that of block '{other.path}'", f"name another one{ends}")
        return
    back = next((taken[claim, not sends] for claim, sends in keys if (claim, not sends) in taken), None)
    if back is not None and isinstance(back.block, Device) and back.block.port_given != port:
        remedy = f"write '{back.block.port_given}' in both, if the input is to read what comes back there"
        faults.add(place, f"port '{port}' is that of block '{back.path}'", remedy)


def _check_ends(one: LineDevice, other: LineDevice, place: Place, faults: Faults) -> None:
    """Report two devices at one cable or port with unlike settings."""
    if str(one.settings) != str(other.settings):
        problem = f"the two ends of '{one.port_given}' are set to {one.settings} and {other.settings}"
        faults.add(place, problem, "give both one setting")
