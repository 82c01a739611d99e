"""Kits: the checks of those kinds of part that can be tested alone."""

from __future__ import annotations

from collections.abc import Mapping

from solidsph.promises import (
    discretisation,
    divergence,
    gradient,
    history,
    integrator,
    kernel,
    material,
    shape,
)
from solidsph.promises.check import Check

KITS: Mapping[str, tuple[Check, ...]] = {
    "kernels": kernel.CHECKS,
    "shapes": shape.CHECKS,
    "discretisations": discretisation.CHECKS,
    "materials": (*material.CHECKS, *history.CHECKS),
    "gradients": gradient.CHECKS,
    "divergences": divergence.CHECKS,
    "integrators": integrator.CHECKS,
}
