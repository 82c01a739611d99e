"""Checks of the shapes of bodies."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import ceil, sqrt
from numbers import Real

import numpy as np

from solidsph.interfaces.shape import Shape
from solidsph.model.particles import Particles
from solidsph.registry.problems import MOST_OF_A_KIND
from solidsph.scene.overlap import overlap

# Bodies that overlap by less, in spacings, merely touch: shapes are drawn no more accurately.
_TOUCHING = 0.05


def check_dimensions(shapes: Mapping[str, Shape], cover: float | None) -> Iterator[str]:
    """Yield problems of bodies of different dimension, and of a cover too small for it."""
    dimensions = {name: shape.dimension for name, shape in shapes.items()}
    if not dimensions:
        return
    if len(set(dimensions.values())) > 1:
        listed = ", ".join(f"{name!r} {d}D" for name, d in dimensions.items())
        yield f"bodies of different dimension in one scene: {listed}; use shapes of one dimension"
        return
    d = next(iter(dimensions.values()))
    least = sqrt(d)
    if isinstance(cover, Real) and 0.0 < cover <= least:
        yield (
            f"cover = {cover:.6g} is too small in {d}D: a particle must reach its diagonal "
            f"neighbours, {least:.4g} spacings away; use at least {ceil(10 * least + 5) / 10:g}"
        )


def check_overlaps(shapes: Mapping[str, Shape], sets: Mapping[str, Particles]) -> Iterator[str]:
    """Yield bodies that overlap; only so many that the rest of them would not be listed."""
    names = list(shapes)
    boxes = np.array([shape.bounds() for shape in shapes.values()])  # (b, 2, d)
    spacings = np.array([float(sets[name].spacings.min()) for name in names])
    count, skipped = 0, 0
    for k, name in enumerate(names[:-1]):
        rest = boxes[k + 1 :]
        common = np.minimum(rest[:, 1], boxes[k, 1]) - np.maximum(rest[:, 0], boxes[k, 0])
        near = k + 1 + np.flatnonzero(np.all(common > 0.0, axis=1))
        for other in near:
            if count == MOST_OF_A_KIND:
                skipped += 1
                continue
            spacing = min(spacings[k], spacings[other])
            common_part = overlap(shapes[name], shapes[names[other]], _TOUCHING * spacing)
            if common_part is not None:
                place = ", ".join(f"{x:.4g}" for x in common_part.place)
                count += 1
                yield (
                    f"bodies {name!r} and {names[other]!r} are in one place: they overlap by "
                    f"{common_part.depth:.3g} m ({common_part.depth / spacing:.2g} spacings) "
                    f"around ({place}); move one, or cut it out with a 'difference'. To press "
                    "bodies together, let them touch and give one an initial displacement"
                )
    if skipped:
        yield f"{skipped} more pairs of bodies, whose bounding boxes overlap, were not checked"
