"""Static equilibrium of a scene by Newton's method."""

from __future__ import annotations

import logging
import time as clock
from collections.abc import Callable

import attrs
import numpy as np

from solidsph.errors import ConvergenceError, PortableError, SceneError
from solidsph.maths.arrays import Array
from solidsph.model.particles import State
from solidsph.run.built_scene import BuiltScene
from solidsph.scene.static_solver import AUTOMATIC, SOLVERS
from solidsph.statics.factors import SingularError
from solidsph.statics.freedoms import Freedoms
from solidsph.statics.increment import AT_REST, Increment
from solidsph.statics.lead import Lead
from solidsph.statics.linearised import Linearised, LinearSolver, UnsolvedError
from solidsph.statics.load_path import Forces, LoadPath
from solidsph.statics.solvers import linear_system
from solidsph.statics.tangent import Tangent

LOG = logging.getLogger(__name__)

# Shorter fractions of a Newton step are not worth their cost.
_SHORTEST_STEP = 2.0**-8

# Load steps shorter than this fraction of the initial one mean that the path ends.
_SHORTEST_LOAD_STEP = 2.0**-10

# After a load step of at most this many iterations, the next one is twice as long.
_QUICK = 4

# Rounding error of a sum over neighbours, relative to the diagonal of K times the displacement.
_ROUNDING = 4.0 * np.finfo(np.float64).eps

# Largest imbalance by rounding, relative to all applied forces, that is accepted.
_MOST_ROUNDED = 1e-4

# What an iteration leaves of the forces, at least and at most, and its part of the tolerance.
_LEAST_LEFT, _MOST_LEFT, _SAFETY = 1e-3, 0.1, 0.3

_NOTHING_HOLDS = (
    "either the body is not fully clamped, or its gradients have a zero-energy mode; clamp it in "
    "every direction, or add hourglass control"
)
_TOO_SOFT = (
    "the body may be nearly free to move in some way: clamp it in every direction; or a material "
    "may be nearly incompressible: use solver = 'direct' if the body is small, or a damped motion"
)
_TOO_LITTLE = (
    "the loads deform the body by less than the rounding error of positions: apply larger loads, "
    "and scale the result down"
)
_PATH_ENDS = (
    "the load may exceed the capacity of the body (a limit point): impose a displacement "
    "instead, or run a damped motion; otherwise use more load_steps, or add hourglass control if "
    "neighbouring particles move against each other"
)


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


class _LoadStepError(PortableError):
    """A load step that must be repeated with a smaller increment."""

    def __init__(self, cause: str, remedy: str, displacements: Array) -> None:
        self.cause = cause
        self.remedy = remedy
        self.displacements = displacements
        super().__init__(cause)


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
    newton = _Newton.of(simulation, tolerance, max_iterations, solver)
    state = newton.state(None, np.zeros_like(simulation.particles.positions), AT_REST)
    observer(state)
    displacements = np.zeros_like(state.positions)
    steps: list[LoadStep] = []
    factor, step = 0.0, 1.0 / load_steps
    while factor < 1.0:
        # Rounding must not leave a tiny last step.
        target = 1.0 if factor + step > 1.0 - 1e-9 else factor + step
        increment = newton.path.increment(factor, target, state.memory)
        try:
            displacements, residuals = newton.solve(displacements, increment)
        except _LoadStepError as failure:
            step *= 0.5
            LOG.info("load factor %.4g failed, and is halved: %s", target, failure.cause)
            hopeless = newton.hopeless_at_rest or step < _SHORTEST_LOAD_STEP / load_steps
            if hopeless:
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


@attrs.frozen(eq=False)
class _Correction:
    """Newton's correction at one configuration."""

    tangent: Linearised
    pull: Array  # (k,) force on free displacements by the missing part of the imposed ones
    values: Array  # (k,) change of free displacements [m]
    size: float  # norm of about this change [m]

    def next_size(self, left: Array) -> float:
        """Norm of about the correction of forces (k,) with the same tangent [m]."""
        finite = bool(np.all(np.isfinite(left)))
        return float(np.linalg.norm(self.tangent.roughly(left))) if finite else float("inf")


@attrs.define(eq=False)
class _Newton:
    """Newton's method for one scene."""

    path: LoadPath
    tangent: Tangent
    solver: LinearSolver
    freedoms: Freedoms
    symmetric: bool
    tolerance: float
    max_iterations: int
    iterations: int = 0
    last: Linearised | None = None
    hopeless_at_rest: bool = False
    rounding: float = 0.0  # imbalance by rounding of displacements [N]
    coarsest: float = 0.0  # imbalance by rounding of positions [N]

    @classmethod
    def of(
        cls, simulation: BuiltScene, tolerance: float, max_iterations: int, solver: str
    ) -> _Newton:
        system = linear_system(simulation, solver)
        return cls(
            path=LoadPath.of(simulation, system.internal),
            tangent=system.tangent,
            solver=system.solver,
            freedoms=system.freedoms,
            symmetric=system.symmetric,
            tolerance=tolerance,
            max_iterations=max_iterations,
        )

    def solve(self, start: Array, increment: Increment) -> tuple[Array, tuple[float, ...]]:
        """Displacements (n, d) in equilibrium after a load step, and the residuals of iterations.

        Each step applies the same fraction of the missing imposed motion and of the change of the
        free displacements, so that a large imposed motion does not crush the particles beside it.
        """
        u, lead, factor = start, None, increment.factor
        missing = self.path.placed(u, factor) - u
        forces = self.path.forces(u, increment)
        residuals = [self._relative(forces)]
        if not (missing.any() or self._imbalance(forces).any()):
            return u, tuple(residuals)
        for _ in range(self.max_iterations):
            correction = self._correction(u, lead, missing, forces, increment)
            try:
                u, lead = self._advanced(u, missing, increment, correction)
            except _LoadStepError:
                if missing.any() or not self._rounded(forces):
                    raise
                return u, tuple(residuals)
            missing = self.path.placed(u, factor) - u
            forces = self.path.forces(u, increment)
            residuals.append(self._relative(forces))
            LOG.debug("load factor %.4g: imbalance %.3g", factor, residuals[-1])
            if not missing.any() and self._converged(forces):
                return u, tuple(residuals)
        if not missing.any() and self._rounded(forces):
            return u, tuple(residuals)
        raise _LoadStepError(
            f"{self.max_iterations} iterations leave an imbalance of {residuals[-1]:.3g} of the "
            "applied forces",
            self._remedy(forces),
            u,
        )

    def _correction(
        self,
        u: Array,
        lead: Lead | None,
        missing: Array,
        forces: Forces,
        increment: Increment,
    ) -> _Correction:
        """Change of the free displacements if all of `missing` (n, d) is imposed."""
        self.iterations += 1
        try:
            tangent = self.solver.linearised(u, lead, increment)
            pull = tangent.pull(missing)
            left = self._imbalance(forces) - pull
            values = tangent.solve(left, self._accuracy(left, forces))
        except SingularError as error:
            self.hopeless_at_rest = not u.any()
            raise _LoadStepError(self._free_motion(error), _NOTHING_HOLDS, u) from None
        except UnsolvedError as error:
            self.hopeless_at_rest = not u.any()
            raise _LoadStepError(str(error), _TOO_SOFT, u) from None
        free, x = self.freedoms.free, self.path.simulation.particles.positions + u
        self.rounding = _ROUNDING * float(np.linalg.norm(tangent.diagonal * np.abs(u[free])))
        self.coarsest = _ROUNDING * float(np.linalg.norm(tangent.diagonal * np.abs(x[free])))
        self.last = tangent
        return _Correction(tangent, pull, values, float(np.linalg.norm(tangent.roughly(left))))

    def _accuracy(self, left: Array, forces: Forces) -> float:
        """What an iteration may leave of the forces: no more digits than are asked for."""
        norm = float(np.linalg.norm(left))
        enough = _SAFETY * max(self.tolerance * forces.scale, self.rounding) / norm if norm else 1.0
        return min(max(enough, _LEAST_LEFT), _MOST_LEFT)

    def _advanced(
        self, u: Array, missing: Array, increment: Increment, newton: _Correction
    ) -> tuple[Array, Lead]:
        """Displacements after the largest acceptable fraction of a step, and its lead."""
        laws = self.tangent.during(increment)
        direction = self.freedoms.expanded(newton.values) + missing
        length = 1.0
        while length >= _SHORTEST_STEP:
            trial = u + length * direction
            if length == 1.0:
                trial = self.path.placed(trial, increment.factor)  # removes rounding
            if np.all(self.path.volume_ratios(trial) > 0.0):
                lead = laws.lead(u, length * direction, trial)
                forces = self.path.forces(trial, increment)
                predicted = self.tangent.forces_ahead(trial, lead).ravel()
                missed = self._imbalance(forces) - (1.0 - length) * newton.pull
                # With the stress that is there, and with the one that the step predicted.
                both = missed, missed + self.freedoms.reduction @ predicted
                # Deuflhard (2004), section 3.3: the restricted natural monotonicity test.
                allowed = (1.0 - 0.25 * length) * newton.size
                if self._converged(forces) or min(map(newton.next_size, both)) <= allowed:
                    return trial, lead
            length *= 0.5
        cause = "no fraction of the Newton step reduces the imbalance"
        raise _LoadStepError(cause, self._remedy(self.path.forces(u, increment)), u)

    def stable(self) -> bool | None:
        """Whether the last tangent resists every motion; None if the forces have no energy.

        The stiffness of a load that follows its surface need not be symmetric. Where a path of
        equilibria turns or branches, it loses its resistance all the same.
        """
        return self.last.positive() if self.symmetric and self.last is not None else None

    def _free_motion(self, error: SingularError) -> str:
        if error.freedom is None:
            return "the tangent is singular"
        particle, axis = (int(k) for k in np.argwhere(self.freedoms.free)[error.freedom])
        return (
            f"the tangent is singular, with free motion of particle {particle} along {'xyz'[axis]}"
        )

    def _imbalance(self, forces: Forces) -> Array:
        """Force on the free displacements, (k,)."""
        free: Array = forces.total[self.freedoms.free]
        return free

    def _converged(self, forces: Forces) -> bool:
        allowed = max(self.tolerance * forces.scale, self.rounding)
        return bool(np.linalg.norm(self._imbalance(forces)) <= allowed)

    def _rounded(self, forces: Forces) -> bool:
        """Whether an imbalance that no step reduces is rounding of positions.

        Positions do not resolve tiny displacements: a metre of steel pulled by 1 Pa moves by
        5e-12 m, and positions are rounded to 1e-16 m.
        """
        imbalance = float(np.linalg.norm(self._imbalance(forces)))
        return imbalance <= min(self.coarsest, _MOST_ROUNDED * forces.scale)

    def _remedy(self, forces: Forces) -> str:
        """What to do where no step reduces the imbalance."""
        imbalance = float(np.linalg.norm(self._imbalance(forces)))
        return _TOO_LITTLE if imbalance <= self.coarsest else _PATH_ENDS

    def _relative(self, forces: Forces) -> float:
        imbalance, scale = float(np.linalg.norm(self._imbalance(forces))), forces.scale
        if scale > 0.0:
            return imbalance / scale
        return 0.0 if imbalance == 0.0 else float("inf")

    def state(self, before: State | None, displacements: Array, increment: Increment) -> State:
        """State at rest after a load step, with the work since `before`."""
        positions = self.path.simulation.particles.positions + displacements
        rest = np.zeros_like(positions)
        forces = self.path.forces(displacements, increment)
        applied = forces.applied
        if before is None:
            return State(
                time=0.0,
                step=0,
                positions=positions,
                velocities=rest,
                accelerations=rest,
                applied=applied,
                work=dict.fromkeys(applied, 0.0),
                memory=forces.remembered,
            )
        return before.advanced(
            time=increment.time,
            positions=positions,
            velocities=rest,
            accelerations=rest,
            applied=applied,
            memory=forces.remembered,
        )

    def error(self, failure: _LoadStepError, reached: float, tried: Increment) -> ConvergenceError:
        """Error of a load step that cannot be shortened any further."""
        forces = self.path.forces(failure.displacements, tried)
        free_force = np.where(self.freedoms.free, forces.total, 0.0)
        worst = int(np.argmax(np.linalg.norm(free_force, axis=1)))
        return ConvergenceError(
            load_factor=reached,
            tried=tried.factor,
            residual=self._relative(forces),
            particle=worst,
            volume_ratio=float(self.path.volume_ratios(failure.displacements)[worst]),
            cause=failure.cause,
            remedy=failure.remedy,
        )
