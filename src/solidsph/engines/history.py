"""Internal forces of bodies whose materials remember."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar, final

import attrs
import numpy as np

from solidsph.interfaces.body import Body
from solidsph.interfaces.engine import InternalForces, StressFields
from solidsph.interfaces.forces_modifier import ForcesModifier
from solidsph.interfaces.history import History, HistoryMaterial
from solidsph.interfaces.law import Law, memory_name
from solidsph.interfaces.plan import Compilation, Operations
from solidsph.interfaces.terms import FieldTerm, Observation, StressTerm, Term
from solidsph.maths.arrays import Array
from solidsph.maths.tensors import components_first, particles_first


@final
@attrs.frozen(eq=False)
class ArrayLaw(Law):
    """By arrays of all particles: the reference for every other way."""

    body: Body

    def flux(self, H: Array, history: Array, step: float) -> tuple[Array, Array]:
        formulation, material = self.body.formulation, self.body.material
        n = self.body.particles.count
        with np.errstate(all="ignore"):  # a run that leaves the material's domain is caught later
            F = formulation.deformation_gradient(components_first(H))
            if isinstance(material, HistoryMaterial):
                h: History = tuple(history.T)
                if step > 0.0:
                    h = material.advance(F, h, step, material.params)
                P = material.stress(F, h, material.params)
                history = np.column_stack([np.broadcast_to(one, n) for one in h])
            else:
                P = material.first_piola(F, material.params)
            T = formulation.flux(F, P)
        return np.moveaxis(particles_first(T, n), 0, -1), history


def modified(
    internal: InternalForces,
    bodies: Sequence[Body],
    terms: Sequence[Term],
    conditions: Sequence[StressTerm],
) -> InternalForces:
    """Internal forces as `terms` modify them, which advance the histories of materials.

    Args:
        internal: by the scene's engine.
        bodies: what exerts them.
        terms: those among them that are modifiers are applied in this order.
        conditions: what changes the stress before forces are formed.

    Raises:
        SceneError: two modifiers do not go together.
    """
    for term in terms:
        if isinstance(term, ForcesModifier):
            internal = term.modified(internal, conditions)
    asked = internal.advances_histories
    if asked or not any(isinstance(body.material, HistoryMaterial) for body in bodies):
        return internal
    return HistoryForces(
        internal, tuple(internal.law(body) or ArrayLaw(body) for body in bodies), tuple(conditions)
    )


@final
@attrs.frozen(eq=False)
class HistoryForces(InternalForces):
    """The sums are the engine's; the law comes between its two passes."""

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

    @property
    def precision(self) -> float:
        return self.sums.precision

    def forces(self, time: float, displacements: Array) -> Array:
        return self.advance(time, 0.0, displacements, {})[0]

    def advance(
        self, time: float, step: float, displacements: Array, memory: Mapping[str, Array]
    ) -> tuple[Array, Mapping[str, Array]]:
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

    def observed(self, displacements: Array, memory: Mapping[str, Array]) -> StressFields:
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
    """Shows what the materials of some bodies remember."""

    bodies: Sequence[Body]
    count: int  # of all particles

    @property
    def label(self) -> str:
        return "history"

    def report(self, observation: Observation) -> Mapping[str, float]:
        return {}

    def fields(self, observation: Observation) -> Mapping[str, Array]:
        found: dict[str, Array] = {}
        for body in self.bodies:
            material = body.material
            if not isinstance(material, HistoryMaterial):
                continue
            history = ArrayLaw(body).history_of(observation.state.memory)
            names = list(material.initial_history(body.smoothing.dimension))
            for name in material.shown:
                values = found.setdefault(name, np.zeros(self.count))
                values[body.extent] = history[:, names.index(name)]
        return found
