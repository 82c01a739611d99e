"""A smoothed boundary value, which three handlers impose in different ways.

In the paper's Dirichlet condition the *approximation* <u> = W u takes the given value at the
boundary particles (eqs. 9 to 12). The unknowns are the values of the boundary particles and of the
ghosts.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import Protocol, final

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


class Dirichlet(Protocol):
    """A handler that imposes a smoothed boundary value."""

    @property
    def where(self) -> Where: ...  # boundary particles
    @property
    def displacement(self) -> Mapping[str, Component]: ...  # [m]
    @property
    def ghosts(self) -> Where: ...  # those that may change with them
    @property
    def extension(self) -> Mapping[str, Component] | None: ...  # at ghosts, if known [m]


class Solve(ABC):
    """Values of boundary particles and ghosts that satisfy the condition."""

    @abstractmethod
    def values(self, smooth: Array, interior: Array, target: Array) -> Array:
        """Values (b + g,) of boundary particles, then ghosts.

        Args:
            smooth: (b + g,) the targets at the boundary and their smooth extension to ghosts.
            interior: (b + g,) contributions of all other particles to the approximation there.
            target: (b,) required approximation at the boundary.
        """

    @abstractmethod
    def transposed(self, forces: Array) -> tuple[Array, Array]:
        """Forces on `smooth` and on `interior`, from forces (b + g,) on the values."""


@final
@attrs.frozen(eq=False)
class SmoothedValue(GhostConstraint):
    """<u> = field(X, t) at the boundary particles.

    Components that the field does not have are free at the boundary, and reflected at the ghosts.
    """

    label: str
    positions: Array  # (n, d) reference positions of all particles
    boundary: Indices  # (b,)
    ghosts: Indices  # (g,)
    field: VectorField
    smoothing: csr_array  # (b + g, n) rows of W
    extension: VectorField | None  # of the field to the ghosts, if known; otherwise reflected
    reflection: csr_array  # (g, n)
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
            column[self.ghosts] = self._extended(axis, time, derivative, column, step)
            smooth = column[self._chosen]
            column[self._chosen] = 0.0
            interior = self.smoothing @ column
            column[self._chosen] = self.solve.values(smooth, interior, target)

    def _extended(
        self, axis: int, time: float, derivative: int, column: Array, step: float
    ) -> Array:
        """Smooth values at the ghosts (g,), which the solve starts from."""
        if self.extension is None:
            reflection: Array = self.reflection @ column
            return reflection
        X = self.positions[self.ghosts]
        return self.extension.derivative(axis, X, time, derivative, step)

    def return_forces(self, forces: Array) -> None:
        for axis in self._free_axes():
            forces[:, axis] += self.reflection.T @ forces[self.ghosts, axis]
        boundary_count = len(self.boundary)
        for axis in self.field.components:
            column = forces[:, axis]
            # Only forces on ghosts are returned; boundary particles have a reaction of their own.
            on_ghosts = np.zeros(len(self._chosen))
            on_ghosts[boundary_count:] = column[self.ghosts]
            smooth, interior = self.solve.transposed(on_ghosts)
            carried = self.smoothing.T @ interior
            if self.extension is None:
                carried += self.reflection.T @ smooth[boundary_count:]
            carried[self._chosen] = 0.0  # forces on imposed values have no effect
            column += carried
        forces[self.ghosts] = 0.0

    def miss(self, observation: Observation) -> float:
        """Largest error of the approximation at the boundary [m]."""
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
    handler: Dirichlet,
    name: str,
    solve: Callable[[csr_array, int], Solve],
    model: DiscreteModel,
    label: str,
) -> SmoothedValue:
    """Bind a handler, which is called `name` in messages.

    `solve` is given the rows and columns of W of boundary particles and ghosts, and the number of
    boundary particles.

    Raises:
        SceneError: nothing matches, or the equations of this solve have no unique solution.
    """
    field = VectorField.of(handler.displacement, f"{name}: displacement", end=model.end)
    field.check_dimension(model.particles.dimension, name)
    boundary = model.select(handler.where)
    if model.particles.ghosts[boundary].any():
        raise SceneError(
            f"{name}: where = {handler.where!r} matches ghosts; name them under `ghosts`"
        )
    ghosts = chosen_ghosts(model, handler.ghosts, name)
    chosen = np.concatenate([boundary, ghosts])
    smoothing = csr_array(model.smoothing_matrix()[chosen])
    return SmoothedValue(
        label=label,
        positions=model.particles.positions,
        boundary=boundary,
        ghosts=ghosts,
        field=field,
        smoothing=smoothing,
        extension=_extension(handler, name, field, model.end),
        reflection=reflected(model.particles, ghosts),
        solve=solve(csr_array(smoothing[:, chosen]), len(boundary)),
    )


def _extension(handler: Dirichlet, name: str, field: VectorField, end: float) -> VectorField | None:
    if handler.extension is None:
        return None
    extension = VectorField.of(handler.extension, f"{name}: extension", end=end)
    missing = set(field.components) - set(extension.components)
    if missing:
        raise SceneError(
            f"{name}: extension lacks component {COMPONENTS[min(missing)]!r}; give every "
            "component that displacement has"
        )
    return extension


def solved_transposed(factors: SuperLU, right: Array) -> Array:
    """The solution x of A^T x = right, from the factors of A."""
    # SciPy's type stubs lack `trans`.
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
