"""Newton's method for the equilibrium at the end of a load step."""

from __future__ import annotations

import logging

import attrs
import numpy as np

from solidsph.errors import ConvergenceError, PortableError
from solidsph.maths.arrays import Array
from solidsph.model.particles import State
from solidsph.run.built_scene import BuiltScene
from solidsph.statics.factors import SingularError
from solidsph.statics.freedoms import Freedoms
from solidsph.statics.increment import Increment
from solidsph.statics.lead import Lead
from solidsph.statics.linearised import Linearised, LinearSolver, UnsolvedError
from solidsph.statics.load_path import Forces, LoadPath
from solidsph.statics.solvers import linear_system
from solidsph.statics.tangent import Tangent

LOG = logging.getLogger(__name__)

# Shorter fractions of a Newton step are not worth their cost.
_SHORTEST_STEP = 2.0**-8

# A body in need of support moves by this part of a spacing at most in an iteration: it meets what
# will hold it without sinking far into it. The support, over the own stiffness, is found in so
# many trials, from the least.
_APPROACH = 0.1
_LEAST_SUPPORT, _TRIALS = 1e-8, 8

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
_MEETS_NOTHING = (
    "push the body towards what is to hold it, and place it within two spacings of that; or clamp "
    "it in every direction"
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


class LoadStepError(PortableError):
    """A load step that must be repeated with a smaller increment."""

    def __init__(self, cause: str, remedy: str, displacements: Array) -> None:
        self.cause = cause
        self.remedy = remedy
        self.displacements = displacements
        super().__init__(cause)


@attrs.frozen(eq=False)
class _Iterate:
    """Where an iteration begins."""

    u: Array  # (n, d) [m]
    lead: Lead | None  # of the step that led there
    missing: Array  # (n, d) of the imposed motion [m]
    forces: Forces


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
class Newton:
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
    hopeless: bool = False
    rounding: float = 0.0  # imbalance by rounding of displacements [N]
    coarsest: float = 0.0  # imbalance by rounding of positions [N]

    @classmethod
    def of(
        cls, simulation: BuiltScene, tolerance: float, max_iterations: int, solver: str
    ) -> Newton:
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
        at = self._at(start, None, self.path.forces(start, increment), increment)
        residuals, adrift = [self._relative(at.forces)], True
        if not (at.missing.any() or self._imbalance(at.forces).any()):
            return at.u, tuple(residuals)
        for _ in range(self.max_iterations):
            try:
                at = self._iterated(at, increment)
            except LoadStepError:
                if self._cannot_improve(at):
                    return at.u, tuple(residuals)
                raise
            adrift = adrift and self.last is not None and bool(self.last.support.any())
            residuals.append(self._relative(at.forces))
            LOG.debug("load factor %.4g: imbalance %.3g", increment.factor, residuals[-1])
            if not at.missing.any() and self._converged(at.forces):
                return at.u, tuple(residuals)
        if self._cannot_improve(at):
            return at.u, tuple(residuals)
        if adrift:
            self.hopeless = True
            raise LoadStepError("a body meets nothing that holds it", _MEETS_NOTHING, at.u)
        raise LoadStepError(
            f"{self.max_iterations} iterations leave an imbalance of {residuals[-1]:.3g} of the "
            "applied forces",
            self._remedy(at.forces),
            at.u,
        )

    def _at(self, u: Array, lead: Lead | None, forces: Forces, increment: Increment) -> _Iterate:
        """The iterate at displacements (n, d) [m], with the `forces` there."""
        return _Iterate(u, lead, self.path.placed(u, increment.factor) - u, forces)

    def _iterated(self, at: _Iterate, increment: Increment) -> _Iterate:
        """Where an iteration leads.

        A body that only others hold, or a wall, may touch none, or so few particles that a step
        throws it far: forces that begin at once are not in the tangent. Support then keeps the step
        short: springs that are unstrained where the iteration begins, so that equilibria do not
        depend on them (pseudo-transient continuation, Kelley & Keyes 1998).
        """
        self.iterations += 1
        try:
            return self._advanced(at, increment, self._correction(at, increment))
        except SingularError as error:
            if not self.path.may_meet:
                self.hopeless = not at.u.any()
                raise LoadStepError(self._free_motion(error), _NOTHING_HOLDS, at.u) from None
        except UnsolvedError as error:
            if not self.path.may_meet:
                self.hopeless = not at.u.any()
                raise LoadStepError(str(error), _TOO_SOFT, at.u) from None
        except LoadStepError:
            if not self.path.may_meet or self._cannot_improve(at):
                raise
        try:
            return self._advanced(at, increment, self._supported(at, increment))
        except (SingularError, UnsolvedError) as error:
            raise LoadStepError(str(error), _NOTHING_HOLDS, at.u) from None

    def _supported(self, at: _Iterate, increment: Increment) -> _Correction:
        """The correction with so much support that it moves no particle further than allowed."""
        support, allowed = _LEAST_SUPPORT, _APPROACH * self.path.spacing
        correction = self._correction(at, increment, support)
        for _ in range(_TRIALS):
            furthest = float(np.abs(correction.values).max())
            if furthest <= allowed:
                break
            support *= 1.1 * furthest / allowed
            correction = self._correction(at, increment, support)
        return correction

    def _correction(self, at: _Iterate, increment: Increment, support: float = 0.0) -> _Correction:
        """Change of the free displacements if all of the missing motion is imposed.

        Raises:
            SingularError: some motion has no stiffness.
            UnsolvedError: an iteration does not converge.
        """
        tangent = self.solver.linearised(at.u, at.lead, increment, support)
        pull = tangent.pull(at.missing)
        left = self._imbalance(at.forces) - pull
        values = tangent.solve(left, self._accuracy(left, at.forces))
        free, x = self.freedoms.free, self.path.simulation.particles.positions + at.u
        self.rounding = _ROUNDING * float(np.linalg.norm(tangent.diagonal * np.abs(at.u[free])))
        self.coarsest = _ROUNDING * float(np.linalg.norm(tangent.diagonal * np.abs(x[free])))
        self.last = tangent
        return _Correction(tangent, pull, values, float(np.linalg.norm(tangent.roughly(left))))

    def _accuracy(self, left: Array, forces: Forces) -> float:
        """What an iteration may leave of the forces: no more digits than are asked for."""
        norm = float(np.linalg.norm(left))
        enough = _SAFETY * max(self.tolerance * forces.scale, self.rounding) / norm if norm else 1.0
        return min(max(enough, _LEAST_LEFT), _MOST_LEFT)

    def _advanced(self, at: _Iterate, increment: Increment, newton: _Correction) -> _Iterate:
        """Where the largest acceptable fraction of a step leads."""
        u, missing = at.u, at.missing
        laws = self.tangent.during(increment)
        direction = self.freedoms.expanded(newton.values) + missing
        length, whole = 1.0, None
        while length >= _SHORTEST_STEP:
            trial = u + length * direction
            if length == 1.0:
                trial = self.path.placed(trial, increment.factor)  # removes rounding
            if np.all(self.path.volume_ratios(trial) > 0.0):
                lead = laws.lead(u, length * direction, trial)
                forces = self.path.forces(trial, increment)
                there = self._at(trial, lead, forces, increment)
                if self._converged(forces) or self._smaller(there, newton, length):
                    return there
                if length == 1.0:
                    whole = there
            length *= 0.5
        if whole is not None and newton.tangent.support.any():
            return whole  # it has met what will hold it, and forces begin at once
        cause = "no fraction of the Newton step reduces the imbalance"
        raise LoadStepError(cause, self._remedy(at.forces), u)

    def _smaller(self, there: _Iterate, newton: _Correction, length: float) -> bool:
        """Whether the next correction with the same tangent is smaller, after a fraction of a step.

        Deuflhard (2004), section 3.3: the restricted natural monotonicity test, with the stress
        that is there or with the one that the step predicted.
        """
        allowed = (1.0 - 0.25 * length) * newton.size
        missed = self._imbalance(there.forces) - (1.0 - length) * newton.pull
        missed -= length * newton.tangent.support * newton.values
        if newton.next_size(missed) <= allowed:
            return True
        assert there.lead is not None, "a step has led there"
        predicted = self.tangent.forces_ahead(there.u, there.lead).ravel()
        return newton.next_size(missed + self.freedoms.reduction @ predicted) <= allowed

    def stable(self) -> bool | None:
        """Whether the last tangent resists every motion; None if the forces have no energy.

        The stiffness of a load that follows its surface need not be symmetric. Where a path of
        equilibria turns or branches, it loses its resistance all the same.
        """
        if not self.symmetric or self.last is None:
            return None
        return not self.last.support.any() and self.last.positive()

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

    def _cannot_improve(self, at: _Iterate) -> bool:
        """Whether nothing is missing but what rounding hides."""
        return not at.missing.any() and self._rounded(at.forces)

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

    def error(self, failure: LoadStepError, reached: float, tried: Increment) -> ConvergenceError:
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
