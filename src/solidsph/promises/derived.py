"""What a declared kind derives from arrays and a formula, and an implementation must leave alone.

A compiled loop takes the arrays and the formula, the step by step loop calls the method: where that
is overridden, the two carry out different physics.
"""

from __future__ import annotations

from collections.abc import Mapping

from solidsph.interfaces.compilable_terms import (
    HourglassLoad,
    LinearExtension,
    PairLoad,
    PointwiseLoad,
    ScheduledConstraint,
    ScheduledLoad,
)
from solidsph.interfaces.integrator import PointwiseIntegrator
from solidsph.interfaces.terms import Load

_DERIVED: Mapping[type, tuple[str, ...]] = {
    ScheduledConstraint: ("held", "impose"),
    LinearExtension: ("held", "impose", "return_forces", "impose_stress"),
    ScheduledLoad: ("forces", "advance"),
    PointwiseLoad: ("forces", "advance"),
    PairLoad: ("particles", "forces", "advance"),
    HourglassLoad: ("particles", "forces", "advance"),
    PointwiseIntegrator: ("start", "advance"),
}


def overridden(part: object) -> str:
    """What `part` overrides of what its declared kind derives; nothing if all is well."""
    for kind, names in _DERIVED.items():
        if not isinstance(part, kind):
            continue
        for name in names:
            original = getattr(kind, name, None) or getattr(Load, name)
            if getattr(type(part), name) is not original:
                return f"{type(part).__name__} is a {kind.__name__}, and overrides {name}"
    return ""
