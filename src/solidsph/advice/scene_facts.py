"""SceneFacts: a built scene as warnings look at it, each fact found once and only if asked for."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from math import sqrt
from typing import Any

import attrs
import numpy as np
from scipy.spatial import cKDTree

from solidsph.advice import load_histories
from solidsph.advice.thickness import through
from solidsph.interfaces.body import Body
from solidsph.interfaces.effect import Effect, Need
from solidsph.interfaces.formulation import Formulation
from solidsph.interfaces.gradient import Gradient
from solidsph.interfaces.shape import Shape
from solidsph.interfaces.terms import GhostConstraint
from solidsph.maths.arrays import Array, Mask
from solidsph.registry.construct import construct
from solidsph.run.built_scene import BuiltScene
from solidsph.scene.default_cover import cover_of

# Particles of a body that are asked whether they are in its shape.
_SAMPLES = 400

# Particles looked at where neighbours are compared.
_LOOKED_AT = 4000

# Velocity over the wave speed by which a field may miss a linear one: what a twist bends within a
# few spacings stays below it, a jump of 3 % does not.
_ROUGH = 0.01


@attrs.frozen(eq=False, slots=False)
class BodyFacts:
    """One body."""

    body: Body
    shape: Shape
    held_axes: Mask  # (d,) along which some motion keeps it from moving away

    @property
    def name(self) -> str:
        return self.body.name

    @property
    def dimension(self) -> int:
        return self.body.particles.dimension

    @property
    def spacing(self) -> float:
        """Smallest of its particles [m]."""
        return float(self.body.particles.spacings.min())

    @property
    def speed(self) -> float:
        """Of confined waves [m/s]."""
        return self.body.material.wave_speed

    @property
    def density(self) -> float:
        return self.body.material.density

    @property
    def modulus(self) -> float:
        """lambda + 2 mu [Pa]."""
        lam, mu = self.body.material.lame_parameters
        return lam + 2.0 * mu

    @property
    def poissons_ratio(self) -> float:
        lam, mu = self.body.material.lame_parameters
        return lam / (2.0 * (lam + mu))

    @property
    def youngs_modulus(self) -> float:
        _, mu = self.body.material.lame_parameters
        return 2.0 * mu * (1.0 + self.poissons_ratio)

    @property
    def supported(self) -> bool:
        return bool(self.held_axes.any())

    @cached_property
    def real(self) -> Array:
        """Positions of its particles, without ghosts, (k, d) [m]."""
        return self.body.particles.positions[~self.body.particles.ghosts]

    @cached_property
    def length(self) -> float:
        """Its largest extent along an axis [m]."""
        return float((np.ptp(self.real, axis=0) + self.spacing).max())

    @cached_property
    def thicknesses(self) -> tuple[float, float]:
        """Smallest and usual way through it, normal to its surface [m]."""
        if self.dimension == 1:
            return self.length, self.length
        if self._moved:
            raise ValueError("particles do not stand where the shape is")
        rays = through(self.shape, self.spacing)
        some = self.real[:: max(1, len(self.real) // _LOOKED_AT)]
        widest = 2.0 * float(-self.shape.signed_distance(some).min())
        return rays.least(widest), rays.usual(widest)

    @property
    def _moved(self) -> bool:
        X = self.real[:: max(1, len(self.real) // _SAMPLES)]
        return bool((self.shape.signed_distance(X) > self.spacing).mean() > 0.02)

    @cached_property
    def transit(self) -> float:
        """Time of a wave along it [s]."""
        return self.length / self.speed

    @cached_property
    def slowest_period(self) -> float:
        """Of its free vibration, held or not, about: that of a bar or a cantilever [s]."""
        along = 4.0 * self.length / sqrt(self.youngs_modulus / self.density)
        if self.dimension == 1:
            return 4.0 * self.transit
        if not self.supported:
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
    def scene(self) -> Any:
        return self.simulation.scene

    @property
    def moves(self) -> bool:
        """Whether it is a motion and no equilibrium."""
        return self.simulation.scene.statics is None

    @property
    def dimension(self) -> int:
        return self.simulation.particles.dimension

    def answering(self, need: Need) -> dict[str, Effect]:
        """Effects that are for this, by label."""
        return {
            label: effect
            for label, effect in self.simulation.effects.items()
            if effect.answers is not None and need in effect.answers
        }

    def lacks(self, need: Need) -> bool:
        """Whether nothing answers it; an effect that does not say what it is for may."""
        return not self.answering(need) and not self._undeclared

    @property
    def _undeclared(self) -> bool:
        return any(effect.answers is None for effect in self.simulation.effects.values())

    @cached_property
    def cover(self) -> float:
        """Support radius in particle spacings, the scene's or the kernel's own."""
        return cover_of(self.simulation.scene)

    @cached_property
    def fits_surface(self) -> bool:
        """Whether the gradient is changed for each body as a whole, so that sums end right where
        the body does."""
        formulation: Formulation = construct("formulations", self.simulation.scene.formulation)
        return type(formulation.gradient).of_body is not Gradient.of_body

    @cached_property
    def bodies(self) -> Sequence[BodyFacts]:
        particles = self.simulation.particles
        held = self._stays_behind | (self.freedoms & ~particles.ghosts[:, None])
        return [
            BodyFacts(
                body,
                construct("shapes", self.simulation.scene.bodies[body.name].shape),
                np.asarray(held[body.extent].any(axis=0)),
            )
            for body in self.simulation.model.bodies
        ]

    @cached_property
    def freedoms(self) -> Mask:
        """(n, d) that some motion determines."""
        held = np.zeros(self.simulation.particles.positions.shape, dtype=np.bool_)
        for motion in self.simulation.dynamics.constraints:
            held |= motion.held
        return held

    @cached_property
    def _stays_behind(self) -> Mask:
        """(n, d) ghosts that do not go along where all else is moved: those of a symmetry plane."""
        behind = np.zeros(self.freedoms.shape, dtype=np.bool_)
        followers = [
            motion
            for motion in self.simulation.dynamics.constraints
            if isinstance(motion, GhostConstraint)
        ]
        for axis in range(self.dimension if followers else 0):
            moved = np.zeros(self.freedoms.shape)
            moved[:, axis] = 1.0
            for motion in followers:
                motion.impose(0.0, 0, moved)
            behind[:, axis] = np.abs(moved[:, axis] - 1.0) > 0.5
        return behind

    @cached_property
    def loads(self) -> Sequence[load_histories.LoadHistory]:
        return list(load_histories.loads(self.simulation))

    @cached_property
    def motions(self) -> Sequence[load_histories.Motion]:
        return list(load_histories.motions(self.simulation))

    @cached_property
    def velocities(self) -> Array:
        """(n, d) at the start, with what is imposed then [m/s]."""
        return self.simulation.dynamics.carry(0.0, self.simulation.initial.velocities)

    @cached_property
    def displacements(self) -> Array:
        """(n, d) at the start [m]."""
        initial, particles = self.simulation.initial, self.simulation.particles
        return self.simulation.dynamics.place(0.0, initial.positions) - particles.positions

    @cached_property
    def velocity_jump(self) -> float:
        """Largest jump of the velocity at the start, over the wave speed [-].

        Where it is not smooth, the largest difference between neighbours. Smooth is what the linear
        field fits that is nearest to it around a particle: a body that turns or stretches.
        """
        worst = 0.0
        for one in self.bodies:
            V = self.velocities[one.body.extent][~one.body.particles.ghosts]
            near = 4 * self.dimension + 1
            if not V.any() or len(V) < near:
                continue
            chosen = np.linspace(0, len(V) - 1, min(len(V), _LOOKED_AT)).astype(np.intp)
            _, others = cKDTree(one.real).query(one.real[chosen], near)
            offsets = (one.real[others] - one.real[chosen][:, None, :]) / one.spacing
            linear = np.concatenate([np.ones((*others.shape, 1)), offsets], axis=2)
            fitted = linear @ (np.linalg.pinv(linear) @ V[others])
            rough = np.linalg.norm(V[others] - fitted, axis=2).max(axis=1) > _ROUGH * one.speed
            if rough.any():
                apart = np.linalg.norm(V[others][rough] - V[chosen][rough, None, :], axis=2)
                worst = max(worst, float(apart.max()) / one.speed)
        return worst

    @cached_property
    def vigour(self) -> float:
        """Largest velocity over the wave speed, or strain by a load, that is asked for [-]."""
        one = self.first
        velocity = float(abs(self.velocities).max(initial=0.0))
        strained = max((float(load.stresses.max()) / one.modulus for load in self.loads), default=0)
        moved = max((float(motion.speeds.max()) for motion in self.motions), default=0.0)
        return max(velocity / one.speed, strained, moved / one.speed)

    @property
    def first(self) -> BodyFacts:
        """The body with the fastest waves across a spacing."""
        return min(self.bodies, key=lambda one: one.spacing / one.speed)

    @property
    def cell_time(self) -> float:
        """Of a wave across a spacing [s]."""
        return self.first.spacing / self.first.speed

    @cached_property
    def slowest_period(self) -> float:
        """Of the slowest body [s]."""
        return max(one.slowest_period for one in self.bodies)
