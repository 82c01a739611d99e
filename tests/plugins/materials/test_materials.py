"""Materials: the conformance kit for every one that is installed, over its range of constants."""

from __future__ import annotations

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solidsph.interfaces.history import HistoryMaterial
from solidsph.registry import registry
from solidsph.testing import Check, checks, conformance, example_part
from solidsph.testing.strategies import deformation_gradients, dimensions, rotations
from tests.helpers.examples import examples

every_material = pytest.mark.parametrize("name", registry.names("materials"))


@pytest.mark.parametrize(
    ("name", "check"),
    [
        # Paths of plastic flow take seconds a check: at every change, for the simplest law.
        pytest.param(name, check, marks=pytest.mark.validation if name == "johnson-cook" else ())
        for name in registry.names("materials")
        for check in checks("materials")
    ],
    ids=lambda value: value if isinstance(value, str) else value.__name__,
)
def test_conformance(name: str, check: Check) -> None:
    result = check(example_part("materials", name))
    assert result.passed, result


def has(name: str, parameter: str) -> bool:
    return parameter in attrs.fields_dict(registry.load("materials", name))


@pytest.mark.parametrize(
    ("name", "poissons_ratio"),
    [
        # Laws with a history are led along paths, which takes up to 20 s.
        pytest.param(
            name,
            ratio,
            marks=pytest.mark.validation
            if ratio == 0.0 or issubclass(registry.load("materials", name), HistoryMaterial)
            else (),
        )
        for name in registry.names("materials")
        if has(name, "poissons_ratio")
        for ratio in (-0.5, 0.0, 0.49)
    ],
)
def test_conformance_for_other_ratios(name: str, poissons_ratio: float) -> None:
    # As hard as steel, but where the yield stress, of rubber, would then be next to nothing.
    part = example_part(
        "materials",
        name,
        youngs_modulus=1e6 if has(name, "yield_stress") else 200e9,
        poissons_ratio=poissons_ratio,
    )
    assert [result for result in conformance("materials", part) if not result.passed] == []


@every_material
@given(data=st.data(), dimension=dimensions())
@examples(50)
def test_rotation_leaves_the_energy_of_an_objective_law_alone(
    name: str, data: st.DataObject, dimension: int
) -> None:
    material = example_part("materials", name)
    if not material.objective:
        return
    F = data.draw(deformation_gradients(dimension))
    Q = data.draw(rotations(dimension))
    lam, mu = material.lame_parameters
    before = material.energy(F, material.params)
    difference = material.energy(Q @ F, material.params) - before
    # Some dozen operations on numbers of the order of the moduli, or of exponentials.
    assert abs(difference) < 1e-13 * (lam + 2.0 * mu + before)


@every_material
@given(data=st.data(), dimension=dimensions())
@examples(50)
def test_work_along_a_path_is_the_energy_stored(
    name: str, data: st.DataObject, dimension: int
) -> None:
    # Independent of differences: the integral of P : dF from I to F along a straight line.
    material = example_part("materials", name)
    F = data.draw(deformation_gradients(dimension))
    one = np.eye(dimension)
    H = F - one
    nodes, weights = np.polynomial.legendre.leggauss(40)
    path = [one + 0.5 * (1.0 + node) * H for node in nodes]
    if min(np.linalg.det(at) for at in path) < 0.2:
        return  # a straight line to a large rotation passes through states without volume
    power = [np.vdot(np.array(material.first_piola(at, material.params)), H) for at in path]
    lam, mu = material.lame_parameters
    # 40 Gauss points resolve 1 / J on a path that stays away from J = 0; a bend of the stress, of
    # the order of the moduli, is off by the square of their distance.
    tolerance = 1e-9 if material.smooth else 1e-3
    assert abs(0.5 * np.dot(weights, power) - material.energy(F, material.params)) < tolerance * (
        lam + 2.0 * mu
    )
