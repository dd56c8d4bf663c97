#!/usr/bin/env python3
"""Draws the figures of docs/method.md: `docs/figures/draw.py [NAME…]`, or `make figures`. Needs nothing but Python 3.

Schematics are drawn by hand; curves come from the data in docs/charts and tests/data, so that they are what was measured.
"""

import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
sys.dont_write_bytecode = True

import field  # noqa: E402
import light  # noqa: E402
import overview  # noqa: E402
import plots  # noqa: E402
import slab  # noqa: E402

FIGURES = {
    "lifetimes": overview.lifetimes,
    "geometry": slab.geometry,
    "phase": plots.phase,
    "doubling": slab.doubling,
    "orders": slab.orders,
    "peak": plots.peak,
    "tabulated": slab.tabulated,
    "null-collision": light.null_collision,
    "view-ray": light.view_ray,
    "synthesis": field.synthesis,
    "motion": field.motion,
    "transport": light.transport,
    "exchange": light.exchange,
    "precision": plots.precision,
    "limits": plots.limits,
}


def main(names):
    for name in names or FIGURES:
        if name not in FIGURES:
            sys.exit(f"{name}: no such figure; there are {', '.join(FIGURES)}")
        FIGURES[name]().save(HERE / f"{name}.svg")


if __name__ == "__main__":
    main(sys.argv[1:])
