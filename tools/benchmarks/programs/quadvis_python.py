"""quadvis with interpreted blocks."""

from __future__ import annotations

from benchmarks.programs import _quadvis

load = _quadvis.load
build = _quadvis.builder("python")
