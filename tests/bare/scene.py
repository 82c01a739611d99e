"""A bare scene: shape, spacing, material, loads and holds as a user writes them, and no more."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any, final

import attrs
import numpy as np

from solidsph import Simulation
from solidsph.interfaces.terms import Observation
from solidsph.maths.arrays import Array
from solidsph.results.output_fields import stress
from solidsph.run.hooks import implementation
from solidsph.scene.scene_builder import SceneBuilder


@final
@attrs.frozen
class Bare:
    """A scene at several spacings, its relative errors, and how large they may be.

    `measure` takes the particles across the body, both surfaces included: the spacing is the
    thickness over one less, unless the scene says otherwise.
    """

    name: str
    source: str  # of the reference
    measure: Callable[[int], Mapping[str, float]]  # relative errors by name
    bars: Mapping[str, Mapping[int, float]]  # by error and particles across, the largest that pass
    across: Sequence[int]  # from coarse to fine
    unordered: Collection[str] = ()  # errors with a bar that need not fall with every refinement
    floor: float = 2e-4  # errors below it need not fall: the reference's own, and the reading's

    def __attrs_post_init__(self) -> None:
        assert list(self.across) == sorted(set(self.across)), self.name
        assert all(set(bars) <= set(self.across) for bars in self.bars.values()), self.name


def body(
    shape: Mapping[str, Any], spacing: float, material: Mapping[str, Any], title: str = "bare"
) -> SceneBuilder:
    """A scene with one body, of which nothing of the scheme is said."""
    builder = Simulation.builder().title(title).body("body", shape=shape, spacing=spacing)
    return builder.material(material)


def elastic(
    law: str, youngs_modulus: float, poissons_ratio: float, density: float = 1.0
) -> Mapping[str, Any]:
    """A material by its engineering constants."""
    return {
        "type": law,
        "youngs_modulus": youngs_modulus,
        "poissons_ratio": poissons_ratio,
        "density": density,
    }


@final
@attrs.frozen(eq=False)
class Fields:
    """A body at one time, at rest or in motion, and where its particles were."""

    observation: Observation
    u: Array  # displacements (n, d) [m]
    sigma: Array  # Cauchy stresses (n, d, d) [Pa]

    @classmethod
    def of(cls, observation: Observation) -> Fields:
        """What there is to read of an observation."""
        u = observation.state.positions - observation.particles.positions
        return cls(observation, u, stress(observation))

    @property
    def places(self) -> Array:
        """Reference positions, (n, d) [m]."""
        return self.observation.particles.positions

    @property
    def spacing(self) -> float:
        """Of the particles [m]."""
        return float(self.observation.particles.spacings.max())

    @property
    def pressure(self) -> Array:
        """Of every particle; in the plane the mean stress of its two axes, (n,) [Pa]."""
        return -np.trace(self.sigma, axis1=1, axis2=2) / self.places.shape[1]


def at_rest(builder: SceneBuilder) -> Fields:
    """The equilibrium of a scene under its loads."""
    simulation = builder.duration(1.0).statics().build()
    return Fields.of(simulation.dynamics.observe(simulation.run().state))


def histories(
    builder: SceneBuilder, duration: float, outputs: int, read: Callable[[Fields], float | Array]
) -> tuple[Array, Array]:
    """Times (t,) of the outputs of a motion, and what is read of each, (t, ...)."""
    times, values = [], []

    class Reader:
        @implementation
        def solidsph_step_end(self, simulation: Simulation, observation: Observation) -> None:
            times.append(observation.state.time)
            values.append(read(Fields.of(observation)))

    builder.duration(duration).outputs(outputs).build().run(observers=[Reader()])
    return np.array(times), np.array(values)
