"""What the compiled engine has to compile, each unit once per process and key."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from solidsph.engines.compiled.fixed.body import ReferenceBody
from solidsph.engines.compiled.moving.body import MovingBody
from solidsph.engines.compiled.time_loop.loads import kind_of
from solidsph.interfaces.equation_of_motion import EquationOfMotion
from solidsph.interfaces.integrator import Integrator
from solidsph.interfaces.plan import Compilation, CompilationUnit
from solidsph.interfaces.terms import GhostConstraint, StressTerm


def of_forces(
    parts: Sequence[ReferenceBody | MovingBody], stress_terms: Sequence[StressTerm]
) -> Iterator[Compilation]:
    """Compilations for one evaluation of the internal forces."""
    operations = [o for part in parts for o in part.operations]
    threaded = any(o.threaded for o in operations)
    d = parts[0].body.particles.dimension
    fixed = [part for part in parts if isinstance(part, ReferenceBody)]
    if fixed:
        yield Compilation(CompilationUnit.ENGINE, 0, False)
        staged = bool(stress_terms) or any(
            not part.body.formulation.divergence.adjoint for part in parts
        )
        for law in {_law(part) for part in fixed}:
            yield Compilation(
                CompilationUnit.STAGED if staged else CompilationUnit.FORCES, d, threaded, law
            )
        yield Compilation(CompilationUnit.FIELDS, d, threaded, _precision(fixed))
    if len(fixed) < len(parts):
        yield Compilation(CompilationUnit.MOVING_ENGINE, d, False)
        for law in {_law(part) for part in parts if isinstance(part, MovingBody)}:
            yield Compilation(CompilationUnit.MOVING, d, threaded, law)


def of_steps(
    parts: Sequence[ReferenceBody], equation: EquationOfMotion, integrator: Integrator
) -> Iterator[Compilation]:
    """Additional compilations for whole steps."""
    d = equation.particles.dimension
    threaded = any(o.threaded for part in parts for o in part.operations)
    kinds = tuple(sorted(type(term).__name__ for term in (*equation.constraints, *equation.loads)))
    laws = tuple(sorted({_law(part) for part in parts}, key=repr))
    yield Compilation(CompilationUnit.STEPS, d, threaded, (type(integrator), laws, kinds))
    for load in equation.loads:
        kind = kind_of(load)
        if kind is None:  # called: what it adds is the same for all
            yield Compilation(CompilationUnit.LOAD, d, threaded)
        else:
            yield Compilation(kind.unit, d, threaded, type(load) if kind.formula else None)
    if any(isinstance(term, GhostConstraint) for term in equation.constraints):
        yield Compilation(CompilationUnit.EXTENSION, d, threaded)


def _law(part: ReferenceBody | MovingBody) -> object:
    body = part.body
    precision = _precision([part]) if isinstance(part, ReferenceBody) else None
    filters = body.dilatation_filter is not None
    return type(body.material), type(body.formulation), precision, filters


def _precision(parts: Sequence[ReferenceBody]) -> int:
    return min(o.precision for part in parts for o in part.operations)
