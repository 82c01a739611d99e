"""Particles (fixed reference data) and State (evolving arrays): all data of a run.

Both are plain arrays that can be stored. Nothing else evolves, so a restart only reads a file, and
two runs never share a history.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import attrs
import numpy as np
from numpy.typing import NDArray

from solidsph.errors import SceneError
from solidsph.maths.arrays import Array, Indices, Mask

# Of particles, one row for each.
_ARRAYS = ("positions", "volumes", "spacings", "area_vectors", "ghosts", "images", "cells")


@attrs.frozen(eq=False)
class Face:
    """A named part of a body's surface: the particles that own some of it, and their areas."""

    particles: Indices  # (k,)
    area_vectors: Array  # (k, d) outward [m^(d-1)]
    areas: Array = attrs.field()  # (k,) above the vectors' length where it is curved [m^(d-1)]
    moments: Array = attrs.field()  # (k, d, d) integral of n_i (x - X)_j over the area [m^d]

    @areas.default
    def _lengths(self) -> Array:
        return np.asarray(np.linalg.norm(self.area_vectors, axis=1), dtype=np.float64)

    @moments.default
    def _at_the_particles(self) -> Array:
        return np.zeros((*self.area_vectors.shape, self.area_vectors.shape[1]))


@attrs.frozen(eq=False)
class Particles:
    """The reference configuration of every body of a scene.

    Ghosts are particles beyond the surface. They carry values to complete the support of those near
    it, and have no mass and no equation of motion.
    """

    positions: Array  # (n, d) reference positions X [m]
    volumes: Array  # (n,) share of the body, for masses and energies [m^d]
    spacings: Array  # (n,) particle spacing of the body there [m]
    area_vectors: Array  # (n, d) outward surface area that a particle owns, 0 inside [m^(d-1)]
    ghosts: Mask  # (n,)
    images: Array  # (n, d) mirror image of a ghost through the surface; otherwise X itself [m]
    tags: Mapping[str, Mask] = attrs.field(factory=dict)  # named sets of particles, each (n,)
    bodies: Mapping[str, slice] = attrs.field(factory=dict)  # each body is one run of particles
    faces: Mapping[str, Face] = attrs.field(factory=dict)  # a particle at an edge is on several
    cells: Array = attrs.field()  # (n,) weights in sums over neighbours [m^d]

    @cells.default
    def _shares(self) -> Array:
        # The two differ where ghosts complete the sums beyond the middle of a cell.
        return self.volumes

    @property
    def count(self) -> int:
        """Number of particles n, ghosts included."""
        return int(self.positions.shape[0])

    @property
    def graded(self) -> bool:
        """Whether the spacing of particles of one body differs."""
        parts = self.bodies.values() or (slice(None),)
        return any(bool(np.ptp(self.spacings[part]) > 0.0) for part in parts)

    @property
    def dimension(self) -> int:
        """Number of space dimensions d."""
        return int(self.positions.shape[1])

    @classmethod
    def joined(cls, bodies: Mapping[str, Particles]) -> Particles:
        """The particles of several bodies as one set; the name of a body becomes a tag."""
        parts = list(bodies.values())
        starts = np.cumsum([0, *(part.count for part in parts)])
        slices = {
            name: slice(int(a), int(b))
            for name, a, b in zip(bodies, starts[:-1], starts[1:], strict=True)
        }
        total = int(starts[-1])
        tags: dict[str, Mask] = {}
        faces: dict[str, list[Face]] = {}
        for name, part in bodies.items():
            for tag, mask in {**part.tags, name: ~part.ghosts}.items():
                tags.setdefault(tag, np.zeros(total, dtype=np.bool_))[slices[name]] |= mask
            for face, owned in part.faces.items():
                moved = owned.particles + slices[name].start
                faces.setdefault(face, []).append(attrs.evolve(owned, particles=moved))
        return cls(
            **{name: _joined([getattr(part, name) for part in parts]) for name in _ARRAYS},
            tags=tags,
            bodies=slices,
            faces={
                face: Face(
                    np.concatenate([piece.particles for piece in pieces]),
                    np.concatenate([piece.area_vectors for piece in pieces]),
                    np.concatenate([piece.areas for piece in pieces]),
                    np.concatenate([piece.moments for piece in pieces]),
                )
                for face, pieces in faces.items()
            },
        )

    def read_only(self) -> Particles:
        """The same particles for observers: read-only views of the same memory."""
        views: dict[str, Any] = {name: locked(getattr(self, name)) for name in _ARRAYS}
        return attrs.evolve(self, **views)

    def tagged(self, name: str) -> Indices:
        """Indices of the particles in the named set.

        Raises:
            SceneError: no particle carries that tag.
        """
        if name not in self.tags:
            known = ", ".join(sorted(self.tags)) or "none"
            raise SceneError(f"no tag {name!r} among the particles; known tags: {known}")
        return np.flatnonzero(self.tags[name])


def _joined(parts: Sequence[NDArray[Any]]) -> NDArray[Any]:
    """The arrays in sequence; a single one is shared, since reference data are never changed."""
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


@attrs.frozen(eq=False)
class State:
    """All evolving data. An integrator takes a state and returns the next; they share no array."""

    time: float  # t [s]
    step: int  # completed steps
    positions: Array  # (n, d) current positions x [m]
    velocities: Array  # (n, d) v [m/s]
    accelerations: Array  # (n, d) a [m/s^2], belonging to these positions
    memory: Mapping[str, Array] = attrs.field(factory=dict)  # of parts with history, by name
    applied: Mapping[str, Array] = attrs.field(factory=dict)  # force of each account, (n, d) [N]
    work: Mapping[str, float] = attrs.field(factory=dict)  # work done by each account so far [J]

    def begun(
        self,
        *,
        accelerations: Array,
        applied: Mapping[str, Array],
        memory: Mapping[str, Array] | None = None,
    ) -> State:
        """The first state of a run, with all energy accounts at zero."""
        return attrs.evolve(
            self,
            accelerations=accelerations,
            applied=applied,
            work=dict.fromkeys(applied, 0.0),
            memory={**self.memory, **(memory or {})},
        )

    def advanced(
        self,
        *,
        time: float,
        positions: Array,
        velocities: Array,
        accelerations: Array,
        applied: Mapping[str, Array],
        memory: Mapping[str, Array],
    ) -> State:
        """The state one step later; energy accounts follow by the trapezoidal rule."""
        path = positions - self.positions
        # Not by `vdot`: from 10000 numbers on it uses the threads of a linear algebra library,
        # which costs more than the rest of a step, and several times that on busy cores.
        work = {
            name: self.work[name]
            + 0.5 * float(np.einsum("ij,ij->", self.applied[name] + force, path))
            for name, force in applied.items()
        }
        return State(
            time=time,
            step=self.step + 1,
            positions=positions,
            velocities=velocities,
            accelerations=accelerations,
            memory=memory,
            applied=applied,
            work=work,
        )


def read_only(state: State) -> State:
    """The same state for observers: read-only views of the same memory."""
    return attrs.evolve(
        state,
        positions=locked(state.positions),
        velocities=locked(state.velocities),
        accelerations=locked(state.accelerations),
        memory={name: locked(values) for name, values in state.memory.items()},
        applied={name: locked(values) for name, values in state.applied.items()},
        work=dict(state.work),
    )


def locked(values: NDArray[Any]) -> NDArray[Any]:
    """A read-only view."""
    view = values.view()
    view.flags.writeable = False
    return view
