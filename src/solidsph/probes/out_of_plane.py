"""Stress across the plane of a body in plane strain, or across a bar in uniaxial strain.

A material knows only the components of its dimension. Its law in three dimensions, at F with
stretches of 1 across, gives the others. Internal variables keep their names in every dimension;
those that only three dimensions have stay as they were at the start.
"""

from __future__ import annotations

import numpy as np

from solidsph.errors import SceneError
from solidsph.interfaces.body import Body
from solidsph.interfaces.history import HistoryMaterial
from solidsph.interfaces.law import memory_name
from solidsph.interfaces.material import Material
from solidsph.interfaces.memory import Memory
from solidsph.maths.arrays import Array, Indices
from solidsph.maths.tensors import components_first, particles_first

# A deformation with which a law is tried, and how closely both dimensions must agree.
_TRIED = np.eye(3) + 0.01 * np.array([[2.0, 1.0, 0.0], [-0.5, 1.0, 0.0], [0.0, 0.0, 0.0]])
_AGREEMENT = 1e-9


def stress_across(body: Body, rows: Indices, F: Array, memory: Memory) -> Array:
    """Normal Cauchy stresses along the missing axes, (k, 3 - d) [Pa].

    Args:
        body: the body.
        rows: the particles within the body, (k,).
        F: their deformation gradients, (k, d, d).
        memory: `State.memory`.
    """
    d, material = F.shape[1], body.material
    history = None
    if isinstance(material, HistoryMaterial):
        recorded = memory.get(memory_name(body))
        start = np.array([*material.initial_history(d).values()], dtype=np.float64)
        history = np.tile(start, (len(rows), 1)) if recorded is None else recorded[rows]
    P = _first_piola(material, F, history)
    ratios = np.linalg.det(F)
    return np.stack([P[:, k, k] / ratios for k in range(d, 3)], axis=1)


def check_stress_across(body: Body, dimension: int) -> None:
    """Raise SceneError unless the law of a body agrees with its own in three dimensions."""
    material, d = body.material, dimension
    F = _TRIED[None, :d, :d]
    history = None
    if isinstance(material, HistoryMaterial):
        history = np.array([[*material.initial_history(d).values()]], dtype=np.float64)
    problem = ""
    try:
        P = particles_first(material.first_piola(components_first(F), material.params), 1)
        agree = np.abs(_first_piola(material, F, history)[:, :d, :d] - P).max()
        if not agree <= _AGREEMENT * np.abs(P).max():
            problem = "in three dimensions it has other stresses in the plane"
    except Exception as cause:  # of any material: one of two dimensions only, for example
        problem = f"in three dimensions it fails: {type(cause).__name__}: {cause}"
    if problem:
        raise SceneError(
            f"body {body.name!r}: the stress across the plane is not known of "
            f"{type(material).__name__}: {problem}; measure components of 'stress', or "
            "'principal-stress'"
        )


def _first_piola(material: Material, F: Array, history: Array | None) -> Array:
    """P in three dimensions, (k, 3, 3) [Pa], from F (k, d, d) and internal variables (k, ...)."""
    k, d, _ = F.shape
    wide = np.tile(np.eye(3), (k, 1, 1))
    wide[:, :d, :d] = F
    components, params = components_first(wide), material.params
    with np.errstate(all="ignore"):  # as in steps
        if not isinstance(material, HistoryMaterial) or history is None:
            return particles_first(material.first_piola(components, params), k)
        own = dict(zip(material.initial_history(d), history.T, strict=True))
        h = tuple(
            own.get(name, np.full(k, start)) for name, start in material.initial_history(3).items()
        )
        return particles_first(material.stress(components, h, params), k)
