"""Joysticks are known by lasting names."""

from __future__ import annotations

from pathlib import Path

import pytest

from quadvis.machine.ports import PortError
from quadvis_blocks.hardware._joysticks import identity_of, joysticks, lasting_name, missing, node_of
from tests.blocks.hardware.events import Folders

BY_ID, BY_PATH = "by-id/usb-freedom-event-joystick", "by-path/pci-1-event-joystick"


@pytest.fixture
def folders(tmp_path: Path) -> Folders:
    made = Folders(tmp_path)
    made.add(0, "AT keyboard", stick=False)
    made.add(
        10,
        "Logitech Freedom",
        uniq="A1",
        links=(BY_ID, BY_PATH),
    )
    return made


def path(folders: Folders, link: str) -> str:
    return f"{folders.system}/dev/input/{link}"


def test_a_joystick_has_its_names_and_a_keyboard_is_none(folders: Folders) -> None:
    (found,) = joysticks(folders.system)
    assert found.node == str(folders.node(10)) and found.title == "Logitech Freedom"
    assert found.names == (
        path(folders, BY_ID),
        path(folders, BY_PATH),
    )
    assert found.identity == ("0003", "046d", "c216", "Logitech Freedom", "A1")
    assert identity_of(found.names[0], folders.system) == found.identity


def test_a_number_stands_for_the_only_joystick_and_no_other(folders: Folders) -> None:
    system, lasting = folders.system, path(folders, BY_ID)
    assert lasting_name("10", system) == lasting_name(str(folders.node(10)), system) == lasting
    assert "is missing; plug it in, or give the path of another one, such as" in missing("3", system)
    folders.add(11, "Radiomaster Boxer")
    for device in ("10", str(folders.node(11))):
        with pytest.raises(PortError, match=r"after each start: there are 2; name one of .*Boxer"):
            lasting_name(device, system)
        assert "there are 2" in missing(device, system)
    assert lasting_name(lasting, system) == lasting and missing(lasting, system) == ""


def test_a_name_that_it_gives_itself_will_do_if_it_is_the_only_one(folders: Folders) -> None:
    system = folders.system
    folders.add(11, "Radiomaster Boxer")
    assert node_of("name:Radiomaster Boxer", system) == str(folders.node(11))
    folders.remove(11)
    with pytest.raises(PortError, match="joystick 'name:Radiomaster Boxer' is missing; plug it in"):
        node_of("name:Radiomaster Boxer", system)
    folders.add(3, "Radiomaster Boxer")
    assert node_of("name:Radiomaster Boxer", system) == str(folders.node(3))
    folders.add(4, "Radiomaster Boxer", links=("by-path/pci-2-event-joystick",))
    with pytest.raises(PortError, match=r"of 2 joysticks; name one by its place, .*by-path/pci-2"):
        node_of("name:Radiomaster Boxer", system)


def test_twins_are_told_apart_by_their_places_alone(folders: Folders) -> None:
    system, one = folders.system, path(folders, BY_ID)
    folders.add(11, "Logitech Freedom", uniq="A1", links=("by-path/pci-2-event-joystick",))
    with pytest.raises(PortError, match=r"of 2 joysticks; name one by its place, .*pci-1.* or .*pci-2"):
        lasting_name(one, system)
    assert "name one by its place" in missing(one, system)
    assert missing(path(folders, "by-path/pci-2-event-joystick"), system) == ""
