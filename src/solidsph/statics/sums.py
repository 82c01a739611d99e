"""Internal forces of a scene in double precision, whatever its engine."""

from __future__ import annotations

import sys

from solidsph.engines.matrix import MatrixEngine, MatrixForces
from solidsph.interfaces.engine import InternalForces
from solidsph.interfaces.terms import StressTerm
from solidsph.run.built_scene import BuiltScene


def sums_by_matrices(simulation: BuiltScene) -> MatrixForces:
    """The internal forces by sparse matrices, from which a tangent can be assembled."""
    internal = simulation.dynamics.internal
    if isinstance(internal, MatrixForces):
        return internal
    conditions = [term for term in simulation.terms if isinstance(term, StressTerm)]
    prepared = MatrixEngine().prepare(simulation.model.bodies, conditions)
    assert isinstance(prepared, MatrixForces)
    return prepared


def sums_of_engine(simulation: BuiltScene) -> InternalForces:
    """The internal forces by the scene's own engine, if it counts in double precision."""
    internal = simulation.dynamics.internal
    exact = internal.precision <= sys.float_info.epsilon
    return internal if exact else sums_by_matrices(simulation)
