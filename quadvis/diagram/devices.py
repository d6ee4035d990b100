"""The ports of a diagram's devices: each has one, unless they share it; ends of a cable have one setting."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from quadvis.block import CABLE, Device, Input, LineDevice, NewsDevice, Output
from quadvis.diagram.draft import Draft
from quadvis.errors import Faults, Place
from quadvis.machine.files import file_key
from quadvis.machine.serial_port import Line


def check_devices(drafts: Sequence[Draft], faults: Faults) -> None:
    """Report ports that two devices have, and cables with unlike ends."""
    taken: dict[object, Draft] = {}
    shared: dict[str, list[Draft]] = {}
    cables: dict[str, LineDevice] = {}
    for draft in drafts:
        device = draft.block
        if not isinstance(device, Device):
            continue
        port, place = device.port_given, draft.places.get(device.port_parameter, draft.place)
        is_cable = port.startswith(CABLE)
        keys = list(_keys(device))
        with faults.about(f"block '{draft.path}'"):
            other = next((taken[key] for key in keys if key in taken), None)
            if other is not None and _share(device, other.block):
                _check_shared(shared.setdefault(port, [other]), draft, place, faults)
            elif other is not None:
                ends = "; a cable has one end for an output and one for an input" if is_cable else ""
                problem = f"port '{port}' is that of block '{other.path}'"
                faults.add(place, problem, f"name another one{ends}")
            if is_cable and device.shared:
                problem = f"'{port}' is a cable between two blocks of the diagram"
                faults.add(place, problem, "name a serial port, or such as udp:127.0.0.1:14550")
            elif is_cable and isinstance(device, LineDevice) and isinstance(device.settings, Line):
                _check_ends(cables.setdefault(port, device), device, place, faults)
            elif is_cable:
                faults.add(place, f"'{port}' is a cable for bytes", f"write such as {device.port_example}")
        for key in keys:
            taken.setdefault(key, draft)


def _keys(device: Device) -> Iterable[object]:
    """Return what a device has for itself alone."""
    port = device.port_given
    if port.startswith(CABLE):
        return [(port, isinstance(device, Output))]
    return device.settings.claims(port) if isinstance(device, LineDevice) else [file_key(port)]


def _share(one: Device, other: object) -> bool:
    """Return whether two devices may have one port together."""
    return isinstance(other, Device) and bool(one.shared) and one.shared == other.shared


def _check_shared(drafts: list[Draft], draft: Draft, place: Place, faults: Faults) -> None:
    """Report what keeps a device from sharing the port of others, which it joins."""
    device, first = draft.block, drafts[0]
    assert isinstance(device, LineDevice) and isinstance(first.block, LineDevice)
    port = f"port '{device.port_given}' is that of block '{first.path}', too"
    drafts.append(draft)
    if str(device.settings) != str(first.block.settings):
        faults.add(place, f"{port}, which sets it to {first.block.settings}", "give both one setting")
    elif _sealer(device) != _sealer(first.block):
        faults.add(place, f"{port}, which speaks there under another name", "give both the same parameters")
    elif isinstance(device, Input) and any(isinstance(each.block, Input) for each in drafts[:-1]):
        faults.add(place, f"{port}, and two blocks would read there", "let one block read")
    elif (load := sum(_load(each.block) for each in drafts)) > 1:
        faults.add(place, f"the frames of all blocks at '{device.port_given}' take {load:.0%} of its time",
                   "send fewer frames, or use a faster line")  # fmt: skip


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
    """Report two devices at one cable with unlike settings."""
    if str(one.settings) != str(other.settings):
        problem = f"the two ends of '{one.port_given}' are set to {one.settings} and {other.settings}"
        faults.add(place, problem, "give both one setting")
