"""Particles (reference data, fixed) and State (evolving arrays): all that a run is made of.

Both are plain arrays that can be stored; nothing that evolves hides anywhere else, so a restart
is a file read and two runs never share a history.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import attrs
import numpy as np
from numpy.typing import NDArray

from solidsph.errors import SceneError
from solidsph.maths.arrays import Array, Indices, Mask


@attrs.frozen(eq=False)
class Face:
    """A named part of a body's surface: the particles that own some of it, and how much."""

    particles: Indices  # (k,)
    area_vectors: Array  # (k, d) outward [m^(d-1)]
    areas: Array = attrs.field()  # (k,) more than their length where the face is curved [m^(d-1)]

    @areas.default
    def _lengths(self) -> Array:
        return np.asarray(np.linalg.norm(self.area_vectors, axis=1), dtype=np.float64)


@attrs.frozen(eq=False)
class Particles:
    """The reference configuration of every body of a scene.

    Ghosts are particles beyond the surface that carry values only to complete the support of
    those near it; they have no mass and no equation of motion.
    """

    positions: Array  # (n, d) reference positions X [m]
    volumes: Array  # (n,) share of the body, by which masses and energies count [m^d]
    spacings: Array  # (n,) particle spacing of the body that a particle belongs to [m]
    area_vectors: Array  # (n, d) outward surface area that a particle owns, 0 inside [m^(d-1)]
    ghosts: Mask  # (n,)
    images: Array  # (n, d) mirror image of a ghost through the surface; otherwise X itself [m]
    tags: Mapping[str, Mask] = attrs.field(factory=dict)  # named sets of particles, each (n,)
    bodies: Mapping[str, slice] = attrs.field(factory=dict)  # each body is one run of particles
    faces: Mapping[str, Face] = attrs.field(factory=dict)  # a particle at an edge is on several
    cells: Array = attrs.field()  # (n,) weights in sums over neighbours [m^d]

    @cells.default
    def _shares(self) -> Array:
        # The two differ where ghosts take up the sums beyond the middle of a cell.
        return self.volumes

    @property
    def count(self) -> int:
        """Number of particles n, ghosts included."""
        return int(self.positions.shape[0])

    @property
    def dimension(self) -> int:
        """Number of space dimensions d."""
        return int(self.positions.shape[1])

    @classmethod
    def joined(cls, bodies: Mapping[str, Particles]) -> Particles:
        """The particles of several bodies as one set; a body's name becomes a tag of its own."""
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
            own = dict(part.tags)
            own[name] = ~part.ghosts
            for tag, mask in own.items():
                tags.setdefault(tag, np.zeros(total, dtype=np.bool_))[slices[name]] |= mask
            for face, own_face in part.faces.items():
                moved = own_face.particles + slices[name].start
                faces.setdefault(face, []).append(attrs.evolve(own_face, particles=moved))
        return cls(
            positions=_joined([part.positions for part in parts]),
            volumes=_joined([part.volumes for part in parts]),
            spacings=_joined([part.spacings for part in parts]),
            area_vectors=_joined([part.area_vectors for part in parts]),
            ghosts=_joined([part.ghosts for part in parts]),
            images=_joined([part.images for part in parts]),
            tags=tags,
            bodies=slices,
            faces={
                face: Face(
                    np.concatenate([one.particles for one in several]),
                    np.concatenate([one.area_vectors for one in several]),
                    np.concatenate([one.areas for one in several]),
                )
                for face, several in faces.items()
            },
            cells=_joined([part.cells for part in parts]),
        )

    def read_only(self) -> Particles:
        """The same particles for those who look at them: the same memory, shut."""
        return attrs.evolve(
            self,
            positions=shut(self.positions),
            volumes=shut(self.volumes),
            spacings=shut(self.spacings),
            area_vectors=shut(self.area_vectors),
            ghosts=shut(self.ghosts),
            images=shut(self.images),
            cells=shut(self.cells),
        )

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
    """Arrays one behind the other; reference data are never written, so one alone is shared."""
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


@attrs.frozen(eq=False)
class State:
    """All that evolves. An integrator takes one and returns the next; arrays are never shared."""

    time: float  # t [s]
    step: int  # completed steps
    positions: Array  # (n, d) current positions x [m]
    velocities: Array  # (n, d) v [m/s]
    accelerations: Array  # (n, d) a [m/s^2], belonging to these positions
    memory: Mapping[str, Array] = attrs.field(factory=dict)  # what a part remembers, by its name
    applied: Mapping[str, Array] = attrs.field(factory=dict)  # force of each account, (n, d) [N]
    work: Mapping[str, float] = attrs.field(factory=dict)  # work done by each account so far [J]

    def begun(
        self,
        *,
        accelerations: Array,
        applied: Mapping[str, Array],
        memory: Mapping[str, Array] | None = None,
    ) -> State:
        """The first state of a run, all its energy accounts at zero."""
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
        """The state one step on; the energy accounts are settled by the trapezoidal rule."""
        path = positions - self.positions
        # Not by `vdot`: from 10000 numbers on it wakes the threads of a linear algebra library,
        # which costs more than the rest of a step, and several times that where cores are busy.
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
    """The same state for those who look at it: the same memory, which they cannot write to."""
    return attrs.evolve(
        state,
        positions=shut(state.positions),
        velocities=shut(state.velocities),
        accelerations=shut(state.accelerations),
        memory={name: shut(values) for name, values in state.memory.items()},
        applied={name: shut(values) for name, values in state.applied.items()},
        work=dict(state.work),
    )


def shut(values: NDArray[Any]) -> NDArray[Any]:
    """A view that cannot be written to."""
    view = values.view()
    view.flags.writeable = False
    return view
