"""Load path: a scene at rest under a growing fraction of its loads and imposed motions."""

from __future__ import annotations

from collections.abc import Mapping

import attrs
import numpy as np

from solidsph.interfaces.engine import InternalForces
from solidsph.interfaces.memory import Memory
from solidsph.interfaces.terms import EnergyTerm, GhostConstraint
from solidsph.maths.arrays import Array, Mask
from solidsph.run.built_scene import BuiltScene
from solidsph.statics.increment import Increment
from solidsph.statics.stiff import is_stiff


@attrs.frozen(eq=False)
class Forces:
    """Forces on all particles at rest."""

    total: Array  # (n, d) [N], those on ghosts returned to the particles that they follow
    applied: Mapping[str, Array]  # by account, reactions included, (n, d) [N]
    remembered: Memory  # at the end of the load step

    @property
    def scale(self) -> float:
        """Norm of all applied forces and reactions [N], the scale of the imbalance."""
        return float(np.sqrt(sum(np.vdot(force, force) for force in self.applied.values())))


@attrs.frozen(eq=False)
class LoadPath:
    """A scene at load factors from 0, without loads and imposed motions, to 1.

    At factor s they are those of the time s T, with T the duration, minus 1 - s times those at
    t = 0. A formula that grows from zero is thus followed in time; a constant grows with s.
    """

    simulation: BuiltScene
    internal: InternalForces  # in double precision
    offset: Array  # (n, d) motion imposed at t = 0 [m]
    initial_loads: Mapping[str, Array]  # (k, d) of each load at t = 0 [N]
    held: Mask  # (n, d) components of real particles that a constraint determines

    @classmethod
    def of(cls, simulation: BuiltScene, internal: InternalForces) -> LoadPath:
        """Load path of a scene from its reference configuration."""
        dynamics, particles = simulation.dynamics, simulation.particles
        rest = np.zeros_like(particles.positions)
        held = np.zeros(rest.shape, dtype=np.bool_)
        offset = rest.copy()
        for motion in dynamics.constraints:
            motion.impose(0.0, 0, offset)
            held |= motion.held
        return cls(
            simulation=simulation,
            internal=internal,
            offset=offset,
            initial_loads={
                load.label: load.forces(0.0, particles.positions, rest) for load in dynamics.loads
            },
            held=held & ~particles.ghosts[:, None],
        )

    @property
    def may_meet(self) -> bool:
        """Whether a body may come to something that holds it, such as another body or a wall."""
        loads = self.simulation.dynamics.loads
        return any(
            isinstance(load, EnergyTerm) and not load.acts_always and is_stiff(load)
            for load in loads
        )

    @property
    def spacing(self) -> float:
        """Of the finest particles [m]."""
        particles = self.simulation.particles
        return float(particles.spacings[~particles.ghosts].min())

    def time(self, factor: float) -> float:
        """Time of a load factor [s]."""
        return factor * self.simulation.scene.duration

    def placed(self, displacements: Array, factor: float) -> Array:
        """Displacements (n, d) with the imposed motions of a load factor."""
        placed = displacements.copy()
        for motion in self.simulation.dynamics.constraints:
            motion.impose(self.time(factor), 0, placed)
        return placed - (1.0 - factor) * self.offset

    def increment(self, since: float, factor: float, memory: Memory, start: Array) -> Increment:
        """The load step to a factor, from displacements (n, d) and memory at the factor `since`."""
        time = self.time(factor)
        return Increment(factor, time, time - self.time(since), memory, start)

    def forces(self, displacements: Array, increment: Increment) -> Forces:
        """Forces at displacements (n, d) at the end of a load step."""
        dynamics, time, factor = self.simulation.dynamics, increment.time, increment.factor
        positions = dynamics.particles.positions + displacements
        total, changed = self.internal.advance(
            time, increment.step, displacements, increment.memory
        )
        remembered = dict(changed)
        applied: dict[str, Array] = {}
        for load in dynamics.loads:
            velocities = increment.velocities(load, displacements)
            own, changed = load.advance(
                time, increment.step, positions, velocities, increment.memory
            )
            remembered |= changed
            force = np.zeros_like(positions)
            force[load.particles] = own - (1.0 - factor) * self.initial_loads[load.label]
            applied[load.label] = force
            total = total + force
        for motion in dynamics.constraints:
            if isinstance(motion, GhostConstraint):
                motion.return_forces(total)
        for motion in dynamics.constraints:
            applied[motion.label] = np.where(motion.held & self.held, -total, 0.0)
        return Forces(total, applied, remembered)

    def volume_ratios(self, displacements: Array) -> Array:
        """J of every particle, (n,); 1 for ghosts."""
        with np.errstate(all="ignore"):  # trial displacements may be absurd
            H = self.internal.gradients(displacements)
            ratios = np.linalg.det(np.eye(displacements.shape[1]) + H)
        return np.where(self.simulation.particles.ghosts, 1.0, ratios)
