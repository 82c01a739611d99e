"""Checks of a discretisation, on shapes with flat and curved faces, edges and a hole.

A discretisation may refuse a shape that it cannot represent; it must not refuse all of them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

import attrs
import numpy as np
from scipy.spatial import cKDTree

from solidsph.conformance.check import Broken, Kit, Verdict
from solidsph.conformance.samples import accepted, kept_for_last
from solidsph.interfaces.discretisation import Discretisation
from solidsph.interfaces.kernel import Kernel
from solidsph.interfaces.shape import Shape
from solidsph.interfaces.smoothing_kernel import smoothing_kernel
from solidsph.maths.arrays import Array, Indices, Mask
from solidsph.model.neighbours import neighbour_pairs
from solidsph.model.particles import Face, Particles
from solidsph.registry.construct import construct

SPACING = 0.1  # [m]

_BOX: Mapping[str, Any] = {"type": "box", "lengths": [1.2, 0.8]}
_SHAPES: Mapping[str, Mapping[str, Any]] = {
    "bar": {"type": "box", "lengths": [1.3]},
    "rectangle": _BOX,
    "disc": {"type": "disc", "radius": 0.5},
    "rectangle with a hole": {
        "type": "difference",
        "of": _BOX,
        "minus": [{"type": "disc", "radius": 0.22, "centre": [0.6, 0.4]}],
    },
    "block": {"type": "box", "lengths": [0.6, 0.5, 0.4]},
    "ball": {"type": "ball", "radius": 0.35},
}

# Sums over some hundred particles, scaled to a total: three digits of 1e-16.
_ROUNDING = 1e-12

# Areas of a face are sums over its samples, whatever their number.
_AREAS = 1e-10

# A particle is still on the boundary if it is outside by less than this, in spacings.
_ON_BOUNDARY = 1e-6

# A particle this deep still ends on the surface, in spacings.
_ON_SURFACE = 0.1
_BOXES = ("bar", "rectangle", "block")

# Support radius of the sums [spacings], so small that some supports are complete.
_COVER = 2.2

KIT = Kit()


@attrs.frozen(eq=False)
class _Sample:
    """A shape and its particles."""

    name: str
    shape: Shape
    particles: Particles

    @classmethod
    def of(cls, discretisation: Discretisation, name: str, shape: Shape) -> _Sample:
        return cls(name, shape, discretisation.particles(shape, SPACING))

    @property
    def real(self) -> Mask:
        """The particles that are no ghosts, (n,)."""
        return ~self.particles.ghosts

    @property
    def total_area(self) -> float:
        """Area of the boundary [m^(d-1)]."""
        areas = np.linalg.norm(self.shape.surface(SPACING).area_vectors, axis=1)
        return float(areas.sum())


def _discretised(discretisation: Discretisation) -> list[_Sample]:
    """The shapes that are not refused.

    Raises:
        SceneError: all of them are.
    """
    shapes: dict[str, Shape] = {name: construct("shapes", _SHAPES[name]) for name in _SHAPES}
    return accepted(
        "shape",
        (
            (name, partial(_Sample.of, discretisation, name, shape))
            for name, shape in shapes.items()
        ),
    )


_samples = kept_for_last(_discretised)


@KIT.check
def represents_a_shape(discretisation: Discretisation) -> Verdict:
    """Some shape is represented; any other is refused by a SceneError."""
    return Verdict(True, ", ".join(sample.name for sample in _samples(discretisation)))


@KIT.problems("one finite row each, positive")
def arrays(discretisation: Discretisation) -> Iterator[str]:
    """Every array has a finite row for each particle, and volumes and spacings are positive."""
    for sample in _samples(discretisation):
        p, d = sample.particles, sample.shape.dimension
        expected = {
            "positions": (p.positions, (p.count, d)),
            "volumes": (p.volumes, (p.count,)),
            "cells": (p.cells, (p.count,)),
            "spacings": (p.spacings, (p.count,)),
            "area_vectors": (p.area_vectors, (p.count, d)),
            "images": (p.images, (p.count, d)),
        }
        for name, (array, shape) in expected.items():
            if array.shape != shape or not np.all(np.isfinite(array)):
                yield f"{sample.name}: {name} {array.shape}, or not finite"
        real = sample.real
        if not real.any() or min(p.volumes[real].min(), p.spacings.min()) <= 0.0:
            yield f"{sample.name}: least volume {p.volumes.min():.1e}"
        off = np.abs(p.spacings / SPACING - 1.0).max()
        if off > 0.5:
            yield f"{sample.name}: spacings differ from the requested one by {off:.0%}"


@KIT.errors(_ROUNDING)
def volumes(discretisation: Discretisation) -> Iterator[float]:
    """Volumes add up to the shape's."""
    for sample in _samples(discretisation):
        known = sample.shape.volume()
        if known is not None:
            yield abs(float(sample.particles.volumes[sample.real].sum()) / known - 1.0)


@KIT.errors(0.1)
def middle(discretisation: Discretisation) -> Iterator[float]:
    """The centre of mass of the volumes is that of the shape, within a tenth of a spacing."""
    for sample in _samples(discretisation):
        p, surface = sample.particles, sample.shape.surface(0.2 * SPACING)
        # The integral of x_i over the shape, by the divergence theorem, is that of x_i^2 n_i / 2.
        first = 0.5 * np.sum(surface.points**2 * surface.area_vectors, axis=0)
        flux = np.vdot(surface.points, surface.area_vectors) / sample.shape.dimension
        real = sample.real
        centre = p.volumes[real] @ p.positions[real] / p.volumes[real].sum()
        yield float(np.abs(centre - first / flux).max()) / SPACING


@KIT.errors(0.1, none="no support is complete")
def sums(discretisation: Discretisation) -> Iterator[float]:
    """Where supports are complete, the kernel summed with the weights in sums is 1 on average,
    within a tenth."""
    kernel: Kernel = construct("kernels", "modified-mollifier")
    for sample in _samples(discretisation):
        p, radius = sample.particles, _COVER * SPACING
        pairs = neighbour_pairs(p.positions, radius)
        W = smoothing_kernel(kernel, p.dimension, radius)
        mass = pairs.row_sums(W.value(pairs.distances) * p.cells[pairs.columns])
        deep = sample.shape.signed_distance(p.positions) < -radius
        if (deep & sample.real).any():
            yield abs(float(mass[deep & sample.real].mean()) - 1.0)


@KIT.errors(_ON_BOUNDARY)
def inside(discretisation: Discretisation) -> Iterator[float]:
    """Particles lie inside the shape or on its boundary, ghosts outside."""
    for sample in _samples(discretisation):
        p = sample.particles
        distances = sample.shape.signed_distance(p.positions) / SPACING
        yield float(distances[sample.real].max())
        if p.ghosts.any():
            yield -float(distances[p.ghosts].min())


@KIT.problems("as declared")
def ends_on_surface(discretisation: Discretisation) -> Iterator[str]:
    """On boxes, whose surface every arrangement can follow, the particles of most of the surface
    stand on it and there are no ghosts, or the discretisation says that it does not end there."""
    for sample in _samples(discretisation):
        if sample.name not in _BOXES:
            continue
        p, shape = sample.particles, sample.shape
        names = sorted(set(shape.surface(SPACING).faces))
        outer = np.unique(np.concatenate([p.tagged(name) for name in names if name in p.tags]))
        depths = np.abs(shape.signed_distance(p.positions[outer])) / SPACING
        found = bool((depths <= _ON_SURFACE).mean() > 0.5) and not p.ghosts.any()
        declared = discretisation.ends_on_surface(shape, SPACING)
        if declared is not found:
            yield f"{sample.name}: says {declared!r}, is {found}"


@KIT.check
def spacing(discretisation: Discretisation) -> Verdict:
    """Particles are about a spacing apart: the median distance to the nearest one is half to one
    and a half spacings, and no two are at the same place."""
    medians, least = [], []
    for sample in _samples(discretisation):
        X = sample.particles.positions
        gaps = np.asarray(cKDTree(X).query(X, k=2)[0])[:, 1] / SPACING
        medians.append(float(np.median(gaps)))
        least.append(float(gaps.min()))
    passed = 0.5 <= min(medians) <= max(medians) <= 1.5 and min(least) > 1e-3
    return Verdict(
        passed,
        f"medians {min(medians):.2f} to {max(medians):.2f} spacings, closest {min(least):.2f}",
    )


@KIT.errors(_AREAS)
def closed_surface(discretisation: Discretisation) -> Iterator[float]:
    """The area vectors of a closed surface add up to zero."""
    for sample in _samples(discretisation):
        yield np.abs(sample.particles.area_vectors.sum(axis=0)).max() / sample.total_area


@KIT.errors(_AREAS)
def faces(discretisation: Discretisation) -> Iterator[float]:
    """Every named face of the shape is a face of the particles, with the same total area vector,
    and their area vectors are the sums over their faces."""
    for sample in _samples(discretisation):
        p, surface = sample.particles, sample.shape.surface(SPACING)
        total = np.zeros_like(p.area_vectors)
        for name in sorted(set(surface.faces)):
            if name not in p.faces:
                raise Broken(f"{sample.name}: no face {name!r}")
            expected = surface.area_vectors[np.array(surface.faces) == name].sum(axis=0)
            areas = p.faces[name].area_vectors
            yield float(np.abs(areas.sum(axis=0) - expected).max()) / sample.total_area
            np.add.at(total, p.faces[name].particles, areas)
        yield float(np.abs(total - p.area_vectors).max()) / sample.total_area


@KIT.problems("one for every face")
def tags(discretisation: Discretisation) -> Iterator[str]:
    """Every named face of the shape is a tag of particles that own all of it but a hundredth.

    Others may own that: beside an edge, the functions of a fit reach around it.
    """
    for sample in _samples(discretisation):
        p = sample.particles
        for name in sorted(set(sample.shape.surface(SPACING).faces)):
            if name not in p.tags:
                yield f"{sample.name}: no tag {name!r}"
            if name not in p.faces or not _owned(p.faces[name], p.tagged(name)):
                yield f"{sample.name}: tag {name!r} is not on the particles of the face"


def _owned(face: Face, tagged: Indices) -> bool:
    """Whether all tagged particles own some of a face, and others at most a hundredth of it."""
    sizes = np.abs(face.areas)
    others = ~np.isin(face.particles, tagged)
    return bool(np.isin(tagged, face.particles).all() and sizes[others].sum() <= 0.01 * sizes.sum())


@KIT.errors(_ON_BOUNDARY)
def images(discretisation: Discretisation) -> Iterator[float]:
    """A particle is its own image; a ghost's image lies inside the shape or on its boundary."""
    yield 0.0
    for sample in _samples(discretisation):
        p = sample.particles
        yield float(np.abs(p.images - p.positions)[sample.real].max()) / SPACING
        if p.ghosts.any():
            yield float(sample.shape.signed_distance(p.images[p.ghosts]).max()) / SPACING


@KIT.problems("the same")
def same_bits(discretisation: Discretisation) -> Iterator[str]:
    """The same input gives the same bits."""
    pairs = zip(_samples(discretisation), _discretised(discretisation), strict=True)
    for first, second in pairs:
        arrays = zip(_arrays(first.particles), _arrays(second.particles), strict=True)
        if not all(np.array_equal(a, b) for a, b in arrays):
            yield f"{first.name}: the second time the particles differ"


def _arrays(p: Particles) -> Iterator[Array]:
    yield from (p.positions, p.volumes, p.cells, p.area_vectors, p.images)
