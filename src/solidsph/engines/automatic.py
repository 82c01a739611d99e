"""AutomaticEngine: the compiled engine where compiling pays, otherwise the matrix engine."""

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

# Rough times [s] of the matrix engine per step and per pair, for constant and for moving
# neighbours; the steps of the compiled engine are negligible beside them.
_STEP, _PAIR = 3e-4, 25e-9
_MOVING_STEP, _MOVING_PAIR = 1e-3, 400e-9

# Time of the matrix engine from which compiling pays [s]. The first run of a kind of scene compiles
# for some ten seconds, the others read in less than one: it pays for whoever runs four.
_WORTH_COMPILING = 3.0

# Number of pairs beyond which the matrices alone fill a gigabyte.
_MANY_PAIRS = 1e7


@final
@attrs.frozen
class AutomaticEngine(Engine):
    """The compiled engine if compiling pays, else the matrix engine."""

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
    """True if evaluations by matrices take long, or matrices too much memory."""
    work = evaluations * sum(_matrix_time(size) for size in sizes)
    return work > _WORTH_COMPILING or sum(size.pairs for size in sizes) > _MANY_PAIRS


def _matrix_time(size: BodySize) -> float:
    """Approximate time of the matrix engine for a step of a body [s]."""
    if size.moving:
        return _MOVING_STEP + _MOVING_PAIR * size.pairs
    return _STEP + _PAIR * size.pairs
