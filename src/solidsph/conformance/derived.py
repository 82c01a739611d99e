"""Methods that a compilable kind derives from its formula, and that a part must not override.

A compiled loop uses the arrays and the formula, the step by step loop calls the method. If the
method is overridden, the two compute different physics.
"""

from __future__ import annotations

from collections.abc import Mapping

from solidsph.interfaces.compilable_terms import (
    HourglassLoad,
    LinearExtension,
    PairLoad,
    PointwiseLoad,
    RateStressLoad,
    ScheduledConstraint,
    ScheduledLoad,
)
from solidsph.interfaces.deformation_load import DeformationLoad
from solidsph.interfaces.integrator import PointwiseIntegrator
from solidsph.interfaces.terms import Load

_DERIVED: Mapping[type, tuple[str, ...]] = {
    ScheduledConstraint: ("held", "impose"),
    LinearExtension: ("held", "impose", "return_forces", "impose_stress"),
    ScheduledLoad: ("forces", "advance"),
    PointwiseLoad: ("forces", "advance"),
    RateStressLoad: ("particles", "forces", "advance"),
    PairLoad: ("particles", "forces", "advance"),
    DeformationLoad: ("forces", "advance"),
    HourglassLoad: ("particles", "forces", "advance"),
    PointwiseIntegrator: ("start", "advance"),
}


def overridden(part: object) -> str:
    """The first derived method that `part` overrides, as a message; "" if there is none."""
    for kind, names in _DERIVED.items():
        if not isinstance(part, kind):
            continue
        for name in names:
            original = getattr(kind, name, None) or getattr(Load, name)
            if getattr(type(part), name) is not original:
                return f"{type(part).__name__} is a {kind.__name__}, and overrides {name}"
    return ""
