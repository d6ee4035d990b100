"""All keys that can stand at the top of a file, in the order in which a resolved diagram has them."""

from __future__ import annotations

from typing import Any

from quadvis.diagram.sections.analyse import ANALYSE
from quadvis.diagram.sections.base import BASE, WITHOUT
from quadvis.diagram.sections.blocks import BLOCKS
from quadvis.diagram.sections.computers import COMPUTERS
from quadvis.diagram.sections.context import RunSection
from quadvis.diagram.sections.expect import EXPECT
from quadvis.diagram.sections.figures import FIGURES
from quadvis.diagram.sections.files import FILES
from quadvis.diagram.sections.header import DOC, FORMAT, NAME
from quadvis.diagram.sections.links import LINKS
from quadvis.diagram.sections.log import LOG
from quadvis.diagram.sections.on_host_loss import ON_HOST_LOSS
from quadvis.diagram.sections.overload import OVERLOAD
from quadvis.diagram.sections.params import PARAMS
from quadvis.diagram.sections.ports import PORTS
from quadvis.diagram.sections.rates import RATES
from quadvis.diagram.sections.section import FileSection, Section
from quadvis.diagram.sections.seed import SEED
from quadvis.diagram.sections.solver import SOLVER
from quadvis.diagram.sections.stop_time import STOP_TIME
from quadvis.diagram.sections.summary import SUMMARY
from quadvis.diagram.sections.tasking import TASKING
from quadvis.diagram.sections.variants import VARIANTS

FILE_SECTIONS: tuple[FileSection[Any], ...] = (
    FORMAT, NAME, DOC, BASE, WITHOUT, PARAMS, RATES, SOLVER, TASKING, STOP_TIME, SEED, OVERLOAD, ON_HOST_LOSS,
    COMPUTERS, LINKS, FILES, BLOCKS, VARIANTS, PORTS,
)  # fmt: skip
RUN_SECTIONS: tuple[RunSection[Any], ...] = (LOG, ANALYSE, EXPECT, SUMMARY, FIGURES)  # `expect` names cuts
SECTIONS: tuple[Section[Any], ...] = (*FILE_SECTIONS, *RUN_SECTIONS)


def keys(kind: str, *, required: bool) -> tuple[str, ...]:
    """Return the keys that a kind of file must have, or those that it can have besides."""
    return tuple(
        section.key for section in SECTIONS if kind in section.kinds and section.required == required
    )
