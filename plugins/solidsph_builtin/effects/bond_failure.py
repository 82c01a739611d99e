"""Fracture: bonds between neighbours fail when they are stretched too far."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, final

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.effect import Effect, Need
from solidsph.interfaces.engine import InternalForces
from solidsph.interfaces.forces_modifier import ForcesModifier
from solidsph.interfaces.gradient import PointwiseGradient
from solidsph.interfaces.terms import FieldTerm, Load, Observation, StressTerm
from solidsph.maths.arrays import Array, Indices
from solidsph.model.regions import Where
from solidsph.registry.parameters import check_positive, number
from solidsph.run.cfl_step import lattice_frequency
from solidsph_builtin.effects._bonds import Bonds
from solidsph_builtin.effects._breaking import BreakingForces
from solidsph_builtin.effects._gradients import in_the_reference

# Increase of the highest frequency of a lattice by cracks, relative: one-sided corrections are
# stiffer. For bodies broken to rubble the largest value measured was 0.9 (`solidsph check
# bond-failure`).
_RUBBLE = 1.0


@final
@attrs.frozen
class BondFailure(Effect):
    """Permanent failure of pairs stretched to over (1 + critical_stretch) times their distance.

    The kernel gradient of a failed pair is left out of the sums of both particles, whose correction
    is recomputed from the remaining pairs, as in the pseudo-spring method of Chakraborty & Shaw
    (2013). A crack is then a free surface for the gradient. A particle that has lost a fraction D
    of its bonds has the energy (1 - D) psi(F); otherwise the remaining neighbours could give more
    strain than all did, and a crack would gain energy from nowhere. A particle whose remaining
    bonds do not determine a gradient loses them and flies on without strain. Only 'contact' keeps
    the two sides of a crack from overlapping.

    The energy released by bonds is dissipated. It depends on the spacing, as does the width of the
    strip that a crack unloads: choose the stretch for the spacing in use.
    """

    conserves_momentum: ClassVar[bool] = True
    answers: ClassVar[frozenset[Need] | None] = frozenset()
    breaks_bonds: ClassVar[bool] = True
    at_cell_centres: ClassVar[bool] = True  # what is left of a correction is formed anew

    critical_stretch: float = number()  # [-]
    where: Where = "all"  # particles between which bonds may fail

    example: ClassVar[Mapping[str, Any]] = {"critical_stretch": 4e-4}

    def __attrs_post_init__(self) -> None:
        check_positive(
            "bond-failure", "critical_stretch", self.critical_stretch, "parts of the first distance"
        )

    def bind(self, model: DiscreteModel, label: str) -> Load:
        return _Cracks(
            label=label,
            bonds=self._bonds(model),
            count=model.particles.count,
            stiffness_rate=_RUBBLE * lattice_frequency(model.bodies),
        )

    def pair_work(self, particles: float, pairs: float) -> float:
        return pairs

    def _bonds(self, model: DiscreteModel) -> Sequence[Bonds]:
        in_the_reference(model, "bond-failure")
        chosen = np.zeros(model.particles.count, dtype=np.bool_)
        chosen[model.select(self.where)] = True
        found = []
        for body in model.bodies:
            gradient = body.formulation.gradient
            if not isinstance(gradient, PointwiseGradient):
                raise SceneError(
                    f"bond-failure: the gradient of body {body.name!r} is "
                    "not formed particle by particle, so that what failed bonds leave cannot be "
                    "corrected anew; use 'corrected'"
                )
            if not gradient.of_differences:
                # What failed bonds leave of its sums strains a body that merely moves.
                raise SceneError(
                    f"bond-failure: the gradient of body {body.name!r} acts on values and not on "
                    "their differences, so that particles with failed bonds would be strained by "
                    "moving alone; use 'corrected'"
                )
            found.append(Bonds.of(body, self.critical_stretch, chosen[body.extent]))
        return found


@final
@attrs.frozen(eq=False)
class _Cracks(FieldTerm, Load, ForcesModifier):
    """A term without forces of its own, which shows failed bonds."""

    label: str
    bonds: Sequence[Bonds]
    count: int
    stiffness_rate: float  # [rad/s]

    def modified(
        self, internal: InternalForces, stress_terms: Sequence[StressTerm]
    ) -> InternalForces:
        if isinstance(internal, BreakingForces):
            raise SceneError(
                "bond-failure: it is named twice, and a bond fails once; give it one "
                "critical_stretch, and places by `where`"
            )
        return BreakingForces(internal, self.bonds, stress_terms)

    @property
    def arrays(self) -> Mapping[str, int]:
        return {f"bonds of {bonds.body.name}": bonds.bytes for bonds in self.bonds}

    @property
    def pair_count(self) -> int:
        return sum(bonds.pairs.count for bonds in self.bonds)

    @property
    def particles(self) -> Indices:
        return np.arange(0)

    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        return np.empty((0, positions.shape[1]))

    def damage(self, observation: Observation) -> Array:
        """Fraction of the bonds of each particle that have failed, (n,) [-]."""
        found, memory = np.zeros(self.count), observation.state.memory
        for bonds in self.bonds:
            if bonds.name in memory:
                found[bonds.body.extent] = bonds.damage(memory[bonds.name])
        return found

    def fields(self, observation: Observation) -> Mapping[str, Array]:
        return {"damage [-]": self.damage(observation)}

    def report(self, observation: Observation) -> Mapping[str, float]:
        memory = observation.state.memory
        failed = sum(
            float(np.sum(1.0 - memory[bonds.name])) for bonds in self.bonds if bonds.name in memory
        )
        return {
            f"{self.label} failed bonds [-]": failed / 2.0,
            f"{self.label} largest damage [-]": float(self.damage(observation).max()),
        }
