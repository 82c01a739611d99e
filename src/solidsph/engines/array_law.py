"""Constitutive laws evaluated by arrays of all particles of a body: the reference for any other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import final

import attrs
import numpy as np

from solidsph.interfaces.body import Body
from solidsph.interfaces.engine import StressFields
from solidsph.interfaces.history import History, HistoryMaterial
from solidsph.interfaces.law import Law
from solidsph.interfaces.material import Material
from solidsph.maths.arrays import Array, Tensor
from solidsph.maths.tensors import components_first, particles_first

# Particles whose stress is evaluated together for reports, so that temporaries stay in cache.
_AT_ONCE = 4096


@final
@attrs.frozen(eq=False)
class ArrayLaw(Law):
    """A law evaluated by arrays."""

    body: Body

    def flux(self, H: Array, history: Array, step: float) -> tuple[Array, Array]:
        formulation, material = self.body.formulation, self.body.material
        n = self.body.particles.count
        with np.errstate(all="ignore"):  # a run that leaves the material's domain is caught later
            if isinstance(material, HistoryMaterial):
                F = formulation.deformation_gradient(components_first(H))
                h: History = tuple(history.T)
                if step > 0.0:
                    h = material.advance(F, h, step, material.params)
                T = formulation.flux(F, material.stress(F, h, material.params))
                history = np.column_stack([np.broadcast_to(values, n) for values in h])
            else:
                T = flux(self.body, components_first(H))
        return np.moveaxis(particles_first(T, n), 0, -1), history


def flux(body: Body, H: Tensor) -> Tensor:
    """The formulation's flux [Pa] at displacement gradients H, without history."""
    F = body.formulation.deformation_gradient(H)
    return body.formulation.flux(F, body.material.first_piola(F, body.material.params))


def energy_densities(body: Body, gradients: Array, history: Array) -> Array:
    """Strain energy densities (k,) [J/m^3] of some particles.

    Args:
        body: the body that they belong to.
        gradients: their displacement gradients H, (k, d, d).
        history: their internal variables, (k, j).
    """
    material = body.material
    with np.errstate(all="ignore"):  # as above
        F = body.formulation.deformation_gradient(components_first(gradients))
        if isinstance(material, HistoryMaterial):
            return np.asarray(material.stored(F, tuple(history.T), material.params))
        return np.asarray(material.energy(F, material.params))


def stress_and_energy(material: Material, F: Array, history: Array) -> tuple[Array, Array]:
    """P (n, d, d) [Pa] and psi (n,) [J/m^3] at F (n, d, d) and internal variables (n, k)."""
    components, params = components_first(F), material.params
    with np.errstate(all="ignore"):  # as above
        if isinstance(material, HistoryMaterial):
            h: History = tuple(history.T)
            P, psi = material.stress(components, h, params), material.stored(components, h, params)
        else:
            P, psi = material.first_piola(components, params), material.energy(components, params)
        return particles_first(P, len(F)), np.broadcast_to(np.asarray(psi), len(F))


def stress_fields(bodies: Sequence[Body], gradients: Array) -> StressFields:
    """Deformation, stress and energy, without history.

    Args:
        bodies: all bodies, in order.
        gradients: displacement gradients H of their particles, (n, d, d); F takes their place.
    """
    fields = StressFields(gradients, np.zeros_like(gradients), np.zeros(len(gradients)))
    for body in bodies:
        begin, end = body.extent.start, body.extent.stop
        for first in range(begin, end, _AT_ONCE):
            some = slice(first, min(first + _AT_ONCE, end))
            F, count = gradients[some], some.stop - some.start
            with np.errstate(all="ignore"):  # as above
                F[...] = particles_first(
                    body.formulation.deformation_gradient(components_first(F)), count
                )
                F[body.particles.ghosts[first - begin : some.stop - begin]] = np.eye(F.shape[1])
                components, params = components_first(F), body.material.params
                P = body.material.first_piola(components, params)
                fields.stresses[some] = particles_first(P, count)
                fields.energy_densities[some] = body.material.energy(components, params)
    return fields
