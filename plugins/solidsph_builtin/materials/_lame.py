"""Elastic constants as materials take them from a scene."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from solidsph.errors import SceneError
from solidsph.registry.parameters import check_positive

RUBBER: Mapping[str, float] = {"youngs_modulus": 1e6, "poissons_ratio": 0.3, "density": 1000.0}
"""A soft solid: example values [Pa], [-], [kg/m^3]."""


class Isotropic(Protocol):
    """A material given by two elastic constants."""

    @property
    def youngs_modulus(self) -> float: ...  # E [Pa]
    @property
    def poissons_ratio(self) -> float: ...  # nu [-]
    @property
    def density(self) -> float: ...  # rho_0 [kg/m^3]


def lame(material: Isotropic) -> tuple[float, float]:
    """Moduli (lambda, mu) [Pa]."""
    nu = material.poissons_ratio
    mu = material.youngs_modulus / (2.0 * (1.0 + nu))
    return 2.0 * mu * nu / (1.0 - 2.0 * nu), mu


def check_elastic(law: str, material: Isotropic) -> None:
    """Check the elastic constants and the density of a material, which is called `law`.

    Raises:
        SceneError: values are outside the range in which the law is stable; names all of them.
    """
    wrong: list[str] = []
    for name, unit in (("youngs_modulus", "Pa"), ("density", "kg/m^3")):
        try:
            check_positive(f"material {law!r}", name, getattr(material, name), unit)
        except SceneError as cause:
            wrong.append(str(cause))
    if not -1.0 < material.poissons_ratio < 0.5:
        wrong.append(
            f"material {law!r}: poissons_ratio must lie between -1 and 0.5, both excluded, "
            f"got {material.poissons_ratio}; an incompressible solid needs a mixed formulation, "
            "take 0.49 to come near it"
        )
    if wrong:
        raise SceneError("; ".join(wrong))
