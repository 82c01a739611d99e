"""Finite elements of the plane for references: nothing in common with particles.

Quadrilaterals with nine nodes for the displacement and four for the pressure p = lambda ln J
(Taylor and Hood's pair), which do not lock however nearly incompressible the body is. The law is
written out again from the paper's eq. 15: P = mu (F - F^-T) + p F^-T, in plane strain.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import attrs
import numpy as np
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from solidsph.maths.arrays import Array, Indices, Mask

Map = Callable[[Array, Array], tuple[Array, Array]]
"""A block of the body: x and y from two coordinates that run from 0 to 1."""

_THREE = np.array([-1.0, 0.0, 1.0])
_GAUSS, _WEIGHTS = np.polynomial.legendre.leggauss(3)
_STEPS, _ITERATIONS, _TOLERANCE = 3, 30, 1e-9


def graded(cells: int, start: float = 1.0, end: float = 1.0) -> Array:
    """Coordinates from 0 to 1 of so many cells and the nodes between, finer towards an end.

    Args:
        start: 1 or more; the first cell is of the order of its power of a cell.
        end: the same at the other end.
    """
    t = np.linspace(0.0, 1.0, cells + 1)
    t = t**start / (t**start + (1.0 - t) ** end) if end > 1.0 else t**start
    between = np.empty(2 * cells + 1)
    between[::2], between[1::2] = t, 0.5 * (t[1:] + t[:-1])
    return between


@attrs.frozen(eq=False)
class Mesh:
    """Nodes, elements of nine nodes in rows of three, and which nodes carry a pressure."""

    nodes: Array  # (n, 2) [m]
    elements: Indices  # (e, 9)
    pressures: Indices  # (e, 4) numbers of pressures, from 0

    @classmethod
    def of(cls, blocks: Sequence[tuple[Map, Array, Array]]) -> Mesh:
        """Blocks that share the nodes of their common sides."""
        points, elements, start = [], [], 0
        for place, s, t in blocks:
            x, y = place(*np.meshgrid(s, t, indexing="ij"))
            points.append(np.stack([x, y], axis=-1).reshape(-1, 2))
            number = np.arange(len(s) * len(t)).reshape(len(s), len(t)) + start
            start += number.size
            for i in range(0, len(s) - 2, 2):
                for j in range(0, len(t) - 2, 2):
                    elements.append(number[i : i + 3, j : j + 3].ravel())
        every = np.concatenate(points)
        size = np.ptp(every, axis=0).max()
        _, first, same = np.unique(
            np.round(every / size, 9), axis=0, return_index=True, return_inverse=True
        )
        nine = same.ravel()[np.array(elements)]
        corners = nine[:, [0, 2, 6, 8]]
        pressures = np.unique(corners, return_inverse=True)[1].reshape(corners.shape)
        return cls(every[first], nine, pressures)

    def side(self, chosen: Mask) -> Indices:
        """The element sides of three nodes whose nodes are all chosen, (k, 3)."""
        sides = [[0, 1, 2], [6, 7, 8], [0, 3, 6], [2, 5, 8]]
        every = np.concatenate([self.elements[:, side] for side in sides])
        return np.asarray(every[chosen[every].all(axis=1)])

    def side_loads(self, chosen: Mask, traction: Callable[[Array], Array]) -> Array:
        """Forces (n, 2) of a dead `traction`, (k, 2) from places (k, 2), on a side of the body."""
        loads = np.zeros_like(self.nodes)
        for three in self.side(chosen):
            for q, w in zip(_GAUSS, _WEIGHTS, strict=True):
                values, slopes = _line(q)
                length = np.hypot(*(slopes @ self.nodes[three]))
                pull = traction((values @ self.nodes[three])[None])[0]
                loads[three] += w * length * np.outer(values, pull)
        return loads


@attrs.frozen(eq=False)
class Solid:
    """A neo-Hookean body in plane strain on a mesh."""

    mesh: Mesh
    lam: float  # lambda [Pa]
    mu: float  # [Pa]
    slopes: Array  # (e, g, 9, 2) dN / dX at the points of quadrature
    corners: Array  # (g, 4) shape functions of the pressure
    volumes: Array  # (e, g)

    @classmethod
    def of(cls, mesh: Mesh, youngs_modulus: float, poissons_ratio: float) -> Solid:
        E, nu = youngs_modulus, poissons_ratio
        lam, mu = E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), 0.5 * E / (1.0 + nu)
        places = [(a, b) for a in _GAUSS for b in _GAUSS]
        inverses, determinants, local = _jacobians(mesh, places)
        volumes = np.outer(_WEIGHTS, _WEIGHTS).ravel() * np.abs(determinants)
        corners = np.array([np.outer(_ends(a), _ends(b)).ravel() for a, b in places])
        return cls(mesh, lam, mu, local @ inverses, corners, volumes)

    def equilibrium(self, held: Mask, loads: Array, imposed: Array | None = None) -> Solution:
        """Displacements under dead loads, all of them at once or in steps as Newton needs.

        Args:
            held: components that are imposed, (n, 2).
            loads: forces on the nodes, (n, 2).
            imposed: displacements of what is held, (n, 2) [m]; zero by default.
        """
        n, m = 2 * len(self.mesh.nodes), int(self.mesh.pressures.max()) + 1
        x = np.zeros(n + m)
        free = np.flatnonzero(np.concatenate([~held.ravel(), np.ones(m, dtype=bool)]))
        given = np.zeros(n) if imposed is None else np.where(held, imposed, 0.0).ravel()
        for step in range(_STEPS):
            part = (step + 1) / _STEPS
            x[:n] = np.where(held.ravel(), part * given, x[:n])
            for _ in range(_ITERATIONS):
                residual, tangent = self._assembled(x)
                residual[:n] -= part * loads.ravel()
                change = splu(tangent[free][:, free]).solve(-residual[free])
                x[free] += change
                if np.linalg.norm(change) <= _TOLERANCE * np.linalg.norm(x[free]):
                    break
            else:
                raise AssertionError(f"no equilibrium at {part:.2f} of the load")
        return Solution(self, x[:n].reshape(-1, 2), x[n:])

    def _assembled(self, x: Array) -> tuple[Array, csc_array]:
        """Residual of forces and of p = lambda ln J, and its derivative."""
        nine, four, n = self.mesh.elements, self.mesh.pressures, 2 * len(self.mesh.nodes)
        u, p = x[:n].reshape(-1, 2), x[n:]
        B, V = self.slopes, self.volumes
        F = np.einsum("eai,egaj->egij", u[nine], B) + np.eye(2)
        pressure = p[four] @ self.corners.T
        J, inverse = np.linalg.det(F), np.linalg.inv(F)
        turned = np.swapaxes(inverse, -1, -2)
        P = self.mu * F + (pressure - self.mu)[..., None, None] * turned
        force = np.einsum("eg,egij,egaj->eai", V, P, B)
        miss = np.einsum("eg,ga->ea", V * (np.log(J) - pressure / self.lam), self.corners)
        # dP = mu dF + (mu - p) F^-T dF^T F^-T + dp F^-T
        pushed = np.einsum("egaj,egji->egai", B, inverse)
        stiff = self.mu * np.einsum("eg,egaj,egbj->eab", V, B, B, optimize=True)
        uu = np.einsum("eab,ik->eaibk", stiff, np.eye(2))
        uu += np.einsum(
            "eg,egak,egbi->eaibk", V * (self.mu - pressure), pushed, pushed, optimize=True
        )
        up = np.einsum("eg,egai,gc->eaic", V, pushed, self.corners, optimize=True)
        pp = -np.einsum("eg,ga,gb->eab", V, self.corners, self.corners) / self.lam
        e = len(nine)
        rows_u = (2 * nine[:, :, None] + np.arange(2)).reshape(e, 18)
        own = np.concatenate([rows_u, n + four], axis=1)
        up = up.reshape(e, 18, 4)
        block = np.concatenate(
            [
                np.concatenate([uu.reshape(e, 18, 18), up], axis=2),
                np.concatenate([np.swapaxes(up, 1, 2), pp], axis=2),
            ],
            axis=1,
        )
        rows = np.repeat(own, 22, axis=1).ravel()
        columns = np.tile(own, (1, 22)).ravel()
        tangent = csc_array((block.ravel(), (rows, columns)), shape=(len(x), len(x)))
        both = np.concatenate([force.reshape(e, 18), miss], axis=1)
        return np.bincount(own.ravel(), both.ravel(), len(x)), tangent


@attrs.frozen(eq=False)
class Solution:
    """An equilibrium."""

    solid: Solid
    u: Array  # (n, 2) [m]
    p: Array  # (m,) [Pa]

    def cauchy(self, node: int) -> Array:
        """Cauchy stress at a node, the mean over its elements, (2, 2) [Pa]."""
        mesh, found = self.solid.mesh, []
        for element in np.flatnonzero((mesh.elements == node).any(axis=1)):
            k = int(np.flatnonzero(mesh.elements[element] == node)[0])
            a, b = _THREE[k // 3], _THREE[k % 3]
            one = attrs.evolve(mesh, elements=mesh.elements[[element]])
            inverses, _, local = _jacobians(one, [(a, b)])
            F = self.u[mesh.elements[element]].T @ (local @ inverses)[0, 0] + np.eye(2)
            pressure = np.outer(_ends(a), _ends(b)).ravel() @ self.p[mesh.pressures[element]]
            P = self.solid.mu * F + (pressure - self.solid.mu) * np.linalg.inv(F).T
            found.append(P @ F.T / np.linalg.det(F))
        return np.mean(found, axis=0)


def _jacobians(mesh: Mesh, places: Sequence[tuple[float, float]]) -> tuple[Array, Array, Array]:
    """d xi / d X (e, g, 2, 2), det dX / d xi (e, g) and dN / d xi (g, 9, 2) at local places."""
    local = np.array(
        [
            np.stack(
                [np.outer(_line(a)[1], _line(b)[0]), np.outer(_line(a)[0], _line(b)[1])], axis=-1
            ).reshape(9, 2)
            for a, b in places
        ]
    )
    J = np.einsum("eai,gaj->egij", mesh.nodes[mesh.elements], local)
    return np.linalg.inv(J), np.linalg.det(J), local


def _line(q: float) -> tuple[Array, Array]:
    """Quadratic shape functions on [-1, 1] and their slopes, (3,) each."""
    values = np.array([0.5 * q * (q - 1.0), 1.0 - q * q, 0.5 * q * (q + 1.0)])
    return values, np.array([q - 0.5, -2.0 * q, q + 0.5])


def _ends(q: float) -> Array:
    """Linear shape functions on [-1, 1], (2,)."""
    return np.array([0.5 * (1.0 - q), 0.5 * (1.0 + q)])
