"""The commands about what is there: blocks, files, cameras, machine code. Each returns the exit code."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from quadvis.cli.given import YAML, own_blocks
from quadvis.cli.shown import json_text, print_json, terminal_width, write_text
from quadvis.errors import QuadvisError, counted
from quadvis.machine.files import Kind
from quadvis.machine.shipped import PREFIX, named_file

if TYPE_CHECKING:
    from quadvis.library.catalogue import Catalogue

SCHEMA = Kind("the schema", (b"{",), rb'"\$schema"')


def list_blocks(options: argparse.Namespace) -> int:
    """Print all blocks and files that come with quadvis, or those with words; 2 if one cannot be loaded."""
    from quadvis.library.listing import lines, listed_blocks, listed_files, matching

    catalogue = _catalogue(options)
    blocks, failures = listed_blocks(catalogue)
    files = listed_files()
    if options.words:
        found = matching([*blocks, *files], options.words)
        blocks, files = [each for each in found if each in blocks], [each for each in found if each in files]
    if options.json:
        from quadvis.library.describe import facts

        print_json([facts(each.name, catalogue.find(each.name)) for each in blocks])
    else:
        parts = [lines(each, terminal_width()) for each in (blocks, files) if each]
        print("\n\n".join("\n".join(part) for part in parts))
    return _all_loaded(failures)


def describe(options: argparse.Namespace) -> int:
    """Print the declarations of a block, those of a part, or a file that comes with quadvis."""
    from quadvis.library.describe import description, facts
    from quadvis.library.shipped_files import shipped_text

    if options.block.startswith(PREFIX):
        text = shipped_text(options.block)
        if options.json:
            print_json({"file": options.block, "path": str(named_file(options.block)), "text": text})
        else:
            print(text, end="")
        return 0
    if options.block.endswith(YAML):
        from quadvis.diagram.part_description import part_description, part_facts

        if options.json:
            print_json(part_facts(options.block))
        else:
            print(part_description(options.block, terminal_width()))
        return 0
    block = _catalogue(options).find(options.block)
    if options.json:
        print_json(facts(options.block, block))
    else:
        print(description(options.block, block, terminal_width()))
    return 0


def _catalogue(options: argparse.Namespace) -> Catalogue:
    """Return the catalogue for diagrams in the working directory."""
    from quadvis.library.catalogue import Catalogue

    return Catalogue(Path(), own_blocks(options))


def _all_loaded(failures: list[str]) -> int:
    """Report at the end which blocks could not be loaded."""
    if failures:
        raise QuadvisError("\n".join(failures))
    return 0


def schema(options: argparse.Namespace) -> int:
    """Write the JSON schema of diagrams; 2 if a block cannot be loaded, which is then left out."""
    from quadvis.diagram.schema import diagram_schema

    blocks, failures = _catalogue(options).load_all()
    write_text(json_text(diagram_schema(blocks), indent=1) + "\n", options.output or "-", SCHEMA)
    return _all_loaded(failures)


def new(options: argparse.Namespace) -> int:
    """Write the skeleton of a block, an output device, a diagram or a project."""
    from quadvis.library.skeleton import KINDS, new_block, new_diagram, new_project

    name, kind = options.name, options.kind
    made = {"diagram": new_diagram, "project": new_project}
    for path in new_block(name, kind) if kind in KINDS else made[kind](name):
        print(path)
    return 0


def camera(options: argparse.Namespace) -> int:
    """List the cameras, show what one sees, or calibrate it."""
    from quadvis.cli.camera import camera as perform

    return perform(options)


def completion(options: argparse.Namespace) -> int:
    """Print the script with which a shell completes words."""
    from quadvis.cli.completion import completion as script
    from quadvis.cli.options import new_parser

    print(script(new_parser(), options.shell), end="")
    return 0


def cache(options: argparse.Namespace) -> int:
    """Print where machine code is kept, and how much; remove it if asked for."""
    from quadvis.native import cache as kept

    files = list(kept.files())
    size = sum(size for _, size in files)
    what = f"{counted(len(files), 'block type')}, {size / 1e6:.1f} MB"
    if options.clear:
        kept.clear()
        print(f"removed from {kept.folder()}: {what}")
    else:
        print(f"{kept.folder()}: {what}")
    return 0
