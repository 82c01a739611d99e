"""Kernels: the conformance kit for every one that is installed, and their gradients in space."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solidsph.conformance.kernel import MASS_TOLERANCE, smoothed_mass
from solidsph.interfaces.smoothing_kernel import smoothing_kernel
from solidsph.registry import registry
from solidsph.testing import Check, checks, example_part
from solidsph.testing.strategies import dimensions, support_radii
from tests.helpers.examples import examples

every_kernel = pytest.mark.parametrize("name", registry.names("kernels"))


@every_kernel
@pytest.mark.parametrize("check", checks("kernels"), ids=lambda check: check.__name__)
def test_conformance(name: str, check: Check) -> None:
    result = check(example_part("kernels", name))
    assert result.passed, result


@every_kernel
@given(dimension=dimensions(), support_radius=support_radii())
@examples(50)
def test_declared_mass_whatever_the_support_radius(
    name: str, dimension: int, support_radius: float
) -> None:
    kernel = example_part("kernels", name)
    expected = 1.0 - kernel.lost_mass(dimension)
    assert abs(smoothed_mass(kernel, dimension, support_radius) - expected) < MASS_TOLERANCE


@every_kernel
@given(dimension=dimensions(), direction=st.integers(0, 2**32 - 1), q=st.floats(0.05, 0.95))
@examples(50)
def test_gradient_is_the_derivative_by_the_first_position(
    name: str, dimension: int, direction: int, q: float
) -> None:
    H = 0.3
    W = smoothing_kernel(example_part("kernels", name), dimension, H)
    rng = np.random.default_rng(direction)
    towards = rng.normal(size=dimension)
    offset = q * H * towards / np.linalg.norm(towards)  # x_q - x_p
    found = W.gradient(offset[None, :], np.array([q * H]))[0]
    step = 1e-5 * H
    for axis, moved in enumerate(step * np.eye(dimension)):
        # Moving x_p forward shortens the offset.
        ahead, behind = W.value(
            np.array([np.linalg.norm(offset - moved), np.linalg.norm(offset + moved)])
        )
        # Second order differences: (step / H)^2 = 1e-10 times derivatives of up to some hundreds
        # of the slope's scale, W(0) / H.
        scale = W.value(np.zeros(1))[0] / H
        assert abs((ahead - behind) / (2.0 * step) - found[axis]) < 1e-7 * scale


@every_kernel
@pytest.mark.parametrize("dimension", [1, 2, 3])
def test_no_gradient_at_the_particle_itself(name: str, dimension: int) -> None:
    W = smoothing_kernel(example_part("kernels", name), dimension, 0.3)
    assert not W.gradient(np.zeros((1, dimension)), np.zeros(1)).any()
