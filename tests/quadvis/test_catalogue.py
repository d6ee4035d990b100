import subprocess
import sys
from importlib.metadata import entry_points
from pathlib import Path

import pytest

from quadvis.library.catalogue import Catalogue, CatalogueError
from quadvis.library.libraries import GROUP, registered_libraries

FAN = '''"""A fan."""
from quadvis.block import Block, Out

class Fan(Block):
    """Turns."""
    y = Out(doc="speed")
    def output(self):
        return 1.0
'''


def own(folder: Path, **files: str) -> Catalogue:
    """Return a catalogue for a diagram in a folder with blocks of its own: wind__fan is wind/fan.py."""
    for name, text in files.items():
        path = folder.joinpath("blocks", *name.split("__")).with_suffix(".py")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return Catalogue(folder)


def refusal(name: str) -> str:
    """Return what the catalogue says about a name that it refuses."""
    with pytest.raises(CatalogueError) as caught:
        Catalogue().find(name)
    return str(caught.value)


@pytest.fixture
def library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An installed distribution `acme` that offers a library of that name with the block `wind.fan`."""
    for name, text in {
        "acme_blocks/__init__.py": '"""Blocks."""',
        "acme_blocks/wind/__init__.py": '"""Wind."""',
        "acme_blocks/wind/fan.py": FAN,
        "acme_blocks/wind/_shared.py": "",
        "acme-1.0.dist-info/METADATA": "Name: acme\nVersion: 1.0\n",
        "acme-1.0.dist-info/entry_points.txt": "[quadvis.libraries]\nacme = acme_blocks\n",
    }.items():
        path = tmp_path / "site" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    monkeypatch.syspath_prepend(str(tmp_path / "site"))
    yield tmp_path / "site"
    for name in [name for name in sys.modules if name.startswith("acme_blocks")]:
        del sys.modules[name]


def test_a_name_leads_to_the_class_of_that_module() -> None:
    found = Catalogue().find("signal.unit_delay")
    assert (found.__name__, found.__module__) == ("UnitDelay", "quadvis_blocks.signal.unit_delay")


def test_all_names_can_be_found_and_none_is_shared_mathematics() -> None:
    catalogue = Catalogue()
    names = catalogue.names()
    assert {"signal.gain", "plant.rotorcraft", "vision.circle_detector"} <= set(names)
    assert len(names) == len(set(names)) and not any(
        part.startswith("_") for name in names for part in name.split(".")
    )
    assert all(catalogue.find(name).interface for name in names)


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("signal.derivativ", "there is no block 'signal.derivativ'; did you mean 'signal.derivative'?"),
        ("gain", "there is no block 'gain'; did you mean 'signal.gain'?"),
        ("signal", "there is no block 'signal'; "),
        ("signal.gain.more", "there is no block 'signal.gain.more'; "),
        ("no.such.thing_at_all", "there is no block 'no.such.thing_at_all'; quadvis list shows all"),
        ("signal._elements", "'signal._elements' is not a block name; "),
        ("_", "'_' is not a block name; write group.block, such as signal.derivative"),
        ("TransferFcn", "'TransferFcn' is not a block name; did you mean 'systems.transfer_function'?"),
        ("../../etc/passwd", "'../../etc/passwd' is not a block name; "),
        ("Signal.Gain", "'Signal.Gain' is not a block name; "),
        ("", "'' is not a block name; "),
        ("acmee:fan", "there is no library 'acmee'"),
    ],
)
def test_a_wrong_name_gets_a_sentence(name: str, sentence: str) -> None:
    assert refusal(name).startswith(sentence)


def test_a_folder_beside_the_diagram_adds_blocks(tmp_path: Path) -> None:
    catalogue = own(tmp_path, wind__fan=FAN, wind___shared="", _private__fan=FAN)
    assert catalogue.find("wind.fan").__name__ == "Fan"
    assert [name for name in catalogue.names() if name not in Catalogue().names()] == ["wind.fan"]


def test_a_block_is_loaded_once(tmp_path: Path) -> None:
    catalogue = own(tmp_path, wind__fan=FAN)
    assert catalogue.find("wind.fan") is catalogue.find("wind.fan")


def test_a_block_of_ones_own_may_not_hide_one_of_the_library(tmp_path: Path) -> None:
    with pytest.raises(
        CatalogueError, match=r"'signal\.gain' is in the standard library and in .*; rename the file"
    ):
        own(tmp_path, signal__gain=FAN).find("signal.gain")


def test_the_standard_library_in_its_own_repository_is_nobodys_own(tmp_path: Path) -> None:
    catalogue = own(tmp_path, quadvis_blocks__signal__gain=FAN)
    assert catalogue.names() == Catalogue().names()


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (
            "import no_such_module_anywhere\n",
            "ModuleNotFoundError: No module named 'no_such_module_anywhere'",
        ),
        ("def fan(:\n", "SyntaxError: invalid syntax"),
        ("1 / 0\n", "ZeroDivisionError: division by zero"),
        (FAN.replace("def output(self)", "def output(self, u)"), "TypeError: Fan.output asks for 'u'"),
        ("", "must define one block, it defines none"),
        (FAN + FAN.replace("Fan", "Other"), "must define one block, it defines Fan, Other"),
    ],
)
def test_a_module_that_is_not_right_is_told_and_never_passed_over(
    tmp_path: Path, text: str, sentence: str
) -> None:
    catalogue = own(tmp_path, wind__fan=text)
    assert "wind.fan" in catalogue.names()
    for _ in range(2):
        with pytest.raises(CatalogueError, match=r"block 'wind\.fan'") as caught:
            catalogue.find("wind.fan")
        assert sentence in str(caught.value)


def test_a_second_name_of_the_block_and_a_private_base_do_no_harm(tmp_path: Path) -> None:
    text = (
        FAN.replace("class Fan(Block)", "class _Base(Block):\n    pass\n\nclass Fan(_Base)")
        + "Ventilator = Fan\n"
    )
    assert own(tmp_path, wind__fan=text).find("wind.fan").__name__ == "Fan"


def test_an_installed_library_adds_blocks_under_its_name(library: Path) -> None:
    assert Catalogue().find("acme:wind.fan").__name__ == "Fan"
    assert "acme:wind.fan" in Catalogue().names()
    assert refusal("acme:wind.fun") == "there is no block 'acme:wind.fun'; did you mean 'acme:wind.fan'?"
    assert refusal("acne:wind.fan") == "there is no library 'acne'; did you mean 'acme'?"


def test_an_installed_library_that_cannot_be_imported_is_told(library: Path) -> None:
    (library / "acme_blocks" / "wind" / "__init__.py").write_text("import no_such_module\n")
    problem = "block 'acme:wind.fan' cannot be loaded: ModuleNotFoundError: No module named 'no_such_module'"
    assert refusal("acme:wind.fan") == problem


def test_an_installed_library_without_its_package_is_told(library: Path) -> None:
    (library / "acme-1.0.dist-info" / "entry_points.txt").write_text(
        "[quadvis.libraries]\nacme = acme_gone\n"
    )
    with pytest.raises(CatalogueError, match="the library package 'acme_gone' cannot be found"):
        Catalogue().names()


def test_libraries_are_those_that_the_standard_library_finds(
    library: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (library / "acme-1.0.dist-info" / "entry_points.txt").write_text(
        "[console_scripts]\nacme = acme_blocks:main\n\n"
        "[quadvis.libraries]\n# of wind\nacme=acme_blocks [extra]\nother = other.blocks\n\n[more]\nx = y\n"
    )
    hidden = library / "later" / "acme-0.9.dist-info" / "entry_points.txt"
    hidden.parent.mkdir(parents=True)
    hidden.write_text("[quadvis.libraries]\nold = acme_old\n")
    monkeypatch.setattr(sys, "path", [*sys.path, str(library / "later")])
    found = registered_libraries()
    assert {"acme": "acme_blocks", "other": "other.blocks"}.items() <= found.items()
    assert found == {entry.name: entry.module for entry in entry_points(group=GROUP)}
    archive = library / "modules.zip"
    archive.write_bytes(b"")
    monkeypatch.setattr(sys, "path", [*sys.path, str(archive)])
    assert found == registered_libraries()


def test_looking_at_the_library_loads_none_of_the_heavy_packages() -> None:
    code = (
        "import sys; from quadvis.library.catalogue import Catalogue; c = Catalogue();"
        "[c.find(name) for name in c.names()];"
        "print([m for m in ('cv2', 'control', 'scipy', 'numba', 'matplotlib') if m in sys.modules])"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"
