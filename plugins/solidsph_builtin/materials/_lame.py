"""Elastic constants as materials take them from a scene."""

from __future__ import annotations

from solidsph.errors import SceneError
from solidsph.parameters import check_positive


def checked_lame(
    material: str, youngs_modulus: float, poissons_ratio: float, density: float
) -> tuple[float, float]:
    """Moduli (lambda, mu) [Pa] from Young's modulus [Pa] and Poisson's ratio [-].

    Raises:
        SceneError: a constant is outside the range in which the law is stable.
    """
    for name, value, unit in (
        ("youngs_modulus", youngs_modulus, "Pa"),
        ("density", density, "kg/m^3"),
    ):
        check_positive(f"material {material!r}", name, value, unit)
    if not -1.0 < poissons_ratio < 0.5:
        raise SceneError(
            f"material {material!r}: poissons_ratio must lie between -1 and 0.5, both excluded, "
            f"got {poissons_ratio}; an incompressible solid needs a mixed formulation, take "
            "0.49 to come near it"
        )
    mu = youngs_modulus / (2.0 * (1.0 + poissons_ratio))
    lam = 2.0 * mu * poissons_ratio / (1.0 - 2.0 * poissons_ratio)
    return lam, mu
