"""A gradient whose sums satisfy discrete integration by parts."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import product
from typing import final

import attrs
import numpy as np
from scipy.sparse import bsr_array, csc_array, csr_array, diags_array
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import SuperLU, splu

from solidsph.errors import BuildError
from solidsph.interfaces.gradient import Gradient
from solidsph.interfaces.smoothing_kernel import SmoothingKernel
from solidsph.maths.arrays import Array, Indices, Mask
from solidsph.maths.band import BandFactors, band_factors
from solidsph.maths.one_thread import one_thread
from solidsph.model.neighbours import Pairs
from solidsph.model.particles import Particles
from solidsph_builtin.gradients._local_fits import LocalFits, closeness, portions
from solidsph_builtin.gradients._rim import freedom, wrong
from solidsph_builtin.gradients._softening import softening
from solidsph_builtin.gradients.cubic import Cubic

_SMALLEST = 1e-300

# Multipliers of a body up to which the system is factorised, by dimension: for some seconds, or for
# half a minute in a body of the plane that is not slender.
_FACTORISED = {1: 1_000_000, 2: 30_000, 3: 1200}

# Keeps the matrix regular in spite of smooth fields, which hardly change any weight; corrected by
# iterative refinement.
_REGULAR = 1e-12
_REFINEMENTS = 50
_SOLVED = 1e-12

# With few neighbours there is little to change, and refinement stalls at some 1e-4 of what is
# missing; with more than this left over, the wrapper would be of no use.
_USELESS = 1e-2


@final
@attrs.frozen
class Consistent(Gradient):
    """Another gradient with the smallest change of its weights that makes the forces of a constant
    stress cancel at every particle inside a body, and equal the traction on its surface; those of
    a stress that varies linearly are its divergence and the traction as nearly as can be.

    Integration by parts, with the function N_p of a particle, its volume V_p and its area A_p, 0
    inside, asks for

        sum over q of V_q g_qp = A_p,
        sum over q of V_q g_qp (x) (X_q - X_p) = M_p - V_p I,

    where M_p is the integral of N_p n (x) (x - X_p) over the surface. The first is the condition of
    the patch test (Chen, Hillman & Rueter 2013). Both hold by symmetry on a lattice, and fail
    beside a surface and in irregular arrangements: there a constant stress exerts forces, and the
    error does not decrease with the spacing. Chen et al. change test functions only, which costs
    the energy and the angular momentum; here the gradient itself is changed, so that the
    variational divergence remains the derivative of an energy:

        g_pq <- g_pq + w_pq s_p V_p (l_q - l_p - L_q (X_q - X_p) - b(X_pq) . a_p),

    with s_p 1 beside what the sums miss and 0 deep inside, a_p such that polynomials up to the
    degree of the gradient, at most the second, keep what their gradients, and l and L from the
    sparse linear system of the sums: the least change, with each weight's change divided by its
    kernel weight w. Sums that are exact to the second degree at a surface need the fourth order
    inside (Strand 1994); on a lattice `cubic` has it. With `quadratic` the change is as large as
    the weights themselves.

    The system is solved once, when the body is built: by a factorisation if it is small, else by
    conjugate gradients over the fixed pairs. They leave a tenth of what the first moments lack. Of
    the sums they leave 1e-7 of it up to some 100 000 particles in space; in the plane, where long
    rims are slow, 4e-4 in a plate with a hole of 13 000 and 0.002 in a ring of 95 000.
    """

    of: Gradient = attrs.field(factory=Cubic, metadata={"part": "gradients"})

    @property
    def exact_degree(self) -> int:
        """That of the wrapped gradient."""
        return self.of.exact_degree

    @property
    def deep_inside(self) -> Gradient:
        """The wrapped gradient, whose sums are right by symmetry."""
        return self.of.deep_inside

    def weights(self, pairs: Pairs, kernel_gradients: Array, volumes: Array) -> Array:
        """Those of the wrapped gradient: the change is known once there is a body."""
        return self.of.weights(pairs, kernel_gradients, volumes)

    def of_body(
        self,
        body: str,
        particles: Particles,
        smoothing: SmoothingKernel,
        pairs: Callable[[], Pairs],
        *,
        moving: bool,
    ) -> Gradient:
        if particles.ghosts.any():
            raise BuildError(
                [
                    f"gradient 'consistent': body {body!r} has {int(particles.ghosts.sum())} "
                    "ghosts, whose sums have no known value; put particles on the boundary "
                    "instead (conforming-lattice)"
                ]
            )
        if moving:
            raise BuildError(
                [
                    f"gradient 'consistent': the sums of body {body!r} follow its motion, but "
                    "its surface is known in the reference configuration; use 'total-lagrangian'"
                ]
            )
        inner = self.of.of_body(body, particles, smoothing, pairs, moving=moving)
        found = pairs()
        slopes = smoothing.gradients_of(found)
        length = float(particles.spacings.mean())
        plain = inner.weights(found, slopes, particles.cells)
        missing = _missing(particles, found, plain, length)
        surface = np.zeros(particles.count, dtype=np.bool_)
        for face in particles.faces.values():
            surface[face.particles] = True
        degree = self.exact_degree
        changing = [surface, wrong(missing)]
        for piece in _pieces(found):
            allowed = [mask[piece] for mask in changing]
            X = particles.positions[piece]
            missing[piece, 0] = _possible(missing[piece, 0], X, allowed, degree)
        if not missing.any():
            return inner
        V = particles.volumes
        sizes = particles.spacings / length if particles.graded else np.ones(particles.count)
        free = freedom(missing, particles.positions, length * sizes)
        if missing.shape[0] * missing.shape[1] <= _FACTORISED[particles.dimension]:
            fits = LocalFits.of_gradient(found, slopes, particles.cells, degree)
            change = _Change.of(fits, V, free, length)
            multipliers = _solved(change.matrix(), missing, surface, sizes)
        else:
            from solidsph_builtin.gradients._iteration import solved  # loads the compiler

            close = closeness(slopes, found.distances)
            with one_thread():
                multipliers = solved(
                    found, close, particles, free, degree, length, missing, surface, sizes
                )
        return _OfBody(inner, V, free, multipliers, length)


@final
@attrs.frozen(eq=False)
class _OfBody(Gradient):
    """The gradient of one body, whose weights are computed row by row as engines need them."""

    of: Gradient
    volumes: Array  # (n,) of the body [m^d]
    freedom: Array  # (n,) s
    multipliers: Array  # (n, 1 + d, d) l and the columns of L
    length: float  # unit of the offsets that L is multiplied by [m]

    @property
    def exact_degree(self) -> int:
        return self.of.exact_degree

    def weights(self, pairs: Pairs, kernel_gradients: Array, volumes: Array) -> Array:
        weights = self.of.weights(pairs, kernel_gradients, volumes)
        changing = np.flatnonzero(self.freedom[pairs.rows[pairs.starts[:-1]]])
        where, rows = pairs.chosen(changing)
        slopes = kernel_gradients[where]
        change = np.empty_like(slopes)
        for own, part in portions(rows):
            fits = LocalFits.of_gradient(part, slopes[own], volumes, self.exact_degree)
            changed = _Change.of(fits, self.volumes, self.freedom, self.length)
            change[own] = changed.weights(self.multipliers)
        weights[where] += rows.of_differences(change)
        return weights


def _missing(particles: Particles, pairs: Pairs, weights: Array, length: float) -> Array:
    """What the sums with these `weights` (m, d) of all pairs lack, (n, 1 + d, d).

    First the sum itself, then its first moments in units of `length`.
    """
    n, d = particles.positions.shape
    V = particles.volumes
    own = [V[pairs.rows] * g for g in weights.T]
    sums = [[np.bincount(pairs.columns, part, minlength=n) for part in own]]
    for arm in -pairs.offsets.T / length:
        sums.append([np.bincount(pairs.columns, part * arm, minlength=n) for part in own])
    wanted = np.zeros((n, 1 + d, d))
    wanted[:, 0] = particles.area_vectors
    for face in particles.faces.values():
        wanted[face.particles, 1:] += face.moments.transpose(0, 2, 1) / length
    wanted[:, 1:] -= V[:, None, None] * np.eye(d) / length
    missing: Array = wanted - np.moveaxis(np.array(sums), 2, 0)
    return missing


@attrs.frozen(eq=False)
class _Change:
    """Change of the weights of some rows with the multipliers."""

    fits: LocalFits  # of the functions that must keep their gradient
    root: Array  # (n, k, k) of the inverse of their moments
    volumes: Array  # (n,) V of the rows [m^d]
    freedom: Array  # (n,) s of the rows
    length: float  # unit of the offsets that L is multiplied by [m]

    @classmethod
    def of(cls, fits: LocalFits, volumes: Array, freedom: Array, length: float) -> _Change:
        """With the `volumes` and the `freedom` of the whole body."""
        own = fits.pairs.rows[fits.pairs.starts[:-1]]
        return cls(fits, fits.inverse_root(), volumes[own], freedom[own], length)

    def weights(self, multipliers: Array) -> Array:
        """Change of the weights by multipliers (n, 1 + d, d) of the body, (m, d)."""
        pairs, fits = self.fits.pairs, self.fits
        y = multipliers[pairs.columns, 0] - multipliers[pairs.rows, 0]
        along_offset = multipliers[pairs.columns, 1:]
        y -= np.einsum("mj,mji->mi", pairs.offsets / self.length, along_offset)
        rest = fits.padded(y)
        for _ in range(2):  # a single pass leaves rounding, which shows as stress in a rotation
            along = fits.sums(rest) @ self.root
            rest -= (along @ self.root.transpose(0, 2, 1)) @ fits.basis
        own = self.freedom * self.volumes
        return fits.of_pairs(own[:, None, None] * fits.weights * rest)

    def matrix(self) -> csr_array:
        """From the multipliers of one component, l and a row of L of each particle in turn, to what
        the sums gain, (n (1 + d), n (1 + d)); of all rows only."""
        pairs = self.fits.pairs
        V, s = pairs.spread(self.volumes), pairs.spread(self.freedom)
        w = self.fits.of_pairs(self.fits.weights)[:, 0]
        tests = self.fits.of_pairs(self.root.transpose(0, 2, 1) @ self.fits.basis)
        # The change of a pair is a sum over those of q, times these, less l_p.
        of_q = np.column_stack([np.ones(pairs.count), -pairs.offsets / self.length])
        size = pairs.row_count * of_q.shape[1]

        def blocks(values: Array) -> bsr_array:
            shape = pairs.row_count * values.shape[1], size
            return bsr_array((values, pairs.columns, pairs.starts), shape=shape)

        fitted = (V * np.sqrt(s) * w)[:, None] * tests
        kept = fitted[:, :, None] * of_q[:, None]
        kept[pairs.self_pairs, :, 0] -= pairs.row_sums(fitted)
        strength = V**2 * s * w
        across = np.zeros((pairs.count, of_q.shape[1], of_q.shape[1]))
        across[:, 0] = -strength[:, None] * of_q
        # At the pair (q, q), that of the pair's column.
        at = pairs.self_pairs[pairs.columns]
        own = [
            np.bincount(at, strength * f * g, minlength=pairs.count)
            for f, g in product(of_q.T, repeat=2)
        ]
        both = np.stack(own, axis=1, dtype=np.float64).reshape(across.shape)
        both[pairs.self_pairs, 0, 0] += pairs.row_sums(strength)
        plain = blocks(both + across) + blocks(across).T
        return csr_array(plain - blocks(kept).T @ blocks(kept))


def _pieces(pairs: Pairs) -> Iterator[Indices]:
    """Particles of each piece of a body: none is a neighbour of another's."""
    graph = csr_array(
        (np.ones(pairs.count, dtype=np.int8), pairs.columns, pairs.starts),
        shape=(pairs.row_count, pairs.row_count),
    )
    count, piece_of = connected_components(graph, directed=False)
    for piece in range(count):
        yield np.flatnonzero(piece_of == piece)


def _possible(missing: Array, positions: Array, allowed: Sequence[Mask], degree: int) -> Array:
    """`missing` (n, d) of a piece, with the least change that makes the system solvable where it is
    `allowed` (n,): at the surface, and as far as that is not enough also inside.

    Gradients of polynomials do not change, so that the sum of f_p A_p of a polynomial f is the sum
    of V grad f whatever the weights: so far the areas must agree with the volumes.
    """
    X = positions - positions.mean(axis=0)
    X = X / max(np.abs(X).max(), _SMALLEST)
    upper = np.triu_indices(X.shape[1])
    squares = X[:, upper[0]] * X[:, upper[1]]
    f = np.hstack([np.ones((len(X), 1)), X, *([squares] if degree > 1 else [])])
    # The surface may be where a polynomial vanishes, as that of a ball.
    for places in allowed:
        own = np.where(places[:, None], f, 0.0)
        missing = missing - own @ np.linalg.lstsq(own.T @ own, f.T @ missing)[0]
    return missing


def _solved(matrix: csr_array, missing: Array, surface: Mask, sizes: Array) -> Array:
    """Multipliers (n, 1 + d, d) whose change of the weights adds `missing` (n, 1 + d, d)."""
    n, kinds, d = missing.shape
    diagonal = matrix.diagonal().reshape(n, kinds)
    if not diagonal[:, 0].any():
        raise _unsolved(1.0)
    size = float(np.median(diagonal[:, 0][diagonal[:, 0] > 0.0]))
    soft = softening(diagonal, surface, sizes).ravel()
    softened = csr_array(matrix + diags_array(soft))
    factors = _factors(csr_array(softened + diags_array(np.full(n * kinds, _REGULAR * size))))
    wanted = missing.reshape(n * kinds, d)
    multipliers, left, unsolved = np.zeros_like(wanted), wanted, 1.0
    for _ in range(_REFINEMENTS):
        multipliers = multipliers + factors.solve(left)
        left = wanted - softened @ multipliers
        before, unsolved = (
            unsolved,
            float(np.abs(left).max() / max(np.abs(wanted).max(), _SMALLEST)),
        )
        if unsolved <= _SOLVED or unsolved > 0.9 * before:
            break
    if not unsolved <= _USELESS:
        raise _unsolved(unsolved)
    result: Array = multipliers.reshape(missing.shape)
    return result


def _factors(matrix: csr_array) -> BandFactors | SuperLU:
    """Factors of a symmetric matrix, which but for rounding is positive definite."""
    found = band_factors(matrix)
    if found is not None:
        return found
    try:
        return splu(
            csc_array(matrix),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
    except RuntimeError:  # exactly singular: bodies of a particle or two have nothing to change
        raise _unsolved(1.0) from None


def _unsolved(left: float) -> BuildError:
    return BuildError(
        [
            "gradient 'consistent': no change of the weights satisfies the sums (a part of "
            f"{left:.3g} of what is missing is left); a larger cover or a finer spacing gives it "
            "more weights to change, or take another gradient, such as 'corrected'"
        ]
    )
