"""Quantities: what a probe can measure, by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from difflib import get_close_matches
from functools import cached_property
from typing import Any

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.interfaces.body import Body
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.terms import Observation
from solidsph.maths.arrays import Array
from solidsph.maths.tensors import largest_principal
from solidsph.probes.out_of_plane import check_whole_stress, whole_stress
from solidsph.probes.sampling import Sampling
from solidsph.probes.values import cauchy_stress

COMPONENTS = ("x", "y", "z")

MAGNITUDE = "magnitude"
"""The component of a vector that is its length."""


@attrs.frozen(eq=False, slots=False)
class Sampled:
    """An observation at the points of a sampling."""

    observation: Observation
    sampling: Sampling
    bodies: Sequence[Body]

    @property
    def displacements(self) -> Array:
        """u, (m, d) [m]."""
        return self.sampling.interpolated(self._particle_displacements)

    @property
    def positions(self) -> Array:
        """x = X + u, (m, d) [m]."""
        return self.sampling.points + self.displacements

    @property
    def velocities(self) -> Array:
        """v, (m, d) [m/s]."""
        return self.sampling.interpolated(
            self.observation.state.velocities[self.sampling.particles]
        )

    @property
    def deformation_gradients(self) -> Array:
        """F of the interpolated motion, (m, d, d) [-]."""
        identity = np.eye(self.sampling.points.shape[1])
        gradients = self.sampling.gradients(self._particle_displacements)
        return np.asarray(identity + gradients)

    @cached_property
    def stresses(self) -> Array:
        """Cauchy stress, (m, d, d) [Pa]."""
        return self.sampling.interpolated(cauchy_stress(self.observation, self.sampling.particles))

    @cached_property
    def whole_stresses(self) -> Array:
        """Cauchy stress with the components across a plane or a bar, (m, 3, 3) [Pa]."""
        if self.sampling.points.shape[1] == 3:
            return self.stresses
        chosen, seen = self.sampling.particles, self.observation
        whole = np.empty((len(chosen), 3, 3))
        for body in self.bodies:
            own = (chosen >= body.extent.start) & (chosen < body.extent.stop)
            rows = chosen[own] - body.extent.start
            F = seen.deformation_gradients[body.extent]
            whole[own] = whole_stress(body, F, rows, seen.state.memory)
        return self.sampling.interpolated(whole)

    @property
    def _particle_displacements(self) -> Array:
        chosen, seen = self.sampling.particles, self.observation
        x, X = seen.state.positions[chosen], seen.particles.positions[chosen]
        return np.asarray(x - X)


def _von_mises(sampled: Sampled) -> Array:
    """sqrt(3/2 s : s), s the deviator of the Cauchy stress, (m,)."""
    s = sampled.whole_stresses
    s = s - np.trace(s, axis1=1, axis2=2)[:, None, None] / 3.0 * np.eye(3)
    return np.asarray(np.sqrt(1.5 * np.einsum("mij,mij->m", s, s)))


def _pressure(sampled: Sampled) -> Array:
    """-tr(sigma) / 3, positive in compression, (m,)."""
    return np.asarray(-np.trace(sampled.whole_stresses, axis1=1, axis2=2) / 3.0)


@attrs.frozen
class Quantity:
    """Something that has a value at every point."""

    unit: str
    rank: int  # of the tensor that it is
    values: Callable[[Sampled], Array]  # (m, d, ...), as many times d as its rank
    symmetric: bool = False
    crosses_plane: bool = False  # it needs the stress across a plane or a bar
    is_gradient: bool = False

    def components(self, dimension: int) -> Mapping[str, tuple[int, ...]]:
        """Place of each component in the tensor, by name."""
        axes = range(dimension)
        if self.rank == 0:
            return {"": ()}
        if self.rank == 1:
            return {COMPONENTS[i]: (i,) for i in axes}
        pairs = [(i, k) for i in axes for k in axes if i <= k or not self.symmetric]
        return {COMPONENTS[i] + COMPONENTS[k]: (i, k) for i, k in pairs}


QUANTITIES: Mapping[str, Quantity] = {
    "displacement": Quantity("m", 1, lambda s: s.displacements),
    "position": Quantity("m", 1, lambda s: s.positions),
    "velocity": Quantity("m/s", 1, lambda s: s.velocities),
    "deformation-gradient": Quantity("-", 2, lambda s: s.deformation_gradients, is_gradient=True),
    "stress": Quantity("Pa", 2, lambda s: s.stresses, symmetric=True),
    "principal-stress": Quantity("Pa", 0, lambda s: largest_principal(s.stresses)),
    "von-mises": Quantity("Pa", 0, _von_mises, crosses_plane=True),
    "pressure": Quantity("Pa", 0, _pressure, crosses_plane=True),
}

RESULTANT = "resultant"
"""The quantity that is a force and its moment, and has no value at a point."""


@attrs.frozen
class Measure:
    """A quantity, or one component of it: "stress xy"."""

    name: str
    quantity: Quantity
    component: str | None  # all if None

    @classmethod
    def of(cls, text: str) -> Measure:
        """The measure of a name as in a scene.

        Raises:
            SceneError: there is no such quantity or component in any dimension.
        """
        name, _, component = text.partition(" ")
        quantity = QUANTITIES.get(name)
        if quantity is None:
            known = (*QUANTITIES, RESULTANT)
            near = get_close_matches(name, known, 1)
            hint = f"did you mean {near[0]!r}?" if near else f"known: {', '.join(known)}"
            raise SceneError(f"there is no quantity {name!r}; {hint}")
        measure = cls(name, quantity, component or None)
        measure.check_dimension(3)
        return measure

    def names(self, dimension: int) -> Sequence[str]:
        """Names of the numbers that it has at a point: "stress xx", "stress xy"."""
        found = self._components(dimension)
        return [f"{self.name} {component}".rstrip() for component in found]

    def check_dimension(self, dimension: int) -> None:
        """Raise SceneError if its component does not exist in this dimension."""
        if not self._components(dimension):
            known = [*self.quantity.components(dimension)]
            known += [MAGNITUDE] if self.quantity.rank == 1 else []
            has = f"it has {', '.join(known)}" if self.quantity.rank else "it is one number"
            raise SceneError(
                f"{self.name!r} has no component {self.component!r} in {dimension}D; {has}"
            )

    def check_single(self) -> None:
        """Raise SceneError unless it is one number at a point."""
        if self.quantity.rank and self.component is None:
            known = [*self.quantity.components(3)]
            raise SceneError(
                f"a maximum is of one number, and {self.name!r} has several; choose a component, "
                f"such as '{self.name} {known[0]}'"
                + (f" or '{self.name} {MAGNITUDE}'" if self.quantity.rank == 1 else "")
            )

    def check(self, model: DiscreteModel) -> None:
        """Raise SceneError if it does not exist in the model's dimension, or of its materials."""
        dimension = model.particles.dimension
        self.check_dimension(dimension)
        if self.quantity.crosses_plane and dimension < 3:
            for body in model.bodies:
                check_whole_stress(body, dimension)

    def values(self, sampled: Sampled) -> Array:
        """The numbers at every point, (m, k)."""
        values = self.quantity.values(sampled)
        if self.component == MAGNITUDE:
            return np.asarray(np.linalg.norm(values, axis=1, keepdims=True))
        places = self._components(sampled.sampling.points.shape[1]).values()
        components: Any = [np.moveaxis(values, 0, -1)[place] for place in places]
        return np.stack(components, axis=1)

    def _components(self, dimension: int) -> Mapping[str, tuple[int, ...]]:
        known = self.quantity.components(dimension)
        if self.component is None:
            return known
        if self.component == MAGNITUDE and self.quantity.rank == 1:
            return {MAGNITUDE: ()}
        return {name: place for name, place in known.items() if name == self.component}
