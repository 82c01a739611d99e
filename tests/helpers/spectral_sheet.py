"""The quarter sheet with a hole by spectral elements: nothing in common with particles.

An independent computation, for references of the cases `sheet-in-motion` and `sheet-convergence`:
quadrilaterals of the fourth order between the hole and the edges, Gauss-Lobatto quadrature, a
diagonal mass matrix, central differences. The law is written out again from the paper's eq. 15.
"""

from __future__ import annotations

import attrs
import numpy as np
from numpy.polynomial import legendre

from solidsph.maths.arrays import Array, Indices

YOUNGS_MODULUS, POISSONS_RATIO, DENSITY = 70e6, 0.49, 1000.0
LAMBDA = YOUNGS_MODULUS * POISSONS_RATIO / ((1 + POISSONS_RATIO) * (1 - 2 * POISSONS_RATIO))
MU = 0.5 * YOUNGS_MODULUS / (1 + POISSONS_RATIO)
SPEED = float(np.sqrt((LAMBDA + 2 * MU) / DENSITY))

_DEGREE = 4
_GRADING = 1.5  # how much larger elements at the edge are than those at the hole, less one


@attrs.frozen
class Swing:
    """What a run leaves: its columns over time, lengths in W, times in W / c_p."""

    times: Array  # (t,)
    extensions: Array  # (t,) mean u_x of the loaded edge
    largest: Array  # (t,) largest principal Cauchy stress anywhere [Pa]
    at_top: Array  # (t,) the same at (0, a) [Pa]


def swing(
    across: int,
    duration: float,
    *,
    hole: float = 0.2,
    traction: float = 5e6,
    ramp: float = 0.0,
    damping: float = 0.0,
) -> Swing:
    """Pull the quarter with `across` elements from the hole to an edge and twice as many around it.

    Args:
        across: elements along the radius; as many to each half of the hole's arc.
        duration: [W / c_p].
        hole: radius over W.
        traction: [Pa].
        ramp: how long the load grows [W / c_p].
        damping: rate of damping in proportion to mass [c_p / W].
    """
    elements = _Elements.of(across, hole)
    X, c = elements.positions, damping * SPEED
    on_left, on_bottom = X[:, 0] < 1e-9, X[:, 1] < 1e-9
    top = elements.nodes == np.hypot(X[:, 0], X[:, 1] - hole).argmin()
    every = 0.05 / SPEED
    inner = int(np.ceil(every / (0.4 * elements.shortest / SPEED)))
    dt, steps = every / inner, inner * round(duration / 0.05)
    u, v = np.zeros_like(X), np.zeros_like(X)
    rows = []
    for step in range(steps + 1):
        if step % inner == 0:
            stress = elements.largest_principal(u)
            rows.append(
                (
                    step * dt * SPEED,
                    elements.edge @ u[:, 0] / elements.edge.sum(),
                    stress.max(),
                    stress[top].mean(),
                )
            )
        grown = min(step * dt * SPEED / ramp, 1.0) if ramp else 1.0
        f = elements.forces(u)
        f[:, 0] += grown * traction * elements.edge
        v = (v * (1.0 - 0.5 * c * dt) + dt * f / elements.masses[:, None]) / (1.0 + 0.5 * c * dt)
        v[on_left, 0] = 0.0
        v[on_bottom, 1] = 0.0
        u = u + dt * v
    return Swing(*np.array(rows).T)


@attrs.frozen
class _Elements:
    positions: Array  # (n, 2) of the nodes
    nodes: Indices  # (e, p, p) of the elements
    slopes: Array  # (p, p) derivatives of the nodal polynomials
    inverses: Array  # (e, p, p, 2, 2) d xi / d X
    volumes: Array  # (e, p, p) quadrature weights times the Jacobian
    masses: Array  # (n,)
    edge: Array  # (n,) area of the loaded edge that goes to each node

    @classmethod
    def of(cls, across: int, hole: float) -> _Elements:
        points, weights, slopes = _lobatto(_DEGREE)
        unit = 0.5 * (points + 1.0)
        own = []
        for half in (0, 1):
            for i in range(across):
                for j in range(across):
                    r = ((1.0 + _GRADING) ** ((i + unit) / across) - 1.0) / _GRADING
                    angle = 0.25 * np.pi * ((j + unit) / across + half)
                    ray = np.stack([np.cos(angle), np.sin(angle)], axis=1)
                    outer = ray / np.abs(ray).max(axis=1, keepdims=True)
                    r = r[:, None, None]
                    own.append(hole * ray * (1.0 - r) + outer * r)
        every = np.array(own)
        _, first, number = np.unique(
            np.round(every.reshape(-1, 2), 9), axis=0, return_index=True, return_inverse=True
        )
        X, nodes = every.reshape(-1, 2)[first], number.reshape(every.shape[:3])
        placed = X[nodes]
        along = np.einsum("ai,eijc->eajc", slopes, placed)
        around = np.einsum("bj,eijc->eibc", slopes, placed)
        jacobians = np.stack([along, around], axis=-1)
        volumes = weights[:, None] * weights * np.abs(np.linalg.det(jacobians))
        edge = np.zeros(len(X))
        for element in nodes:
            last = element[-1]
            if np.all(np.abs(X[last, 0] - 1.0) < 1e-9):
                np.add.at(edge, last, weights * np.abs(slopes @ X[last, 1]))
        masses = np.bincount(nodes.ravel(), DENSITY * volumes.ravel(), len(X))
        return cls(X, nodes, slopes, np.linalg.inv(jacobians), volumes, masses, edge)

    @property
    def shortest(self) -> float:
        """Least distance between neighbouring nodes."""
        placed = self.positions[self.nodes]
        return float(min(np.linalg.norm(np.diff(placed, axis=k), axis=-1).min() for k in (1, 2)))

    def _gradients(self, u: Array) -> Array:
        """F at every quadrature point, (e, p, p, 2, 2)."""
        own = u[self.nodes]
        along = np.einsum("ai,eijc->eajc", self.slopes, own)
        around = np.einsum("bj,eijc->eibc", self.slopes, own)
        F: Array = np.stack([along, around], axis=-1) @ self.inverses + np.eye(2)
        return F

    def forces(self, u: Array) -> Array:
        """What the stress does to each node, (n, 2)."""
        P = _first_piola(self._gradients(u)) * self.volumes[..., None, None]
        flux = P @ np.swapaxes(self.inverses, -1, -2)
        f = np.einsum("ai,eajc->eijc", self.slopes, flux[..., 0])
        f += np.einsum("bj,eibc->eijc", self.slopes, flux[..., 1])
        rows, n = self.nodes.ravel(), len(self.positions)
        return -np.stack([np.bincount(rows, f[..., k].ravel(), n) for k in (0, 1)], axis=1)

    def largest_principal(self, u: Array) -> Array:
        """Of the Cauchy stress at every quadrature point, (e, p, p) [Pa]."""
        F = self._gradients(u)
        sigma = _first_piola(F) @ np.swapaxes(F, -1, -2) / np.linalg.det(F)[..., None, None]
        largest: Array = np.linalg.eigvalsh(sigma)[..., -1]
        return largest


def _first_piola(F: Array) -> Array:
    """P = mu (F - F^-T) + lambda ln J F^-T."""
    J = F[..., 0, 0] * F[..., 1, 1] - F[..., 0, 1] * F[..., 1, 0]
    factor = (LAMBDA * np.log(J) - MU) / J
    P = MU * F
    P[..., 0, 0] += factor * F[..., 1, 1]
    P[..., 1, 1] += factor * F[..., 0, 0]
    P[..., 0, 1] -= factor * F[..., 1, 0]
    P[..., 1, 0] -= factor * F[..., 0, 1]
    return P


def _lobatto(degree: int) -> tuple[Array, Array, Array]:
    """Gauss-Lobatto points, weights, and derivatives of the polynomials through the points."""
    unit = np.eye(degree + 1)[degree]
    inner = np.sort(legendre.legroots(legendre.legder(unit)).real)
    points = np.concatenate([[-1.0], inner, [1.0]])
    values = legendre.legval(points, unit)
    weights = 2.0 / (degree * (degree + 1) * values**2)
    gaps = points[:, None] - points + np.eye(degree + 1)
    slopes = values[:, None] / values / gaps
    np.fill_diagonal(slopes, 0.0)
    slopes[0, 0], slopes[-1, -1] = (s * 0.25 * degree * (degree + 1) for s in (-1.0, 1.0))
    return points, weights, slopes
