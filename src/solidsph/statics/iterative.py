"""IterativeSolver: conjugate gradients on the sums of the run, without a matrix of the tangent."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import final

import attrs
import numpy as np
from scipy.sparse import csr_array, diags_array

from solidsph.maths.arrays import Array, Mask
from solidsph.run.built_scene import BuiltScene
from solidsph.statics.alternation import alternating_signs
from solidsph.statics.coarse_space import CoarseSpace, Fineness
from solidsph.statics.factors import Factors, SingularError, factorise
from solidsph.statics.freedoms import Freedoms
from solidsph.statics.held_in_body import held_in_body
from solidsph.statics.increment import Increment
from solidsph.statics.krylov import Krylov
from solidsph.statics.lead import Lead
from solidsph.statics.linearised import Linearised, LinearSolver
from solidsph.statics.lowest import lowest_modes
from solidsph.statics.tangent import Moduli, Tangent

# Stiffnesses of a particle alone count as at least this part of the median, if one is not positive.
_LEAST = 0.1

# Grids. What alternates gains less by a fine one, and has seven patterns in space.
_SMOOTH = Fineness(2.0, {1: 10_000, 2: 10_000, 3: 3_000})
_ALTERNATING = Fineness(3.0, {1: 10_000, 2: 10_000, 3: 1_500})

# Share of the correction by alternating functions. Their stiffness on the grid is somewhat too
# small, because it leaves out how the functions bend.
_SHARE = 0.4

_MOST = 5000  # iterations of one solution

# A load's stiffness is made symmetric if what it loses is below this part of that of particles.
_SKEW = 0.01

# What the solution that looks for a soft or falling motion leaves of its smooth forces.
_LOOK = 1e-3


@attrs.frozen(eq=False)
class _Correction:
    """A correction by the functions of a coarse space."""

    space: CoarseSpace
    factors: Sequence[Factors]  # of the stiffness of each pattern's functions
    shares: Sequence[float]  # of the correction by each

    def motion(self, forces: Array) -> Array:
        """Displacements (n, d) [m] by forces (n, d) [N]."""
        each = zip(self.shares, self.factors, self.space.restricted(forces), strict=True)
        return self.space.extended([share * factors.solve(own) for share, factors, own in each])


@final
@attrs.define(eq=False)
class IterativeSolver(LinearSolver):
    """Conjugate gradients with a preconditioner of coarse grids and of every particle alone.

    A product with the tangent is two passes over the neighbours, as one evaluation of the forces.
    What changes over several spacings is solved on a coarse grid; so is what alternates along the
    rows of a lattice, which the gradients do not see. The blocks of the diagonal are left with the
    rest. (Nocedal & Wright 2006, algorithm 5.3; two levels, added up: Smith, Bjorstad & Gropp 1996,
    chapter 2.)
    """

    tangent: Tangent
    freedoms: Freedoms
    volumes: Array  # (n,)
    smooth_space: CoarseSpace | None  # of one pattern; None where all nodes are held
    alternating_space: CoarseSpace | None  # None where no functions alternate
    smooth_at_rest: _Correction | None = None  # once it is needed
    alternating: _Correction | None = None  # likewise
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
        signs = [own for own in patterns if own.any()]

        def space(signs: Sequence[Array], fineness: Fineness) -> CoarseSpace | None:
            made = CoarseSpace.of(bodies, free, np.stack(signs), gradients, fineness)
            return made if made.kept.any() else None

        return cls(
            tangent,
            freedoms,
            simulation.particles.volumes,
            space([np.ones(len(free))], _SMOOTH),
            space(signs, _ALTERNATING) if signs else None,
        )

    def linearised(
        self, displacements: Array, lead: Lead | None, increment: Increment, support: float = 0.0
    ) -> Linearised:
        tangent = self.tangent.during(increment)
        of_loads = tangent.of_loads(displacements)
        return self._linearised(tangent.moduli(displacements, lead), of_loads, support)

    def lowest_modes(
        self, displacements: Array, masses: Array, shift: float, count: int
    ) -> tuple[Array, Array]:
        free = self.freedoms.free.ravel()
        shifts = np.zeros(free.size)
        shifts[free] = shift * masses
        added = csr_array(diags_array(shifts, format="csr"))
        of_loads = _symmetric(self.tangent.of_loads(displacements))
        shifted = self._linearised(self.tangent.moduli(displacements), _sum(of_loads, added))
        if not shifted.positive():
            raise SingularError(None)
        squares, modes = lowest_modes(shifted.product, shifted.roughly, masses, count)
        return squares - shift, modes

    def _linearised(
        self, moduli: Moduli, of_loads: csr_array | None, support: float = 0.0
    ) -> _Iterated:
        blocks = self.tangent.own_stiffness(moduli.alone)
        whole, of_loads = of_loads, _symmetric(of_loads)
        turns = whole is not None and _turns(whole, np.einsum("pii->pi", blocks))
        if of_loads is not None:
            blocks += _blocks(of_loads, blocks.shape[1])
        added = support * np.abs(np.einsum("pii->pi", blocks))
        supporting = None
        if support:
            blocks += added[:, :, None] * np.eye(blocks.shape[1])
            supporting = csr_array(diags_array(added.ravel(), format="csr"))
            whole, of_loads = _sum(whole, supporting), _sum(of_loads, supporting)
        smooth, rises = self._smooth_correction(moduli, of_loads, supporting)
        alternating = self._alternating_correction()
        return _Iterated(
            solver=self,
            whole_product=self.product(moduli, whole if turns else of_loads),
            turns=turns,
            own_diagonal=np.einsum("pii->pi", blocks)[self.freedoms.free],
            added=added[self.freedoms.free],
            alone=_inverted(blocks, self.freedoms.free),
            corrections=[own for own in (smooth, alternating) if own is not None],
            rises=rises,
        )

    def product(self, moduli: Moduli, of_loads: csr_array | None) -> Callable[[Array], Array]:
        """The product of the tangent with motions (n, d)."""

        def product(motion: Array) -> Array:
            self.products += 1
            forces = self.tangent.product(moduli, motion)
            if of_loads is not None:
                forces += (of_loads @ motion.ravel()).reshape(motion.shape)
            return forces

        return product

    def _smooth_correction(
        self, moduli: Moduli, of_loads: csr_array | None, supporting: csr_array | None
    ) -> tuple[_Correction | None, bool]:
        """The correction by smooth functions, of a positive stiffness, and whether it is that here.

        Raises:
            SingularError: nothing holds the body at rest.
        """
        space = self.smooth_space
        if space is None:
            return None, True
        try:
            factors = self._factorised(space, 0, moduli, of_loads)
            if factors.positive:
                return _Correction(space, [factors], [1.0]), True
        except SingularError:
            pass
        if supporting is not None:  # nothing may hold the body at rest
            at_rest, own = self._at_rest()
            factors = self._factorised(space, 0, at_rest, _sum(own, supporting))
            return _Correction(space, [factors], [1.0]), False
        if self.smooth_at_rest is None:
            factors = self._factorised(space, 0, *self._at_rest())
            self.smooth_at_rest = _Correction(space, [factors], [1.0])
        return self.smooth_at_rest, False

    def _alternating_correction(self) -> _Correction | None:
        """That by alternating functions, of their stiffness at rest: it hardly changes."""
        space = self.alternating_space
        if self.alternating is None and space is not None:
            at_rest = self._at_rest()
            factors = [self._factorised(space, k, *at_rest) for k in range(len(space.signs))]
            shares = [self._share(space, k, own, *at_rest) for k, own in enumerate(factors)]
            self.alternating = _Correction(space, factors, shares)
        return self.alternating

    def _share(
        self,
        space: CoarseSpace,
        pattern: int,
        factors: Factors,
        moduli: Moduli,
        of_loads: csr_array | None,
    ) -> float:
        """Share of the correction by alternating functions, from the energy of a soft one.

        Of some wide kernels the sums see how such a function bends, but not its slope.
        """
        free = self.freedoms.free
        P = space.matrix(pattern)
        forces = np.random.default_rng(0).standard_normal(P.shape[1])
        values = factors.solve(forces)
        motion = np.where(free, (P @ values).reshape(free.shape), 0.0)
        energy = float(np.vdot(motion, self.product(moduli, of_loads)(motion)))
        on_grid = float(forces @ values)
        return _SHARE * min(1.0, on_grid / energy) if energy > 0.0 else 0.0

    def _at_rest(self) -> tuple[Moduli, csr_array | None]:
        """Moduli, and the symmetric stiffness of loads."""
        rest = np.zeros(self.freedoms.free.shape)
        return self.tangent.moduli(rest), _symmetric(self.tangent.of_loads(rest))

    def _factorised(
        self, space: CoarseSpace, pattern: int, moduli: Moduli, of_loads: csr_array | None
    ) -> Factors:
        """Factors of the stiffness of one pattern's functions.

        Raises:
            SingularError: with a free displacement that a motion without stiffness moves.
        """
        n, d = self.freedoms.free.shape
        # A filter leaves smooth functions as they are, and takes most of what alternates.
        known = moduli.local if space is self.smooth_space else moduli.alone
        each = (self.volumes[:, None, None, None, None] * known).reshape(n, d * d, d * d)
        matrix = space.stiffness(pattern, each)
        if of_loads is not None:
            P = space.matrix(pattern)
            matrix = csr_array(matrix + P.T @ of_loads @ P)
        try:
            return factorise(matrix, symmetric=True)
        except SingularError as error:
            own = self.product(moduli, of_loads)
            held = held_in_body(space, pattern, matrix, self.freedoms.free, own)
            if held is not None:
                return held
            if error.freedom is None:
                raise
            moved = np.abs(space.matrix(pattern)[:, [error.freedom]].toarray()).ravel()
            free = np.flatnonzero(self.freedoms.free.ravel())
            raise SingularError(int(np.argmax(moved[free]))) from None


@final
@attrs.frozen(eq=False)
class _Iterated(Linearised):
    """The tangent at one configuration, by its products, and what preconditions them."""

    solver: IterativeSolver
    whole_product: Callable[[Array], Array]  # with motions (n, d) of all particles
    turns: bool  # True if it is far from symmetric
    own_diagonal: Array  # (k,)
    added: Array  # (k,)
    alone: Array  # (n, d, d) inverse stiffness of every particle alone [m/N]
    corrections: Sequence[_Correction]
    rises: bool  # False if their own stiffness is not positive

    @property
    def support(self) -> Array:
        return self.added

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
        if self.turns:
            return self._krylov.of_any(forces, tolerance)
        return self._krylov.of_symmetric(forces, tolerance)

    def roughly(self, forces: Array) -> Array:
        return self._preconditioned(forces)

    def positive(self) -> bool:
        if not self.rises:
            return False
        # Bodies buckle smoothly: random smooth forces meet every such motion.
        space, free = self.solver.smooth_space, self.solver.freedoms.free
        random = np.random.default_rng(0)
        if space is None:
            smooth = random.standard_normal(len(self.own_diagonal))
        else:
            smooth = (space.interpolation @ random.standard_normal(space.kept.shape))[free]
        return not self._krylov.iterated(self.own_diagonal * smooth, _LOOK).falls

    @property
    def _krylov(self) -> Krylov:
        return Krylov(self.product, self._preconditioned, _MOST)

    def product(self, values: Array) -> Array:
        """Forces (k,) [N] that resist a motion (k,) [m]."""
        free = self.solver.freedoms.free
        motion = np.zeros(free.shape)
        motion[free] = values
        product: Array = self.whole_product(motion)[free]
        return product

    def _preconditioned(self, forces: Array) -> Array:
        free = self.solver.freedoms.free
        whole = np.zeros(free.shape)
        whole[free] = forces
        motion = np.einsum("pij,pj->pi", self.alone, whole)
        for correction in self.corrections:
            motion += correction.motion(whole)
        values: Array = motion[free]
        return values


def _blocks(matrix: csr_array, d: int) -> Array:
    """Blocks (n, d, d) on the diagonal of a matrix (d n, d n)."""
    entries = matrix.tocoo()
    p, q = entries.row // d, entries.col // d
    own = p == q
    blocks = np.zeros((matrix.shape[0] // d, d, d))
    np.add.at(blocks, (p[own], entries.row[own] % d, entries.col[own] % d), entries.data[own])
    return blocks


def _inverted(blocks: Array, free: Mask) -> Array:
    """Inverse (n, d, d) of the free part of symmetric blocks, made positive where they are not."""
    fixed = ~free
    kept = np.where(fixed[:, :, None] | fixed[:, None, :], 0.0, blocks)
    kept += np.eye(free.shape[1]) * fixed[:, None, :]
    try:
        np.linalg.cholesky(kept)
    except np.linalg.LinAlgError:
        values, vectors = np.linalg.eigh(kept)
        values = np.maximum(values, _LEAST * np.median(values[:, -1]))
        return np.asarray((vectors / values[:, None, :]) @ vectors.transpose(0, 2, 1))
    return np.linalg.inv(kept)


def _sum(one: csr_array | None, other: csr_array) -> csr_array:
    return other if one is None else csr_array(one + other)


def _turns(matrix: csr_array, diagonal: Array) -> bool:
    """Whether a load's stiffness is so far from symmetric that this slows Newton's method."""
    skew = csr_array(matrix - matrix.T)
    return bool(skew.nnz and np.abs(skew.data).max() > _SKEW * np.median(diagonal))


def _symmetric(matrix: csr_array | None) -> csr_array | None:
    """The symmetric part: a load that follows its surface may have no energy."""
    return None if matrix is None else csr_array(0.5 * (matrix + matrix.T))
