"""The linear solver of a scene's equilibrium, and the sums that it works on."""

from __future__ import annotations

import attrs

from solidsph.engines.law_forces import with_laws
from solidsph.errors import SceneError
from solidsph.interfaces.engine import InternalForces
from solidsph.interfaces.terms import StressTerm
from solidsph.run.built_scene import BuiltScene
from solidsph.scene.static_solver import ITERATIVE, iterates
from solidsph.statics.direct import DirectSolver
from solidsph.statics.filtered_solver import FilteredSolver
from solidsph.statics.freedoms import Freedoms, freedoms
from solidsph.statics.linearised import LinearSolver
from solidsph.statics.sums import sums_by_matrices, sums_of_engine
from solidsph.statics.tangent import Tangent, is_symmetric


@attrs.frozen(eq=False)
class LinearSystem:
    """The tangent of a scene, its free displacements, and a solver for them."""

    internal: InternalForces  # in double precision, with what the bodies remember
    tangent: Tangent
    freedoms: Freedoms
    symmetric: bool  # forces derive from an energy
    solver: LinearSolver


def linear_system(simulation: BuiltScene, solver: str) -> LinearSystem:
    """The system of a scene with a solver of `scene.static_solver`.

    Raises:
        SceneError: the scene does not allow iteration.
        SolidsphError: a formulation is not the total Lagrangian form.
    """
    free = freedoms(simulation.dynamics)
    symmetric = free.adjoint and is_symmetric(simulation)
    hindrance = _hindrance(simulation, free, symmetric)
    if solver == ITERATIVE and hindrance:
        raise SceneError(
            f"statics: solver {ITERATIVE!r} is given, but {hindrance}; use 'direct', or none"
        )
    if hindrance or not iterates(solver, simulation.particles.dimension, free.count):
        sums: InternalForces = sums_by_matrices(simulation)
        tangent = Tangent.of(simulation, sums)
        direct: LinearSolver = DirectSolver(tangent, free, symmetric)
        if symmetric and simulation.model.filters:
            direct = FilteredSolver(tangent, free)
        return LinearSystem(_whole(simulation, sums), tangent, free, symmetric, direct)
    from solidsph.statics.iterative import IterativeSolver  # brings the compiler with it

    sums = sums_of_engine(simulation)
    tangent = Tangent.of(simulation, sums)
    iterative = IterativeSolver.of(simulation, tangent, free)
    return LinearSystem(_whole(simulation, sums), tangent, free, symmetric, iterative)


def _whole(simulation: BuiltScene, sums: InternalForces) -> InternalForces:
    conditions = [term for term in simulation.terms if isinstance(term, StressTerm)]
    return with_laws(sums, simulation.model.bodies, conditions)


def _hindrance(simulation: BuiltScene, free: Freedoms, symmetric: bool) -> str | None:
    """What in a scene keeps conjugate gradients from it."""
    if not symmetric:
        return "the forces have no energy (their divergence or a constraint is not adjoint)"
    if free.expansion.nnz > free.count or any(isinstance(t, StressTerm) for t in simulation.terms):
        return "ghosts follow the particles"
    if free.count == 0:
        return "nothing is free to move"
    return None
