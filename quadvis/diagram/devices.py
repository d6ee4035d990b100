"""The ports of a diagram's devices: each has one, unless they share it; ends of a cable have one setting."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from quadvis.block import CABLE, Block, Card, Device, Input, LineDevice, NewsDevice, Output
from quadvis.diagram.draft import Draft
from quadvis.diagram.sections.computers import Computers
from quadvis.errors import Faults, Place, known
from quadvis.machine.files import file_key
from quadvis.machine.serial_port import Line

Key = tuple[object, bool]  # what a device has for itself, and whether it sends there


def check_devices(drafts: Sequence[Draft], faults: Faults) -> None:
    """Report ports that two devices have, and cables with unlike ends."""
    taken: dict[Key, Draft] = {}
    users: dict[str, list[Draft]] = {}
    for draft in drafts:
        device = draft.block
        if not isinstance(device, Device):
            continue
        place = draft.places.get(device.port_parameter, draft.place)
        others = users.setdefault(device.port_given, [])
        with faults.about(f"block '{draft.path}'"):
            if device.port_given.startswith(CABLE):
                _check_cable(device, others, taken, place, faults)
            elif others and all(_share(device, other.block) for other in others):
                _check_shared(others, draft, place, faults)
            else:
                _check_taken(device, taken, place, faults)
        others.append(draft)
        for key in _keys(device):
            taken.setdefault(key, draft)


def check_losses(computers: Computers, drafts: Sequence[Draft], faults: Faults) -> None:
    """Report computers whose loss the others are to survive, though outputs would be without their values."""
    for draft in drafts:
        spec = computers.get(draft.computer) if known(draft.computer) else None
        if spec is None or not known(spec) or not spec.is_dispensable or not commands(draft.block):
            continue
        problem = f"the outputs of block '{draft.path}' are on the computer '{draft.computer}'"
        faults.add(
            spec.place, f"{problem}, so nothing can continue without it", "leave out 'on_loss: continue'"
        )


def commands(block: object) -> bool:
    """Return whether a block has outputs for which the loss of its computer is unsafe."""
    if not isinstance(block, Block) or block.harmless:
        return False
    return "write" in block.interface.arguments or type(block).write_safe is not Block.write_safe


def _sends(device: Device) -> bool:
    return isinstance(device, Output | NewsDevice) and not isinstance(device, Input)


def _keys(device: Device) -> Iterable[Key]:
    """Return what a device has for itself alone."""
    port, sends = device.port_given, _sends(device)
    if port.startswith(CABLE):
        return [(port, sends)]
    if not isinstance(device, LineDevice):
        return [(file_key(port), sends)]
    return [(claim, sends) for claim in device.settings.claims(port)]


def _check_cable(
    device: Device, others: Sequence[Draft], taken: dict[Key, Draft], place: Place, faults: Faults
) -> None:
    """Report what is no end of a cable, an end that two devices have, and ends with unlike settings."""
    port = device.port_given
    if device.shared:
        problem = f"'{port}' is a cable between two blocks of the diagram"
        faults.add(place, problem, "name a serial port, or such as udp:127.0.0.1:14550")
        return
    if not (isinstance(device, LineDevice) and isinstance(device.settings, Line)):
        faults.add(place, f"'{port}' is a cable for bytes", f"write such as {device.port_example}")
        return
    _check_taken(device, taken, place, faults)
    for other in others[:1]:
        if isinstance(other.block, LineDevice) and str(other.block.settings) != str(device.settings):
            problem = f"the two ends of '{port}' are set to {other.block.settings} and {device.settings}"
            faults.add(place, problem, "give both one setting")


def _check_taken(device: Device, taken: dict[Key, Draft], place: Place, faults: Faults) -> None:
    """Report that another device has the port, perhaps under another name."""
    port, keys = device.port_given, list(_keys(device))
    is_cable = port.startswith(CABLE)
    if other := next((taken[key] for key in keys if key in taken), None):
        ends = "; a cable has one end for an output and one for an input" if is_cable else ""
        faults.add(place, f"port '{port}' is that of block '{other.path}'", f"name another one{ends}")
        return
    back = next((taken[claim, not sends] for claim, sends in keys if (claim, not sends) in taken), None)
    if back is not None and not is_cable:
        assert isinstance(back.block, Device)
        remedy = f"write '{back.block.port_given}' in both, if one is to read what comes back to the other"
        faults.add(place, f"port '{port}' is that of block '{back.path}'", remedy)


def _share(one: Device, other: object) -> bool:
    """Return whether two devices may have a port together: by one word, or one sends and the other reads."""
    if not (isinstance(one, LineDevice) and isinstance(other, LineDevice)):
        return False
    if isinstance(one.settings, Card) or isinstance(other.settings, Card):
        return False
    if one.shared or other.shared:
        return one.shared == other.shared
    return _sends(one) != _sends(other)


def _check_shared(others: Sequence[Draft], draft: Draft, place: Place, faults: Faults) -> None:
    """Report what keeps a device from sharing the port of others, which it joins."""
    device, first = draft.block, others[0]
    assert isinstance(device, LineDevice) and isinstance(first.block, LineDevice)
    port = f"port '{device.port_given}' is that of block '{first.path}', too"
    blocks = [each.block for each in (*others, draft)]
    sealers = [block.sealer() for block in blocks if isinstance(block, Output | NewsDevice)]
    if str(device.settings) != str(first.block.settings):
        faults.add(place, f"{port}, which sets it to {first.block.settings}", "give both one setting")
    elif any(sealer != sealers[0] for sealer in sealers):
        faults.add(place, f"{port}, which speaks there under another name", "give both the same parameters")
    elif isinstance(device, Input) and any(isinstance(each.block, Input) for each in others):
        faults.add(place, f"{port}, and two blocks would read there", "let one block read")
    elif (load := sum(map(_load, blocks))) > 1:
        problem = f"the frames of all blocks at '{device.port_given}' take {load:.0%} of its time"
        faults.add(place, problem, "send fewer frames, or use a faster line")


def _load(device: object) -> float:
    """Return which part of the time of its line the frames of a device take, if it repeats them."""
    if not isinstance(device, Output):
        return 0.0
    sealer = device.sealer()
    count = len(device.safe_frame()) + (sealer.added if sealer is not None else 0)
    return (device.settings.time(count) + device.settings.gap) / device.interval
