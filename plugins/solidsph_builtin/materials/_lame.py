"""Elastic constants as materials take them from a scene."""

from __future__ import annotations

from collections.abc import Mapping

from solidsph.errors import SceneError
from solidsph.registry.parameters import check_positive

RUBBER: Mapping[str, float] = {"youngs_modulus": 1e6, "poissons_ratio": 0.3, "density": 1000.0}
"""A soft solid: example values [Pa], [-], [kg/m^3]."""


def checked_lame(
    material: str, youngs_modulus: float, poissons_ratio: float, density: float
) -> tuple[float, float]:
    """Moduli (lambda, mu) [Pa] from Young's modulus [Pa] and Poisson's ratio [-].

    Raises:
        SceneError: constants are outside the range in which the law is stable; all are told.
    """
    wrong: list[str] = []
    for name, value, unit in (
        ("youngs_modulus", youngs_modulus, "Pa"),
        ("density", density, "kg/m^3"),
    ):
        try:
            check_positive(f"material {material!r}", name, value, unit)
        except SceneError as cause:
            wrong.append(str(cause))
    if not -1.0 < poissons_ratio < 0.5:
        wrong.append(
            f"material {material!r}: poissons_ratio must lie between -1 and 0.5, both excluded, "
            f"got {poissons_ratio}; an incompressible solid needs a mixed formulation, take "
            "0.49 to come near it"
        )
    if wrong:
        raise SceneError("; ".join(wrong))
    mu = youngs_modulus / (2.0 * (1.0 + poissons_ratio))
    lam = 2.0 * mu * poissons_ratio / (1.0 - 2.0 * poissons_ratio)
    return lam, mu
