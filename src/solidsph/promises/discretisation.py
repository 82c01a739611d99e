"""What every discretisation must keep, on shapes with flat and curved faces, edges and a hole.

A discretisation may refuse a shape that it cannot represent; it must not refuse all of them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import attrs
import numpy as np
from scipy.spatial import cKDTree

from solidsph.errors import SceneError
from solidsph.interfaces.discretisation import Discretisation
from solidsph.interfaces.kernel import Kernel
from solidsph.interfaces.shape import Shape
from solidsph.interfaces.smoothing_kernel import smoothing_kernel
from solidsph.maths.arrays import Array
from solidsph.model.neighbours import neighbour_pairs
from solidsph.model.particles import Particles
from solidsph.promises.check import Check, Verdict, at_most, check, not_promised
from solidsph.promises.samples import made_once
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

# So far outside, in spacings, a particle is still on the boundary.
_ON_BOUNDARY = 1e-6

# Of the sums [spacings], so small that some supports are whole.
_COVER = 2.2


@attrs.frozen(eq=False)
class _Sample:
    name: str
    shape: Shape
    particles: Particles

    @property
    def total_area(self) -> float:
        """Of the boundary [m^(d-1)]."""
        areas = np.linalg.norm(self.shape.surface(SPACING).area_vectors, axis=1)
        return float(areas.sum())


def _discretised(discretisation: Discretisation) -> list[_Sample]:
    """Those shapes that are not refused.

    Raises:
        SceneError: all of them are.
    """
    found: list[_Sample] = []
    refusals: list[str] = []
    for name, table in _SHAPES.items():
        shape: Shape = construct("shapes", table)
        try:
            found.append(_Sample(name, shape, discretisation.particles(shape, SPACING)))
        except SceneError as refusal:
            refusals.append(f"{name}: {refusal}")
    if not found:
        raise SceneError(f"every shape is refused; the first, {refusals[0]}")
    return found


_samples = made_once(_discretised)


@check
def represents_a_shape(discretisation: Discretisation) -> Verdict:
    """Some shape is represented; any other is refused by a SceneError."""
    names = [sample.name for sample in _samples(discretisation)]
    return Verdict(True, ", ".join(names))


@check
def arrays(discretisation: Discretisation) -> Verdict:
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
                return Verdict(False, f"{sample.name}: {name} {array.shape}, or not finite")
        real = ~p.ghosts
        if not real.any() or min(p.volumes[real].min(), p.spacings.min()) <= 0.0:
            return Verdict(False, f"{sample.name}: least volume {p.volumes.min():.1e}")
        off = np.abs(p.spacings / SPACING - 1.0).max()
        if off > 0.5:
            return Verdict(False, f"{sample.name}: spacings are off the asked one by {off:.0%}")
    return Verdict(True, "one finite row each, positive")


@check
def volumes(discretisation: Discretisation) -> Verdict:
    """Volumes add up to the shape's."""
    errors = []
    for sample in _samples(discretisation):
        known = sample.shape.volume()
        if known is not None:
            total = sample.particles.volumes[~sample.particles.ghosts].sum()
            errors.append(abs(float(total) / known - 1.0))
    return at_most(max(errors), _ROUNDING)


@check
def middle(discretisation: Discretisation) -> Verdict:
    """Volumes are where the body is: their centre of mass is the shape's, within a tenth of a
    spacing."""
    errors = []
    for sample in _samples(discretisation):
        p, surface = sample.particles, sample.shape.surface(0.2 * SPACING)
        # The integral of x_i over the shape, by the divergence theorem, is that of x_i^2 n_i / 2.
        first = 0.5 * np.sum(surface.points**2 * surface.area_vectors, axis=0)
        flux = np.vdot(surface.points, surface.area_vectors) / sample.shape.dimension
        real = ~p.ghosts
        found = p.volumes[real] @ p.positions[real] / p.volumes[real].sum()
        errors.append(float(np.abs(found - first / flux).max()) / SPACING)
    return at_most(max(errors), 0.1)


@check
def sums(discretisation: Discretisation) -> Verdict:
    """The weights in sums make the kernel's mass where supports are whole: 1 on the mean, within a
    tenth."""
    kernel: Kernel = construct("kernels", "modified-mollifier")
    errors = []
    for sample in _samples(discretisation):
        p, radius = sample.particles, _COVER * SPACING
        pairs = neighbour_pairs(p.positions, radius)
        W = smoothing_kernel(kernel, p.dimension, radius)
        found = pairs.row_sums(W.value(pairs.distances) * p.cells[pairs.columns])
        deep = sample.shape.signed_distance(p.positions) < -radius
        whole = found[deep & ~p.ghosts]
        errors += [abs(float(whole.mean()) - 1.0)] if len(whole) else []
    return at_most(max(errors), 0.1) if errors else not_promised("no support is whole")


@check
def inside(discretisation: Discretisation) -> Verdict:
    """Particles lie inside the shape or on its boundary, ghosts outside."""
    errors = []
    for sample in _samples(discretisation):
        p = sample.particles
        distances = sample.shape.signed_distance(p.positions) / SPACING
        errors.append(float(distances[~p.ghosts].max()))
        if p.ghosts.any():
            errors.append(-float(distances[p.ghosts].min()))
    return at_most(max(errors), _ON_BOUNDARY)


@check
def spacing(discretisation: Discretisation) -> Verdict:
    """Particles are about a spacing apart: the nearest other one is, by the median, between half
    and one and a half, and none is at another's place."""
    medians, least = [], []
    for sample in _samples(discretisation):
        p = sample.particles
        gaps = np.asarray(cKDTree(p.positions).query(p.positions, k=2)[0])[:, 1] / SPACING
        medians.append(float(np.median(gaps)))
        least.append(float(gaps.min()))
    told = f"medians {min(medians):.2f} to {max(medians):.2f} spacings, closest {min(least):.2f}"
    return Verdict(0.5 <= min(medians) <= max(medians) <= 1.5 and min(least) > 1e-3, told)


@check
def closed_surface(discretisation: Discretisation) -> Verdict:
    """The area vectors of a closed surface add up to zero."""
    errors = [
        float(np.abs(sample.particles.area_vectors.sum(axis=0)).max()) / sample.total_area
        for sample in _samples(discretisation)
    ]
    return at_most(max(errors), _AREAS)


@check
def faces(discretisation: Discretisation) -> Verdict:
    """Every named face of the shape is a face of the particles, with the same total area vector,
    and their area vectors are the sums of their faces'."""
    errors = []
    for sample in _samples(discretisation):
        p, surface = sample.particles, sample.shape.surface(SPACING)
        total = np.zeros_like(p.area_vectors)
        for name in sorted(set(surface.faces)):
            if name not in p.faces:
                return Verdict(False, f"{sample.name}: no face {name!r}")
            expected = surface.area_vectors[np.array(surface.faces) == name].sum(axis=0)
            found = p.faces[name].area_vectors
            errors.append(float(np.abs(found.sum(axis=0) - expected).max()) / sample.total_area)
            np.add.at(total, p.faces[name].particles, found)
        errors.append(float(np.abs(total - p.area_vectors).max()) / sample.total_area)
    return at_most(max(errors), _AREAS)


@check
def tags(discretisation: Discretisation) -> Verdict:
    """Every named face of the shape is a tag of the particles that own some of it."""
    for sample in _samples(discretisation):
        p = sample.particles
        for name in sorted(set(sample.shape.surface(SPACING).faces)):
            if name not in p.tags:
                return Verdict(False, f"{sample.name}: no tag {name!r}")
            if name not in p.faces or set(p.tagged(name)) != set(p.faces[name].particles.tolist()):
                return Verdict(False, f"{sample.name}: tag {name!r} is not those on the face")
    return Verdict(True, "one for every face")


@check
def images(discretisation: Discretisation) -> Verdict:
    """A particle is its own image; a ghost's image lies inside the shape or on its boundary."""
    errors = [0.0]
    for sample in _samples(discretisation):
        p = sample.particles
        real = ~p.ghosts
        errors.append(float(np.abs(p.images - p.positions)[real].max()) / SPACING)
        if p.ghosts.any():
            errors.append(float(sample.shape.signed_distance(p.images[p.ghosts]).max()) / SPACING)
    return at_most(max(errors), _ON_BOUNDARY)


@check
def same_bits(discretisation: Discretisation) -> Verdict:
    """The same input gives the same bits."""
    pairs = zip(_samples(discretisation), _discretised(discretisation), strict=True)
    for one, other in pairs:
        for first, again in zip(_arrays(one.particles), _arrays(other.particles), strict=True):
            if not np.array_equal(first, again):
                return Verdict(False, f"{one.name}: another arrangement the second time")
    return Verdict(True, "the same")


CHECKS: tuple[Check, ...] = (
    represents_a_shape,
    arrays,
    volumes,
    middle,
    sums,
    inside,
    spacing,
    closed_surface,
    faces,
    tags,
    images,
    same_bits,
)


def _arrays(p: Particles) -> Iterator[Array]:
    yield from (p.positions, p.volumes, p.cells, p.area_vectors, p.images)
