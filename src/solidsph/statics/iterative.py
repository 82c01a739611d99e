"""IterativeSolver: conjugate gradients on the sums of the run, without a matrix of the tangent."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import final

import attrs
import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.linalg import LinearOperator, minres

from solidsph.maths.arrays import Array
from solidsph.maths.conjugate_gradients import Solution, conjugate_gradients
from solidsph.run.built_scene import BuiltScene
from solidsph.statics.alternation import alternating_signs
from solidsph.statics.coarse_space import CoarseSpace
from solidsph.statics.factors import Factors, SingularError, factorise
from solidsph.statics.freedoms import Freedoms
from solidsph.statics.linearised import Linearised, LinearSolver, UnsolvedError
from solidsph.statics.tangent import Tangent

# Random vectors that estimate the diagonal, each to about 0.8 / sqrt(count) of itself.
_PROBES = 32

# The estimate of a particle is at least this part of the median.
_LEAST = 0.1

# Share of the correction by alternating functions. Their stiffness on the grid is somewhat too
# small, because it leaves out how the functions bend.
_SHARE = 0.4

# Iterations of one solution.
_MOST = 5000

# What the solution that looks for a soft or falling motion leaves of its smooth forces.
_LOOK = 1e-3


@final
@attrs.define(eq=False)
class IterativeSolver(LinearSolver):
    """Conjugate gradients with a preconditioner of coarse grids and the diagonal.

    A product with the tangent is two passes over the neighbours, as one evaluation of the forces.
    What changes over several spacings is solved on a coarse grid; so is what alternates along the
    rows of a lattice, which the gradients do not see. The diagonal is left with the rest.
    (Nocedal & Wright 2006, algorithm 5.3; two levels, added up: Smith, Bjorstad & Gropp 1996,
    chapter 2; the diagonal: Bekas, Kokiopoulou & Saad 2007.)
    """

    tangent: Tangent
    freedoms: Freedoms
    volumes: Array  # (n,)
    space: CoarseSpace  # its first pattern is smooth, the others alternate
    diagonal_at_rest: Array  # (n, d) [N/m]
    stiffness_at_rest: Array  # (n, d) sums of the moduli that the diagonal grows with [Pa]
    smooth_at_rest: Factors | None = None  # once it is needed
    alternating: Sequence[Factors] | None = None  # likewise
    shares: Sequence[float] = ()  # of the corrections by these
    products: int = 0

    @classmethod
    def of(cls, simulation: BuiltScene, tangent: Tangent, freedoms: Freedoms) -> IterativeSolver:
        """The solver of a scene without ghosts, whose sums have an energy."""
        bodies, free = simulation.model.bodies, freedoms.free
        gradients = tangent.internal.gradients
        of_bodies = [
            alternating_signs(b.particles.positions, float(b.particles.spacings.mean()))
            for b in bodies
        ]
        patterns = [np.concatenate(signs) for signs in zip(*of_bodies, strict=True)]
        signs = np.stack([np.ones(len(free)), *(own for own in patterns if own.any())])
        space = CoarseSpace.of(bodies, free, signs, gradients)
        rest = np.zeros(free.shape)
        moduli = tangent.moduli(rest)
        solver = cls(
            tangent=tangent,
            freedoms=freedoms,
            volumes=simulation.particles.volumes,
            space=space,
            diagonal_at_rest=rest,
            stiffness_at_rest=_resistance(moduli),
        )
        of_loads = _symmetric(tangent.of_loads(rest, 0.0))
        product = solver.product(moduli, of_loads)
        solver.diagonal_at_rest = _diagonal(product, free.shape)
        return solver

    def linearised(self, displacements: Array, ahead: Array | None, time: float) -> Linearised:
        moduli = self.tangent.moduli(displacements, ahead)
        of_loads = _symmetric(self.tangent.of_loads(displacements, time))
        stiffer = _resistance(moduli) / self.stiffness_at_rest
        diagonal = self.diagonal_at_rest * np.maximum(stiffer, _LEAST)
        smooth, rises = self._smooth_factors(moduli, of_loads)
        return _Iterated(
            solver=self,
            whole_product=self.product(moduli, of_loads),
            own_diagonal=diagonal[self.freedoms.free],
            factors=[*smooth, *self._alternating_factors()],
            rises=rises,
        )

    def product(self, moduli: Array, of_loads: csr_array | None) -> Callable[[Array], Array]:
        """The product of the tangent with motions (n, d)."""

        def product(motion: Array) -> Array:
            self.products += 1
            forces = self.tangent.product(moduli, motion)
            if of_loads is not None:
                forces += (of_loads @ motion.ravel()).reshape(motion.shape)
            return forces

        return product

    def _smooth_factors(
        self, moduli: Array, of_loads: csr_array | None
    ) -> tuple[Sequence[Factors], bool]:
        """Factors of a positive stiffness of the smooth functions, and whether it is the present.

        None where there are no such functions.

        Raises:
            SingularError: nothing holds the body at rest.
        """
        if not self.space.kept.any():
            return [], True
        try:
            factors = self._factorised(0, moduli, of_loads)
            if factors.positive:
                return [factors], True
        except SingularError:
            pass
        if self.smooth_at_rest is None:
            self.smooth_at_rest = self._factorised(0, *self._at_rest())
        return [self.smooth_at_rest], False

    def _alternating_factors(self) -> Sequence[Factors]:
        """Factors of the stiffness of the alternating functions, at rest: it hardly changes."""
        if self.alternating is None:
            count = len(self.space.signs) if self.space.kept.any() else 0
            at_rest = self._at_rest()
            self.alternating = [self._factorised(k, *at_rest) for k in range(1, count)]
            self.shares = [
                self._share(k, own, *at_rest) for k, own in enumerate(self.alternating, start=1)
            ]
        return self.alternating

    def _share(
        self, pattern: int, factors: Factors, moduli: Array, of_loads: csr_array | None
    ) -> float:
        """Share of the correction by alternating functions, from the energy of a soft one.

        Of some wide kernels the sums see how such a function bends, but not its slope.
        """
        free = self.freedoms.free
        P = self.space.matrix(pattern)
        forces = np.random.default_rng(0).standard_normal(P.shape[1])
        values = factors.solve(forces)
        motion = np.where(free, (P @ values).reshape(free.shape), 0.0)
        energy = float(np.vdot(motion, self.product(moduli, of_loads)(motion)))
        on_grid = float(forces @ values)
        return _SHARE * min(1.0, on_grid / energy) if energy > 0.0 else 0.0

    def _at_rest(self) -> tuple[Array, csr_array | None]:
        """Moduli, and the symmetric stiffness of loads."""
        rest = np.zeros(self.freedoms.free.shape)
        return self.tangent.moduli(rest), _symmetric(self.tangent.of_loads(rest, 0.0))

    def _factorised(self, pattern: int, moduli: Array, of_loads: csr_array | None) -> Factors:
        """Factors of the stiffness of one pattern's functions.

        Raises:
            SingularError: with a free displacement that a motion without stiffness moves.
        """
        n, d = self.freedoms.free.shape
        each = (self.volumes[:, None, None, None, None] * moduli).reshape(n, d * d, d * d)
        matrix = self.space.stiffness(pattern, each)
        if of_loads is not None:
            P = self.space.matrix(pattern)
            matrix = csr_array(matrix + P.T @ of_loads @ P)
        try:
            return factorise(matrix, symmetric=True)
        except SingularError as error:
            if error.freedom is None:
                raise
            moved = np.abs(self.space.matrix(pattern)[:, [error.freedom]].toarray()).ravel()
            free = np.flatnonzero(self.freedoms.free.ravel())
            raise SingularError(int(np.argmax(moved[free]))) from None


@final
@attrs.frozen(eq=False)
class _Iterated(Linearised):
    """The tangent at one configuration, by its products, and what preconditions them."""

    solver: IterativeSolver
    whole_product: Callable[[Array], Array]  # with motions (n, d) of all particles
    own_diagonal: Array  # (k,)
    factors: Sequence[Factors]  # of the stiffness of each pattern's functions
    rises: bool  # False if their own stiffness is not positive

    @property
    def diagonal(self) -> Array:
        return self.own_diagonal

    def pull(self, motion: Array) -> Array:
        free = self.solver.freedoms.free
        if not motion.any():
            return np.zeros(len(self.own_diagonal))
        pull: Array = self.whole_product(motion)[free]
        return pull

    def solve(self, forces: Array, tolerance: float) -> Array:
        found = self._iterated(forces, tolerance)
        if found.falls:
            return self._by_minimal_residuals(forces, tolerance)
        if found.left > tolerance:
            raise UnsolvedError(found.left, _MOST)
        return found.values

    def roughly(self, forces: Array) -> Array:
        return self._preconditioned(forces)

    def positive(self) -> bool:
        if not self.rises:
            return False
        # Bodies buckle smoothly: random smooth forces meet every such motion.
        space, free = self.solver.space, self.solver.freedoms.free
        random = np.random.default_rng(0).standard_normal(
            (space.interpolation.shape[1], free.shape[1])
        )
        smooth = (space.interpolation @ random)[free]
        return not self._iterated(self.own_diagonal * smooth, _LOOK).falls

    def _iterated(self, forces: Array, tolerance: float) -> Solution:
        return conjugate_gradients(self._product, self._preconditioned, forces, tolerance, _MOST)

    def _by_minimal_residuals(self, forces: Array, tolerance: float) -> Array:
        """Solution with a tangent that lets some motions fall."""
        shape = (len(forces), len(forces))
        values, code = minres(
            LinearOperator(shape, matvec=self._product, dtype=np.float64),
            forces,
            rtol=tolerance,
            maxiter=_MOST,
            M=LinearOperator(shape, matvec=self._preconditioned, dtype=np.float64),
        )
        if code != 0:
            left = np.linalg.norm(forces - self._product(values)) / np.linalg.norm(forces)
            raise UnsolvedError(float(left), _MOST)
        solution: Array = values
        return solution

    def _product(self, values: Array) -> Array:
        free = self.solver.freedoms.free
        motion = np.zeros(free.shape)
        motion[free] = values
        product: Array = self.whole_product(motion)[free]
        return product

    def _preconditioned(self, forces: Array) -> Array:
        values = forces / self.own_diagonal
        if not self.factors:
            return values
        space, free = self.solver.space, self.solver.freedoms.free
        whole = np.zeros(free.shape)
        whole[free] = forces
        corrections = [
            share * factors.solve(own)
            for share, factors, own in zip(
                (1.0, *self.solver.shares), self.factors, space.restricted(whole), strict=True
            )
        ]
        values += space.extended(corrections)[free]
        return values


def _resistance(moduli: Array) -> Array:
    """Sums over k of dT_ik / dF_ik, (n, d) [Pa]."""
    resistance: Array = np.einsum("pikik->pi", moduli)
    return resistance


def _diagonal(product: Callable[[Array], Array], shape: tuple[int, ...]) -> Array:
    """Estimate of the diagonal of a positive matrix, in the shape of motions (n, d)."""
    random = np.random.default_rng(0)
    total = np.zeros(shape)
    for _ in range(_PROBES):
        signs = random.choice([-1.0, 1.0], shape)
        total += signs * product(signs)
    diagonal = total / _PROBES
    return np.maximum(diagonal, _LEAST * np.median(diagonal))


def _symmetric(matrix: csr_array | None) -> csr_array | None:
    """The symmetric part: a load that follows its surface may have no energy."""
    return None if matrix is None else csr_array(0.5 * (matrix + matrix.T))
