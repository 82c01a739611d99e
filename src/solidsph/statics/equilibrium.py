"""Equilibrium of a scene at rest, by Newton's method on the sparse tangent."""

from __future__ import annotations

import time as clock
from collections.abc import Callable

import attrs
import numpy as np

from solidsph.errors import ConvergenceError, PortableError, SceneError
from solidsph.maths.arrays import Array
from solidsph.model.particles import State
from solidsph.run.built_scene import BuiltScene
from solidsph.statics.factors import Factors, SingularError, factorised
from solidsph.statics.freedoms import Freedoms, freedoms
from solidsph.statics.load_path import Forces, LoadPath
from solidsph.statics.tangent import Tangent, is_symmetric

# A step shorter than this part of Newton's makes too little way to be worth its cost.
_SHORTEST_STEP = 2.0**-8

# Load steps this much shorter than the first asked for show that the path ends.
_SHORTEST_LOAD_STEP = 2.0**-10

# Solved in so few iterations, the next load step may be twice as long.
_QUICK = 4

# Rounding of a sum over neighbours, in units of a diagonal entry of K times the displacement.
_ROUNDING = 4.0 * np.finfo(np.float64).eps

# Where rounding leaves more of what is applied, an equilibrium is of no use.
_MOST_ROUNDED = 1e-4

_NOTHING_HOLDS = (
    "either nothing holds the body, or its gradients leave a pattern of motion without energy; "
    "clamp it in every direction, or add hourglass control"
)
_TOO_LITTLE = (
    "what is applied deforms the body by less than positions can hold in double precision: apply "
    "more, and scale the result down"
)
_PATH_ENDS = (
    "the load may exceed what the body can carry (a limit point): impose a displacement in its "
    "place, or follow it in time with damping; if not, take more load_steps, or add hourglass "
    "control if neighbouring particles move against each other"
)


@attrs.frozen
class LoadStep:
    """One equilibrium on the path."""

    load_factor: float
    residuals: tuple[float, ...]  # imbalance over loads before every iteration, and at the end [-]


@attrs.frozen(eq=False)
class EquilibriumResult:
    """The scene at rest under its loads at the end of its duration."""

    state: State  # velocities are zero; `applied` and `work` hold loads and reactions
    steps: tuple[LoadStep, ...]
    iterations: int  # factorisations in all, those of failed load steps included
    residual: float  # norm of the imbalance over that of all that is applied [-]
    stable: (
        bool | None
    )  # whether the last tangent was positive definite; None if it is not symmetric
    seconds: float  # wall time [s]


class _LoadStepError(PortableError):
    """A load step that must be tried again, shorter."""

    def __init__(self, cause: str, remedy: str, displacements: Array) -> None:
        self.cause = cause
        self.remedy = remedy
        self.displacements = displacements
        super().__init__(cause)


def equilibrium(
    simulation: BuiltScene,
    *,
    load_steps: int = 1,
    tolerance: float = 1e-9,
    max_iterations: int = 25,
    observer: Callable[[State], None] = lambda state: None,
) -> EquilibriumResult:
    """Displacements at which all forces on free particles balance.

    The path begins at the reference configuration with nothing imposed; initial displacements
    and velocities of the scene play no part. Along it, formulas in t are followed over the
    duration, and constants are brought on in proportion (`LoadPath`). A load step that fails is
    halved, and doubled again after quick success, so `load_steps` is but the first guess.

    Where a slender body swings through an angle, Newton's step stretches it, and plain iteration
    spends itself on forces far above the load that come and go. So stresses are treated as if
    they were unknowns too: the tangent takes the stress that turns with the body as the last step
    predicted it (Magisano, Leonetti & Garcea 2017). It converges quadratically to the same
    equilibrium, in a quarter of the iterations for a beam bent by a fifth of its length.

    Newton's steps are halved while they turn a volume over or fail Deuflhard's natural
    monotonicity test: with the same tangent, the next correction must be smaller.

    Args:
        simulation: a built scene in the total Lagrangian form.
        load_steps: equal steps to begin with.
        tolerance: imbalance over the norm of loads and reactions [-].
        max_iterations: of Newton's method in a load step.
        observer: told the state without loads, and then that of every load step.

    Raises:
        ConvergenceError: no equilibrium was found at some load factor: where, and what to do.
        SceneError: an argument is out of range.
        SolidsphError: the formulation or a motion has no constant linear operator.
    """
    for name, value in (("load_steps", load_steps), ("max_iterations", max_iterations)):
        if value < 1:
            raise SceneError(f"equilibrium: {name} must be at least 1, got {value}")
    if not 0.0 < tolerance < 1.0:
        raise SceneError(f"equilibrium: tolerance must lie between 0 and 1, got {tolerance}")
    begun = clock.perf_counter()
    newton = _Newton.of(simulation, tolerance, max_iterations)
    state = newton.state(None, np.zeros_like(simulation.particles.positions), 0.0)
    observer(state)
    displacements = np.zeros_like(state.positions)
    steps: list[LoadStep] = []
    factor, step = 0.0, 1.0 / load_steps
    while factor < 1.0:
        # Rounding must not leave a last step of no length.
        target = 1.0 if factor + step > 1.0 - 1e-9 else factor + step
        try:
            displacements, residuals = newton.balanced(displacements, target)
        except _LoadStepError as failure:
            step *= 0.5
            hopeless = newton.singular_at_rest or step < _SHORTEST_LOAD_STEP / load_steps
            if hopeless:
                raise newton.error(failure, factor, target) from None
            continue
        steps.append(LoadStep(target, residuals))
        state = newton.state(state, displacements, target)
        observer(state)
        factor = target
        if len(residuals) <= _QUICK + 1:
            step *= 2.0
    return EquilibriumResult(
        state=state,
        steps=tuple(steps),
        iterations=newton.iterations,
        residual=steps[-1].residuals[-1],
        stable=newton.stable(),
        seconds=clock.perf_counter() - begun,
    )


@attrs.frozen(eq=False)
class _Correction:
    """Newton's correction at one place."""

    factors: Factors
    pull: Array  # (k,) force on the free displacements from those still missing of the imposed
    values: Array  # (k,) change of the free displacements [m]


@attrs.define(eq=False)
class _Newton:
    """Newton's method on one scene."""

    path: LoadPath
    tangent: Tangent
    freedoms: Freedoms
    symmetric: bool
    tolerance: float
    max_iterations: int
    iterations: int = 0
    last: Factors | None = None
    singular_at_rest: bool = False
    rounding: float = 0.0  # imbalance that is rounding of displacements alone [N]
    coarsest: float = 0.0  # that rounding of positions may leave, too [N]

    @classmethod
    def of(cls, simulation: BuiltScene, tolerance: float, max_iterations: int) -> _Newton:
        own = freedoms(simulation.dynamics)
        return cls(
            path=LoadPath.of(simulation),
            tangent=Tangent.of(simulation),
            freedoms=own,
            symmetric=own.adjoint and is_symmetric(simulation),
            tolerance=tolerance,
            max_iterations=max_iterations,
        )

    def balanced(self, start: Array, factor: float) -> tuple[Array, tuple[float, ...]]:
        """Displacements (n, d) in equilibrium at `factor`, and the residuals on the way to them.

        Newton's unknowns are all displacements: what is missing of the imposed motion is made
        up in proportion with each step, and the free displacements go with it at once, so that
        a large imposed motion does not first crush the particles beside it.
        """
        u, ahead = start, None
        missing = self.path.placed(u, factor) - u
        forces = self.path.forces(u, factor)
        residuals = [self._relative(forces)]
        if not (missing.any() or self._imbalance(forces).any()):
            return u, tuple(residuals)
        for _ in range(self.max_iterations):
            correction = self._correction(u, ahead, missing, forces, self.path.time(factor))
            try:
                u, ahead = self._advanced(u, missing, factor, correction)
            except _LoadStepError:
                if missing.any() or not self._rounded(forces):
                    raise
                return u, tuple(residuals)
            missing = self.path.placed(u, factor) - u
            forces = self.path.forces(u, factor)
            residuals.append(self._relative(forces))
            if not missing.any() and self._converged(forces):
                return u, tuple(residuals)
        if not missing.any() and self._rounded(forces):
            return u, tuple(residuals)
        raise _LoadStepError(
            f"{self.max_iterations} iterations leave an imbalance of {residuals[-1]:.3g} of what "
            "is applied",
            _PATH_ENDS,
            u,
        )

    def _correction(
        self, u: Array, ahead: Array | None, missing: Array, forces: Forces, time: float
    ) -> _Correction:
        """Newton's change of the free displacements, with `missing` (n, d) imposed too."""
        matrix = self.tangent.matrix(u, ahead, time)
        reduced = self.freedoms.reduced(matrix)
        self.iterations += 1
        free, diagonal = self.freedoms.free, reduced.diagonal()
        x = self.path.simulation.particles.positions + u
        self.rounding = _ROUNDING * float(np.linalg.norm(diagonal * np.abs(u[free])))
        self.coarsest = _ROUNDING * float(np.linalg.norm(diagonal * np.abs(x[free])))
        try:
            factors = factorised(reduced, symmetric=self.symmetric)
        except SingularError as found:
            self.singular_at_rest = not u.any()
            raise _LoadStepError(self._free_motion(found), _NOTHING_HOLDS, u) from None
        self.last = factors
        pull = self.freedoms.reduction @ (matrix @ missing.ravel())
        return _Correction(factors, pull, factors.solve(self._imbalance(forces) - pull))

    def _advanced(
        self, u: Array, missing: Array, factor: float, newton: _Correction
    ) -> tuple[Array, Array]:
        """As much of Newton's step as is safe: displacements, and stress predicted ahead."""
        direction = self.freedoms.expanded(newton.values) + missing
        size = float(np.linalg.norm(newton.values))
        length = 1.0
        while length >= _SHORTEST_STEP:
            trial = u + length * direction
            if length == 1.0:
                trial = self.path.placed(trial, factor)  # to the last digit
            if np.all(self.path.volume_ratios(trial) > 0.0):
                ahead = self.tangent.ahead(u, length * direction, trial)
                forces = self.path.forces(trial, factor)
                predicted = self.tangent.forces_ahead(trial, ahead).ravel()
                left = self._imbalance(forces) + self.freedoms.reduction @ predicted
                left -= (1.0 - length) * newton.pull
                if np.all(np.isfinite(left)):
                    next_size = float(np.linalg.norm(newton.factors.solve(left)))
                    # Deuflhard (2004), section 3.3: the restricted natural monotonicity test.
                    if next_size <= (1.0 - 0.25 * length) * size or self._converged(forces):
                        return trial, ahead
            length *= 0.5
        cause = "no part of Newton's step brings the forces nearer to balance"
        imbalance = float(np.linalg.norm(self._imbalance(self.path.forces(u, factor))))
        raise _LoadStepError(cause, _TOO_LITTLE if imbalance <= self.coarsest else _PATH_ENDS, u)

    def stable(self) -> bool | None:
        """Whether the last tangent was positive definite; None if nobody can tell."""
        return self.last.positive if self.symmetric and self.last is not None else None

    def _free_motion(self, found: SingularError) -> str:
        if found.freedom is None:
            return "the tangent is singular"
        particle, axis = (int(k) for k in np.argwhere(self.freedoms.free)[found.freedom])
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
        """Whether an imbalance that no step reduces is but rounding.

        Under a small load positions do not hold all digits of the displacements: those of a metre
        of steel that is pulled by 1 Pa are 5e-12 m, and positions end at 1e-16 m.
        """
        imbalance = float(np.linalg.norm(self._imbalance(forces)))
        return imbalance <= min(self.coarsest, _MOST_ROUNDED * forces.scale)

    def _relative(self, forces: Forces) -> float:
        imbalance, scale = float(np.linalg.norm(self._imbalance(forces))), forces.scale
        if scale > 0.0:
            return imbalance / scale
        return 0.0 if imbalance == 0.0 else float("inf")

    def state(self, before: State | None, displacements: Array, factor: float) -> State:
        """The state at rest, with the work done since `before`."""
        positions = self.path.simulation.particles.positions + displacements
        rest = np.zeros_like(positions)
        applied = self.path.forces(displacements, factor).applied
        if before is None:
            return State(
                time=0.0,
                step=0,
                positions=positions,
                velocities=rest,
                accelerations=rest,
                applied=applied,
                work=dict.fromkeys(applied, 0.0),
            )
        return before.advanced(
            time=self.path.time(factor),
            positions=positions,
            velocities=rest,
            accelerations=rest,
            applied=applied,
            memory={},
        )

    def error(self, failure: _LoadStepError, reached: float, tried: float) -> ConvergenceError:
        """What to tell of a load step that cannot be made any shorter."""
        forces = self.path.forces(failure.displacements, tried)
        free_force = np.where(self.freedoms.free, forces.total, 0.0)
        worst = int(np.argmax(np.linalg.norm(free_force, axis=1)))
        return ConvergenceError(
            load_factor=reached,
            tried=tried,
            residual=self._relative(forces),
            particle=worst,
            volume_ratio=float(self.path.volume_ratios(failure.displacements)[worst]),
            cause=failure.cause,
            remedy=failure.remedy,
        )
