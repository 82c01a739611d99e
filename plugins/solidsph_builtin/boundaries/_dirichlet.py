"""What the three ways to impose a smoothed boundary value exactly have in common.

The paper's Dirichlet condition asks that the *approximation* <u> = W u takes the given value at
the boundary particles (eqs. 9 to 12). Free to be chosen are the values that the boundary
particles and the ghosts carry.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import final

import attrs
import numpy as np
from scipy.sparse import csc_array, csr_array
from scipy.sparse.linalg import SuperLU, splu

from solidsph.errors import SceneError
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.terms import GhostConstraint, Observation
from solidsph.maths.arrays import Array, Indices, Mask
from solidsph.model.fields import Component, VectorField
from solidsph.model.regions import Where
from solidsph_builtin.boundaries._images import reflected
from solidsph_builtin.boundaries._reports import COMPONENTS, reaction
from solidsph_builtin.boundaries.ghost_extension import chosen_ghosts


class Solve(ABC):
    """Values of boundary particles and ghosts that make the approximation right."""

    @abstractmethod
    def values(self, smooth: Array, interior: Array, target: Array) -> Array:
        """Values (b + g,) of boundary particles, then ghosts.

        Args:
            smooth: (b + g,) the targets at the boundary and their smooth extension to ghosts.
            interior: (b + g,) what all other particles contribute to the approximation there.
            target: (b,) what the approximation must be at the boundary.
        """

    @abstractmethod
    def transposed(self, forces: Array) -> tuple[Array, Array]:
        """Forces (b + g,) on the values, carried back to `smooth` and to `interior`."""


class Extension(ABC):
    """A smooth extension of the field to the ghosts, which the solve starts from."""

    @abstractmethod
    def values(self, axis: int, time: float, derivative: int, column: Array, step: float) -> Array:
        """Values at the ghosts (g,) from those of all particles (n,)."""

    @abstractmethod
    def transposed(self, forces: Array) -> Array | float:
        """Forces (g,) on the ghosts, carried back to the particles that they follow, (n,)."""


@final
@attrs.frozen(eq=False)
class ReflectedExtension(Extension):
    """Point reflection of the field at the surface."""

    matrix: csr_array  # (g, n)

    def values(self, axis: int, time: float, derivative: int, column: Array, step: float) -> Array:
        reflection: Array = self.matrix @ column
        return reflection

    def transposed(self, forces: Array) -> Array | float:
        carried: Array = self.matrix.T @ forces
        return carried


@final
@attrs.frozen(eq=False)
class KnownExtension(Extension):
    """A field that is known beyond the surface too."""

    positions: Array  # (g, d)
    field: VectorField

    def values(self, axis: int, time: float, derivative: int, column: Array, step: float) -> Array:
        return self.field.derivative(axis, self.positions, time, derivative, step)

    def transposed(self, forces: Array) -> Array | float:
        return 0.0


@final
@attrs.frozen(eq=False)
class SmoothedValue(GhostConstraint):
    """<u> = field(X, t) at the boundary particles.

    Components that the field does not have are reflected at the ghosts, and left free at the
    boundary.
    """

    label: str
    positions: Array  # (n, d) reference positions of all particles
    boundary: Indices  # (b,)
    ghosts: Indices  # (g,)
    field: VectorField
    smoothing: csr_array  # (b + g, n) rows of W
    extension: Extension  # smooth, of boundary values to ghosts
    reflection: csr_array  # (g, n), for components that are not imposed
    solve: Solve

    @property
    def _chosen(self) -> Indices:
        return np.concatenate([self.boundary, self.ghosts])

    @property
    def held(self) -> Mask:
        held = np.zeros(self.positions.shape, dtype=np.bool_)
        for axis in self.field.components:
            held[self._chosen, axis] = True
        held[self.ghosts] = True
        return held

    def _free_axes(self) -> list[int]:
        return [k for k in range(self.positions.shape[1]) if k not in self.field.components]

    def impose(self, time: float, derivative: int, values: Array, step: float = 0.0) -> None:
        for axis in self._free_axes():
            values[self.ghosts, axis] = self.reflection @ values[:, axis]
        for axis in self.field.components:
            target = self.field.derivative(
                axis, self.positions[self.boundary], time, derivative, step
            )
            column = values[:, axis]
            column[self.boundary] = target
            column[self.ghosts] = self.extension.values(axis, time, derivative, column, step)
            smooth = column[self._chosen]
            column[self._chosen] = 0.0
            interior = self.smoothing @ column
            column[self._chosen] = self.solve.values(smooth, interior, target)

    def return_forces(self, forces: Array) -> None:
        for axis in self._free_axes():
            forces[:, axis] += self.reflection.T @ forces[self.ghosts, axis]
        boundary_count = len(self.boundary)
        for axis in self.field.components:
            column = forces[:, axis]
            # Only what acts on ghosts goes back; boundary particles have a reaction of their own.
            on_ghosts = np.zeros(len(self._chosen))
            on_ghosts[boundary_count:] = column[self.ghosts]
            smooth, interior = self.solve.transposed(on_ghosts)
            carried = self.smoothing.T @ interior
            carried += self.extension.transposed(smooth[boundary_count:])
            carried[self._chosen] = 0.0  # what falls on imposed values is held
            column += carried
        forces[self.ghosts] = 0.0

    def miss(self, observation: Observation) -> float:
        """Largest difference between the approximation at the boundary and what was asked [m]."""
        state = observation.state
        u = state.positions - self.positions
        approximation = (self.smoothing @ u)[: len(self.boundary)]
        X = self.positions[self.boundary]
        return max(
            float(np.max(np.abs(approximation[:, axis] - self.field.values(axis, X, state.time))))
            for axis in self.field.components
        )

    def report(self, observation: Observation) -> Mapping[str, float]:
        return {
            **reaction(observation, self.label),
            f"{self.label} miss [m]": self.miss(observation),
        }


def smoothed_value(
    model: DiscreteModel,
    label: str,
    *,
    where: Where,
    ghosts: Where,
    displacement: Mapping[str, Component],
    extension: Mapping[str, Component] | None,
    handler: str,
    solve: Callable[[csr_array, int], Solve],
) -> SmoothedValue:
    """Bind one of the handlers; `solve` is given the rows and columns of W of boundary and ghosts.

    Raises:
        SceneError: nothing matches, or the equations of this solve have no unique solution.
    """
    field = VectorField.of(displacement, f"{handler}: displacement", end=model.end)
    field.check_dimension(model.particles.dimension, handler)
    boundary = model.select(where)
    if model.particles.ghosts[boundary].any():
        raise SceneError(f"{handler}: where = {where!r} matches ghosts; name them under `ghosts`")
    own_ghosts = chosen_ghosts(model, ghosts, handler)
    chosen = np.concatenate([boundary, own_ghosts])
    smoothing = csr_array(model.smoothing_matrix()[chosen])
    return SmoothedValue(
        label=label,
        positions=model.particles.positions,
        boundary=boundary,
        ghosts=own_ghosts,
        field=field,
        smoothing=smoothing,
        extension=_extension(model, own_ghosts, extension, field, handler),
        reflection=reflected(model.particles, own_ghosts),
        solve=solve(csr_array(smoothing[:, chosen]), len(boundary)),
    )


def _extension(
    model: DiscreteModel,
    ghosts: Indices,
    known: Mapping[str, Component] | None,
    field: VectorField,
    handler: str,
) -> Extension:
    if known is None:
        return ReflectedExtension(reflected(model.particles, ghosts))
    beyond = VectorField.of(known, f"{handler}: extension", end=model.end)
    missing = set(field.components) - set(beyond.components)
    if missing:
        raise SceneError(
            f"{handler}: extension lacks component {COMPONENTS[min(missing)]!r}; give every "
            "component that displacement has"
        )
    return KnownExtension(model.particles.positions[ghosts], beyond)


def solved_transposed(factors: SuperLU, right: Array) -> Array:
    """The solution x of A^T x = right, from the factors of A."""
    # The stubs of SciPy do not know of `trans`.
    solution: Array = factors.solve(right, trans="T")  # type: ignore[call-overload]
    return solution


def factorised(matrix: csr_array, handler: str) -> SuperLU:
    """LU factors of a square sparse matrix; SceneError if it is singular."""
    try:
        return splu(csc_array(matrix))
    except RuntimeError:
        raise SceneError(
            f"{handler}: the approximation at the {matrix.shape[0]} chosen particles does not "
            "determine their values; choose fewer ghosts, or a smaller cover"
        ) from None
