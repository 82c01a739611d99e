"""Static equilibrium of a scene by Newton's method."""

from __future__ import annotations

import logging
import time as clock
from collections.abc import Callable

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.model.particles import State
from solidsph.run.built_scene import BuiltScene
from solidsph.scene.static_solver import AUTOMATIC, SOLVERS
from solidsph.statics.increment import AT_REST
from solidsph.statics.newton import LoadStepError, Newton

LOG = logging.getLogger(__name__)

# Load steps shorter than this fraction of the initial one mean that the path ends.
_SHORTEST_LOAD_STEP = 2.0**-10

# After a load step of at most this many iterations, the next one is twice as long.
_QUICK = 4


@attrs.frozen
class LoadStep:
    """One equilibrium on the load path."""

    load_factor: float
    residuals: tuple[float, ...]  # relative imbalance before each iteration and at the end [-]


@attrs.frozen(eq=False)
class EquilibriumResult:
    """Equilibrium of a scene under the loads at the end of its duration."""

    state: State  # velocities are zero; `applied` and `work` hold loads and reactions
    steps: tuple[LoadStep, ...]
    iterations: int  # of Newton's method, those of failed load steps included
    residual: float  # norm of the imbalance over that of all applied forces [-]
    stable: bool | None  # last tangent positive; None if forces have no energy
    seconds: float  # wall time [s]
    products: int = 0  # with the tangent, by an iterative solver


def equilibrium(
    simulation: BuiltScene,
    *,
    load_steps: int | None = None,
    tolerance: float = 1e-9,
    max_iterations: int = 25,
    solver: str = AUTOMATIC,
    observer: Callable[[State], None] = lambda state: None,
) -> EquilibriumResult:
    """Find the displacements at which all forces on free particles balance.

    The load path (`LoadPath`) begins at the reference configuration without loads; the initial
    state of the scene plays no part. Formulas of t are followed over the duration, constants grow
    in proportion. A load step that fails is halved, and doubled after quick convergence, but not
    beyond the initial ones if a material remembers: its internal variables advance once a load
    step, over the time that it takes of the duration.

    Newton steps stretch a slender body that rotates, and plain iteration spends many steps on
    spurious membrane forces. Stresses are therefore treated like unknowns: the geometric stiffness
    uses the stress that the last step predicted (Magisano, Leonetti & Garcea 2017). Convergence
    stays quadratic, in a quarter of the iterations for a beam bent by a fifth of its length. So is
    the volume: in a nearly incompressible body a false one of a step would outweigh the shear
    modulus, and let motions fall that are stiff.

    Newton steps are halved while they invert a volume or fail Deuflhard's natural monotonicity
    test: with the same tangent, the next correction must be smaller, that of the actual stresses or
    that of the predicted ones.

    Args:
        simulation: a built scene in the total Lagrangian form.
        load_steps: initial number of equal load steps; by default `BuiltScene.load_steps`.
        tolerance: imbalance over the norm of loads and reactions [-].
        max_iterations: of Newton's method per load step.
        solver: of its linear systems. "direct" factorises the tangent; "iterative" takes conjugate
            gradients on the sums of the run; "automatic" what is faster.
        observer: called with the unloaded state, and with the state of every load step.

    Raises:
        ConvergenceError: no equilibrium was found; the error has the load factor and a remedy.
        SceneError: an argument is out of range.
        SolidsphError: the formulation or a motion has no constant linear operator.
    """
    load_steps = simulation.load_steps if load_steps is None else load_steps
    for name, value in (("load_steps", load_steps), ("max_iterations", max_iterations)):
        if value < 1:
            raise SceneError(f"equilibrium: {name} must be at least 1, got {value}")
    if solver not in SOLVERS:
        raise SceneError(f"equilibrium: solver must be one of {SOLVERS}, got {solver!r}")
    if not 0.0 < tolerance < 1.0:
        raise SceneError(f"equilibrium: tolerance must lie between 0 and 1, got {tolerance}")
    start = clock.perf_counter()
    newton = Newton.of(simulation, tolerance, max_iterations, solver)
    state = newton.state(None, np.zeros_like(simulation.particles.positions), AT_REST)
    observer(state)
    displacements = np.zeros_like(state.positions)
    steps: list[LoadStep] = []
    factor, step = 0.0, 1.0 / load_steps
    while factor < 1.0:
        # Rounding must not leave a tiny last step.
        target = 1.0 if factor + step > 1.0 - 1e-9 else factor + step
        increment = newton.path.increment(factor, target, state.memory, displacements)
        try:
            displacements, residuals = newton.solve(displacements, increment)
        except LoadStepError as failure:
            step *= 0.5
            LOG.info("load factor %.4g failed, and is halved: %s", target, failure.cause)
            if newton.hopeless or step < _SHORTEST_LOAD_STEP / load_steps:
                raise newton.error(failure, factor, increment) from None
            continue
        steps.append(LoadStep(target, residuals))
        LOG.info("load factor %.4g reached; iterations: %d", target, len(residuals) - 1)
        state = newton.state(state, displacements, increment)
        observer(state)
        factor = target
        if len(residuals) <= _QUICK + 1 and not (simulation.remembers and step >= 1.0 / load_steps):
            step *= 2.0
    return EquilibriumResult(
        state=state,
        steps=tuple(steps),
        iterations=newton.iterations,
        residual=steps[-1].residuals[-1],
        stable=newton.stable(),
        seconds=clock.perf_counter() - start,
        products=newton.solver.products,
    )
