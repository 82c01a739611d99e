"""Internal forces with laws between their passes: of materials with internal variables, and of
bodies that filter their dilatation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar, final

import attrs
import numpy as np

from solidsph.engines.array_law import ArrayLaw, stress_and_energy
from solidsph.engines.filtered_law import FilteredLaw
from solidsph.errors import SceneError
from solidsph.interfaces.body import Body
from solidsph.interfaces.engine import InternalForces, StressFields
from solidsph.interfaces.equation_of_motion import EquationOfMotion
from solidsph.interfaces.forces_modifier import ForcesModifier
from solidsph.interfaces.history import HistoryMaterial
from solidsph.interfaces.integrator import Integrator
from solidsph.interfaces.law import Law, memory_name
from solidsph.interfaces.memory import Memory
from solidsph.interfaces.plan import Compilation, Operations, Plan
from solidsph.interfaces.terms import FieldTerm, Observation, StressTerm, Term
from solidsph.interfaces.time_loop import TimeLoop
from solidsph.maths.arrays import Array


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
            _check_whole(bodies, term)
            internal = term.modified(internal, conditions)
    return internal if internal.advances_histories else with_laws(internal, bodies, conditions)


def _check_whole(bodies: Sequence[Body], term: Term) -> None:
    """Raise SceneError if a body whose forces a term changes filters its dilatation."""
    filtered = [body.name for body in bodies if body.dilatation_filter is not None]
    if filtered:
        raise SceneError(
            f"{term.label!r} changes the forces inside bodies, and does not know that body "
            f"{filtered[0]!r} filters its dilatation; give the formulation filter_above = inf"
        )


def with_laws(
    internal: InternalForces, bodies: Sequence[Body], conditions: Sequence[StressTerm]
) -> InternalForces:
    """Internal forces by an engine, with laws of their own between its passes where bodies need it:
    they advance the histories of materials, and filter dilatations."""
    if not any(map(_needs_law, bodies)):
        return internal
    return LawForces(internal, tuple(_law(internal, body) for body in bodies), tuple(conditions))


def _needs_law(body: Body) -> bool:
    return isinstance(body.material, HistoryMaterial) or body.dilatation_filter is not None


def _own(law: Law) -> Law:
    return law.own if isinstance(law, FilteredLaw) else law


def _law(internal: InternalForces, body: Body) -> Law:
    own, added = internal.law(body) or ArrayLaw(body), body.dilatation_filter
    return own if added is None else FilteredLaw(body, own, added)


@final
@attrs.frozen(eq=False)
class LawForces(InternalForces):
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
        """Whether the engine has its own form of all laws that need one."""
        needed = [_own(law) for law in self.laws if _needs_law(law.body)]
        return not any(isinstance(law, ArrayLaw) for law in needed)

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
            if not _needs_law(body):
                continue
            extent = body.extent
            history = law.history_of(memory)
            P, psi = law_fields(body, virgin.deformation_gradients[extent], history)
            virgin.stresses[extent], virgin.energy_densities[extent] = P, psi
            if isinstance(material, HistoryMaterial):
                own = material.dissipated(tuple(history.T))
                dissipated[extent] = np.where(body.particles.ghosts, 0.0, own)
        remembers = any(isinstance(law.body.material, HistoryMaterial) for law in self.laws)
        return attrs.evolve(virgin, dissipated_densities=dissipated if remembers else None)


def law_fields(body: Body, F: Array, history: Array) -> tuple[Array, Array]:
    """P (n, d, d) [Pa] and psi (n,) [J/m^3] of all particles of a body, from F (n, d, d) and
    internal variables (n, k)."""
    P, psi = stress_and_energy(body.material, F, history)
    added = body.dilatation_filter
    return (P, psi) if added is None else (P + added.stress(F), psi + added.energy_densities(F))


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
