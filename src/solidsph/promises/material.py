"""What every material must keep, in 1, 2 and 3D, at strains of up to 40 %."""

from __future__ import annotations

from functools import partial

import numpy as np

from solidsph.interfaces.material import Material
from solidsph.maths.arrays import Array, Tensor
from solidsph.maths.tensors import particles_first
from solidsph.promises.check import Check, Verdict, at_most, check, more_than, not_promised
from solidsph.promises.ellipticity import least_stiffness, losses_of_ellipticity
from solidsph.promises.samples import (
    ANGLES,
    central_difference,
    random_deformation_gradients,
    random_rotation,
    rotation,
    seeded,
)

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

# Points that no jump of the tangent is near. A law that is wrong on one side of it is so at half.
_MOST = 0.8

# A few dozen operations on numbers of the order of the stiffness.
_ROUNDING = 1e-13


@check
def stress(material: Material) -> Verdict:
    """P is the derivative of the energy by F."""
    errors = []
    for d, rng in seeded():
        F, dF = random_deformation_gradients(rng, d, _COUNT), _directions(rng, d)
        power = np.einsum("ijn,ijn->n", _stress(material, F), dF)
        found = central_difference(partial(_energy, material), F, dF, _STEP)
        errors.append(_largest(material, found - power))
    return at_most(max(errors) / _stiffness(material), _DIFFERENCE_TOLERANCE)


@check
def tangent(material: Material) -> Verdict:
    """The tangent is the derivative of P by F."""
    errors = []
    for d, rng in seeded():
        F, dF = random_deformation_gradients(rng, d, _COUNT), _directions(rng, d)
        found = central_difference(partial(_stress, material), F, dF, _STEP)
        errors.append(_largest(material, found - _tangent(material, F, dF)))
    return at_most(max(errors) / _stiffness(material), _DIFFERENCE_TOLERANCE)


@check
def symmetric_tangent(material: Material) -> Verdict:
    """The tangent is symmetric, dG : A : dF = dF : A : dG, as that of any energy is."""
    errors = []
    for d, rng in seeded():
        F = random_deformation_gradients(rng, d, _COUNT)
        dF, dG = _directions(rng, d), _directions(rng, d)
        there = np.einsum("ijn,ijn->n", dG, _tangent(material, F, dF))
        back = np.einsum("ijn,ijn->n", dF, _tangent(material, F, dG))
        errors.append(np.abs(there - back).max())
    return at_most(max(errors) / _stiffness(material), _ROUNDING)


@check
def natural_state(material: Material) -> Verdict:
    """Energy and stress are zero at F = I."""
    errors = []
    for d, _ in seeded():
        one = np.eye(d)[:, :, None]
        errors += [np.abs(_energy(material, one)).max(), np.abs(_stress(material, one)).max()]
    return at_most(max(errors) / _stiffness(material), _ROUNDING)


@check
def objectivity(material: Material) -> Verdict:
    """A rotation leaves the energy alone and turns the stress, if and only if so declared."""
    if not material.objective:
        turned = [rotation(d, [1.0] * ANGLES[d])[:, :, None] for d in (2, 3)]
        energies = [float(_energy(material, Q)[0]) for Q in turned]
        # One radian looks like a strain of 1 - cos 1 = 0.5, whose square is 0.2.
        return more_than(min(np.abs(energies)) / _stiffness(material), 1e-3)
    errors = []
    for d, rng in seeded():
        F, Q = random_deformation_gradients(rng, d, _COUNT), random_rotation(rng, d)
        QF = np.einsum("ij,jkn->ikn", Q, F)
        QP = np.einsum("ij,jkn->ikn", Q, _stress(material, F))
        errors += [
            np.abs(_energy(material, QF) - _energy(material, F)).max(),
            np.abs(_stress(material, QF) - QP).max(),
        ]
    return at_most(max(errors) / _stiffness(material), _ROUNDING)


@check
def angular_momentum(material: Material) -> Verdict:
    """The Cauchy stress is symmetric: P F^T = F P^T, if the law is objective."""
    if not material.objective:
        return not_promised("the law declares that it is not objective")
    errors = []
    for d, rng in seeded():
        F = random_deformation_gradients(rng, d, _COUNT)
        turn = np.einsum("ikn,jkn->ijn", _stress(material, F), F)
        errors.append(np.abs(turn - turn.transpose(1, 0, 2)).max())
    return at_most(max(errors) / _stiffness(material), _ROUNDING)


@check
def stress_measures(material: Material) -> Verdict:
    """F S F^T / J with S = F^-1 P is the Cauchy stress: J sigma : d is the power of a rate of
    deformation d, if the law is objective."""
    if not material.objective:
        return not_promised("the law declares that it is not objective")
    errors = []
    for d, rng in seeded():
        F = random_deformation_gradients(rng, d, _COUNT)
        S = np.moveaxis(
            np.linalg.solve(np.moveaxis(F, -1, 0), np.moveaxis(_stress(material, F), -1, 0)), 0, -1
        )
        J = np.linalg.det(np.moveaxis(F, -1, 0))
        sigma = np.einsum("ikn,kln,jln->ijn", F, S, F) / J
        rate = _directions(rng, d)
        rate = 0.5 * (rate + rate.transpose(1, 0, 2))
        power = J * np.einsum("ijn,ijn->n", sigma, rate)
        along = np.einsum("ikn,kjn->ijn", rate, F)
        found = central_difference(partial(_energy, material), F, along, _STEP)
        errors.append(_largest(material, found - power))
        errors.append(np.abs(sigma - sigma.transpose(1, 0, 2)).max())
    return at_most(max(errors) / _stiffness(material), _DIFFERENCE_TOLERANCE)


@check
def ellipticity(material: Material) -> Verdict:
    """Unstrained it carries waves in every direction; where that is lost under uniaxial stretch is
    told: there the deformation localises, whatever the particles do."""
    at_rest = min(least_stiffness(material, np.eye(d)).value for d in (1, 2, 3))
    if not at_rest > 0.0:
        return Verdict(False, f"least stiffness {at_rest / _stiffness(material):.1e} unstrained")
    lost = [
        found
        for end in _STRETCHES
        for found in losses_of_ellipticity(
            material, lambda s: np.diag([s, 1.0]), 1.0, end, samples=_SAMPLES
        )[:1]
    ]
    where = " and ".join(f"at a stretch of {one:.3f}" for one in lost)
    least, most = _STRETCHES
    return Verdict(True, f"lost {where}" if lost else f"kept from {least:g} to {most:g}")


@check
def small_strain(material: Material) -> Verdict:
    """The tangent at F = I is that of the declared Lame parameters, lambda tr(e) I + 2 mu e; where
    the law declares that directions are not alike, it is another, and nowhere stiffer."""
    lam, mu = material.lame_parameters
    errors, ratios = [], []
    for d, rng in seeded():
        dF = _directions(rng, d)
        one = np.repeat(np.eye(d)[:, :, None], _COUNT, axis=2)
        expected = lam * np.einsum("kkn->n", dF) * one + mu * (dF + dF.transpose(1, 0, 2))
        errors.append(np.abs(_tangent(material, one, dF) - expected).max())
        # Fibres may be taut on one side of F = I only.
        stiffest = np.maximum(*(_form(material, one + s * dF, dF) for s in (-_SMALL, _SMALL)))
        ratios.append((stiffest / np.einsum("ijn,ijn->n", expected, dF)).max())
    if material.isotropic:
        return at_most(max(errors) / _stiffness(material), _ROUNDING)
    if not max(errors) / _stiffness(material) > _ALIKE:
        return Verdict(False, "declared as anisotropic, but all directions are alike")
    return at_most(max(ratios), 1.0 + _BESIDE)


@check
def missing_dimensions(material: Material) -> Verdict:
    """In 1D and 2D it is the 3D law with the missing stretches 1: uniaxial and plane strain."""
    errors = []
    for d, rng in seeded():
        F = random_deformation_gradients(rng, d, _COUNT)
        whole = np.repeat(np.eye(3)[:, :, None], _COUNT, axis=2)
        whole[:d, :d] = F
        errors += [
            np.abs(_energy(material, F) - _energy(material, whole)).max(),
            np.abs(_stress(material, F) - _stress(material, whole)[:d, :d]).max(),
        ]
    return at_most(max(errors) / _stiffness(material), _ROUNDING)


@check
def wave_speed(material: Material) -> Verdict:
    """The wave speed is sqrt(A_1111(I) / rho_0), that of the confined wave; where directions are
    not alike, no confined wave along an axis is faster."""
    errors, ratios = [], []
    for d, _ in seeded():
        for axis in range(d):
            along = np.zeros((d, d, 1))
            along[axis, axis] = 1.0
            one = np.eye(d)[:, :, None]
            A = [_form(material, one + s * along, along)[0] for s in (0.0, -_SMALL, _SMALL)]
            speeds = np.sqrt(np.array(A) / material.density) / material.wave_speed
            errors.append(abs(speeds[0] - 1.0))
            ratios.append(speeds.max())
    if material.isotropic:
        return at_most(max(errors), _ROUNDING)
    return at_most(max(ratios), 1.0 + _BESIDE)


@check
def pointwise(material: Material) -> Verdict:
    """Energy, stress and tangent give nested tuples of numbers what they give arrays."""
    errors = []
    for d, rng in seeded():
        F, dF = random_deformation_gradients(rng, d, 3), _directions(rng, d)[:, :, :3]
        energy, P, dP = _energy(material, F), _stress(material, F), _tangent(material, F, dF)
        for n in range(3):
            one, along = _tuples(F[:, :, n]), _tuples(dF[:, :, n])
            params = material.params
            errors += [
                abs(float(material.energy(one, params)) - energy[n]),
                np.abs(np.array(material.first_piola(one, params)) - P[:, :, n]).max(),
                np.abs(np.array(material.tangent(one, along, params)) - dP[:, :, n]).max(),
            ]
    return at_most(max(errors) / _stiffness(material), _ROUNDING)


@check
def leaves_its_input(material: Material) -> Verdict:
    """Energy, stress and tangent leave F and its change as they were, and the same F has the same
    answer again."""
    for d, rng in seeded():
        F, dF = random_deformation_gradients(rng, d, _COUNT), _directions(rng, d)
        before = F.copy(), dF.copy()
        first = _energy(material, F), _stress(material, F), _tangent(material, F, dF)
        if not (np.array_equal(before[0], F) and np.array_equal(before[1], dF)):
            return Verdict(False, f"{d}D: F was changed in place")
        _stress(material, 1.1 * F)
        again = _energy(material, F), _stress(material, F), _tangent(material, F, dF)
        if not all(np.array_equal(a, b) for a, b in zip(first, again, strict=True)):
            return Verdict(False, f"{d}D: the same F got another answer")
    return Verdict(True, "untouched")


CHECKS: tuple[Check, ...] = (
    leaves_its_input,
    stress,
    tangent,
    symmetric_tangent,
    natural_state,
    objectivity,
    angular_momentum,
    stress_measures,
    ellipticity,
    small_strain,
    missing_dimensions,
    wave_speed,
    pointwise,
)


def _stiffness(material: Material) -> float:
    lam, mu = material.lame_parameters
    return lam + 2.0 * mu


def _directions(rng: np.random.Generator, dimension: int) -> Array:
    """Changes of F of length 1, (d, d, n)."""
    dF = rng.normal(size=(dimension, dimension, _COUNT))
    return np.asarray(dF / np.linalg.norm(dF, axis=(0, 1)))


def _largest(material: Material, errors: Array) -> float:
    """The largest of errors (..., n) of differences, or that of most points: where the tangent of
    a law that is not smooth jumps within the difference, the difference is wrong and not the law.
    """
    found = np.abs(errors).reshape(-1, errors.shape[-1]).max(axis=0)
    return float(np.quantile(found, 1.0 if material.smooth else _MOST))


def _form(material: Material, F: Array, dF: Array) -> Array:
    """dF : A : dF, (n,)."""
    return np.asarray(np.einsum("ijn,ijn->n", _tangent(material, F, dF), dF))


def _energy(material: Material, F: Array) -> Array:
    return np.asarray(material.energy(F, material.params), dtype=np.float64)


def _stress(material: Material, F: Array) -> Array:
    return _spread(material.first_piola(F, material.params), F)


def _tangent(material: Material, F: Array, dF: Array) -> Array:
    return _spread(material.tangent(F, dF, material.params), F)


def _spread(T: Tensor, F: Array) -> Array:
    return np.moveaxis(particles_first(T, F.shape[2]), 0, -1)


def _tuples(A: Array) -> Tensor:
    return tuple(tuple(float(a) for a in row) for row in A)
