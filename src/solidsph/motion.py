"""Fields of position and time as a scene states them: displacements, tractions, velocities."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any, TypeAlias

import attrs
import numpy as np

from solidsph.arrays import Array
from solidsph.errors import SceneError
from solidsph.expressions import Expression
from solidsph.where import AXES

Component: TypeAlias = float | str | Callable[[Array, float], Array]
"""A number, a formula of X, Y, Z and t, or in Python a function of positions (k, d) and time."""

_COMPONENT_NAMES = ("x", "y", "z")

# Weights of the values at t + k step, by k, for first and second derivatives.
_CENTRED = {1: {-1: -0.5, 1: 0.5}, 2: {-1: 1.0, 0: -2.0, 1: 1.0}}
_AT_START = {1: {0: -1.5, 1: 2.0, 2: -0.5}, 2: {0: 2.0, 1: -5.0, 2: 4.0, 3: -1.0}}


@attrs.frozen
class VectorField:
    """Some components of a vector as functions of position and time; the others are left alone."""

    components: Mapping[int, Component]

    @classmethod
    def of(cls, table: Mapping[str, Component], what: str) -> VectorField:
        """From a scene's table such as {x = "0.1*t", y = 0}.

        Raises:
            SceneError: an unknown component, or a formula that cannot be read.
        """
        if not isinstance(table, Mapping) or not table:
            raise SceneError(
                f'{what} must be a table of components such as {{x = "0.1*X"}}, got {table!r}'
            )
        components: dict[int, Component] = {}
        for name, value in table.items():
            if name not in _COMPONENT_NAMES:
                raise SceneError(f"{what}: unknown component {name!r}; expected x, y or z")
            components[_COMPONENT_NAMES.index(name)] = _checked(value, f"{what}.{name}")
        return cls(components)

    def check_dimension(self, dimension: int, what: str) -> None:
        """Raise SceneError if a component or a variable does not exist in this dimension."""
        for axis in self.components:
            if axis >= dimension:
                raise SceneError(
                    f"{what}: component {_COMPONENT_NAMES[axis]!r} in a {dimension}D scene; "
                    "leave it out"
                )

    def values(self, axis: int, positions: Array, time: float) -> Array:
        """The component along `axis` at `positions` (k, d) and `time` [s], (k,).

        Raises:
            SceneError: a value is not a finite number.
        """
        component = self.components[axis]
        if isinstance(component, str):
            variables: dict[str, Any] = {
                name: positions[:, k] for k, name in enumerate(AXES[: positions.shape[1]])
            }
            expression = _parsed(component, (*variables, "t"))
            result = expression({**variables, "t": time})
        elif callable(component):
            result = component(positions, time)
        else:
            result = component
        spread = np.broadcast_to(np.asarray(result, dtype=np.float64), (len(positions),))
        if not np.all(np.isfinite(spread)):
            bad = int(np.flatnonzero(~np.isfinite(spread))[0])
            raise SceneError(
                f"{component!r} is {spread[bad]} at X = {positions[bad].tolist()}, "
                f"t = {time:.6g} s; it must be finite everywhere it is used"
            )
        return spread

    def derivative(
        self, axis: int, positions: Array, time: float, order: int, step: float
    ) -> Array:
        """Time derivative of order 0, 1 or 2 of a component, by second order differences.

        Differences over the time `step` [s] of the run are what the integrators see: a kink in
        the motion, such as the end of a ramp, becomes the impulse that the step delivers, and the
        work of the reaction stays right. Before t = 0 the formula is never asked.
        """
        if order == 0:
            return self.values(axis, positions, time)
        component = self.components[axis]
        if not isinstance(component, str) and not callable(component):
            return np.zeros(len(positions))
        weights = _CENTRED[order] if time >= step * (1.0 - 1e-9) else _AT_START[order]
        terms = [
            weight * self.values(axis, positions, max(0.0, time + k * step))
            for k, weight in weights.items()
        ]
        derivative: Array = np.sum(terms, axis=0) / step**order
        return derivative


@cache
def _parsed(text: str, variables: tuple[str, ...]) -> Expression:
    """A formula is asked at every step, and parsed once."""
    return Expression.parse(text, variables)


def _checked(value: Component, what: str) -> Component:
    if isinstance(value, bool) or not (isinstance(value, (int, float, str)) or callable(value)):
        raise SceneError(f"{what}: expected a number or a formula, got {value!r}")
    if isinstance(value, str):
        Expression.parse(value, [*AXES, "t"])
    elif isinstance(value, (int, float)) and not np.isfinite(value):
        raise SceneError(f"{what}: expected a finite number, got {value!r}")
    return value
