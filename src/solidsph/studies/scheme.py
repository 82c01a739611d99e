"""Scheme: the parts that decide which small deviations of a lattice grow, and how fast all move."""

from __future__ import annotations

from collections.abc import Sequence
from math import floor

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.interfaces.formulation import Configuration, Formulation
from solidsph.interfaces.integrator import Integrator
from solidsph.interfaces.kernel import Kernel
from solidsph.interfaces.material import Material
from solidsph.maths.arrays import Array
from solidsph.model.particles import State
from solidsph.registry.construct import construct
from solidsph.scene.default_cover import cover_of, kernel_cover
from solidsph.scene.scene import Scene
from solidsph.scene.scene_data import DEFAULT_INTEGRATOR, PartLike
from solidsph.simulation import Simulation

# A soft solid of usual proportions; only Poisson's ratio shows in units of its wave speed.
_MATERIAL = {
    "type": "neo-hookean",
    "youngs_modulus": 1e6,
    "poissons_ratio": 0.3,
    "density": 1000.0,
}

# Transits of a spacing: so many steps that rounding them to a whole number does not show.
_LONG = 1e4

# In spacings: by rounding, a particle so far beyond the support may count as a neighbour.
_EDGE = 1e-9

# Particles of a block beyond which a certificate would take many minutes, and gigabytes.
_MOST_PARTICLES = 120_000


def _kernel(wanted: PartLike) -> Kernel:
    kernel: Kernel = construct("kernels", wanted)
    return kernel


def _formulation(wanted: PartLike) -> Formulation:
    formulation: Formulation = construct("formulations", wanted)
    return formulation


def _material(wanted: PartLike) -> Material:
    material: Material = construct("materials", wanted)
    return material


def _integrator(wanted: PartLike) -> Integrator:
    integrator: Integrator = construct("integrators", wanted)
    return integrator


@attrs.frozen
class Scheme:
    """What small deviations on a lattice depend on, apart from its stretch.

    Every part is a name, a table with a `type`, or an object.
    """

    kernel: Kernel = attrs.field(factory=lambda: _kernel("modified-mollifier"), converter=_kernel)
    cover: float = attrs.field()  # the kernel's own, unless it is given [spacings]
    formulation: Formulation = attrs.field(
        factory=lambda: _formulation("total-lagrangian"), converter=_formulation
    )
    material: Material = attrs.field(factory=lambda: _material(_MATERIAL), converter=_material)
    effects: Sequence[PartLike] = ()
    integrator: Integrator = attrs.field(
        factory=lambda: _integrator(DEFAULT_INTEGRATOR), converter=_integrator
    )
    spacing: float = 1.0  # [m]
    time_step_factor: float = 0.5  # in use, of the CFL step [-]

    @cover.default
    def _own_cover(self) -> float:
        return kernel_cover(self.kernel)

    @classmethod
    def of(cls, scene: Scene) -> Scheme:
        """That of a scene, by its first body.

        Raises:
            SceneError: no material is named.
        """
        body = next(iter(scene.bodies.values()))
        material = scene.material if body.material is None else body.material
        if material is None:
            raise SceneError("the scene names no material; add [material]")
        return cls(
            kernel=scene.kernel,
            cover=cover_of(scene),
            formulation=scene.formulation,
            material=material,
            effects=tuple(effect.part for effect in scene.effects),
            integrator=scene.integrator or DEFAULT_INTEGRATOR,
            spacing=body.spacing,
            time_step_factor=scene.time_step_factor,
        )

    @property
    def transit(self) -> float:
        """Time in which a confined wave crosses a spacing, the unit of rates and steps [s]."""
        return self.spacing / self.material.wave_speed

    def depth(self, least_stretch: float = 1.0) -> int:
        """Layers of particles about one that must be there for the surface not to be felt."""
        # Forces from stresses, stresses from gradients: two supports. In the current configuration
        # volumes by the crowding of neighbours are a third, and stretch moves neighbours.
        if self.formulation.configuration is Configuration.REFERENCE:
            reach = 2 * floor(self.cover + _EDGE) + 2 * bool(self.effects)
        else:
            reach = 3 * floor(self.cover / min(1.0, least_stretch) + _EDGE)
        return 2 * max(reach, 1) + 1

    def simulation(
        self,
        dimension: int,
        layers: Sequence[int],
        *,
        boundaries: Sequence[tuple[PartLike, str]] = (),
        time_step_factor: float = 1.0,
        duration: float = _LONG,
    ) -> Simulation:
        """A block of lattice about the origin.

        Args:
            dimension: 1, 2 or 3.
            layers: of particles on either side of the middle one, along each axis.
            boundaries: parts and the labels of their accounts; free by default.
            time_step_factor: of the CFL step.
            duration: at least, in transits of a spacing; it is a whole number of steps.

        Raises:
            SceneError: there would be too many particles.
            BuildError: parts do not fit each other.
        """
        count = int(np.prod([2 * one + 1 for one in layers]))
        if count > _MOST_PARTICLES:
            raise SceneError(
                f"a block of {count} particles would be needed, more than {_MOST_PARTICLES}; "
                "take a smaller cover, a milder compression, or fewer dimensions"
            )
        lengths = [2.0 * one * self.spacing for one in layers]
        shape = {"type": "box", "lengths": lengths, "origin": [-0.5 * one for one in lengths]}
        builder = (
            Simulation.builder()
            .body(
                "block",
                shape=shape,
                spacing=self.spacing,
                discretisation={"type": "lattice", "on_boundary": True},
            )
            .kernel(self.kernel, cover=self.cover)
            .material(self.material)
            .formulation(self.formulation)
            .integrator(self.integrator, time_step_factor=time_step_factor)
            .engine("matrix" if count < _MOST_PARTICLES // 4 else "auto")
            .duration(duration * self.transit)
            .outputs(1)
        )
        for effect in self.effects:
            builder.effect(effect)
        for part, label in boundaries:
            builder.boundary(part, label=label)
        return builder.build()


def stretched(simulation: Simulation, stretches: Sequence[float]) -> State:
    """At rest in a uniform stretch along each axis."""
    return attrs.evolve(
        simulation.initial,
        positions=simulation.particles.positions * np.asarray(stretches),
        velocities=np.zeros_like(simulation.initial.velocities),
    )


def deformation(stretches: Sequence[float]) -> Array:
    """F of that stretch, (d, d)."""
    return np.diag(np.asarray(stretches, dtype=np.float64))
