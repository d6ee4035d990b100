"""Sphinx with its settings: Markdown as the repository's own pages have it, every warning a fault."""

from __future__ import annotations

import io
import re
import warnings
from pathlib import Path

from quadvis.errors import QuadvisError
from quadvis.version import __version__

STATIC = Path(__file__).with_name("static")
SETTINGS = {
    "project": "quadvis",
    "version": __version__,
    "release": __version__,
    "extensions": "myst_parser",
    "source_suffix": ".md",
    "root_doc": "index",
    "myst_heading_anchors": 6,
    "myst_disable_syntax": ["myst_line_comment", "myst_block_break", "myst_target", "myst_role"],
    "html_theme": "furo",
    "html_title": f"quadvis {__version__}",
    "html_static_path": [str(STATIC)],
    "html_css_files": ["site.css"],
    "html_copy_source": False,
    "html_show_sourcelink": False,
    "html_show_copyright": False,
    "smartquotes": False,  # "--vary" stays what one types and searches for
    "highlight_language": "text",
    "pygments_style": "friendly",
}


def render(pages: Path, output: Path, cache: Path) -> None:
    """Render a folder of pages as a site; QuadvisError has all that Sphinx warns of."""
    from sphinx.application import Sphinx
    from sphinx.util.docutils import docutils_namespace

    cache.mkdir(parents=True, exist_ok=True)
    found = io.StringIO()
    with docutils_namespace(), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Python's own: what MyST calls of Sphinx is not for us to mend
        site = Sphinx(
            srcdir=pages,
            confdir=None,
            outdir=output,
            doctreedir=cache,
            buildername="html",
            confoverrides=dict(SETTINGS),
            status=None,
            warning=found,
        )
        site.build()
    # The colours of a terminal, and the folder of the pages, are of no use in a message.
    text = re.sub(r"\x1b\[[0-9;]*m", "", found.getvalue()).replace(f"{pages}/", "")
    if text.strip():
        raise QuadvisError(f"the pages have faults:\n{text.strip()}")
