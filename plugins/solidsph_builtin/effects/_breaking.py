"""Internal forces of bodies with bonds, that is neighbour pairs, that fail."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar, final

import attrs
import numpy as np

from solidsph.engines.array_law import ArrayLaw, energy_densities
from solidsph.engines.law_forces import LawForces, with_laws
from solidsph.engines.matrix import fixed_forces
from solidsph.interfaces.body import Body
from solidsph.interfaces.engine import InternalForces, StressFields
from solidsph.interfaces.history import HistoryMaterial
from solidsph.interfaces.law import Law, memory_name
from solidsph.interfaces.memory import Memory
from solidsph.interfaces.plan import Compilation, Operations
from solidsph.interfaces.terms import StressTerm
from solidsph.maths.arrays import Array
from solidsph_builtin.effects._bonds import Bonds, Remains, Watch


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
    forces are those of the engine until a bond fails. Then the rows of weights of particles that
    have lost bonds are replaced, and are kept until another one fails.
    """

    advances_histories: ClassVar[bool] = True

    engine: InternalForces
    bonds: Sequence[Bonds]
    conditions: Sequence[StressTerm]
    _whole: InternalForces = attrs.field(init=False)  # while all bonds are intact
    _laws: Sequence[Law] = attrs.field(init=False)
    _watches: Sequence[Watch] = attrs.field(init=False)
    _remains: tuple[Remains, ...] = attrs.field(init=False)
    _made: InternalForces = attrs.field(init=False)  # of these remains

    def __attrs_post_init__(self) -> None:
        bodies = [bonds.body for bonds in self.bonds]
        self._whole = self._made = with_laws(self.engine, bodies, self.conditions)
        self._laws = [self.engine.law(body) or ArrayLaw(body) for body in bodies]
        self._watches = [Watch(bonds) for bonds in self.bonds]
        self._remains = tuple(bonds.none_failed for bonds in self.bonds)

    @property
    def pair_count(self) -> int:
        return sum(bonds.pairs.count for bonds in self.bonds)

    @property
    def operations(self) -> Sequence[Operations]:
        return self.engine.operations

    @property
    def precision(self) -> float:
        return self.engine.precision

    @property
    def compilations(self) -> frozenset[Compilation]:
        return self.engine.compilations

    def note(self, compilations: frozenset[Compilation]) -> None:
        self.engine.note(compilations)

    def forces(self, time: float, displacements: Array) -> Array:
        return self.advance(time, 0.0, displacements, {})[0]

    def advance(
        self, time: float, step: float, displacements: Array, memory: Memory
    ) -> tuple[Array, Memory]:
        before = remains = self._remembered(memory)
        if step > 0.0:
            remains = tuple(
                watch.after(own, displacements[watch.bonds.body.extent])
                for watch, own in zip(self._watches, before, strict=True)
            )
        released = self._released(memory, displacements)
        if any(new is not old for new, old in zip(remains, before, strict=True)):
            released = released + self._lost(before, remains, displacements, memory)
        forces, histories = self._of(remains).advance(time, step, displacements, memory)
        kept = {bonds.name: own.flags for bonds, own in zip(self.bonds, remains, strict=True)}
        if not all(own.intact for own in remains):
            kept[_RELEASED] = released - self._spared(remains, memory, histories)
        return forces, {**kept, **histories}

    def _lost(
        self,
        before: tuple[Remains, ...],
        after: tuple[Remains, ...],
        displacements: Array,
        memory: Memory,
    ) -> Array:
        """Strain energy that bodies lose by bonds that fail now, (n,) [J/m^3]."""
        lost = np.zeros(len(displacements))
        for remains, sign in ((before, 1.0), (after, -1.0)):
            H = self._of(remains).gradients(displacements)
            for law, old, new, own in zip(self._laws, before, after, remains, strict=True):
                losers = np.flatnonzero(new.damage != old.damage)
                history = law.history_of(memory)[losers]
                at = law.body.extent.start + losers
                energies = energy_densities(law.body, H[at], history)
                lost[at] += sign * (1.0 - own.damage[losers]) * energies
        return lost

    def _spared(
        self, remains: Sequence[Remains], memory: Memory, after: Mapping[str, Array]
    ) -> Array:
        """Excess of the dissipation in a step according to the laws, (n,) [J/m^3].

        A law does not know the damage; its stress is scaled by 1 - D, and so is its dissipation.
        """
        spared = np.zeros(sum(bonds.body.particles.count for bonds in self.bonds))
        for law, bonds, own in zip(self._laws, self.bonds, remains, strict=True):
            name, material = memory_name(law.body), law.body.material
            if name in after and isinstance(material, HistoryMaterial):
                lost = [
                    material.dissipated(tuple(history.T))
                    for history in (law.history_of(memory), after[name])
                ]
                spared[bonds.body.extent] = own.damage * (lost[1] - lost[0])
        return spared

    def fields(self, displacements: Array) -> StressFields:
        return self.observed(displacements, {})

    def observed(self, displacements: Array, memory: Memory) -> StressFields:
        remains = self._remembered(memory)
        found = self._of(remains).observed(displacements, memory)
        for bonds, own in zip(self.bonds, remains, strict=True):
            left, extent = 1.0 - own.damage, bonds.body.extent
            found.stresses[extent] *= left[:, None, None]
            found.energy_densities[extent] *= left
        dissipated = found.dissipated_densities
        released = self._released(memory, displacements)
        total = released if dissipated is None else dissipated + released
        return attrs.evolve(found, dissipated_densities=total)

    def gradients(self, displacements: Array) -> Array:
        return self.engine.gradients(displacements)

    def spread(self, displacements: Array, stress: Array) -> Array:
        return self.engine.spread(displacements, stress)

    def own_stiffness(self, moduli: Array) -> Array | None:
        return self.engine.own_stiffness(moduli)

    def _released(self, memory: Memory, displacements: Array) -> Array:
        """Strain energy released so far, (n,) [J/m^3]."""
        return memory.get(_RELEASED, np.zeros(len(displacements)))

    def _remembered(self, memory: Memory) -> tuple[Remains, ...]:
        """What is left in this memory; formed anew if it is not that of the last step."""
        found = []
        for bonds, last in zip(self.bonds, self._remains, strict=True):
            flags = memory.get(bonds.name, bonds.none_failed.flags)
            found.append(last if flags is last.flags else bonds.remains(flags))
        return tuple(found)

    def _of(self, remains: tuple[Remains, ...]) -> InternalForces:
        """The forces of what is left."""
        if any(new is not old for new, old in zip(remains, self._remains, strict=True)):
            intact = all(own.intact for own in remains)
            self._made = self._whole if intact else self._without(remains)
            self._remains = remains
        return self._made

    def _without(self, remains: Sequence[Remains]) -> InternalForces:
        """The forces without the bonds that have failed."""
        laws = [
            _Damaged(law.body, law, 1.0 - own.damage)
            for law, own in zip(self._laws, remains, strict=True)
        ]
        sums = self.engine.reweighted([own.rows for own in remains]) or fixed_forces(
            [bonds.body for bonds in self.bonds],
            [bonds.operators(own) for bonds, own in zip(self.bonds, remains, strict=True)],
            self.conditions,
        )
        return LawForces(sums, laws, self.conditions)


_RELEASED = "energy released by bonds"
