"""Growth of small deviations over stretch and cover, in the paper's two Lagrangian forms."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from itertools import pairwise
from math import nan
from pathlib import Path
from typing import final

import attrs
from scipy.optimize import brentq

from solidsph.studies import stability_map as maps
from solidsph.studies.dispersion import dispersion
from solidsph.studies.scheme import Scheme, stretched
from solidsph.studies.stability_map import StabilityMap
from solidsph_builtin.materials.neo_hookean import NeoHookean

TOTAL, UPDATED = FORMS = ("total-lagrangian", "updated-lagrangian")


@cache
def stability_map(
    form: str, poissons_ratio: float, stretches: tuple[float, ...], covers: tuple[float, ...]
) -> StabilityMap:
    """The map of one form; with lengths in spacings and times in transits of one, only Poisson's
    ratio of the material is left."""
    return maps.stability_map(_scheme(form, poissons_ratio, covers[0]), stretches, covers)


def onset(form: str, poissons_ratio: float, cover: float, rate: float) -> float:
    """Smallest stretch in tension at which deviations grow at `rate`, in the unit of the map; nan
    if there is none up to 2."""
    scheme = _scheme(form, poissons_ratio, cover)
    simulation = scheme.simulation(1, [scheme.depth()])

    def excess(stretch: float) -> float:
        uniform = stretched(simulation, [stretch])
        return dispersion(simulation.dynamics, uniform).growth_rate - rate

    for low, high in pairwise([1.0, *(1.0 + 10.0 ** (-3.0 + k / 8.0) for k in range(25))]):
        if excess(high) > 0.0:
            return float(brentq(excess, low, high, xtol=1e-9))
    return nan


def _scheme(form: str, poissons_ratio: float, cover: float) -> Scheme:
    """With the paper's sums, and a wave speed of 1."""
    unit = NeoHookean(youngs_modulus=1.0, poissons_ratio=poissons_ratio, density=1.0)
    return Scheme(
        cover=cover,
        formulation={"type": form, "gradient": "difference", "divergence": "plain"},
        material=attrs.evolve(unit, youngs_modulus=1.0 / unit.wave_speed**2),
    )


@final
@attrs.frozen(eq=False)
class GrowthMaps:
    """The picture of some maps, by form."""

    maps: Mapping[str, StabilityMap]
    title: str
    cover: tuple[float, str]  # that is marked, and its name

    def save(self, path: Path) -> Path:
        """Draw it into a file; returns the path."""
        from solidsph.studies.stability_picture import draw_growth

        draw_growth(self.maps, path, title=self.title, mark=self.cover)
        return path
