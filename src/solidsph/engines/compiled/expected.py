"""The plan of the compiled engine for bodies that are not built yet."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from solidsph.engines.compiled.constants import STRIDE, WORTH_A_THREAD
from solidsph.engines.compiled.filter_operations import filter_operations
from solidsph.engines.compiled.notes import looked_up
from solidsph.interfaces.plan import (
    BodySize,
    Compilation,
    CompilationUnit,
    Operations,
    Plan,
    SumMethod,
    vectors,
)


def expected_plan(sizes: Sequence[BodySize], precision: int = 8) -> Plan:
    """The plan for bodies of these sizes; `precision` is that of the sums [bytes per number]."""
    d, moving = sizes[0].dimension, any(size.moving for size in sizes)
    if moving:
        units = [
            Compilation(unit, d, False)
            for unit in (CompilationUnit.MOVING_ENGINE, CompilationUnit.MOVING)
        ]
    else:
        own = (CompilationUnit.FORCES, CompilationUnit.FIELDS, CompilationUnit.STEPS)
        units = [
            Compilation(CompilationUnit.ENGINE, 0, False),
            *(Compilation(p, d, True) for p in own),
        ]
    operations = tuple(o for size in sizes for o in _operations(size, precision))
    return Plan(not moving, operations, (), looked_up(units))


def _operations(size: BodySize, precision: int) -> Iterator[Operations]:
    n, m, d = round(size.particles), round(size.pairs), size.dimension
    both = vectors(n, d)
    if size.moving:
        held = 36 * m + 8 * n * (d * d + 2)  # the list, its rows, kernel values and slopes
        yield Operations(SumMethod.FORMULAS, m, n, held + both, held)
        return
    # Factors, flat displacements, and buffers for the forces.
    own = precision * n * (1 + 2 * STRIDE[d])
    threaded = m > WORTH_A_THREAD
    if size.filters:
        yield filter_operations(n, m, d, 0 if size.lattice else m, threaded=threaded)
    if size.lattice:
        yield Operations(SumMethod.STENCILS, m, n, own + both, own, precision, threaded)
        return
    rows = m * (d * precision + 4) + 16 * n
    yield Operations(SumMethod.STENCILS, 0, 0, own + both, own, precision, threaded)
    yield Operations(SumMethod.ROWS, m, n, rows, rows, precision, threaded)
