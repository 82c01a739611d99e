"""Errors without a reference: what refinement says of each quantity of a scene.

Points of one scheme at three spacings or more are extrapolated to spacing zero
(`solidsph.studies.richardson`). That limit stands for the reference, and its own uncertainty is
added to every error.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite, nan

import attrs

from solidsph.errors import SceneError
from solidsph.studies.frontier import Frontier
from solidsph.studies.limit import Limit
from solidsph.studies.point import Point
from solidsph.studies.richardson import extrapolate

LEAST = 3
"""Spacings of one scheme that tell an order."""

# Results that differ by less than this part of their scale are the same: rounding, and what the
# iteration of an equilibrium leaves.
_EXACT = 1e-8


class TooFewError(SceneError):
    """Too few spacings have finished for an error bar."""


def limits(points: Sequence[Point], refining: str) -> Sequence[Limit]:
    """Limits of all quantities of `points`, each from the scheme that tells it best.

    Raises:
        TooFewError: no scheme has finished at three spacings.
    """
    ran = [attrs.evolve(point, error=0.0) for point in points if point.ran]
    found: dict[str, Limit] = {}
    for own in Frontier(ran, refining).schemes().values():
        levels = list({point.spacing: point for point in own}.values())
        if len(levels) < LEAST:
            continue
        for name in levels[-1].values:
            limit = _limit(name, levels, refining)
            if name not in found or _doubt(limit) < _doubt(found[name]):
                found[name] = limit
    if not found:
        failed = next((point for point in points if not point.ran), None)
        why = f" ({failed.label()}: {failed.failure})" if failed else ""
        raise TooFewError(
            f"an error bar needs {LEAST} spacings with the same scheme that finish, and there are "
            f"fewer{why}; give finer ones by --axis spacing=..., or a --reference"
        )
    return list(found.values())


def _limit(name: str, levels: Sequence[Point], refining: str) -> Limit:
    values = [point.values[name][0] for point in levels]
    scheme = {k: v for k, v in levels[-1].settings.items() if k != refining}
    scale = levels[-1].values[name][1]
    spread = max(values) - min(values)
    if spread <= _EXACT * scale:
        return Limit(name, values[-1], spread, scale, nan, scheme, values[-1], "")
    found = extrapolate([point.spacing for point in levels], values)
    return Limit(
        quantity=name,
        value=found.limit,
        uncertainty=found.uncertainty,
        scale=scale,
        order=found.order,
        scheme=scheme,
        finest=values[-1],
        warning=found.warning,
        in_sight=found.in_sight,
    )


def _doubt(limit: Limit) -> tuple[bool, float]:
    return bool(limit.warning), limit.bar


def needs_estimate(points: Sequence[Point]) -> bool:
    """Whether some point ran without a reference."""
    return any(point.ran and not isfinite(point.error) and point.values for point in points)


def judged(point: Point, known: Sequence[Limit]) -> Point:
    """`point` with the largest of its estimated errors, and the quantity that has it."""
    if not needs_estimate([point]):
        return point
    errors = {
        limit.quantity: limit.error(point.values[limit.quantity][0], point.settings)
        for limit in known
    }
    worst = max(known, key=lambda limit: errors[limit.quantity])
    return attrs.evolve(
        point,
        error=errors[worst.quantity],
        quantity=worst.quantity,
        value=point.values[worst.quantity][0],
        reference=worst.value if worst.in_sight else None,
    )
