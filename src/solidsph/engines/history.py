"""Internal forces of bodies whose materials have internal variables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar, final

import attrs
import numpy as np

from solidsph.engines.array_law import ArrayLaw
from solidsph.interfaces.body import Body
from solidsph.interfaces.engine import InternalForces, StressFields
from solidsph.interfaces.equation_of_motion import EquationOfMotion
from solidsph.interfaces.forces_modifier import ForcesModifier
from solidsph.interfaces.history import History, HistoryMaterial
from solidsph.interfaces.integrator import Integrator
from solidsph.interfaces.law import Law, memory_name
from solidsph.interfaces.memory import Memory
from solidsph.interfaces.plan import Compilation, Operations, Plan
from solidsph.interfaces.terms import FieldTerm, Observation, StressTerm, Term
from solidsph.interfaces.time_loop import TimeLoop
from solidsph.maths.arrays import Array
from solidsph.maths.tensors import components_first, particles_first


def modified(
    internal: InternalForces,
    bodies: Sequence[Body],
    terms: Sequence[Term],
    conditions: Sequence[StressTerm],
) -> InternalForces:
    """Internal forces with all modifiers among `terms`, which advance the histories of materials.

    Args:
        internal: forces by the scene's engine.
        bodies: all bodies.
        terms: all terms; modifiers are applied in this order.
        conditions: terms that change the stress before forces are formed.

    Raises:
        SceneError: two modifiers cannot be combined.
    """
    for term in terms:
        if isinstance(term, ForcesModifier):
            internal = term.modified(internal, conditions)
    return internal if internal.advances_histories else with_histories(internal, bodies, conditions)


def with_histories(
    internal: InternalForces, bodies: Sequence[Body], conditions: Sequence[StressTerm]
) -> InternalForces:
    """Internal forces by an engine, which advance the histories of materials that have some."""
    if not any(isinstance(body.material, HistoryMaterial) for body in bodies):
        return internal
    return HistoryForces(
        internal, tuple(internal.law(body) or ArrayLaw(body) for body in bodies), tuple(conditions)
    )


@final
@attrs.frozen(eq=False)
class HistoryForces(InternalForces):
    """Internal forces by the two passes of an engine, with the laws between them."""

    advances_histories: ClassVar[bool] = True

    sums: InternalForces
    laws: Sequence[Law]
    conditions: Sequence[StressTerm]

    @property
    def pair_count(self) -> int:
        return self.sums.pair_count

    @property
    def operations(self) -> Sequence[Operations]:
        return self.sums.operations

    @property
    def compilations(self) -> frozenset[Compilation]:
        return self.sums.compilations

    def note(self, compilations: frozenset[Compilation]) -> None:
        self.sums.note(compilations)

    @property
    def precision(self) -> float:
        return self.sums.precision

    def plan(self, equation: EquationOfMotion, integrator: Integrator) -> Plan:
        if self._engine_has_laws:
            return self.sums.plan(equation, integrator)
        return super().plan(equation, integrator)

    def time_loop(self, equation: EquationOfMotion, integrator: Integrator) -> TimeLoop | None:
        return self.sums.time_loop(equation, integrator) if self._engine_has_laws else None

    @property
    def _engine_has_laws(self) -> bool:
        """Whether the engine has its own form of all laws with internal variables."""
        return not any(
            isinstance(law, ArrayLaw) and isinstance(law.body.material, HistoryMaterial)
            for law in self.laws
        )

    def forces(self, time: float, displacements: Array) -> Array:
        return self.advance(time, 0.0, displacements, {})[0]

    def advance(
        self, time: float, step: float, displacements: Array, memory: Memory
    ) -> tuple[Array, Memory]:
        n, d = displacements.shape
        H = self.sums.gradients(displacements)
        stress = np.zeros((d, d, n))
        kept = {}
        for law in self.laws:
            extent = law.body.extent
            T, history = law.flux(H[extent], law.history_of(memory), step)
            stress[:, :, extent] = np.where(law.body.particles.ghosts, 0.0, T)
            if isinstance(law.body.material, HistoryMaterial):
                kept[memory_name(law.body)] = history
        for condition in self.conditions:
            condition.impose_stress(time, stress)
        return self.sums.spread(displacements, stress), kept

    def fields(self, displacements: Array) -> StressFields:
        return self.observed(displacements, {})

    def gradients(self, displacements: Array) -> Array:
        return self.sums.gradients(displacements)

    def spread(self, displacements: Array, stress: Array) -> Array:
        return self.sums.spread(displacements, stress)

    def own_stiffness(self, moduli: Array) -> Array | None:
        return self.sums.own_stiffness(moduli)

    def observed(self, displacements: Array, memory: Memory) -> StressFields:
        virgin = self.sums.fields(displacements)
        dissipated = np.zeros(len(displacements))
        for law in self.laws:
            body, material = law.body, law.body.material
            if not isinstance(material, HistoryMaterial):
                continue
            extent, n = body.extent, body.particles.count
            h: History = tuple(law.history_of(memory).T)
            F = components_first(virgin.deformation_gradients[extent])
            with np.errstate(all="ignore"):
                virgin.stresses[extent] = particles_first(material.stress(F, h, material.params), n)
                virgin.energy_densities[extent] = material.stored(F, h, material.params)
            dissipated[extent] = np.where(body.particles.ghosts, 0.0, material.dissipated(h))
        return attrs.evolve(virgin, dissipated_densities=dissipated)


@final
@attrs.frozen(eq=False)
class HistoryFields(FieldTerm):
    """Internal variables of materials, as fields of the record."""

    bodies: Sequence[Body]
    count: int  # of all particles

    @property
    def label(self) -> str:
        return "history"

    def fields(self, observation: Observation) -> Mapping[str, Array]:
        fields: dict[str, Array] = {}
        for body in self.bodies:
            material = body.material
            if not isinstance(material, HistoryMaterial):
                continue
            history = ArrayLaw(body).history_of(observation.state.memory)
            names = list(material.initial_history(body.smoothing.dimension))
            for name in material.shown:
                values = fields.setdefault(name, np.zeros(self.count))
                values[body.extent] = history[:, names.index(name)]
        return fields
