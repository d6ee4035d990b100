"""The kinds of ceilings on which the detector is measured."""

from __future__ import annotations

from tests.ceilings import layers as of
from tests.ceilings.stage import Kind

_COMBINED = (of.darkened((0.35, 0.42, 0.5)), of.smeared(4.0), of.jpeg(70))

KINDS = {
    "plain": Kind(),
    "plain, r 2.2 to 4 px": Kind(radius=(2.2, 4.0)),
    "plain, near": Kind(radius=(16.0, 24.0)),
    "plain, tilt to 40 deg": Kind(tilt=40.0, radius=(5.0, 12.0)),
    "tiles 60 cm": Kind((of.tiles(0.6, 0.6),)),
    "tiles 30 cm": Kind((of.tiles(0.3, 0.3),)),
    "tiles 60 cm, joints 0.72": Kind((of.tiles(0.6, 0.6, dark=(0.72, 0.72)),)),
    "tiles 30 cm, joints 0.35": Kind((of.tiles(0.3, 0.3, dark=(0.35, 0.35)),)),
    "tiles 60 cm, 0.5 m target": Kind((of.tiles(0.6, 0.6),), scale=0.5),
    "tiles 60 cm, r 2.2 to 4 px": Kind((of.tiles(0.6, 0.6),), radius=(2.2, 4.0)),
    "tiles 60 cm, tilt to 40 deg": Kind((of.tiles(0.6, 0.6),), tilt=40.0, radius=(5.0, 12.0)),
    "uneven tiles": Kind((of.tiles(0.5, 0.5, uneven=0.25),)),
    "planks": Kind((of.tiles(0.15, 1.5),)),
    "line through, 0.8": Kind((of.joint((-1.0, 1.0), 0.8, 0.02),)),
    "line through, 0.5": Kind((of.joint((-1.0, 1.0), 0.5, 0.02),)),
    "line through, 0.35": Kind((of.joint((-1.0, 1.0), 0.35, 0.03),)),
    "lines beside all circles": Kind((of.lines_beside,)),
    "line across, 0.5": Kind(over=(of.joint((-0.9, 0.9), 0.5, 0.02, over=True),)),
    "cables under": Kind((of.cables(3, (20, 90), over=False),)),
    "cables over": Kind(over=(of.cables(2, (20, 90), over=True),)),
    "vents": Kind((of.vents,)),
    "lamp grid": Kind((of.tiles(0.6, 0.6, dark=(0.6, 0.9)), of.lamp_grid)),
    "hard shadow": Kind(light=(of.shadow((0.3, 0.6), (0, 0)),)),
    "soft shadow": Kind(light=(of.shadow((0.3, 0.6), (0.05, 0.6)),)),
    "hard shadow on a circle": Kind(light=(of.shadow((0.3, 0.6), (0, 0), near=True),)),
    "soft shadow on a circle": Kind(light=(of.shadow((0.3, 0.6), (0.05, 0.4), near=True),)),
    "blades": Kind(light=(of.blades,)),
    "banding 15 %": Kind(light=(of.banding(0.15),)),
    "banding 30 %": Kind(light=(of.banding(0.3),)),
    "banding 45 %": Kind(light=(of.banding(0.45),)),
    "banding 45 % on tiles": Kind((of.tiles(0.6, 0.6),), light=(of.banding(0.45),)),
    "wood": Kind((of.wood,)),
    "concrete": Kind((of.concrete,)),
    "board on a dark ceiling": Kind((of.board(0.1, (60, 62, 66)),), radius=(5.0, 12.0)),
    "four sheets": Kind((of.sheets,), radius=(5.0, 12.0)),
    "dust and hot pixels": Kind(sensor=(of.dust, of.hot_pixels)),
    "glare on one circle": Kind(over=(of.glare,)),
    "10 coloured discs": Kind((of.things(10),)),
    "combo": Kind(sensor=_COMBINED, noise=3.0),
    "combo on tiles": Kind((of.tiles(0.6, 0.6),), sensor=_COMBINED, noise=3.0),
    "empty, tiles": Kind((of.tiles(0.3, 0.3),), shown=False),
    "empty, vents and cables": Kind((of.vents, of.cables(3, (20, 90), over=False)), shown=False),
    "empty, concrete": Kind((of.concrete,), shown=False),
    "empty, 8 coloured discs": Kind((of.things(8),), shown=False),
    "empty, 8 discs of our paint": Kind((of.things(8, paint=True),), shown=False),
}
