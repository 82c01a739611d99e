"""Joints between bodies of different materials."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import ClassVar, final

import attrs
import numpy as np
from scipy.sparse import bsr_array, csr_array
from scipy.spatial import cKDTree

from solidsph.errors import SceneError
from solidsph.interfaces.body import Body
from solidsph.interfaces.compilable_terms import PairLoad
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.effect import Effect, Need
from solidsph.interfaces.marks import Links, Mark
from solidsph.interfaces.pair_table import PairTable
from solidsph.interfaces.terms import EnergyTerm, Load, Observation
from solidsph.maths.arrays import Array, Indices, Scalar, Vector
from solidsph.maths.tensors import dot
from solidsph.registry.parameters import number


@final
@attrs.frozen
class Joint(Effect):
    """Springs between particles of two bodies that are neighbours in the reference configuration.

    psi = k_ab / 2 (|x_ab| - |X_ab|)^2: forces act along the line between the two, so that momentum
    and angular momentum are conserved to rounding and rigid motions have no energy. In the
    direction of its partners, the springs of a particle add up to the stiffness of the material
    between the outermost particles of both bodies: half a spacing of each, in series,

        sum over b of k_ab (e_ab . n_a)^2 = s^(d-1) / (s_A / (2 M_A) + s_B / (2 M_B)),

    with M = lambda + 2 mu. A joint of equal materials is then as stiff as the material, to first
    order in the spacing. Particles closer than `reach` mean spacings are partners.
    """

    conserves_momentum: ClassVar[bool] = True
    answers: ClassVar[frozenset[Need] | None] = frozenset({Need.MEETING})

    between: tuple[str, ...] | None = attrs.field(
        default=None, converter=attrs.converters.optional(tuple)
    )  # names of the bodies; all by default
    reach: float = number(default=1.8)  # [mean spacings of the two bodies]

    def __attrs_post_init__(self) -> None:
        if not 1.0 < self.reach <= 5.0:
            raise SceneError(
                f"joint: reach must lie between 1 and 5 spacings, got {self.reach}; 1.8 takes the "
                "nearest across a face, and their neighbours"
            )
        if self.between is not None and len(set(self.between)) < 2:
            raise SceneError(
                f"joint: between must name two bodies at least, got {list(self.between)}"
            )

    def bind(self, model: DiscreteModel, label: str) -> Load:
        springs = self._springs(model.bodies)
        return _Springs(
            label=label,
            pairs=springs.table(model.particles.count),
            reference=model.particles.positions,
            stiffness_rate=springs.highest_frequency(model.masses),
        )

    def marks(self, model: DiscreteModel, label: str) -> Sequence[Mark]:
        springs, X = self._springs(model.bodies), model.particles.positions
        return (Links(np.stack([X[springs.one], X[springs.other]], axis=1)),)

    def pair_work(self, particles: float, pairs: float) -> float:
        return 0.0  # few, at the faces, and not known before they are searched

    def _springs(self, bodies: Sequence[Body]) -> _SpringList:
        names = [body.name for body in bodies]
        for name in self.between or ():
            if name not in names:
                raise SceneError(
                    f"joint: there is no body {name!r}; the bodies are {', '.join(names)}"
                )
        chosen = [body for body in bodies if self.between is None or body.name in self.between]
        if len(chosen) < 2:
            raise SceneError(
                f"joint: it joins two bodies at least, and the scene has only {', '.join(names)}; "
                "leave it out, or add a body"
            )
        parts = [_between(a, b, self.reach) for a, b in combinations(chosen, 2)]
        found = _SpringList(*(np.concatenate([getattr(p, f) for p in parts]) for f in _FIELDS))
        if not len(found.one):
            raise SceneError(
                f"joint: no particles of {', '.join(body.name for body in chosen)} are closer than "
                f"{self.reach:g} spacings; let the bodies touch, or take a longer reach"
            )
        return found


@attrs.frozen(eq=False)
class _SpringList:
    """Springs, each once."""

    one: Indices  # (m,) first end, among all particles
    other: Indices  # (m,) second end
    stiffness: Array  # k (m,) [N/m]
    length: Array  # |X_ab| (m,) [m]

    def highest_frequency(self, masses: Array) -> float:
        """Bound on the angular frequencies of these springs alone, with masses (n,) [rad/s]."""
        # Gershgorin: no eigenvalue exceeds the largest row sum of the scaled matrix.
        a, b, k = self.one, self.other, self.stiffness
        own = np.asarray(np.bincount(a, k, len(masses)) + np.bincount(b, k, len(masses)))
        across = k / np.sqrt(masses[a] * masses[b])
        real = masses > 0.0
        rows = np.zeros(len(masses))
        rows += np.bincount(a, across, len(masses)) + np.bincount(b, across, len(masses))
        rows[real] += own[real] / masses[real]
        return float(np.sqrt(rows.max()))

    def table(self, count: int) -> PairTable:
        rows = np.concatenate([self.one, self.other])
        columns = np.concatenate([self.other, self.one])
        values = np.tile(np.column_stack([self.stiffness, self.length]), (2, 1))
        return PairTable.of(rows, columns, values, count)


_FIELDS = tuple(field.name for field in attrs.fields(_SpringList))


def _between(one: Body, other: Body, reach: float) -> _SpringList:
    """The springs between two bodies."""
    real = [np.flatnonzero(~body.particles.ghosts) for body in (one, other)]
    X, Y = one.particles.positions[real[0]], other.particles.positions[real[1]]
    s, t = one.particles.spacings[real[0]], other.particles.spacings[real[1]]
    longest = reach * 0.5 * (s.max() + t.max())
    near = cKDTree(X).sparse_distance_matrix(cKDTree(Y), longest, output_type="coo_matrix")
    a, b, R = near.row.astype(np.intp), near.col.astype(np.intp), near.data
    close = (reach * 0.5 * (s[a] + t[b]) >= R) & (R > 0.0)
    a, b, R = a[close], b[close], R[close]
    order = np.lexsort((b, a))
    a, b, R = a[order], b[order], R[order]
    e = (Y[b] - X[a]) / R[:, None]
    d = e.shape[1]
    # The layer between, by the confined moduli, on the area of the smaller cell.
    M, N = (body.material.density * body.material.wave_speed**2 for body in (one, other))
    layer = np.minimum(s[a], t[b]) ** (d - 1) / (0.5 * s[a] / M + 0.5 * t[b] / N)
    shares = 0.5 * (1.0 / _squares(a, e, len(X))[a] + 1.0 / _squares(b, e, len(Y))[b])
    return _SpringList(
        one=real[0][a] + one.extent.start,
        other=real[1][b] + other.extent.start,
        stiffness=layer * shares,
        length=R,
    )


def _squares(ends: Indices, directions: Array, count: int) -> Array:
    """Sum over a particle's springs of (e . n)^2, with n their mean direction, (count,) [-]."""
    mean = np.column_stack([np.bincount(ends, e, count) for e in directions.T]).astype(float)
    size = np.linalg.norm(mean, axis=1, keepdims=True)
    normal = np.divide(mean, size, out=np.zeros_like(mean), where=size > 0.0)
    squares = np.einsum("mi,mi->m", directions, normal[ends]) ** 2
    return np.asarray(np.bincount(ends, squares, count), dtype=np.float64)


@final
@attrs.frozen(eq=False)
class _Springs(PairLoad, EnergyTerm):
    acts_always: ClassVar[bool] = True

    label: str
    pairs: PairTable
    reference: Array  # X (n, d)
    stiffness_rate: float  # [rad/s]

    @staticmethod
    def pull(offset: Vector, velocity: Vector, values: Vector) -> Scalar:
        r = np.sqrt(dot(offset, offset))
        return values[0] * (1.0 - values[1] / r)

    def energies(self, observation: Observation) -> Array:
        x, p, q = observation.state.positions, self.pairs.rows, self.pairs.columns
        stretch = np.linalg.norm(x[q] - x[p], axis=1) - self.pairs.values[:, 1]
        # A spring is listed both ways, and each end has half of it.
        shares = 0.25 * self.pairs.values[:, 0] * stretch**2
        return np.asarray(np.bincount(p, shares, len(x)), dtype=np.float64)

    def stiffness(self, displacements: Array, time: float) -> csr_array:
        """K (d n, d n) [N/m]: k (I - (R / r) (I - e e^T)) between the two ends of each spring."""
        n, d = displacements.shape
        p, q = self.pairs.rows, self.pairs.columns
        k, R = self.pairs.values.T
        x = self.reference + displacements
        offsets = x[q] - x[p]
        r = np.linalg.norm(offsets, axis=1)[:, None, None]
        along = np.einsum("mi,mj->mij", offsets, offsets) / r**2
        blocks = k[:, None, None] * (np.eye(d) - (R[:, None, None] / r) * (np.eye(d) - along))
        between = bsr_array((-blocks, q, self.pairs.starts), shape=(d * n, d * n))
        own = np.zeros((n, d, d))
        np.add.at(own, p, blocks)
        places = np.arange(n)
        return csr_array(between + bsr_array((own, places, np.arange(n + 1)), shape=(d * n, d * n)))

    def report(self, observation: Observation) -> Mapping[str, float]:
        x, p, q = observation.state.positions, self.pairs.rows, self.pairs.columns
        r = np.linalg.norm(x[q] - x[p], axis=1)
        return {
            f"{self.label} energy [J]": float(self.energies(observation).sum()),
            f"{self.label} largest stretch [-]": float(np.max(r / self.pairs.values[:, 1])),
        }
