"""The acoustic tensor against its closed form, and where the paper's law stops being elliptic."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.optimize import brentq

from solidsph import SolidsphError
from solidsph.conformance.ellipticity import (
    acoustic_tensors,
    least_stiffness,
    losses_of_ellipticity,
)
from solidsph_builtin.materials.linear_elastic import LinearElastic
from solidsph_builtin.materials.neo_hookean import NeoHookean

RUBBER = NeoHookean(youngs_modulus=1.0, poissons_ratio=0.49, density=1.0)


def uniaxial(stretch: float) -> np.ndarray:
    return np.array([[stretch]])


def in_plane(stretch: float) -> np.ndarray:
    return np.diag([stretch, 1.0])


def closed_form(F: np.ndarray, N: np.ndarray, lam: float, mu: float) -> np.ndarray:
    """mu I + (lambda (1 - ln J) + mu) g (x) g with g = F^-T N, from eq. 15 by hand."""
    g = np.linalg.solve(F.T, N)
    return mu * np.eye(len(F)) + (lam * (1.0 - np.log(np.linalg.det(F))) + mu) * np.outer(g, g)


@pytest.mark.parametrize("dimension", [1, 2, 3])
@given(seed=st.integers(0, 10_000))
def test_the_acoustic_tensor_is_that_of_the_closed_form(dimension: int, seed: int) -> None:
    random = np.random.default_rng(seed)
    F = np.eye(dimension) + random.uniform(-0.25, 0.25, (dimension, dimension))
    N = random.normal(size=(5, dimension))
    N /= np.linalg.norm(N, axis=1)[:, None]
    lam, mu = RUBBER.lame_parameters
    wanted = [closed_form(F, n, lam, mu) for n in N]
    # Rounding of a few products of numbers of order lambda.
    assert acoustic_tensors(RUBBER, F, N) == pytest.approx(np.array(wanted), abs=1e-11 * lam)


@pytest.mark.parametrize("dimension", [1, 2, 3])
def test_at_rest_the_slowest_wave_is_the_shear_wave(dimension: int) -> None:
    material = LinearElastic(youngs_modulus=1.0, poissons_ratio=0.3, density=1.0)
    lam, mu = material.lame_parameters
    slowest = lam + 2.0 * mu if dimension == 1 else mu
    assert least_stiffness(material, np.eye(dimension)).value == pytest.approx(slowest, rel=1e-12)


@pytest.mark.parametrize("dimension", [2, 3])
@given(seed=st.integers(0, 10_000))
@example(seed=3041)  # beside a pole of the angles
def test_the_weakest_direction_is_found_wherever_it_lies(dimension: int, seed: int) -> None:
    """Far beyond the loss the least eigenvalue is mu + k / s^2, with s the smallest stretch."""
    random = np.random.default_rng(seed)
    turn, _ = np.linalg.qr(random.normal(size=(dimension, dimension)))
    stretches = np.array([1.1, 4.0, 5.0][:dimension])
    F = turn @ np.diag(stretches) @ turn.T
    lam, mu = RUBBER.lame_parameters
    k = lam * (1.0 - np.log(np.prod(stretches))) + mu
    assert k < 0.0
    found = least_stiffness(RUBBER, F)
    # The square of the last grid's spacing, 6e-11, some hundred times mu; with room.
    assert found.value == pytest.approx(mu + k / 1.1**2, abs=1e-6 * lam)
    assert abs(found.direction @ turn[:, 0]) == pytest.approx(1.0, abs=1e-6)


def test_in_uniaxial_strain_the_law_softens_between_two_stretches() -> None:
    """P'(s) = mu + (mu + lambda (1 - ln s)) / s^2 vanishes there, by a root finder of its own."""
    lam, mu = RUBBER.lame_parameters

    def slope(s: float) -> float:
        return mu + (mu + lam * (1.0 - np.log(s))) / s**2

    wanted = [brentq(slope, 2.0, 5.0), brentq(slope, 5.0, 10.0)]
    found = losses_of_ellipticity(RUBBER, uniaxial, 1.0, 8.0)
    assert found == pytest.approx(wanted, rel=1e-9)  # both root finders stop at 1e-12
    # The figures known beforehand, to their last digit.
    assert found == pytest.approx([3.631, 6.400], abs=5e-4)


def test_in_the_plane_it_fails_earlier_and_across_the_pull() -> None:
    """mu + mu + lambda (1 - ln s) = 0: the direction that is not stretched is the weakest."""
    lam, mu = RUBBER.lame_parameters
    (found,) = losses_of_ellipticity(RUBBER, in_plane, 1.0, 6.0)
    assert found == pytest.approx(np.exp(1.0 + 2.0 * mu / lam), rel=1e-9)
    weakest = least_stiffness(RUBBER, in_plane(found)).direction
    # An eigenvalue near its minimum tells the angle only to the root of rounding.
    assert abs(weakest[0]) < 1e-4


def test_a_material_of_moderate_compressibility_never_fails() -> None:
    steel = NeoHookean(youngs_modulus=1.0, poissons_ratio=0.3, density=1.0)
    assert losses_of_ellipticity(steel, uniaxial, 1.0, 50.0) == []


def test_a_path_that_starts_beyond_the_loss_is_refused() -> None:
    with pytest.raises(SolidsphError, match="not elliptic at the start of the path, 4"):
        losses_of_ellipticity(RUBBER, uniaxial, 4.0, 5.0)
