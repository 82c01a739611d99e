"""The measure of the dilatation that a law declares is the one its bulk modulus works on."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np
import pytest

from solidsph.interfaces.history import HistoryMaterial
from solidsph.interfaces.material import Material
from solidsph.maths.arrays import Array
from solidsph.maths.dilatation import GREEN, LOGARITHMIC, POWER, SMALL, Dilatation
from solidsph.maths.tensors import components_first, particles_first
from solidsph.registry import registry
from solidsph.testing import example_part

MEASURES = {"log": LOGARITHMIC, "power": POWER, "green": GREEN, "small": SMALL}
DECLARING = [
    name
    for name in registry.names("materials")
    if registry.load("materials", name).dilatation is not None
]


def nearly_incompressible(name: str) -> Material:
    law: Any = example_part("materials", name)
    if hasattr(law, "poissons_ratio"):
        return attrs.evolve(law, poissons_ratio=0.4999)
    return attrs.evolve(law, bulk_modulus=5000.0 * law.lame_parameters[1])


def strained(d: int) -> Array:
    random = np.random.default_rng(d)
    return np.eye(d) + 0.05 * random.uniform(-1.0, 1.0, (200, d, d))


def stress(law: Material, F: Array) -> Array:
    components = components_first(F)
    with np.errstate(all="ignore"):
        if isinstance(law, HistoryMaterial):
            start = law.initial_history(F.shape[1]).values()
            history = tuple(np.full(len(F), value) for value in start)
            return particles_first(law.stress(components, history, law.params), len(F))
        return particles_first(law.first_piola(components, law.params), len(F))


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("name", DECLARING)
def test_a_law_declares_its_own(name: str, d: int) -> None:
    """What the measure leaves of the stress is of shear, or of the third order in the strain."""
    law, F = nearly_incompressible(name), strained(d)
    lam, _ = law.lame_parameters

    def left(measure: Dilatation) -> float:
        theta = np.asarray(measure.of(components_first(F)))
        slope = particles_first(measure.slope(components_first(F)), len(F))
        rest = stress(law, F) - lam * theta[:, None, None] * slope
        return float(np.abs(rest).max() / (lam * np.abs(theta).max()))

    assert law.dilatation is not None
    assert left(law.dilatation) <= 0.01
    others = [one for one in MEASURES.values() if one is not law.dilatation]
    assert all(left(one) > 0.02 for one in others)


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("measure", MEASURES.values(), ids=MEASURES.keys())
def test_slopes_and_bends_are_derivatives(measure: Dilatation, d: int) -> None:
    F, dF = components_first(strained(d)), components_first(strained(d)[::-1] - np.eye(d))
    h = 1e-4  # a central difference errs by its square, some 1e-9 here

    def moved(by: float) -> Any:
        return components_first(particles_first(F, 200) + by * particles_first(dF, 200))

    slope = (np.asarray(measure.of(moved(h))) - np.asarray(measure.of(moved(-h)))) / (2 * h)
    g = particles_first(measure.slope(F), 200)
    assert slope == pytest.approx(np.einsum("pik,pik->p", g, particles_first(dF, 200)), abs=1e-8)
    ahead, behind = (particles_first(measure.slope(moved(by)), 200) for by in (h, -h))
    bend = particles_first(measure.bend(F, dF), 200)
    assert (ahead - behind) / (2 * h) == pytest.approx(bend, abs=1e-8)
