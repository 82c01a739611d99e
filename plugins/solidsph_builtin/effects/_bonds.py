"""Bonds, that is neighbour pairs, and what is left of them when some have failed."""

from __future__ import annotations

from typing import Any, NamedTuple, final

import attrs
import numpy as np

from solidsph.engines.compiled.jit import njit
from solidsph.engines.matrix import Operators, assembled
from solidsph.interfaces.body import Body
from solidsph.interfaces.plan import array_bytes
from solidsph.interfaces.row_weights import RowWeights
from solidsph.maths.arrays import Array, Indices, Mask
from solidsph.model.neighbours import Pairs, row_starts
from solidsph_builtin.effects._gradients import real_pairs

# Smallest singular value of the moment, which is I in a full neighbourhood and half of that at a
# flat surface, below which the remaining neighbours do not determine a gradient.
_LEAST_MOMENT = 0.25


class _Limits(NamedTuple):
    """The pairs p < q that may fail, row by row: (q, p) has the same stretch."""

    starts: Indices  # (n + 1,)
    columns: Any  # (k,) q
    squares: Array  # (k,) of the distance at which they fail [m^2]
    places: Indices  # (k,) where they stand among all pairs


@final
@attrs.frozen(eq=False)
class Remains:
    """What is left of the bonds of a body; it depends on the flags alone."""

    flags: Array  # (m,) 1 for an intact bond, 0 for one that has failed
    damage: Array  # (n,) fraction of the bonds of each particle that have failed [-]
    alone: Mask  # (n,) particles whose remaining bonds do not determine a gradient
    rows: RowWeights  # the gradient of the particles that have lost bonds

    @property
    def intact(self) -> bool:
        """True if no bond has failed."""
        return not len(self.rows.particles)


@final
@attrs.frozen(eq=False)
class Bonds:
    """Neighbour pairs of one body and their critical stretch."""

    body: Body
    pairs: Pairs
    may_fail: Mask  # (m,); (p, q) and (q, p) alike
    limits: _Limits
    none_failed: Remains = attrs.field(init=False)

    @none_failed.default
    def _all_of_them(self) -> Remains:
        n, none = self.pairs.row_count, RowWeights.none(self.body.particles.dimension)
        flags = np.ones(self.pairs.count)
        return Remains(flags, np.zeros(n), np.zeros(n, dtype=np.bool_), none)

    @classmethod
    def of(cls, body: Body, critical_stretch: float, chosen: Mask) -> Bonds:
        """The bonds of a body; only those between chosen particles (n,) may fail."""
        pairs = body.pairs()
        may = real_pairs(body, pairs) & chosen[pairs.rows] & chosen[pairs.columns]
        places = np.flatnonzero(may & (pairs.rows < pairs.columns))
        limits = _Limits(
            starts=row_starts(np.bincount(pairs.rows[places], minlength=pairs.row_count)),
            columns=pairs.columns[places].astype(np.int32),
            squares=((1.0 + critical_stretch) * pairs.distances[places]) ** 2,
            places=places,
        )
        return cls(body, pairs, may, limits)

    @property
    def name(self) -> str:
        """Name of their flags in `State.memory`."""
        return f"bonds of {self.body.name}"

    @property
    def bytes(self) -> int:
        """Memory of the list and of the flags [bytes]."""
        p = self.pairs
        listed = (p.starts, p.rows, p.columns, p.offsets, p.distances, self.may_fail)
        return array_bytes(listed) + array_bytes(self.limits) + 8 * p.count

    def remains(self, flags: Array) -> Remains:
        """What flags (m,) leave."""
        losers = np.unique(self.pairs.rows[flags == 0.0])
        if not losers.size:
            return self.none_failed
        alone = self.none_failed.alone.copy()
        alone[losers] = self._undetermined(flags, losers)
        return self._left(self.none_failed, flags, alone, losers)

    def damage(self, flags: Array) -> Array:
        """Fraction of the bonds of each particle that have failed, (n,) [-]."""
        return _damage(self.pairs, flags)

    def beyond(self, remains: Remains, displacements: Array) -> tuple[Indices, float]:
        """Intact bonds (k,) that are stretched too far at displacements (n, d) [m], each as one of
        its pairs, and by how much every other may still grow [m]."""
        positions = self.body.particles.positions + displacements
        fails, room = _beyond(self.limits, positions, remains.flags)
        return fails, float(room)

    def after(self, remains: Remains, fails: Indices) -> Remains:
        """What is left when bonds (k,) fail.

        A particle whose remaining bonds do not determine a gradient loses all that may fail.
        """
        flags, alone = remains.flags.copy(), remains.alone.copy()
        losers = np.empty(0, dtype=np.intp)
        while fails.size:
            fails = np.concatenate([fails, self._reverse(fails)])
            flags[fails] = 0.0
            new = np.unique(self.pairs.rows[fails])
            alone[new] = self._undetermined(flags, new)
            losers = np.union1d(losers, new)
            theirs, _ = self.pairs.chosen(new[alone[new]])
            fails = theirs[self.may_fail[theirs] & (flags[theirs] > 0.0)]
        return self._left(remains, flags, alone, losers)

    def operators(self, remains: Remains) -> Operators:
        """Gradient and force matrices of the remaining bonds."""
        body, pairs = self.body, self.pairs
        gradient = self._weights(remains.flags, remains.alone, pairs, slice(None))
        force = body.formulation.divergence.weights(pairs, gradient, body.particles.volumes)
        return assembled(pairs, gradient, force)

    def _left(self, before: Remains, flags: Array, alone: Mask, losers: Indices) -> Remains:
        """What is left where the losers (k,) have lost bonds since `before`."""
        where, rows = self.pairs.chosen(losers)
        damage = before.damage.copy()
        damage[losers] = _damage(rows, flags[where])
        acting = (flags[where] > 0.0) & ~alone[rows.rows]
        kept = acting | (rows.rows == rows.columns)
        changed = RowWeights.of(rows, self._weights(flags, alone, rows, where), kept)
        return Remains(flags, damage, alone, before.rows.replaced_by(changed))

    def _undetermined(self, flags: Array, particles: Indices) -> Mask:
        """Whether the bonds of particles (k,) no longer determine a gradient."""
        where, rows = self.pairs.chosen(particles)
        weights = self.body.smoothing.gradients_of(rows)
        weights *= (flags[where] * self.body.particles.cells[rows.columns])[:, None]
        moments = rows.row_sums(rows.offsets[:, :, None] * weights[:, None, :])
        least = np.linalg.svd(moments, compute_uv=False)[:, -1]
        return np.asarray(least < _LEAST_MOMENT)

    def _weights(self, flags: Array, alone: Mask, rows: Pairs, where: Indices | slice) -> Array:
        """Weights (k, d) of rows, which are at `where` (k,) among all pairs.

        Where no gradient is determined, none is formed: such a particle stays unstrained.
        """
        body, undetermined = self.body, alone[rows.rows]
        acting = body.smoothing.gradients_of(rows)
        acting *= np.where(undetermined, 1.0, flags[where])[:, None]
        weights = body.formulation.gradient.weights(rows, acting, body.particles.cells)
        return np.where(undetermined[:, None], 0.0, weights)

    def _reverse(self, places: Indices) -> Indices:
        """Where the pairs (q, p) stand, for pairs (p, q) at `places` (k,)."""
        p, q = self.pairs.rows[places], self.pairs.columns[places]
        where, rows = self.pairs.chosen(np.unique(q))
        keys = rows.rows * self.pairs.row_count + rows.columns
        return np.asarray(where[np.searchsorted(keys, q * self.pairs.row_count + p)])


def _damage(rows: Pairs, flags: Array) -> Array:
    """Fraction of the bonds of the particles listed that have failed, (k,) [-]."""
    own = np.diff(rows.starts) - 1  # a particle is among its own neighbours
    return np.asarray((own + 1 - rows.row_sums(flags)) / np.maximum(own, 1))


@final
@attrs.define(eq=False)
class Watch:
    """The bonds of a body, looked at when some may fail: a cache, which changes no result."""

    bonds: Bonds
    # What was left when they were looked at, the displacements then (n, d) [m], and by how much
    # all could still grow [m].
    _looked: tuple[Remains, Array, float] | None = None

    def after(self, remains: Remains, displacements: Array) -> Remains:
        """What is left at displacements (n, d) [m]: the same object if no bond has failed since."""
        if self._all_hold(remains, displacements):
            return remains
        fails, room = self.bonds.beyond(remains, displacements)
        left = self.bonds.after(remains, fails) if fails.size else remains
        self._looked = left, displacements.copy(), room
        return left

    def _all_hold(self, remains: Remains, displacements: Array) -> bool:
        if self._looked is None or self._looked[0] is not remains:
            return False
        _, before, room = self._looked
        moved = displacements - before
        moved -= moved.mean(axis=0)  # no pair grows where all move alike
        # Both particles of a pair may have moved apart.
        return 4.0 * float(np.max(np.sum(moved**2, axis=1))) < room**2


@njit
def _beyond(limits: _Limits, positions: Array, flags: Array) -> tuple[Indices, float]:
    starts, columns, squares, places = limits
    found = []
    longest = least = np.inf if not len(squares) else squares[0]
    for p in range(len(starts) - 1):
        for k in range(starts[p], starts[p + 1]):
            q, left = columns[k], squares[k]
            longest = max(longest, left)
            for i in range(positions.shape[1]):
                left -= (positions[q, i] - positions[p, i]) ** 2
            if left < least and flags[places[k]] > 0.0:
                if left < 0.0:
                    found.append(places[k])
                else:
                    least = left
    # L - r = (L^2 - r^2) / (L + r), and r < L.
    return np.array(found, dtype=np.intp), 0.5 * least / np.sqrt(longest)
