"""Facts about a built scene that warnings look at, each found once and only if asked for."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from math import sqrt

import attrs
import numpy as np
from scipy.spatial import cKDTree

from solidsph.advice.load_histories import (
    LoadHistory,
    MotionHistory,
    TimeHistory,
    load_histories,
    motion_histories,
)
from solidsph.advice.thickness import Rays, rays_through
from solidsph.interfaces.body import Body
from solidsph.interfaces.effect import Effect, Need
from solidsph.interfaces.formulation import Formulation
from solidsph.interfaces.gradient import Gradient
from solidsph.interfaces.terms import GhostConstraint
from solidsph.maths.arrays import Array, Mask
from solidsph.registry.construct import construct
from solidsph.run.built_scene import BuiltScene
from solidsph.scene.default_cover import cover_of
from solidsph.scene.scene import Scene
from solidsph.scene.scheme import completed

# Particles of a body that are checked to be in its shape.
_SAMPLES = 400

# Particles whose neighbours are compared.
_LOOKED_AT = 4000

# Velocity over the wave speed by which a field may miss a linear one: what a twist bends within a
# few spacings stays below it, a jump of 3 % does not.
_ROUGH = 0.01


@attrs.frozen(eq=False, slots=False)
class BodyFacts:
    """One body; units are SI."""

    body: Body
    held_axes: Mask  # (d,) axes along which some constraint keeps it from moving away
    name: str
    extent: slice  # its place among all particles
    dimension: int
    spacing: float  # smallest of its particles [m]
    exact_degree: int  # of the polynomials for which its gradient is exact
    density: float  # [kg/m^3]
    speed: float  # of confined waves [m/s]
    modulus: float  # lambda + 2 mu [Pa]
    poissons_ratio: float
    youngs_modulus: float  # [Pa]

    @classmethod
    def of(cls, body: Body, held_axes: Mask) -> BodyFacts:
        """Facts about `body`."""
        lam, mu = body.material.lame_parameters
        poissons_ratio = lam / (2.0 * (lam + mu))
        return cls(
            body=body,
            held_axes=held_axes,
            name=body.name,
            extent=body.extent,
            dimension=body.particles.dimension,
            spacing=float(body.particles.spacings.min()),
            exact_degree=body.formulation.gradient.exact_degree,
            density=body.material.density,
            speed=body.material.wave_speed,
            modulus=lam + 2.0 * mu,
            poissons_ratio=poissons_ratio,
            youngs_modulus=2.0 * mu * (1.0 + poissons_ratio),
        )

    @property
    def largest_spacing(self) -> float:
        """The largest of its particles [m]."""
        return float(self.body.particles.spacings.max())

    @property
    def is_held(self) -> bool:
        return bool(self.held_axes.any())

    @cached_property
    def real(self) -> Array:
        """Reference positions of its particles, without ghosts, (k, d) [m]."""
        return self.body.particles.positions[~self.body.particles.ghosts]

    @cached_property
    def length(self) -> float:
        """Largest extent along an axis [m]."""
        return float((np.ptp(self.real, axis=0) + self.spacing).max())

    @cached_property
    def thicknesses(self) -> tuple[float, float]:
        """Smallest and usual thickness, normal to its surface [m].

        Raises:
            ValueError: its particles were moved away from its shape.
        """
        if self.dimension == 1:
            return self.length, self.length
        return self._rays.least(self._widest), self._rays.usual(self._widest)

    @cached_property
    def across(self) -> float:
        """Smallest number of particles along its thickness.

        Raises:
            ValueError: its particles were moved away from its shape.
        """
        particles = self.body.particles
        if not particles.graded:
            return self.thicknesses[0] / self.spacing
        if self.dimension == 1:
            return float(np.sum(1.0 / particles.spacings * particles.volumes))
        rays = self._rays
        beside = cKDTree(particles.positions).query(rays.starts)[1]
        counts = attrs.evolve(rays, lengths=rays.lengths / particles.spacings[beside])
        return counts.least(self._widest / self.spacing)

    @cached_property
    def _rays(self) -> Rays:
        shape = self.body.shape
        samples = self.real[:: max(1, len(self.real) // _SAMPLES)]
        if (shape.signed_distance(samples) > self.spacing).mean() > 0.02:
            raise ValueError("particles do not stand where the shape is")
        return rays_through(shape, self.spacing)

    @cached_property
    def _widest(self) -> float:
        """Diameter of the largest ball inside [m]."""
        some = self.real[:: max(1, len(self.real) // _LOOKED_AT)]
        return 2.0 * float(-self.body.shape.signed_distance(some).min())

    @property
    def transit(self) -> float:
        """Time of a wave along it [s]."""
        return self.length / self.speed

    @cached_property
    def slowest_period(self) -> float:
        """Approximate period of its slowest free vibration, as of a bar or a cantilever [s]."""
        if self.dimension == 1:
            return 4.0 * self.transit
        along = 4.0 * self.length / sqrt(self.youngs_modulus / self.density)
        if not self.is_held:
            return 0.5 * along
        # The first bending of a cantilever: omega = 3.516 / L^2 sqrt(E I / (rho A)).
        thickness = self.thicknesses[1]
        if self.length < 3.0 * thickness:
            return along
        plane = self.youngs_modulus / (1.0 - self.poissons_ratio**2)
        bending = 2.0 * np.pi * self.length**2 * sqrt(12.0 * self.density / plane)
        return max(along, bending / (3.516 * thickness))


@attrs.frozen(eq=False, slots=False)
class SceneFacts:
    """A built scene."""

    simulation: BuiltScene

    @property
    def scene(self) -> Scene:
        return self.simulation.scene

    @property
    def is_motion(self) -> bool:
        """True if it is a motion, not an equilibrium."""
        return self.scene.statics is None

    @property
    def dimension(self) -> int:
        return self.simulation.particles.dimension

    def effects_for(self, need: Need) -> dict[str, Effect]:
        """Effects that answer a need, by label."""
        return {
            label: effect
            for label, effect in self.simulation.effects.items()
            if effect.answers is not None and need in effect.answers
        }

    def lacks(self, need: Need) -> bool:
        """True if nothing answers a need; an effect that does not declare its needs may."""
        undeclared = any(effect.answers is None for effect in self.simulation.effects.values())
        return not self.effects_for(need) and not undeclared

    @cached_property
    def cover(self) -> float:
        """Support radius in particle spacings, the scene's or the kernel's own."""
        return cover_of(self.scene)

    @cached_property
    def fits_surface(self) -> bool:
        """True if the gradient is corrected for each body, so that sums are right at surfaces."""
        formulation: Formulation = construct("formulations", completed(self.scene).formulation)
        return type(formulation.gradient).of_body is not Gradient.of_body

    @cached_property
    def bodies(self) -> Sequence[BodyFacts]:
        held = self._fixed_ghosts | (self.held & ~self.simulation.particles.ghosts[:, None])
        return [
            BodyFacts.of(body, np.asarray(held[body.extent].any(axis=0)))
            for body in self.simulation.model.bodies
        ]

    @cached_property
    def held(self) -> Mask:
        """(n, d) components of motion that some constraint prescribes."""
        held = np.zeros(self.simulation.particles.positions.shape, dtype=np.bool_)
        for motion in self.simulation.dynamics.constraints:
            held |= motion.held
        return held

    @property
    def _fixed_ghosts(self) -> Mask:
        """(n, d) ghosts that stay where all else is moved: those of a symmetry plane."""
        fixed = np.zeros(self.held.shape, dtype=np.bool_)
        constraints = self.simulation.dynamics.constraints
        followers = [motion for motion in constraints if isinstance(motion, GhostConstraint)]
        for axis in range(self.dimension if followers else 0):
            moved = np.zeros(self.held.shape)
            moved[:, axis] = 1.0
            for motion in followers:
                motion.impose(0.0, 0, moved)
            fixed[:, axis] = np.abs(moved[:, axis] - 1.0) > 0.5
        return fixed

    @cached_property
    def loads(self) -> Sequence[LoadHistory]:
        return list(load_histories(self.simulation))

    @cached_property
    def motions(self) -> Sequence[MotionHistory]:
        return list(motion_histories(self.simulation))

    @property
    def imposed(self) -> Sequence[TimeHistory]:
        """Loads and motions that are not zero."""
        return [history for history in (*self.loads, *self.motions) if history.peak > 0.0]

    def acceleration(
        self, body: BodyFacts, time: float, positions: Array, velocities: Array
    ) -> Array:
        """Mean acceleration of a body by all loads, (d,) [m/s^2]."""
        extent = body.extent
        mass = self.simulation.model.masses[extent].sum()
        mean = np.zeros(self.dimension)
        for load in self.simulation.dynamics.loads:
            forces = load.forces(time, positions, velocities)
            own = (load.particles >= extent.start) & (load.particles < extent.stop)
            mean += forces[own].sum(axis=0) / mass
        return mean

    @cached_property
    def velocities(self) -> Array:
        """(n, d) velocities at the start, prescribed ones included [m/s]."""
        return self.simulation.dynamics.carry(0.0, self.simulation.initial.velocities)

    @cached_property
    def displacements(self) -> Array:
        """(n, d) displacements at the start [m]."""
        initial, particles = self.simulation.initial, self.simulation.particles
        return self.simulation.dynamics.place(0.0, initial.positions) - particles.positions

    @property
    def starts_at_rest(self) -> bool:
        """True if nothing moves or is displaced at the start."""
        return not (self.velocities.any() or self.displacements.any())

    @cached_property
    def velocity_jump(self) -> float:
        """Largest jump of the velocity at the start, over the wave speed [-].

        Where the velocity is not smooth, the largest difference between neighbours. It is smooth
        where the nearest linear field around a particle fits: in a body that turns or stretches.
        """
        worst = 0.0
        for body in self.bodies:
            V = self.velocities[body.extent][~body.body.particles.ghosts]
            near = 4 * self.dimension + 1
            if not V.any() or len(V) < near:
                continue
            chosen = np.linspace(0, len(V) - 1, min(len(V), _LOOKED_AT)).astype(np.intp)
            _, others = cKDTree(body.real).query(body.real[chosen], near)
            offsets = (body.real[others] - body.real[chosen][:, None, :]) / body.spacing
            linear = np.concatenate([np.ones((*others.shape, 1)), offsets], axis=2)
            fitted = linear @ (np.linalg.pinv(linear) @ V[others])
            rough = np.linalg.norm(V[others] - fitted, axis=2).max(axis=1) > _ROUGH * body.speed
            if rough.any():
                apart = np.linalg.norm(V[others][rough] - V[chosen][rough, None, :], axis=2)
                worst = max(worst, float(apart.max()) / body.speed)
        return worst

    @cached_property
    def vigour(self) -> float:
        """Largest velocity over the wave speed, or strain by a load, that is asked for [-]."""
        body = self.fastest
        velocity = float(abs(self.velocities).max(initial=0.0))
        strain = max((float(load.stresses.max()) / body.modulus for load in self.loads), default=0)
        moved = max((float(motion.speeds.max()) for motion in self.motions), default=0.0)
        return max(velocity / body.speed, strain, moved / body.speed)

    @property
    def fastest(self) -> BodyFacts:
        """The body in which a wave crosses a spacing in the shortest time."""
        return min(self.bodies, key=lambda body: body.spacing / body.speed)

    @property
    def cell_time(self) -> float:
        """Shortest time of a wave across a spacing [s]."""
        return self.fastest.spacing / self.fastest.speed

    @property
    def slowest_period(self) -> float:
        """Slowest period of all bodies [s]."""
        return max(body.slowest_period for body in self.bodies)
