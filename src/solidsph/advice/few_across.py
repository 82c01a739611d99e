"""Too few particles across the thinnest part of a body."""

from __future__ import annotations

from collections.abc import Iterator

from solidsph.advice.advice import Advice
from solidsph.advice.scene_facts import SceneFacts

# Particles across, for gradients exact for linear fields and for quadratic ones. A cantilever ten
# times as long as thick, at rest under its weight, sags too far by 117, 50, 29, 13 and 7 % with 3,
# 4, 5, 7 and 9 across and the first, by 6, 4 and 2 % with 3, 4 and 5 and the second.
_LINEAR, _QUADRATIC = 5, 3
_BENT = 9

# Length over thickness from which a held body is assumed to bend.
_SLENDER = 5.0

# Along a bar, so that a wave or a stretch has a shape at all.
_ALONG = 10


def few_across(facts: SceneFacts) -> Iterator[Advice]:
    """Count particles along rays through the shape, normal to its surface."""
    for body in facts.bodies:
        least, usual = body.thicknesses
        across = body.across
        wanted, where, remedy = _ALONG, "along it", ""
        if facts.dimension > 1:
            is_quadratic = body.exact_degree >= 2
            bends = body.is_held and body.length >= _SLENDER * usual
            wanted = _QUADRATIC if is_quadratic else _BENT if bends else _LINEAR
            where = "across its thinnest part"
            if not is_quadratic:
                remedy = f", or gradient = 'quadratic', which needs {_QUADRATIC}"
        if round(across, 1) > wanted - 0.5:
            continue
        finer = f"spacing = {least / wanted:.3g}"
        if body.body.particles.graded:
            finer = f"a spacing there of a part {across / wanted:.2g} of what it is"
        slender = ", in a body so slender" if wanted == _BENT else ""
        yield Advice(
            finding=f"body {body.name!r} has {across:.2g} particles {where}, {least:.4g} m",
            expected=f"at least {wanted} with this gradient{slender}",
            remedy=f"{finer}{remedy}",
        )
