"""Scheme: the parts that decide the stability and speed of waves on a lattice."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import floor
from typing import Any

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
from solidsph.scene.graded_spacing import least_spacing
from solidsph.scene.scene import Scene
from solidsph.scene.scene_data import DEFAULT_FACTOR, PartLike
from solidsph.scene.scheme import SCHEMES, completed
from solidsph.simulation import Simulation

_USUAL = SCHEMES["corrected"]

# Defaults by kind of part. The material is a soft solid; in units of its wave speed only Poisson's
# ratio matters.
_DEFAULTS: Mapping[str, Any] = {
    "kernels": _USUAL.kernel,
    "formulations": _USUAL.formulation,
    "materials": {
        "type": "neo-hookean",
        "youngs_modulus": 1e6,
        "poissons_ratio": 0.3,
        "density": 1000.0,
    },
    "integrators": _USUAL.integrator,
}

# Duration in transits of a spacing; rounding so many steps to a whole number has no influence.
_LONG = 1e4

# Rounding may count a particle this far beyond the support as a neighbour [spacings].
_EDGE = 1e-9

# Size of a block beyond which a certificate would take many minutes, and gigabytes.
_MOST_PARTICLES = 120_000


def _kernel(part: PartLike) -> Any:
    return construct("kernels", part)


def _formulation(part: PartLike) -> Any:
    return construct("formulations", part)


def _material(part: PartLike) -> Any:
    return construct("materials", part)


def _integrator(part: PartLike) -> Any:
    return construct("integrators", part)


@attrs.frozen
class Scheme:
    """All that small deviations on a lattice depend on, apart from its stretch.

    Every part is given by name, by a table with a `type`, or as an object.
    """

    kernel: Kernel = attrs.field(default=_DEFAULTS["kernels"], converter=_kernel)
    cover: float = attrs.field()  # by default the kernel's own [spacings]
    formulation: Formulation = attrs.field(
        default=_DEFAULTS["formulations"], converter=_formulation
    )
    material: Material = attrs.field(default=_DEFAULTS["materials"], converter=_material)
    effects: Sequence[PartLike] = ()
    integrator: Integrator = attrs.field(default=_DEFAULTS["integrators"], converter=_integrator)
    spacing: float = 1.0  # [m]
    time_step_factor: float = DEFAULT_FACTOR  # in use, as that of a scene [-]

    @cover.default
    def _own_cover(self) -> float:
        return kernel_cover(self.kernel)

    @classmethod
    def of(cls, scene: Scene) -> Scheme:
        """Scheme of the first body of a scene.

        Raises:
            SceneError: the scene names no material.
        """
        scene = completed(scene)
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
            integrator=scene.integrator,
            spacing=least_spacing(body),
            time_step_factor=scene.time_step_factor,
        )

    @property
    def transit(self) -> float:
        """Transit time of a confined wave over a spacing, the unit of rates and steps [s]."""
        return self.spacing / self.material.wave_speed

    @property
    def deep_inside(self) -> Scheme:
        """As it is far from every surface, where a gradient may be simpler than its body's."""
        form = self.formulation
        if form.configuration is not Configuration.REFERENCE:
            return self
        return attrs.evolve(self, formulation=form.with_gradient(form.gradient.deep_inside))

    def depth(self, least_stretch: float = 1.0) -> int:
        """Layers around a particle within which the surface must not be."""
        # Two supports: forces from stresses, stresses from gradients. In the current configuration
        # volumes from the density of neighbours are a third, and compression adds neighbours.
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
        """Block of lattice around the origin, built.

        Args:
            dimension: 1, 2 or 3.
            layers: of particles on either side of the middle one, along each axis.
            boundaries: parts with the labels of their accounts; none by default.
            time_step_factor: as that of a scene.
            duration: in transits of a spacing, rounded up to whole steps.

        Raises:
            SceneError: there would be too many particles.
            BuildError: parts do not fit each other.
        """
        count = int(np.prod([2 * n + 1 for n in layers]))
        if count > _MOST_PARTICLES:
            raise SceneError(
                f"a block of {count} particles would be needed, more than {_MOST_PARTICLES}; "
                "take a smaller cover, a milder compression, or fewer dimensions"
            )
        lengths = [2.0 * n * self.spacing for n in layers]
        origin = [-0.5 * length for length in lengths]
        shape = {"type": "box", "lengths": lengths, "origin": origin}
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
    """State at rest in a uniform stretch along each axis."""
    return attrs.evolve(
        simulation.initial,
        positions=simulation.particles.positions * np.asarray(stretches),
        velocities=np.zeros_like(simulation.initial.velocities),
    )


def deformation(stretches: Sequence[float]) -> Array:
    """Deformation gradient F (d, d) of stretches along the axes."""
    return np.diag(np.asarray(stretches, dtype=np.float64))
