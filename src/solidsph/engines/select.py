"""Choice of an engine by name or by size."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping, Sequence
from typing import final

import attrs
import numpy as np

from solidsph.engines.matrix import MatrixEngine
from solidsph.errors import SceneError
from solidsph.interfaces.body import Body
from solidsph.interfaces.engine import Engine, InternalForces
from solidsph.interfaces.formulation import Configuration
from solidsph.interfaces.hourglass_energy import (
    HourglassOperator,
    HourglassPairs,
    HourglassProducts,
)
from solidsph.interfaces.smoothing_kernel import UNIT_SPHERE
from solidsph.interfaces.terms import StressTerm

# What the matrix engine takes for a step and for each pair in it, if the pairs stay and if they
# are found anew, and what compilation takes, all [s], about; beside them the compiled engine's own
# steps are as good as free.
_STEP, _PAIR = 1e-4, 25e-9
_MOVING_STEP, _MOVING_PAIR = 1e-3, 400e-9
_COMPILATION = 10.0

# Compiled sweeps over these pairs take some 10 s to compile, and products some 30 ns a pair more
# than they do: from here on they pay within about a thousand evaluations.
_PAIRS_FOR_PRODUCTS = 300_000

# Beyond so many pairs the matrices alone fill a gigabyte, however few steps there are.
_MANY_PAIRS = 1e7


@final
@attrs.frozen
class AutomaticEngine(Engine):
    """The compiled engine where it pays: where there is more to do than compiling is."""

    def prepare(
        self,
        bodies: Sequence[Body],
        conditions: Sequence[StressTerm],
        evaluations: int = 1,
    ) -> InternalForces:
        work = evaluations * sum(_matrix_time(body) for body in bodies)
        pays = work > _COMPILATION or sum(_expected_pairs(body) for body in bodies) > _MANY_PAIRS
        engine = _compiled() if pays else MatrixEngine()
        return engine.prepare(bodies, conditions, evaluations)


def _matrix_time(body: Body) -> float:
    """What the matrix engine takes for a step of a body [s], about."""
    if body.formulation.configuration is Configuration.REFERENCE:
        return _STEP + _PAIR * _expected_pairs(body)
    return _MOVING_STEP + _MOVING_PAIR * _expected_pairs(body)


def hourglass_operator(pairs: HourglassPairs) -> HourglassOperator:
    """The operator of these pairs that suits the size of its body."""
    if _expected_pairs(pairs.body) < _PAIRS_FOR_PRODUCTS:
        return HourglassProducts.of(pairs)
    from solidsph.engines.compiled.hourglass_sweeps import (
        HourglassSweeps,  # brings the compiler with it
    )

    return HourglassSweeps.of(pairs)


def _expected_pairs(body: Body) -> float:
    """Pairs that there would be if every support were complete."""
    d = body.smoothing.dimension
    ball = UNIT_SPHERE[d] / d * body.smoothing.support_radius**d
    return float(body.particles.count * ball / np.mean(body.particles.volumes))


def _compiled(precision: str = "float64") -> Engine:
    from solidsph.engines.compiled.engine import CompiledEngine  # brings the compiler with it

    return CompiledEngine(precision)


_ENGINES: Mapping[str, Callable[[], Engine]] = {
    "auto": AutomaticEngine,
    "matrix": MatrixEngine,
    "compiled": _compiled,
    "compiled-float32": lambda: _compiled("float32"),
}


def engine_named(name: str) -> Engine:
    """The engine of that name.

    Raises:
        SceneError: there is none.
    """
    if name not in _ENGINES:
        near = difflib.get_close_matches(name, _ENGINES, 1)
        hint = f"did you mean {near[0]!r}?" if near else "take 'auto'"
        raise SceneError(f"unknown engine {name!r}; {hint} (known: {', '.join(_ENGINES)})")
    return _ENGINES[name]()
