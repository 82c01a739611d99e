"""The compiled engine: sums by loops that are compiled for the parts in use."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, final

import attrs
import numpy as np

from solidsph.engines.array_law import stress_fields
from solidsph.engines.compiled.compilations import of_forces, of_steps
from solidsph.engines.compiled.expected import expected_plan
from solidsph.engines.compiled.fixed.body import ReferenceBody, reference_body
from solidsph.engines.compiled.history_law import CompiledLaw
from solidsph.engines.compiled.moving.body import MovingBody, moving_body
from solidsph.engines.compiled.notes import looked_up, note
from solidsph.engines.compiled.pointwise import NotCompilableError, compiled_flux
from solidsph.engines.compiled.time_loop.loads import kind_of
from solidsph.engines.compiled.time_loop.loop import are_compilable, compiled_loop
from solidsph.engines.matrix import MatrixEngine
from solidsph.interfaces.body import Body
from solidsph.interfaces.engine import Engine, InternalForces, StressFields
from solidsph.interfaces.equation_of_motion import EquationOfMotion
from solidsph.interfaces.formulation import Configuration
from solidsph.interfaces.integrator import Integrator
from solidsph.interfaces.law import Law
from solidsph.interfaces.plan import BodySize, Compilation, Operations, Plan
from solidsph.interfaces.row_weights import RowWeights
from solidsph.interfaces.terms import StressTerm
from solidsph.interfaces.time_loop import TimeLoop
from solidsph.maths.arrays import Array, Indices


@final
@attrs.frozen
class CompiledEngine(Engine):
    """Sums over rows of weights, with the parts' pointwise functions compiled into the loops.

    If a material or a formulation cannot be compiled, the matrix engine takes all bodies, because
    conditions see the stress of all at once.

    Sums in the reference configuration are in `precision`, those over moving neighbours in double
    precision. The sums are of displacements, not of positions, so that single precision is the
    precision of strain as long as a body does not move by many times its spacing. F, the stress and
    the results are in double precision.
    """

    precision: str = attrs.field(
        default="float64", validator=attrs.validators.in_(("float64", "float32"))
    )

    def prepare(
        self, bodies: Sequence[Body], conditions: Sequence[StressTerm], evaluations: int = 1
    ) -> InternalForces:
        try:
            laws = [compiled_flux(b.formulation, b.material, b.smoothing.dimension) for b in bodies]
        except NotCompilableError:
            return MatrixEngine().prepare(bodies, conditions)
        parts = [self._part(b, law) for b, law in zip(bodies, laws, strict=True)]
        return CompiledForces(tuple(parts), tuple(conditions))

    def expected(self, sizes: Sequence[BodySize], evaluations: int) -> Plan:
        return expected_plan(sizes, 4 if self.precision == "float32" else 8)

    def _part(self, body: Body, law: Any) -> ReferenceBody | MovingBody:
        if body.formulation.configuration is Configuration.REFERENCE:
            return reference_body(body, law, self.precision)
        return moving_body(body, law)


@final
@attrs.frozen
class SinglePrecisionEngine(Engine):
    """The compiled engine with sums in single precision."""

    def prepare(
        self, bodies: Sequence[Body], conditions: Sequence[StressTerm], evaluations: int = 1
    ) -> InternalForces:
        return CompiledEngine("float32").prepare(bodies, conditions, evaluations)

    def expected(self, sizes: Sequence[BodySize], evaluations: int) -> Plan:
        return CompiledEngine("float32").expected(sizes, evaluations)


@final
@attrs.frozen(eq=False)
class CompiledForces(InternalForces):
    """Internal forces by compiled loops."""

    parts: Sequence[ReferenceBody | MovingBody]
    conditions: Sequence[StressTerm]

    @property
    def pair_count(self) -> int:
        return sum(part.pair_count for part in self.parts)

    @property
    def operations(self) -> Sequence[Operations]:
        return tuple(o for part in self.parts for o in part.operations)

    @property
    def precision(self) -> float:
        return max(part.precision for part in self.parts)

    @property
    def compilations(self) -> frozenset[Compilation]:
        return looked_up(of_forces(self.parts, self.conditions))

    def note(self, compilations: frozenset[Compilation]) -> None:
        note(compilations)

    def plan(self, equation: EquationOfMotion, integrator: Integrator) -> Plan:
        fixed = self._fixed
        if len(fixed) < len(self.parts) or not are_compilable(
            fixed, self.conditions, equation, integrator
        ):
            return super().plan(equation, integrator)
        d = equation.particles.dimension
        called = [load.label for load in equation.loads if kind_of(load) is None]
        loads = [
            operations
            for load in equation.loads
            for operations in load.operations(d, compiled=load.label not in called)
        ]
        steps = looked_up(of_steps(fixed, equation, integrator))
        return Plan(True, self.operations, loads, self.compilations | steps, called)

    @property
    def _fixed(self) -> Sequence[ReferenceBody]:
        return [part for part in self.parts if isinstance(part, ReferenceBody)]

    def time_loop(self, equation: EquationOfMotion, integrator: Integrator) -> TimeLoop | None:
        if not self.plan(equation, integrator).compiles_steps:
            return None
        try:
            return compiled_loop(self._fixed, self.conditions, self, equation, integrator)
        except NotCompilableError:  # its kind is known, but it does not compile
            return None

    def forces(self, time: float, displacements: Array) -> Array:
        forces = np.empty(displacements.shape)
        fused = [part for part in self.parts if part.fused and not self.conditions]
        staged = [part for part in self.parts if part not in fused]
        for part in fused:
            extent = part.body.extent
            part.forces(displacements[extent], forces[extent])
        if staged:
            n, d = displacements.shape
            stress = np.zeros((d, d, n))
            for part in staged:
                extent = part.body.extent
                part.stress(displacements[extent], stress[:, :, extent])
            for condition in self.conditions:
                condition.impose_stress(time, stress)
            for part in staged:
                extent = part.body.extent
                part.spread(stress[:, :, extent], forces[extent])
        return forces

    def gradients(self, displacements: Array) -> Array:
        n, d = displacements.shape
        H = np.zeros((n, d, d))
        for part in self.parts:
            part.gradient_of(displacements[part.body.extent], H[part.body.extent])
        return H

    def spread(self, displacements: Array, stress: Array) -> Array:
        forces = np.empty(displacements.shape)
        for part in self.parts:
            part.spread(stress[:, :, part.body.extent], forces[part.body.extent])
        return forces

    def own_stiffness(self, moduli: Array) -> Array | None:
        fixed = self._fixed
        if len(fixed) < len(self.parts) or not all(part.fused for part in fixed):
            return None
        n, d = len(moduli), fixed[0].body.particles.dimension
        blocks = np.zeros((n, d, d))
        for part in fixed:
            part.add_own_stiffness(moduli[part.body.extent], blocks[part.body.extent])
        return blocks

    def part(self, chosen: Indices) -> InternalForces | None:
        only = self.parts[0]
        if self.conditions or len(self.parts) > 1 or not isinstance(only, ReferenceBody):
            return None
        if not only.fused or only.body.particles.ghosts.any():
            return None
        return CompiledForces((only.part(chosen),), ())

    def reweighted(self, changed: Sequence[RowWeights]) -> InternalForces | None:
        fixed = self._fixed
        if len(fixed) < len(self.parts) or not all(part.fused for part in fixed):
            return None
        parts = [part.reweighted(own) for part, own in zip(fixed, changed, strict=True)]
        return CompiledForces(parts, self.conditions)

    def law(self, body: Body) -> Law | None:
        try:
            return CompiledLaw.of(body)
        except NotCompilableError:
            return None

    def fields(self, displacements: Array) -> StressFields:
        return stress_fields([part.body for part in self.parts], self.gradients(displacements))
