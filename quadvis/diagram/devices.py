"""The ports of a diagram's devices: each has one, unless they share it; ends of a cable have one setting.

An input may have the port of an output: it reads what comes back there.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from quadvis.block import CABLE, Card, Device, Input, LineDevice, NewsDevice, Output
from quadvis.diagram.draft import Draft
from quadvis.errors import Faults, Place
from quadvis.machine.files import file_key
from quadvis.machine.serial_port import Line

Key = tuple[object, bool]  # what a device has for itself alone, and whether it sends there


def check_devices(drafts: Sequence[Draft], faults: Faults) -> None:
    """Report ports that two devices have, and ports with unlike ends."""
    taken: dict[Key, Draft] = {}
    ends: dict[str, LineDevice] = {}
    shared: dict[str, list[Draft]] = {}
    for draft in drafts:
        device = draft.block
        if not isinstance(device, Device):
            continue
        port, place = device.port_given, draft.places.get(device.port_parameter, draft.place)
        is_cable = port.startswith(CABLE)
        keys = list(_keys(device))
        with faults.about(f"block '{draft.path}'"):
            if device.shared and not is_cable:
                _check_shared(shared.setdefault(f"{device.shared} {port}", []), draft, place, faults)
            _check_taken(device, keys, taken, place, faults)
            if is_cable and device.shared:
                problem = f"'{port}' is a cable between two blocks of the diagram"
                faults.add(place, problem, "name a serial port, or such as udp:127.0.0.1:14550")
            elif is_cable and not (isinstance(device, LineDevice) and isinstance(device.settings, Line)):
                faults.add(place, f"'{port}' is a cable for bytes", f"write such as {device.port_example}")
            elif isinstance(device, LineDevice):
                _check_ends(ends.setdefault(port, device), device, place, faults)
        for key in keys:
            taken.setdefault(key, draft)


def _keys(device: Device) -> Iterable[Key]:
    """Return what a device has for itself alone."""
    port, sends = device.port_given, isinstance(device, Output | NewsDevice)
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
    other = next((taken[key] for key in keys if key in taken), None)
    if other is not None and not _share(device, other.block):
        ends = "; a cable has one end for an output and one for an input" if port.startswith(CABLE) else ""
        faults.add(place, f"port '{port}' is that of block '{other.path}'", f"name another one{ends}")
        return
    back = next((taken[claim, not sends] for claim, sends in keys if (claim, not sends) in taken), None)
    if back is not None and isinstance(back.block, Device) and back.block.port_given != port:
        remedy = f"write '{back.block.port_given}' in both, if the input is to read what comes back there"
        faults.add(place, f"port '{port}' is that of block '{back.path}'", remedy)


def _share(one: Device, other: object) -> bool:
    """Return whether two devices may have one port together."""
    return isinstance(other, Device) and bool(one.shared) and one.shared == other.shared


def _check_shared(drafts: list[Draft], draft: Draft, place: Place, faults: Faults) -> None:
    """Report what keeps a device from sharing the port of others, which it joins."""
    device = draft.block
    drafts.append(draft)
    first = drafts[0]
    assert isinstance(device, LineDevice) and isinstance(first.block, LineDevice)
    port = f"port '{device.port_given}' is that of block '{first.path}', too"
    if _sealer(device) != _sealer(first.block):
        faults.add(place, f"{port}, which speaks there under another name", "give both the same parameters")
    elif isinstance(device, Input) and any(isinstance(each.block, Input) for each in drafts[:-1]):
        faults.add(place, f"{port}, and two blocks would read there", "let one block read")
    elif (load := sum(_load(each.block) for each in drafts)) > 1:
        problem = f"the frames of all blocks at '{device.port_given}' take {load:.0%} of its time"
        faults.add(place, problem, "send fewer frames, or use a faster line")


def _sealer(device: LineDevice) -> object:
    return device.sealer() if isinstance(device, Output | NewsDevice) else None


def _load(device: object) -> float:
    """Return which part of the time of its line the frames of a device take, if it repeats them."""
    if not isinstance(device, Output):
        return 0.0
    sealer = device.sealer()
    count = len(device.safe_frame()) + (sealer.added if sealer is not None else 0)
    return (device.settings.time(count) + device.settings.gap) / device.interval


def _check_ends(one: LineDevice, other: LineDevice, place: Place, faults: Faults) -> None:
    """Report two devices at one cable or port with unlike settings."""
    if str(one.settings) != str(other.settings):
        problem = f"the two ends of '{one.port_given}' are set to {one.settings} and {other.settings}"
        faults.add(place, problem, "give both one setting")
