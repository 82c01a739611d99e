"""Equilibria by quadratic finite elements: scikit-fem's meshes, shape functions and quadrature.

Element matrices are products of whole arrays. Forms as its manual writes them, which are called
once for every pair of shape functions, take twice the time in the plane and a hundred times in
space.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from itertools import product
from math import sqrt
from typing import Any

import attrs
import numpy as np
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu
from skfem import Basis, FacetBasis, LinearForm

from solidsph.maths.arrays import Array, Indices, Mask

# Rounding leaves some 1e-9 of the loads in slender bodies.
_TOLERANCE, _ITERATIONS = 1e-8, 30

# Three points along an axis integrate this degree and the next.
_DEGREE = 4


@attrs.frozen
class Law:
    """A hyperelastic law with tensors (..., d, d)."""

    stress: Callable[[Array], Array]  # P of F [Pa]
    moduli: Callable[[Array], Array]  # dP_ij / dF_kl of F, (..., d, d, d, d) [Pa]


def _lame(youngs_modulus: float, poissons_ratio: float) -> tuple[float, float]:
    E, nu = youngs_modulus, poissons_ratio
    return E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), 0.5 * E / (1.0 + nu)


def neo_hookean(youngs_modulus: float, poissons_ratio: float) -> Law:
    """P = mu (F - F^-T) + lambda ln J F^-T."""
    lam, mu = _lame(youngs_modulus, poissons_ratio)

    def pulled(F: Array) -> tuple[Array, Array]:
        return np.linalg.inv(F).swapaxes(-1, -2), lam * np.log(np.linalg.det(F)) - mu

    def stress(F: Array) -> Array:
        G, pressure = pulled(F)
        return mu * F + pressure[..., None, None] * G

    def moduli(F: Array) -> Array:
        G, pressure = pulled(F)
        A = lam * np.einsum("...ij,...kl->...ijkl", G, G)
        A -= np.einsum("...il,...kj->...ijkl", pressure[..., None, None] * G, G)
        one = np.eye(F.shape[-1])
        A += mu * np.einsum("ik,jl->ijkl", one, one)
        return A

    return Law(stress, moduli)


def saint_venant_kirchhoff(youngs_modulus: float, poissons_ratio: float) -> Law:
    """P = F S, S = lambda tr(E) I + 2 mu E, E = (F^T F - I) / 2."""
    lam, mu = _lame(youngs_modulus, poissons_ratio)

    def second(F: Array) -> Array:
        one = np.eye(F.shape[-1])
        E = 0.5 * (F.swapaxes(-1, -2) @ F - one)
        return lam * np.trace(E, axis1=-2, axis2=-1)[..., None, None] * one + 2.0 * mu * E

    def stress(F: Array) -> Array:
        return F @ second(F)

    def moduli(F: Array) -> Array:
        one = np.eye(F.shape[-1])
        A = lam * np.einsum("...ij,...kl->...ijkl", F, F)
        A += mu * np.einsum("...il,...kj->...ijkl", F, F)
        A += mu * np.einsum("...ik,jl->...ijkl", F @ F.swapaxes(-1, -2), one)
        A += np.einsum("ik,...jl->...ijkl", one, second(F))
        return A

    return Law(stress, moduli)


@attrs.frozen(eq=False, slots=False)
class Solid:
    """A body on a mesh of scikit-fem, with d displacements at every node."""

    mesh: Any
    element: Any  # quadratic
    law: Law

    @cached_property
    def basis(self) -> Basis:
        """The shape functions of one displacement."""
        return Basis(self.mesh, self.element, intorder=_DEGREE)

    @property
    def nodes(self) -> Array:
        """Of every node, also those between corners, (n, d) [m]."""
        return np.asarray(self.basis.doflocs.T)

    def weight(self, force: Array) -> Array:
        """Forces (n, d) of a `force` (d,) a volume."""
        return np.outer(_ONE.assemble(self.basis), force)

    def pull(self, chosen: Callable[[Array], Mask], traction: Array) -> Array:
        """Forces (n, d) of a dead `traction` (d,) where the middles of facets are `chosen`."""
        facets = self.mesh.facets_satisfying(chosen, boundaries_only=True)
        return np.outer(_ONE.assemble(FacetBasis(self.mesh, self.element, facets=facets)), traction)

    def equilibrium(self, held: Mask, loads: Array) -> Rest:
        """Under `loads` (n, d), all at once, with the displacements that are `held` (n, d)."""
        free = np.flatnonzero(~held.ravel())
        u, allowed = np.zeros(held.size), _TOLERANCE * np.linalg.norm(loads)
        for _ in range(_ITERATIONS):
            F = self._deformation_gradients(u)
            left = (loads.ravel() - self._forces(self.law.stress(F)))[free]
            if np.linalg.norm(left) <= allowed:
                return Rest(self, u.reshape(held.shape))
            tangent = self._tangent(self.law.moduli(F))[free][:, free]
            factors = splu(
                tangent,
                permc_spec="MMD_AT_PLUS_A",
                diag_pivot_thresh=0.0,
                options={"SymmetricMode": True},
            )
            u[free] += factors.solve(left)
        raise RuntimeError("finite elements: no equilibrium")

    @cached_property
    def _own(self) -> Indices:
        """Numbers of the displacements of each element, (e, a d)."""
        nodes = self.basis.element_dofs.T
        d = self.mesh.dim()
        return (d * nodes[:, :, None] + np.arange(d)).reshape(len(nodes), -1)

    @cached_property
    def _slopes(self) -> Array:
        """dN_a / dX_j at the points of quadrature, (e, g, a, j)."""
        slopes = np.array([np.asarray(field[0].grad) for field in self.basis.basis])
        return np.ascontiguousarray(slopes.transpose(2, 3, 0, 1))

    def _deformation_gradients(self, u: Array) -> Array:
        """F, (e, g, d, d)."""
        d = self.mesh.dim()
        values = u[self._own].reshape(len(self._own), 1, -1, d)
        return np.eye(d) + values.swapaxes(-1, -2) @ self._slopes

    def _forces(self, P: Array) -> Array:
        own = self._slopes @ (P * self.basis.dx[..., None, None]).swapaxes(-1, -2)
        return np.bincount(self._own.ravel(), own.sum(axis=1).ravel())

    def _tangent(self, A: Array) -> csc_array:
        e, g, a, d = self._slopes.shape
        whole = (A * self.basis.dx[..., None, None, None, None]).transpose(0, 1, 3, 2, 4, 5)
        left = self._slopes @ whole.reshape(e, g, d, d**3)  # (e, g, a, i k l)
        left = left.reshape(e, g, a * d * d, d).transpose(0, 2, 1, 3).reshape(e, -1, g * d)
        right = self._slopes.transpose(0, 1, 3, 2).reshape(e, g * d, a)
        K = (left @ right).reshape(e, a * d, d, a).transpose(0, 1, 3, 2)
        rows, columns = np.repeat(self._own, a * d, axis=1), np.tile(self._own, (1, a * d))
        return csc_array((K.ravel(), (rows.ravel(), columns.ravel())))


@attrs.frozen(eq=False)
class Rest:
    """An equilibrium."""

    solid: Solid
    u: Array  # (n, d) [m]

    def displacement(self, point: Array) -> Array:
        """Of the node at a point, (d,) [m]."""
        return np.asarray(self.u[_nearest(self.solid.nodes, point)])

    def cauchy(self, point: Array) -> Array:
        """Stress at the node at a point, (d, d) [Pa], of one of its elements.

        Extrapolated from two points along each axis, where the stresses of quadratic elements are
        most accurate (Barlow 1976); those at the node itself are useless near incompressibility.
        """
        basis, node = self.solid.basis, _nearest(self.solid.nodes, point)
        local, number = (int(k) for k in np.argwhere(basis.element_dofs == node)[0])
        d = len(point)
        places = 0.5 + np.array(list(product((-1.0, 1.0), repeat=d))) * sqrt(1.0 / 12.0)
        rule = places.T, np.ones(len(places))
        there = Basis(basis.mesh, basis.elem, elements=np.array([number]), quadrature=rule)
        slopes = np.array([np.asarray(field[0].grad)[:, 0] for field in there.basis])  # (a, j, g)
        F = np.eye(d) + np.einsum("ai,ajg->gij", self.u[basis.element_dofs[:, number]], slopes)
        stresses = self.solid.law.stress(F) @ F.swapaxes(-1, -2)
        stresses /= np.linalg.det(F)[:, None, None]
        away = (np.asarray(basis.elem.doflocs[local]) - 0.5) * sqrt(12.0)
        shares = np.prod(0.5 * (1.0 + away * (places - 0.5) * sqrt(12.0)), axis=1)
        return np.asarray(np.einsum("g,gij->ij", shares, stresses))


@LinearForm
def _ONE(v: Any, w: Any) -> Any:  # noqa: N802 - a form is a value
    return v


def _nearest(nodes: Array, point: Array) -> int:
    return int(np.argmin(np.linalg.norm(nodes - point, axis=1)))
