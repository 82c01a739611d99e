"""Sums of a scene in double precision, whatever its engine."""

from __future__ import annotations

import sys

import numpy as np

from solidsph.engines.law_forces import LawForces
from solidsph.engines.matrix import MatrixEngine, MatrixForces
from solidsph.interfaces.engine import InternalForces
from solidsph.interfaces.terms import StressTerm
from solidsph.run.built_scene import BuiltScene


def sums_by_matrices(simulation: BuiltScene) -> MatrixForces:
    """The internal forces by sparse matrices, from which a tangent can be assembled."""
    internal = _own_sums(simulation)
    if isinstance(internal, MatrixForces):
        return internal
    conditions = [term for term in simulation.terms if isinstance(term, StressTerm)]
    prepared = MatrixEngine().prepare(simulation.model.bodies, conditions)
    assert isinstance(prepared, MatrixForces)
    return prepared


def sums_of_engine(simulation: BuiltScene) -> InternalForces:
    """The internal forces by the scene's own engine, if it counts in double precision.

    It must also tell the stiffness of every particle alone.
    """
    internal = _own_sums(simulation)
    if internal.precision > sys.float_info.epsilon:
        return sums_by_matrices(simulation)
    n, d = simulation.particles.positions.shape
    tells = internal.own_stiffness(np.zeros((n, d * d, d * d))) is not None
    return internal if tells else sums_by_matrices(simulation)


def _own_sums(simulation: BuiltScene) -> InternalForces:
    """The scene's own internal forces, without the internal variables that they advance."""
    internal = simulation.dynamics.internal
    return internal.sums if isinstance(internal, LawForces) else internal
