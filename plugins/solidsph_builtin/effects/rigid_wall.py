"""A rigid plane wall."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite, sqrt
from typing import Any, ClassVar, final

import attrs
import numpy as np
from scipy.sparse import bsr_array, csr_array

from solidsph.errors import SceneError
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.effect import Effect, Need
from solidsph.interfaces.marks import Mark, Plane
from solidsph.interfaces.memory import Memory
from solidsph.interfaces.terms import EnergyTerm, FieldTerm, Load, Observation
from solidsph.maths.arrays import Array, Indices
from solidsph.model.fields import Component, VectorField
from solidsph.model.regions import AXES, Where
from solidsph.registry.parameters import check_positive, formula, number, optional_number
from solidsph_builtin.boundaries._reports import resultant
from solidsph_builtin.effects._slip import slid, slip_stiffness

# Stiffness of the spring of friction over that against penetration (Mindlin 1949, as for contact).
_TANGENTIAL = 0.8

_NAMES = ("x", "y", "z")


@final
@attrs.frozen
class RigidWall(Effect):
    """A spring that pushes back every particle nearer to the plane than its `clearance`.

    The normal points to the side of the bodies. With g the distance from the plane minus the
    clearance, the energy is k min(g, 0)^2 / 2 with k = strength (lambda + 2 mu) V / (s h), where h
    is the layer that a particle stands for, half a spacing and its depth below the surface of its
    body, at most half a spacing: the wall is as compliant as 1 / strength spacings of material. The
    clearance, unless it is given, is that depth, so that a body touches where its surface is. A
    wall may move by formulas in t; its work is in its account.

    Friction is Coulomb's law with a tangential spring for each touching particle, which slides at
    `friction` times the normal force, Cundall & Strack (1979). A law of velocity alone would let
    every block creep down its incline; with the spring it rests, after an elastic displacement of
    f N / (0.8 k). The stretches are in `State.memory`; the energy lost by sliding is the work that
    the account has taken and does not store.
    """

    answers: ClassVar[frozenset[Need] | None] = frozenset()

    point: Mapping[str, float]  # of the plane, such as {y = -0.1}; components not given are 0 [m]
    normal: Mapping[str, float]  # such as {y = 1}; it need not have the length 1 [-]
    where: Where = "all"
    friction: float = number(default=0.0)  # coefficient [-]
    strength: float = number(default=1.0)  # [-]
    clearance: float | None = optional_number()  # [spacings]; the depth below the surface if none
    displacement: Mapping[str, Component] | None = formula(default=None)  # {y = "-0.1*t"} [m]

    example: ClassVar[Mapping[str, Any]] = {"point": {"x": 0.05}, "normal": {"x": 1.0}}

    def __attrs_post_init__(self) -> None:
        check_positive("rigid-wall", "strength", self.strength, "1 / spacings that it yields")
        for name, value in (("friction", self.friction), ("clearance", self.clearance)):
            if value is not None and not 0.0 <= value < 100.0:
                raise SceneError(
                    f"rigid-wall: {name} must lie between 0 and 100, got {value}; friction is "
                    "Coulomb's coefficient, clearance is in spacings; without one bodies touch "
                    "where their surfaces are"
                )
        for name in ("point", "normal"):
            _check_vector(name, getattr(self, name))
        if not any(self.normal.values()):
            raise SceneError("rigid-wall: the normal has no length; give it one, such as {y = 1}")

    def bind(self, model: DiscreteModel, label: str) -> Load:
        particles, d = model.particles, model.particles.dimension
        normal = _vector("normal", self.normal, d)
        indices = model.select(self.where)
        field = None
        if self.displacement is not None:
            field = VectorField.of(self.displacement, "rigid-wall: displacement", end=model.end)
            field.check_without(AXES, "a wall moves as a whole: its motion is a formula of t")
            field.check_dimension(d, "rigid-wall")
        moduli = np.concatenate(
            [
                np.full(body.particles.count, body.material.density * body.material.wave_speed**2)
                for body in model.bodies
            ]
        )[indices]
        V, s = particles.volumes[indices], particles.spacings[indices]
        depths = _depths(model)[indices]
        wall = _Wall(
            label=label,
            particles=indices,
            reference=particles.positions,
            point=_vector("point", self.point, d),
            normal=normal / np.linalg.norm(normal),
            clearances=depths if self.clearance is None else self.clearance * s,
            springs=self.strength * moduli * V / (s * (0.5 * s + depths)),
            friction=self.friction,
            field=field,
            # Every particle is tied to the wall alone, by k / m; the tangential spring is softer.
            stiffness_rate=sqrt(2.0 * self.strength)
            * max(
                body.material.wave_speed / float(body.particles.spacings.min())
                for body in model.bodies
            ),
        )
        wall.motion(0.0)  # a formula outside its domain raises now, not during the run
        return wall

    def marks(self, model: DiscreteModel, label: str) -> Sequence[Mark]:
        d = model.particles.dimension
        normal = _vector("normal", self.normal, d)
        return (Plane(_vector("point", self.point, d), normal / np.linalg.norm(normal)),)


def _depths(model: DiscreteModel) -> Array:
    """Depth of every particle below the surface of its body, (n,) [m], at most half a spacing."""
    distances = [body.shape.signed_distance(body.particles.positions) for body in model.bodies]
    depths: Array = np.clip(-np.concatenate(distances), 0.0, 0.5 * model.particles.spacings)
    return depths


@final
@attrs.frozen(eq=False)
class _Wall(EnergyTerm, FieldTerm, Load):
    rate_independent: ClassVar[bool] = True

    label: str
    particles: Indices  # (k,)
    reference: Array  # X of all particles, (n, d) [m]
    point: Array  # (d,) at the start [m]
    normal: Array  # (d,) of length 1
    clearances: Array  # (k,) [m]
    springs: Array  # (k,) k [N/m]
    friction: float
    field: VectorField | None
    stiffness_rate: float  # [rad/s]

    @property
    def arrays(self) -> Mapping[str, int]:
        count = len(self.particles)
        slip = {"slip": 8 * count * len(self.point)} if self.friction else {}
        return {
            "chosen particles": 8 * count,
            "clearances": 8 * count,
            "stiffness": 8 * count,
            **slip,
        }

    def motion(self, time: float) -> Array:
        """Displacement of the plane, (d,) [m]."""
        moved = np.zeros(len(self.point))
        if self.field is not None:
            for axis in self.field.components:
                moved[axis] = self.field.values(axis, self.point[None, :], time)[0]
        return moved

    def gaps(self, time: float, positions: Array) -> Array:
        """Distance of each particle's surface from the plane, (k,) [m]."""
        # Of all particles, as choosing numbers is cheaper than choosing vectors.
        along = np.einsum("ni,i->n", positions, self.normal)
        plane = (self.point + self.motion(time)) @ self.normal
        return np.asarray(along[self.particles] - (plane + self.clearances))

    def pressed(self, time: float, positions: Array) -> Array:
        """Normal force on every particle, (k,) [N]."""
        return np.asarray(self.springs * np.maximum(-self.gaps(time, positions), 0.0))

    def forces(self, time: float, positions: Array, velocities: Array) -> Array:
        """Normal forces; friction depends on memory."""
        pressed = self.pressed(time, positions)
        if not pressed.any():  # bodies are far from most walls for most of the time
            return np.zeros((len(pressed), len(self.normal)))
        return np.asarray(pressed[:, None] * self.normal)

    def advance(
        self, time: float, step: float, positions: Array, velocities: Array, memory: Memory
    ) -> tuple[Array, Memory]:
        if not self.friction:
            return self.forces(time, positions, velocities), {}
        pressed = self.pressed(time, positions)
        slip = slid(
            self._slip(memory),
            self._sliding(time, step, velocities),
            np.broadcast_to(self.normal, (len(pressed), len(self.normal))),
            step,
            _TANGENTIAL * self.springs,
            self.friction * pressed,
        )
        forces = pressed[:, None] * self.normal - _TANGENTIAL * self.springs[:, None] * slip
        return forces, {self._slip_name: slip}

    def stiffness(self, displacements: Array, time: float) -> csr_array:
        """Minus the derivative of the normal forces, (d n, d n) [N/m]."""
        touching = self.gaps(time, self.reference + displacements) < 0.0
        springs = np.where(touching, self.springs, 0.0)
        blocks = springs[:, None, None] * np.outer(self.normal, self.normal)
        return self._on_particles(blocks, len(displacements))

    def stiffness_of_step(
        self, time: float, step: float, displacements: Array, velocities: Array, memory: Memory
    ) -> csr_array:
        """That of the normal forces and of friction, (d n, d n) [N/m]."""
        normal = self.stiffness(displacements, time)
        if not self.friction or step == 0.0:
            return normal
        pressed = self.pressed(time, self.reference + displacements)
        normals = np.broadcast_to(self.normal, (len(pressed), len(self.normal)))
        slip = slip_stiffness(
            self._slip(memory),
            step * self._sliding(time, step, velocities),
            normals,
            _TANGENTIAL * self.springs,
            self.friction * pressed,
        )
        pressing = np.where(pressed > 0.0, self.friction * self.springs, 0.0)
        by_gap = slip.by_limit[:, :, None] * (pressing[:, None] * -normals)[:, None, :]
        return csr_array(normal + self._on_particles(slip.by_motion + by_gap, len(displacements)))

    def _sliding(self, time: float, step: float, velocities: Array) -> Array:
        """Velocity of the particles relative to the wall, (k, d) [m/s]."""
        if step == 0.0:
            return velocities[self.particles]
        moved = self.motion(time) - self.motion(time - step)
        return np.asarray(velocities[self.particles] - moved / step)

    def _on_particles(self, blocks: Array, n: int) -> csr_array:
        """Matrix (d n, d n) of a block (k, d, d) for each particle on its diagonal."""
        d = blocks.shape[-1]
        of_all, rows = np.zeros((n, d, d)), np.arange(n)
        of_all[self.particles] = blocks
        return csr_array(bsr_array((of_all, rows, np.append(rows, n)), shape=(n * d, n * d)))

    def energies(self, observation: Observation) -> Array:
        """Energy of the springs, (n,) [J]."""
        state = observation.state
        gaps = np.minimum(self.gaps(state.time, state.positions), 0.0)
        slips = np.sum(self._slip(state.memory) ** 2, axis=1) if self.friction else 0.0
        energies = np.zeros(len(state.positions))
        energies[self.particles] = 0.5 * self.springs * (gaps**2 + _TANGENTIAL * slips)
        return energies

    def report(self, observation: Observation) -> Mapping[str, float]:
        state, label = observation.state, self.label
        gaps = self.gaps(state.time, state.positions)
        return {
            f"{label} energy [J]": float(self.energies(observation).sum()),
            **resultant(f"{label} force", f"{label} moment", state.positions, state.applied[label]),
            f"{label} least gap [m]": float(gaps.min()),
            f"{label} touching particles [-]": float(np.sum(gaps < 0.0)),
        }

    def fields(self, observation: Observation) -> Mapping[str, Array]:
        return {f"{self.label} force [N]": observation.state.applied[self.label]}

    def _slip(self, memory: Memory) -> Array:
        return memory.get(self._slip_name, np.zeros((len(self.particles), len(self.point))))

    @property
    def _slip_name(self) -> str:
        return f"{self.label} slip"


def _check_vector(name: str, given: object) -> None:
    if not isinstance(given, Mapping) or not all(
        key in _NAMES
        and isinstance(value, (int, float))
        and not isinstance(value, bool)
        and isfinite(value)
        for key, value in given.items()
    ):
        raise SceneError(
            f"rigid-wall: {name} must be a table of numbers such as {{y = 1.0}}, got {given!r}"
        )


def _vector(name: str, given: Mapping[str, float], d: int) -> Array:
    beyond = [key for key in given if _NAMES.index(key) >= d and given[key] != 0.0]
    if beyond:
        raise SceneError(
            f"rigid-wall: {name} has a component {beyond[0]!r} in a {d}D scene; leave it out"
        )
    return np.array([float(given.get(key, 0.0)) for key in _NAMES[:d]])
