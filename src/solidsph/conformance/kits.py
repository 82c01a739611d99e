"""Kits of the kinds of part that can be checked alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from solidsph.conformance import (
    discretisation,
    divergence,
    gradient,
    history,
    integrator,
    kernel,
    material,
    shape,
)
from solidsph.conformance.check import Check

KITS: Mapping[str, Sequence[Check]] = {
    "kernels": kernel.KIT.checks,
    "shapes": shape.KIT.checks,
    "discretisations": discretisation.KIT.checks,
    "materials": (*material.KIT.checks, *history.KIT.checks),
    "gradients": gradient.KIT.checks,
    "divergences": divergence.KIT.checks,
    "integrators": integrator.KIT.checks,
}
