"""AutomaticEngine: the compiled engine where that pays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import final

import attrs

from solidsph.engines.compiled.expected import expected_plan
from solidsph.engines.matrix import MatrixEngine
from solidsph.engines.sizes import size_of
from solidsph.interfaces.body import Body
from solidsph.interfaces.engine import Engine, InternalForces
from solidsph.interfaces.plan import BodySize, Plan
from solidsph.interfaces.terms import StressTerm

# What the matrix engine takes for a step and for each pair in it, if the pairs stay and if they
# are found anew, and what compilation takes, all [s], about; beside them the compiled engine's own
# steps are as good as free.
_STEP, _PAIR = 1e-4, 25e-9
_MOVING_STEP, _MOVING_PAIR = 1e-3, 400e-9
_COMPILATION = 10.0

# Beyond so many pairs the matrices alone fill a gigabyte, however few steps there are.
_MANY_PAIRS = 1e7


@final
@attrs.frozen
class AutomaticEngine(Engine):
    """The compiled engine where there is more to do than compiling is; the matrix engine else."""

    def prepare(
        self, bodies: Sequence[Body], conditions: Sequence[StressTerm], evaluations: int = 1
    ) -> InternalForces:
        if not compiling_pays([size_of(body) for body in bodies], evaluations):
            return MatrixEngine().prepare(bodies, conditions, evaluations)
        from solidsph.engines.compiled.engine import CompiledEngine  # brings the compiler with it

        return CompiledEngine().prepare(bodies, conditions, evaluations)

    def expected(self, sizes: Sequence[BodySize], evaluations: int) -> Plan:
        if compiling_pays(sizes, evaluations):
            return expected_plan(sizes)
        return MatrixEngine().expected(sizes, evaluations)


def compiling_pays(sizes: Sequence[BodySize], evaluations: int) -> bool:
    """True if so many evaluations by matrices take longer than compiling, or matrices too much."""
    work = evaluations * sum(_matrix_time(size) for size in sizes)
    return work > _COMPILATION or sum(size.pairs for size in sizes) > _MANY_PAIRS


def _matrix_time(size: BodySize) -> float:
    """What the matrix engine takes for a step of a body [s], about."""
    if size.moving:
        return _MOVING_STEP + _MOVING_PAIR * size.pairs
    return _STEP + _PAIR * size.pairs
