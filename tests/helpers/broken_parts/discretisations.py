"""A discretisation that keeps its promises, and others that each break one of them."""

from __future__ import annotations

import attrs
import numpy as np

from solidsph import (
    Discretisation,
    SceneError,
    Shape,
)
from solidsph.model.particles import Particles
from solidsph_builtin.discretisations.lattice import Lattice


@attrs.frozen
class GoodDiscretisation(Discretisation):
    """The cells of a lattice, with a layer of ghosts."""

    def particles(self, shape: Shape, spacing: float) -> Particles:
        return Lattice(ghosts=1).particles(shape, spacing)

    def ends_on_surface(self, shape: Shape, spacing: float) -> bool:
        return False


class RefusesAll(GoodDiscretisation):
    def particles(self, shape: Shape, spacing: float) -> Particles:
        raise SceneError("not today")


class WithoutLast(GoodDiscretisation):
    def particles(self, shape: Shape, spacing: float) -> Particles:
        given = super().particles(shape, spacing)
        return attrs.evolve(given, volumes=given.volumes[:-1], cells=given.volumes)


class TooHeavy(GoodDiscretisation):
    def particles(self, shape: Shape, spacing: float) -> Particles:
        given = super().particles(shape, spacing)
        return attrs.evolve(given, volumes=(1.0 + 1e-9) * given.volumes)


class Beside(GoodDiscretisation):
    def particles(self, shape: Shape, spacing: float) -> Particles:
        given = super().particles(shape, spacing)
        return attrs.evolve(given, positions=given.positions + spacing)


class TooCoarse(GoodDiscretisation):
    def particles(self, shape: Shape, spacing: float) -> Particles:
        return super().particles(shape, 2.0 * spacing)


class OpenSurface(GoodDiscretisation):
    def particles(self, shape: Shape, spacing: float) -> Particles:
        given = super().particles(shape, spacing)
        return attrs.evolve(given, area_vectors=np.abs(given.area_vectors))


class FaceForgotten(GoodDiscretisation):
    def particles(self, shape: Shape, spacing: float) -> Particles:
        given = super().particles(shape, spacing)
        return attrs.evolve(given, faces=dict(list(given.faces.items())[1:]))


class TagOfAll(GoodDiscretisation):
    def particles(self, shape: Shape, spacing: float) -> Particles:
        given = super().particles(shape, spacing)
        tags = {name: np.ones(given.count, dtype=np.bool_) for name in given.tags}
        return attrs.evolve(given, tags=tags)


class NoImages(GoodDiscretisation):
    def particles(self, shape: Shape, spacing: float) -> Particles:
        given = super().particles(shape, spacing)
        return attrs.evolve(given, images=np.zeros_like(given.images))


class Unseeded(GoodDiscretisation):
    def particles(self, shape: Shape, spacing: float) -> Particles:
        given = super().particles(shape, spacing)
        return attrs.evolve(given, volumes=np.random.default_rng().permutation(given.volumes))


class SaysItEnds(GoodDiscretisation):
    def ends_on_surface(self, shape: Shape, spacing: float) -> bool:
        return True


class EndsInSilence(GoodDiscretisation):
    def particles(self, shape: Shape, spacing: float) -> Particles:
        return Lattice(on_boundary=True).particles(shape, spacing)


DISCRETISATIONS = [
    (RefusesAll, {"represents a shape"}),
    (WithoutLast, {"arrays"}),
    (TooHeavy, {"volumes"}),
    (Beside, {"inside"}),
    (TooCoarse, {"spacing"}),
    (OpenSurface, {"closed surface"}),
    (FaceForgotten, {"faces"}),
    (TagOfAll, {"tags"}),
    (NoImages, {"images"}),
    (Unseeded, {"same bits"}),
    (SaysItEnds, {"ends on surface"}),
    (EndsInSilence, {"ends on surface"}),
]
