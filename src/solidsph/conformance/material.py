"""Checks of a material, in 1, 2 and 3D, at strains of up to 40 %."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from solidsph.conformance.check import Broken, Kit, NotPromised, Verdict, at_most, more_than
from solidsph.conformance.ellipticity import least_stiffness, losses_of_ellipticity
from solidsph.conformance.samples import (
    ANGLES,
    DIMENSIONS,
    as_tuples,
    central_difference,
    in_space,
    random_deformation_gradients,
    random_rotation,
    relative_error,
    rotation,
    seeded,
    stiffness,
)
from solidsph.interfaces.material import Material
from solidsph.maths.arrays import Array, Tensor
from solidsph.maths.tensors import particles_first

_COUNT = 20  # deformation gradients in each dimension

# Balances the error of the sixth order formula, step^6 times a seventh derivative, against
# rounding, 1e-16 / step; both stay below 1e-11 of the stiffness.
_STEP = 2e-3
_DIFFERENCE_TOLERANCE = 1e-10

# Where ellipticity is looked for: from strong compression to strong tension.
_STRETCHES = (0.3, 3.0)
_SAMPLES = 15

# A strain at which fibres are taut or slack, and by how much stiffness may have changed there.
_SMALL, _BESIDE = 1e-6, 1e-4

# Less anisotropy than this, over the stiffness, is none.
_ALIKE = 1e-6

# Share of the points that no jump of the tangent is near. A law that is wrong on one side of the
# jump is wrong at half of the points.
_MOST = 0.8

# A few dozen operations on numbers of the order of the stiffness.
_ROUNDING = 1e-13

KIT = Kit()


@KIT.problems("untouched")
def leaves_its_input(material: Material) -> Iterator[str]:
    """Energy, stress and tangent do not change F or its change in place, and give the same answer
    to the same F again."""
    for rng, F in _strained():
        d, dF = len(F), _directions(rng, len(F))
        before = F.copy(), dF.copy()
        first = _energy(material, F), _stress(material, F), _tangent(material, F, dF)
        if not (np.array_equal(before[0], F) and np.array_equal(before[1], dF)):
            yield f"{d}D: F was changed in place"
        _stress(material, 1.1 * F)
        again = _energy(material, F), _stress(material, F), _tangent(material, F, dF)
        if not all(np.array_equal(a, b) for a, b in zip(first, again, strict=True)):
            yield f"{d}D: the same F got another answer"


@KIT.errors(_DIFFERENCE_TOLERANCE)
def stress(material: Material) -> Iterator[float]:
    """P is the derivative of the energy by F."""
    for rng, F in _strained():
        dF = _directions(rng, len(F))
        power = np.einsum("ijn,ijn->n", _stress(material, F), dF)
        found = central_difference(partial(_energy, material), F, dF, _STEP)
        yield _difference_error(material, found - power)


@KIT.errors(_DIFFERENCE_TOLERANCE)
def tangent(material: Material) -> Iterator[float]:
    """The tangent is the derivative of P by F."""
    for rng, F in _strained():
        dF = _directions(rng, len(F))
        found = central_difference(partial(_stress, material), F, dF, _STEP)
        yield _difference_error(material, found - _tangent(material, F, dF))


@KIT.errors(_ROUNDING)
def symmetric_tangent(material: Material) -> Iterator[float]:
    """The tangent is symmetric, dG : A : dF = dF : A : dG, as that of any energy is."""
    for rng, F in _strained():
        dF, dG = _directions(rng, len(F)), _directions(rng, len(F))
        there = np.einsum("ijn,ijn->n", dG, _tangent(material, F, dF))
        back = np.einsum("ijn,ijn->n", dF, _tangent(material, F, dG))
        yield relative_error(material, there - back)


@KIT.errors(_ROUNDING)
def natural_state(material: Material) -> Iterator[float]:
    """Energy and stress are zero at F = I."""
    for d in DIMENSIONS:
        undeformed = np.eye(d)[:, :, None]
        yield relative_error(material, _energy(material, undeformed))
        yield relative_error(material, _stress(material, undeformed))


@KIT.check
def objectivity(material: Material) -> Verdict:
    """A rotation leaves the energy alone and turns the stress, if and only if so declared."""
    if not material.objective:
        turned = [rotation(d, [1.0] * ANGLES[d])[:, :, None] for d in (2, 3)]
        energies = [float(_energy(material, Q)[0]) for Q in turned]
        # One radian looks like a strain of 1 - cos 1 = 0.5, whose square is 0.2.
        return more_than(min(np.abs(energies)) / stiffness(material), 1e-3)
    errors = []
    for rng, F in _strained():
        Q = random_rotation(rng, len(F))
        QF = np.einsum("ij,jkn->ikn", Q, F)
        QP = np.einsum("ij,jkn->ikn", Q, _stress(material, F))
        errors += [
            relative_error(material, _energy(material, QF) - _energy(material, F)),
            relative_error(material, _stress(material, QF) - QP),
        ]
    return at_most(max(errors), _ROUNDING)


@KIT.errors(_ROUNDING)
def angular_momentum(material: Material) -> Iterator[float]:
    """The Cauchy stress is symmetric: P F^T = F P^T, if the law is objective."""
    _needs_objectivity(material)
    for _, F in _strained():
        PF = np.einsum("ikn,jkn->ijn", _stress(material, F), F)
        yield relative_error(material, PF - PF.transpose(1, 0, 2))


@KIT.errors(_DIFFERENCE_TOLERANCE)
def stress_measures(material: Material) -> Iterator[float]:
    """F S F^T / J with S = F^-1 P is the Cauchy stress: J sigma : d is the power of a rate of
    deformation d, if the law is objective."""
    _needs_objectivity(material)
    for rng, F in _strained():
        first = np.moveaxis(F, -1, 0)
        P = np.moveaxis(_stress(material, F), -1, 0)
        S, J = np.moveaxis(np.linalg.solve(first, P), 0, -1), np.linalg.det(first)
        sigma = np.einsum("ikn,kln,jln->ijn", F, S, F) / J
        rate = _directions(rng, len(F))
        rate = 0.5 * (rate + rate.transpose(1, 0, 2))
        power = J * np.einsum("ijn,ijn->n", sigma, rate)
        along = np.einsum("ikn,kjn->ijn", rate, F)
        found = central_difference(partial(_energy, material), F, along, _STEP)
        yield _difference_error(material, found - power)
        yield relative_error(material, sigma - sigma.transpose(1, 0, 2))


@KIT.check
def ellipticity(material: Material) -> Verdict:
    """Unstrained it carries waves in every direction. The stretches at which it loses that under
    uniaxial stretch are reported: there the deformation localises at any resolution."""
    at_rest = min(least_stiffness(material, np.eye(d)).value for d in DIMENSIONS)
    if not at_rest > 0.0:
        raise Broken(f"least stiffness {at_rest / stiffness(material):.1e} unstrained")
    lost = [
        stretch
        for end in _STRETCHES
        for stretch in losses_of_ellipticity(
            material, lambda s: np.diag([s, 1.0]), 1.0, end, samples=_SAMPLES
        )[:1]
    ]
    where = " and ".join(f"at a stretch of {stretch:.3f}" for stretch in lost)
    least, most = _STRETCHES
    return Verdict(True, f"lost {where}" if lost else f"kept from {least:g} to {most:g}")


@KIT.check
def small_strain(material: Material) -> Verdict:
    """The tangent at F = I is that of the declared Lame parameters, lambda tr(e) I + 2 mu e. A law
    declared as anisotropic has another one, nowhere stiffer."""
    lam, mu = material.lame_parameters
    errors, ratios = [], []
    for d, rng in seeded():
        dF = _directions(rng, d)
        identity = np.repeat(np.eye(d)[:, :, None], _COUNT, axis=2)
        expected = lam * np.einsum("kkn->n", dF) * identity + mu * (dF + dF.transpose(1, 0, 2))
        errors.append(relative_error(material, _tangent(material, identity, dF) - expected))
        # Fibres may be taut on one side of F = I only.
        stiffest = np.maximum(*(_form(material, identity + s * dF, dF) for s in (-_SMALL, _SMALL)))
        ratios.append((stiffest / np.einsum("ijn,ijn->n", expected, dF)).max())
    if material.isotropic:
        return at_most(max(errors), _ROUNDING)
    if not max(errors) > _ALIKE:
        raise Broken("declared as anisotropic, but all directions are alike")
    return at_most(max(ratios), 1.0 + _BESIDE)


@KIT.errors(_ROUNDING)
def missing_dimensions(material: Material) -> Iterator[float]:
    """In 1D and 2D it is the 3D law with the missing stretches 1: uniaxial and plane strain."""
    for _, F in _strained():
        d, whole = len(F), in_space(F)
        yield relative_error(material, _energy(material, F) - _energy(material, whole))
        yield relative_error(material, _stress(material, F) - _stress(material, whole)[:d, :d])


@KIT.check
def wave_speed(material: Material) -> Verdict:
    """The wave speed is sqrt(A_1111(I) / rho_0), that of the confined wave. In an anisotropic law
    no confined wave along an axis is faster."""
    errors, ratios = [], []
    for d in DIMENSIONS:
        identity = np.eye(d)[:, :, None]
        for axis in range(d):
            along = np.zeros((d, d, 1))
            along[axis, axis] = 1.0
            A = [_form(material, identity + s * along, along)[0] for s in (0.0, -_SMALL, _SMALL)]
            speeds = np.sqrt(np.array(A) / material.density) / material.wave_speed
            errors.append(abs(speeds[0] - 1.0))
            ratios.append(speeds.max())
    if material.isotropic:
        return at_most(max(errors), _ROUNDING)
    return at_most(max(ratios), 1.0 + _BESIDE)


@KIT.errors(_ROUNDING)
def pointwise(material: Material) -> Iterator[float]:
    """Energy, stress and tangent give the same for nested tuples of numbers as for arrays."""
    params = material.params
    for d, rng in seeded():
        F, dF = random_deformation_gradients(rng, d, 3), _directions(rng, d)[:, :, :3]
        energy, P, dP = _energy(material, F), _stress(material, F), _tangent(material, F, dF)
        for n in range(3):
            point, along = as_tuples(F[:, :, n]), as_tuples(dF[:, :, n])
            yield relative_error(material, float(material.energy(point, params)) - energy[n])
            alone = np.array(material.first_piola(point, params))
            yield relative_error(material, alone - P[:, :, n])
            alone = np.array(material.tangent(point, along, params))
            yield relative_error(material, alone - dP[:, :, n])


def _strained() -> Iterator[tuple[np.random.Generator, Array]]:
    """Deformation gradients (d, d, n) in each dimension, and random numbers."""
    for d, rng in seeded():
        yield rng, random_deformation_gradients(rng, d, _COUNT)


def _needs_objectivity(material: Material) -> None:
    if not material.objective:
        raise NotPromised("the law declares that it is not objective")


def _directions(rng: np.random.Generator, dimension: int) -> Array:
    """Changes of F of length 1, (d, d, n)."""
    dF = rng.normal(size=(dimension, dimension, _COUNT))
    return np.asarray(dF / np.linalg.norm(dF, axis=(0, 1)))


def _difference_error(material: Material, errors: Array) -> float:
    """The largest of `errors` (..., n) of finite differences over the stiffness, or of most points
    where the law is not smooth: across a jump of the tangent the difference is wrong, not the law.
    """
    largest = np.abs(errors).reshape(-1, errors.shape[-1]).max(axis=0)
    return float(np.quantile(largest, 1.0 if material.smooth else _MOST)) / stiffness(material)


def _form(material: Material, F: Array, dF: Array) -> Array:
    """dF : A : dF, (n,)."""
    return np.asarray(np.einsum("ijn,ijn->n", _tangent(material, F, dF), dF))


def _energy(material: Material, F: Array) -> Array:
    return np.asarray(material.energy(F, material.params), dtype=np.float64)


def _stress(material: Material, F: Array) -> Array:
    return _as_array(material.first_piola(F, material.params), F)


def _tangent(material: Material, F: Array, dF: Array) -> Array:
    return _as_array(material.tangent(F, dF, material.params), F)


def _as_array(T: Tensor, F: Array) -> Array:
    return np.moveaxis(particles_first(T, F.shape[2]), 0, -1)
