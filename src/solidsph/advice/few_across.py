"""Too few particles across the thinnest part of a body."""

from __future__ import annotations

from collections.abc import Iterator

from solidsph.advice.advice import Advice
from solidsph.advice.seen import Seen

# Particles across by which a bent strip is off by a few per cent (docs/what-accuracy-costs.md):
# gradients that are exact for quadratic fields need fewer.
_LINEAR, _QUADRATIC = 5, 3

# Along a bar, so that a wave or a stretch has a shape at all.
_ALONG = 10


def few_across(seen: Seen) -> Iterator[Advice]:
    """By rays through the shape, normal to its surface."""
    for one in seen.bodies:
        across = one.thicknesses[0] / one.spacing
        flat = seen.dimension == 1
        quadratic = one.body.formulation.gradient.exact_degree >= 2
        wanted = _ALONG if flat else _QUADRATIC if quadratic else _LINEAR
        if round(across, 1) > wanted - 0.5:
            continue
        word = "along it" if flat else "across its thinnest part"
        other = "" if flat or quadratic else ", or gradient = 'quadratic', which needs 3"
        yield Advice(
            found=f"body {one.name!r} has {across:.2g} particles {word}, "
            f"{one.thicknesses[0]:.4g} m",
            expected=f"at least {wanted} with this gradient",
            remedy=f"spacing = {one.thicknesses[0] / wanted:.3g}{other}",
        )
