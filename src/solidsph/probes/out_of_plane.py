"""The whole stress of a body in plane strain, or of a bar in uniaxial strain.

A material knows only the components of its dimension. Its law in three dimensions, at F with
stretches of 1 across, gives the others.
"""

from __future__ import annotations

import numpy as np

from solidsph.errors import SceneError
from solidsph.interfaces.body import Body
from solidsph.interfaces.history import History, HistoryMaterial
from solidsph.interfaces.law import memory_name
from solidsph.interfaces.material import Material
from solidsph.interfaces.memory import Memory
from solidsph.maths.arrays import Array, Indices
from solidsph.maths.tensors import components_first, particles_first

# A deformation, and a time, in which a law is tried, and how closely both dimensions must agree.
_TRIED = np.eye(3) + 0.1 * np.array([[2.0, 1.0, 0.0], [-0.5, 1.0, 0.0], [0.0, 0.0, 0.0]])
_STEP = 1e-3
_AGREEMENT = 1e-9


def whole_stress(body: Body, F: Array, rows: Indices, memory: Memory) -> Array:
    """Cauchy stress in three dimensions, (k, 3, 3) [Pa].

    Args:
        body: the body.
        F: deformation gradients of all its particles, (n, d, d).
        rows: the particles that are wanted, within the body, (k,).
        memory: `State.memory`.
    """
    material, d = body.material, F.shape[1]
    history: History = ()
    if isinstance(material, HistoryMaterial):
        name = memory_name(body)
        start = [np.full(len(F), value) for value in material.initial_history(d).values()]
        history = tuple(memory[name].T) if name in memory else tuple(start)
    own = tuple(values[rows] for values in history)
    P = _whole_first_piola(material, F[rows], own)
    if body.dilatation_filter is not None:
        added = body.dilatation_filter
        P += added.pressures(F)[rows, None, None] * added.slopes(_widened(F[rows]))
    wide, ratios = _widened(F[rows]), np.linalg.det(F[rows])[:, None, None]
    return np.asarray(np.einsum("pik,pjk->pij", P, wide) / ratios)


def check_whole_stress(body: Body, dimension: int) -> None:
    """Raise SceneError unless the law of a body agrees with its own in three dimensions."""
    material, d = body.material, dimension
    F = _TRIED[None, :d, :d]
    components, params = components_first(F), material.params
    problem = ""
    try:
        with np.errstate(all="ignore"):
            history: History = ()
            if isinstance(material, HistoryMaterial):
                start = tuple(np.full(1, value) for value in material.initial_history(d).values())
                history = material.advance(components, start, _STEP, params)
                P = material.stress(components, history, params)
            else:
                P = material.first_piola(components, params)
            plane = particles_first(P, 1)
            differs = np.abs(_whole_first_piola(material, F, history)[:, :d, :d] - plane).max()
        if not differs <= _AGREEMENT * np.abs(plane).max():
            problem = "in three dimensions it has other stresses in the plane"
    except Exception as cause:  # of any material: one of two dimensions only, for example
        problem = f"in three dimensions it fails: {type(cause).__name__}: {cause}"
    if problem:
        raise SceneError(
            f"body {body.name!r}: the stress across the plane is not known of "
            f"{type(material).__name__}: {problem}; measure components of 'stress', or "
            "'principal-stress'"
        )


def _whole_first_piola(material: Material, F: Array, history: History) -> Array:
    """P in three dimensions, (k, 3, 3) [Pa], from F (k, d, d) and internal variables."""
    k, d, _ = F.shape
    components, params = components_first(_widened(F)), material.params
    with np.errstate(all="ignore"):  # as in steps
        if isinstance(material, HistoryMaterial):
            h = material.history_in_space(history, d)
            return particles_first(material.stress(components, h, params), k)
        return particles_first(material.first_piola(components, params), k)


def _widened(F: Array) -> Array:
    """Deformation gradients (k, 3, 3) with stretches of 1 across, from (k, d, d)."""
    k, d, _ = F.shape
    wide = np.tile(np.eye(3), (k, 1, 1))
    wide[:, :d, :d] = F
    return wide
