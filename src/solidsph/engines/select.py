"""Choice of an engine by name or by size."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping, Sequence
from typing import final

import attrs
import numpy as np

from solidsph.body import Body
from solidsph.engines.engine import Engine, InternalForces
from solidsph.engines.matrix import MatrixEngine
from solidsph.errors import SceneError
from solidsph.interfaces.condition import StressCondition
from solidsph.interfaces.formulation import Configuration
from solidsph.smoothing import UNIT_SPHERE

# Compilation takes about 5 s, and the matrix engine about 20 ns a pair more than the compiled one:
# from here on it pays within some 5000 steps.
_MANY_PAIRS = 50_000

# Where pairs are found anew at every step, the difference is some 400 ns a pair.
_COST_OF_MOVING = 20.0


@final
@attrs.frozen
class AutomaticEngine(Engine):
    """The compiled engine where it pays: for many pairs, or fewer that are found at every step."""

    def prepare(
        self, bodies: Sequence[Body], conditions: Sequence[StressCondition]
    ) -> InternalForces:
        many = sum(_expected_work(body) for body in bodies) > _MANY_PAIRS
        engine = _compiled() if many else MatrixEngine()
        return engine.prepare(bodies, conditions)


def _expected_work(body: Body) -> float:
    """Pairs that there would be if every support were complete, times what one costs."""
    d = body.smoothing.dimension
    ball = UNIT_SPHERE[d] / d * body.smoothing.support_radius**d
    pairs = float(body.particles.count * ball / np.mean(body.particles.volumes))
    fixed = body.formulation.configuration is Configuration.REFERENCE
    return pairs if fixed else _COST_OF_MOVING * pairs


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
