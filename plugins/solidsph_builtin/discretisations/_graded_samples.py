"""Samples of a surface that are as far apart as a spacing that varies asks for."""

from __future__ import annotations

import numpy as np

from solidsph.interfaces.discretisation import Discretisation
from solidsph.interfaces.shape import Shape, Surface
from solidsph.model.spacing import SpacingField
from solidsph_builtin.discretisations._features import gap
from solidsph_builtin.discretisations._surface import sampled


def graded_samples(
    discretisation: Discretisation, shape: Shape, spacing: SpacingField, finer: float = 1.0
) -> Surface:
    """The surface of `shape`, sampled `finer` than its discretisation at every place needs.

    Samples for the least spacing are joined in cubes of 1, 2, 4 ... gaps where it is larger: their
    area vectors are added, so that the sum stays what it is.

    Raises:
        SceneError: there is no surface.
    """
    fine = sampled(discretisation, shape, spacing.least / finer)
    points, areas = fine.points, fine.area_vectors
    numbers = {name: number for number, name in enumerate(dict.fromkeys(fine.faces))}
    face_of = np.array([numbers[name] for name in fine.faces], dtype=np.int64)
    level = np.floor(np.log2(spacing.at(points) / spacing.least) + 1e-9).astype(np.int64)
    cubes = np.floor(points / (gap(fine) * 2.0 ** level[:, None])).astype(np.int64)
    keys = np.column_stack([face_of, level, cubes])
    keys[level == 0, 2] = np.arange(np.sum(level == 0))  # those stay alone
    keys[level == 0, 3:] = 0
    _, first, which = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(np.argsort(first))  # in the order of the samples, as curves are
    which, first = order[which.ravel()], np.sort(first)
    sizes = np.linalg.norm(areas, axis=1)
    total = np.bincount(which, sizes)
    middles = [np.bincount(which, sizes * x) / total for x in points.T]
    vectors = [np.bincount(which, a) for a in areas.T]
    return Surface(
        np.stack(middles, axis=1),
        np.stack(vectors, axis=1),
        tuple(fine.faces[number] for number in first.tolist()),
    )
