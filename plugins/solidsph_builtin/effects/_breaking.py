"""Internal forces of bodies with bonds, that is neighbour pairs, that fail."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar, final

import attrs
import numpy as np

from solidsph.engines.history import HistoryForces
from solidsph.engines.matrix import Operators, assembled, fixed_forces
from solidsph.interfaces.body import Body
from solidsph.interfaces.engine import InternalForces, StressFields
from solidsph.interfaces.history import HistoryMaterial
from solidsph.interfaces.law import Law, memory_name
from solidsph.interfaces.memory import Memory
from solidsph.interfaces.plan import Compilation, Operations, array_bytes
from solidsph.interfaces.terms import StressTerm
from solidsph.maths.arrays import Array, Indices, Mask
from solidsph.model.neighbours import Pairs
from solidsph_builtin.effects._gradients import real_pairs

# Smallest singular value of the moment, which is I in a full neighbourhood and half of that at a
# flat surface, below which the remaining neighbours do not determine a gradient.
_LEAST_MOMENT = 0.25

# Bonds that may fail soon have less than this part of their critical stretch left, of at most one.
# They are searched for anew when particles have moved by half of it.
_AHEAD = 0.3


@attrs.frozen(eq=False)
class Bonds:
    """Neighbour pairs of one body and their critical stretch."""

    body: Body
    pairs: Pairs
    kernel_gradients: Array  # (m, d)
    critical_stretch: float  # [-]
    may_fail: Mask  # (m,); (p, q) and (q, p) fail together, having the same stretch to the bit

    @classmethod
    def of(cls, body: Body, critical_stretch: float, chosen: Mask) -> Bonds:
        """The bonds of a body; only those between chosen particles (n,) may fail."""
        pairs = body.pairs()
        may = real_pairs(body, pairs) & chosen[pairs.rows] & chosen[pairs.columns]
        kernel_gradients = body.smoothing.gradient(pairs.offsets, pairs.distances)
        return cls(body, pairs, kernel_gradients, critical_stretch, may)

    @property
    def name(self) -> str:
        """Name of their flags in `State.memory`."""
        return f"bonds of {self.body.name}"

    @property
    def bytes(self) -> int:
        """Memory of the list and of the flags [bytes]."""
        p = self.pairs
        listed = (p.starts, p.rows, p.columns, p.offsets, p.distances, self.kernel_gradients)
        return array_bytes(listed) + 9 * p.count

    def intact(self) -> Array:
        """Flags (m,) of intact bonds, all 1; a bond that has failed has 0."""
        return np.ones(self.pairs.count)

    def left(self, displacements: Array, chosen: Indices | slice) -> Array:
        """By how much the chosen pairs may still grow at displacements (n, d) [m], (k,) [m]."""
        u, pairs = displacements, self.pairs
        now = pairs.offsets[chosen] + u[pairs.columns[chosen]] - u[pairs.rows[chosen]]
        limit = (1.0 + self.critical_stretch) * pairs.distances[chosen]
        return np.asarray(limit - np.sqrt(np.sum(now**2, axis=1)))

    def after(self, flags: Array, displacements: Array, near: Indices) -> Array:
        """Flags at displacements (n, d) [m]: the same array if no bond has failed since.

        Only bonds among the pairs `near` (k,) may have.
        """
        fails = near[(flags[near] > 0.0) & (self.left(displacements, near) < 0.0)]
        if not fails.size:
            return flags
        p, q = self.pairs.rows, self.pairs.columns
        left = flags.copy()
        left[fails] = 0.0
        while True:
            alone = self._alone(left)
            torn = (left > 0.0) & self.may_fail & (alone[p] | alone[q])
            if not torn.any():
                return left
            left = np.where(torn, 0.0, left)

    def _alone(self, flags: Array) -> Mask:
        """True for particles (n,) whose remaining bonds do not determine a gradient."""
        alone = self.pairs.row_sums(flags) < np.diff(self.pairs.starts)
        touched = np.flatnonzero(alone)
        where, rows = self.pairs.chosen(touched)
        weights = self.kernel_gradients[where] * flags[where, None]
        weights *= self.body.particles.cells[rows.columns, None]
        moments = rows.row_sums(rows.offsets[:, :, None] * weights[:, None, :])
        least = np.linalg.svd(moments, compute_uv=False)[:, -1]
        alone[touched] = least < _LEAST_MOMENT
        return alone

    def damage(self, flags: Array) -> Array:
        """Fraction of the bonds of each particle that have failed, (n,) [-]."""
        own = np.diff(self.pairs.starts) - 1  # a particle is among its own neighbours
        failed = self.pairs.row_sums(1.0 - flags)
        return np.asarray(failed / np.maximum(own, 1))

    def operators(self, flags: Array) -> Operators:
        """Gradient and force matrices of the remaining bonds."""
        body, pairs = self.body, self.pairs
        alone = pairs.spread(self._alone(flags))
        # Where no gradient is determined, none is formed: such a particle stays unstrained.
        acting = np.where(alone, 1.0, flags)[:, None] * self.kernel_gradients
        gradient = body.formulation.gradient.weights(pairs, acting, body.particles.cells)
        gradient = np.where(alone[:, None], 0.0, gradient)
        force = body.formulation.divergence.weights(pairs, gradient, body.particles.volumes)
        return assembled(pairs, gradient, force)


@final
@attrs.define(eq=False)
class Watch:
    """The pairs of bonds that are about to fail: a cache, which does not influence results."""

    bonds: Bonds
    _found: tuple[Array, Indices] | None = None  # displacements of the search, and what it found

    def after(self, flags: Array, displacements: Array) -> Array:
        """`Bonds.after`, of those that may have failed."""
        return self.bonds.after(flags, displacements, self._near(displacements))

    def _near(self, displacements: Array) -> Indices:
        """All pairs that may be beyond their critical stretch at displacements (n, d) [m]."""
        stretch = min(1.0, self.bonds.critical_stretch)
        margin = _AHEAD * stretch * float(self.bonds.body.particles.spacings.min())
        if self._found is not None:
            moved = displacements - self._found[0]
            moved -= moved.mean(axis=0)  # no pair grows where all move alike
            # Both particles of a pair may have moved apart.
            if 4.0 * np.max(np.sum(moved**2, axis=1)) < margin**2:
                return self._found[1]
        close = self.bonds.left(displacements, slice(None)) < 1.001 * margin
        found = np.flatnonzero(self.bonds.may_fail & close)
        self._found = displacements.copy(), found
        return found


@final
@attrs.frozen(eq=False)
class _Damaged(Law):
    """A law weakened by damage, P = (1 - D) P(F)."""

    body: Body
    own: Law
    left: Array  # 1 - D (n,) [-]

    def flux(self, H: Array, history: Array, step: float) -> tuple[Array, Array]:
        stress, history = self.own.flux(H, history, step)
        return stress * self.left, history


@final
@attrs.define(eq=False)
class BreakingForces(InternalForces):
    """Internal forces of the remaining bonds.

    The flags of bonds and the strain energy that failures have released are in `State.memory`. The
    forces are those of the engine until a bond fails, and then products of matrices, which are
    cached until another one does.
    """

    advances_histories: ClassVar[bool] = True

    whole: InternalForces  # while all bonds are intact
    bonds: Sequence[Bonds]
    laws: Sequence[Law]
    conditions: Sequence[StressTerm]
    _flags: tuple[Array, ...] = ()
    _made: InternalForces | None = None  # with these flags
    _watches: Sequence[Watch] = attrs.field(init=False)

    @_watches.default
    def _one_a_body(self) -> Sequence[Watch]:
        return [Watch(bonds) for bonds in self.bonds]

    @property
    def pair_count(self) -> int:
        return sum(bonds.pairs.count for bonds in self.bonds)

    @property
    def operations(self) -> Sequence[Operations]:
        return self.whole.operations

    @property
    def precision(self) -> float:
        return self.whole.precision

    @property
    def compilations(self) -> frozenset[Compilation]:
        return self.whole.compilations

    def note(self, compilations: frozenset[Compilation]) -> None:
        self.whole.note(compilations)

    def forces(self, time: float, displacements: Array) -> Array:
        return self.advance(time, 0.0, displacements, {})[0]

    def advance(
        self, time: float, step: float, displacements: Array, memory: Memory
    ) -> tuple[Array, Memory]:
        flags = self._remembered(memory)
        kept = {bonds.name: own for bonds, own in zip(self.bonds, flags, strict=True)}
        if step > 0.0:
            after = tuple(
                watch.after(own, displacements[watch.bonds.body.extent])
                for watch, own in zip(self._watches, flags, strict=True)
            )
            if any(new is not old for new, old in zip(after, flags, strict=True)):
                energies = [
                    self._observed(state, displacements, memory).energy_densities
                    for state in (flags, after)
                ]
                kept = {bonds.name: own for bonds, own in zip(self.bonds, after, strict=True)}
                kept[_RELEASED] = self._released(memory, displacements) + energies[0] - energies[1]
                flags = after
        forces, histories = self._of(flags).advance(time, step, displacements, memory)
        if histories:
            released = kept.get(_RELEASED, self._released(memory, displacements))
            kept[_RELEASED] = released - self._spared(flags, memory, histories)
        return forces, {**kept, **histories}

    def _spared(self, flags: Sequence[Array], memory: Memory, after: Mapping[str, Array]) -> Array:
        """Excess of the dissipation in a step according to the laws, (n,) [J/m^3].

        A law does not know the damage; its stress is scaled by 1 - D, and so is its dissipation.
        """
        spared = np.zeros(sum(bonds.body.particles.count for bonds in self.bonds))
        for law, bonds, own in zip(self.laws, self.bonds, flags, strict=True):
            name, material = memory_name(law.body), law.body.material
            if name in after and isinstance(material, HistoryMaterial):
                lost = [
                    material.dissipated(tuple(history.T))
                    for history in (law.history_of(memory), after[name])
                ]
                spared[bonds.body.extent] = bonds.damage(own) * (lost[1] - lost[0])
        return spared

    def fields(self, displacements: Array) -> StressFields:
        return self.observed(displacements, {})

    def observed(self, displacements: Array, memory: Memory) -> StressFields:
        found = self._observed(self._remembered(memory), displacements, memory)
        dissipated = found.dissipated_densities
        released = self._released(memory, displacements)
        total = released if dissipated is None else dissipated + released
        return attrs.evolve(found, dissipated_densities=total)

    def _observed(
        self, flags: tuple[Array, ...], displacements: Array, memory: Memory
    ) -> StressFields:
        found = self._of(flags).observed(displacements, memory)
        for bonds, own in zip(self.bonds, flags, strict=True):
            left, extent = 1.0 - bonds.damage(own), bonds.body.extent
            found.stresses[extent] *= left[:, None, None]
            found.energy_densities[extent] *= left
        return found

    def gradients(self, displacements: Array) -> Array:
        return self.whole.gradients(displacements)

    def spread(self, displacements: Array, stress: Array) -> Array:
        return self.whole.spread(displacements, stress)

    def own_stiffness(self, moduli: Array) -> Array | None:
        return self.whole.own_stiffness(moduli)

    def _remembered(self, memory: Memory) -> tuple[Array, ...]:
        return tuple(
            memory[bonds.name] if bonds.name in memory else bonds.intact() for bonds in self.bonds
        )

    def _released(self, memory: Memory, displacements: Array) -> Array:
        """Strain energy released so far, (n,) [J/m^3]."""
        return memory.get(_RELEASED, np.zeros(len(displacements)))

    def _of(self, flags: tuple[Array, ...]) -> InternalForces:
        """The forces of bonds with these flags."""
        same = len(flags) == len(self._flags) and all(
            new is old for new, old in zip(flags, self._flags, strict=True)
        )
        if self._made is None or not same:
            self._made = self.whole if all(map(np.all, flags)) else self._without(flags)
            self._flags = flags
        return self._made

    def _without(self, flags: tuple[Array, ...]) -> HistoryForces:
        """The forces without the bonds that have failed."""
        made = [bonds.operators(own) for bonds, own in zip(self.bonds, flags, strict=True)]
        laws = [
            _Damaged(law.body, law, 1.0 - bonds.damage(own))
            for law, bonds, own in zip(self.laws, self.bonds, flags, strict=True)
        ]
        sums = fixed_forces([bonds.body for bonds in self.bonds], made, self.conditions)
        return HistoryForces(sums, laws, self.conditions)


_RELEASED = "energy released by bonds"
