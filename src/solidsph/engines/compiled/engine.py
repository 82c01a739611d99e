"""The compiled engine: fused sweeps over stencils and rows, compiled for the parts in use."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, final

import attrs
import numpy as np

from solidsph.engines.compiled.compilations import of_forces, of_steps
from solidsph.engines.compiled.expected import expected_plan
from solidsph.engines.compiled.history_law import CompiledLaw
from solidsph.engines.compiled.moving.body import MovingBody, moving_body
from solidsph.engines.compiled.pointwise import NotCompilableError, compiled_flux, no_law
from solidsph.engines.compiled.reference.blocks import STRIDE, group
from solidsph.engines.compiled.reference.body import ReferenceBody, reference_body
from solidsph.engines.compiled.reference.partition import (
    aligned,
    partitioned,
    passes,
    spread_pass,
    thread_count,
)
from solidsph.engines.compiled.reference.subset_rows import part_of_rows
from solidsph.engines.compiled.time_loop.loop import are_compilable, compiled_loop
from solidsph.engines.matrix import MatrixEngine
from solidsph.interfaces.body import Body, part_of
from solidsph.interfaces.engine import Engine, InternalForces, StressFields
from solidsph.interfaces.equation_of_motion import EquationOfMotion
from solidsph.interfaces.formulation import Configuration
from solidsph.interfaces.integrator import Integrator
from solidsph.interfaces.law import Law
from solidsph.interfaces.plan import BodySize, Compilation, Operations, Plan
from solidsph.interfaces.terms import StressTerm
from solidsph.interfaces.time_loop import TimeLoop
from solidsph.maths.arrays import Array, Indices
from solidsph.maths.tensors import components_first, particles_first

# Particles whose stress is found at once for reports and records.
_AT_ONCE = 4096


@final
@attrs.frozen
class CompiledEngine(Engine):
    """Sums over rows of weights, with the parts' pointwise functions compiled into the loops.

    Where a material or a formulation cannot be compiled, the matrix engine does the work: for all
    bodies, because conditions see the stress of all at once.

    The sums themselves are kept in `precision`, if they are taken in the reference configuration:
    what moves is summed in double precision. Displacements, and not positions, go into them, so
    that single precision is precision of strain, as long as a body does not move by many times its
    spacing; F, the stress and what the seam hands out are in double precision.
    """

    precision: str = attrs.field(
        default="float64", validator=attrs.validators.in_(("float64", "float32"))
    )

    def prepare(
        self,
        bodies: Sequence[Body],
        conditions: Sequence[StressTerm],
        evaluations: int = 1,
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
    """Internal forces by compiled sweeps."""

    parts: Sequence[ReferenceBody | MovingBody]
    conditions: Sequence[StressTerm]

    @property
    def pair_count(self) -> int:
        return sum(part.pair_count for part in self.parts)

    @property
    def operations(self) -> Sequence[Operations]:
        return tuple(own for part in self.parts for own in part.operations)

    @property
    def precision(self) -> float:
        return max(part.precision for part in self.parts)

    @property
    def compilations(self) -> frozenset[Compilation]:
        return frozenset(of_forces(self.parts, self.conditions))

    def plan(self, equation: EquationOfMotion, integrator: Integrator) -> Plan:
        fixed = self._fixed
        if len(fixed) < len(self.parts) or not are_compilable(
            fixed, self.conditions, equation, integrator
        ):
            return super().plan(equation, integrator)
        d = equation.particles.dimension
        loads = [o for load in equation.loads for o in load.operations(d, compiled=True)]
        pieces = {*self.compilations, *of_steps(fixed, equation, integrator)}
        return Plan(True, self.operations, loads, frozenset(pieces))

    @property
    def _fixed(self) -> Sequence[ReferenceBody]:
        return [part for part in self.parts if isinstance(part, ReferenceBody)]

    def time_loop(self, equation: EquationOfMotion, integrator: Integrator) -> TimeLoop | None:
        if not self.plan(equation, integrator).compiles_steps:
            return None
        try:
            return compiled_loop(self._fixed, self.conditions, self, equation, integrator)
        except NotCompilableError:  # a formula does not compile, as its kind did not tell
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

    def check_parts(self) -> None:
        if self._whole is None:
            super().check_parts()

    def part(self, chosen: Indices) -> InternalForces:
        whole = self._whole
        if whole is None:
            return super().part(chosen)
        d, dtype = whole.body.particles.dimension, whole.u.dtype.name
        rows = part_of_rows(whole.gradient, chosen, whole.body.particles.count)
        count = rows.run_pairs + rows.row_pairs
        threads = thread_count(count)
        shares = partitioned(rows, d, dtype, threads)
        own = attrs.evolve(
            whole,
            body=part_of(whole.body, chosen),
            gradient=rows,
            force=rows,
            factors=whole.factors[chosen],
            gradient_partition=shares,
            force_partition=shares,
            u=aligned((len(chosen) + group(d, dtype)) * STRIDE[d], dtype),
            passes=passes(d, dtype, whole.law, threads > 1),
            gradients=passes(d, dtype, no_law, threads > 1),
            spread_pass=spread_pass(d, dtype, threads > 1),
            pair_count=count,
        )
        return CompiledForces((own,), ())

    @property
    def _whole(self) -> ReferenceBody | None:
        """The only body, if its forces may be formed in parts."""
        if self.conditions or len(self.parts) > 1 or not isinstance(self.parts[0], ReferenceBody):
            return None
        only = self.parts[0]
        return only if only.fused and not only.body.particles.ghosts.any() else None

    def law(self, body: Body) -> Law | None:
        try:
            return CompiledLaw.of(body)
        except NotCompilableError:
            return None

    def fields(self, displacements: Array) -> StressFields:
        n, d = displacements.shape
        fields = StressFields(np.empty((n, d, d)), np.zeros((n, d, d)), np.zeros(n))
        for part in self.parts:
            extent = part.body.extent
            F, P = fields.deformation_gradients[extent], fields.stresses[extent]
            energy = fields.energy_densities[extent]
            part.gradient_of(displacements[extent], F)
            for some in _portions(part.body.particles.count):
                F[some] = _deformation(part.body, F[some])
            F[part.body.particles.ghosts] = np.eye(d)
            for some in _portions(part.body.particles.count):
                P[some], energy[some] = _stress_and_energy(part.body, F[some])
        return fields


def _portions(count: int) -> Iterator[slice]:
    """Particles 0 to `count`, some at a time: what the law needs between stays in cache."""
    return (slice(first, first + _AT_ONCE) for first in range(0, count, _AT_ONCE))


def _deformation(body: Body, H: Array) -> Array:
    """F (k, d, d) from H (k, d, d)."""
    with np.errstate(all="ignore"):  # as in the matrix engine
        F = body.formulation.deformation_gradient(components_first(H))
    return particles_first(F, len(H))


def _stress_and_energy(body: Body, F: Array) -> tuple[Array, Array]:
    """P (k, d, d) and psi (k,) from F (k, d, d)."""
    components = components_first(F)
    with np.errstate(all="ignore"):  # as in the matrix engine
        P = body.material.first_piola(components, body.material.params)
        energy = body.material.energy(components, body.material.params)
    return particles_first(P, len(F)), energy
