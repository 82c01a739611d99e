"""Samples of the surface at a `where`, with the particles that values there depend on."""

from __future__ import annotations

import attrs
import numpy as np
from scipy.spatial import cKDTree

from solidsph.errors import SceneError
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.maths.arrays import Array
from solidsph.model.regions import Where, described
from solidsph.model.surface import Pieces
from solidsph.probes.sampling import Sampling

# Distance of samples that is asked for [spacings], by dimension. Built-in shapes sample 16 times as
# densely in the plane and 4 times in space: a maximum between two samples is hardly missed.
_DISTANCE = {1: 1.0, 2: 1.0, 3: 2.0}


@attrs.frozen(eq=False)
class FaceSamples:
    """A part of the surface in m samples."""

    sampling: Sampling  # at the samples
    area_vectors: Array  # (m, d) outward [m^(d-1)]


def face_samples(model: DiscreteModel, where: Where, *, slopes: bool = False) -> FaceSamples:
    """The surface at `where`: the faces that it names, or all surface of its particles.

    As with loads on surfaces, the name of a face holds on the samples of that face, everything
    else where it holds for the nearest particle of that face.

    Raises:
        SceneError: no surface is there, or `where` cannot be understood.
    """
    model.surface(where)  # raises if there is none
    particles = model.particles
    names = list(particles.faces)
    points: list[Array] = []
    area_vectors: list[Array] = []
    owners, faces, bodies = [], [], []
    for number, body in enumerate(model.bodies):
        distance = _DISTANCE[particles.dimension] * float(body.particles.spacings.max())
        surface = body.shape.surface(distance)
        own = np.flatnonzero(~body.particles.ghosts) + body.extent.start
        labels = np.array(surface.faces)
        for name in dict.fromkeys(surface.faces):
            chosen = np.flatnonzero(labels == name)
            if name not in names:
                names.append(name)
            on_face = particles.faces[name].particles if name in particles.faces else own
            on_face = on_face[(on_face >= body.extent.start) & (on_face < body.extent.stop)]
            candidates = on_face if on_face.size else own
            nearest = cKDTree(particles.positions[candidates]).query(surface.points[chosen])[1]
            points.append(surface.points[chosen])
            area_vectors.append(surface.area_vectors[chosen])
            owners.append(candidates[nearest])
            faces.append(np.full(chosen.size, names.index(name)))
            bodies.append(np.full(chosen.size, number))
    areas = np.concatenate(area_vectors)
    pieces = Pieces(
        particles=particles,
        conditions=model.conditions,
        owners=np.concatenate(owners),
        faces=np.concatenate(faces),
        names=names,
        area_vectors=areas,
        areas=np.linalg.norm(areas, axis=1),
    )
    chosen = np.flatnonzero(pieces.at(where) & (pieces.areas > 0.0))
    if not chosen.size:
        raise SceneError(f"{described(where)} has no sample of the surface; make it larger")
    return FaceSamples(
        Sampling.of(
            {body.name: body.shape for body in model.bodies},
            particles,
            np.concatenate(points)[chosen],
            np.concatenate(bodies)[chosen],
            slopes=slopes,
        ),
        areas[chosen],
    )
