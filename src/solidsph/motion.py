"""Fields of position and time as a scene states them: displacements, tractions, velocities."""

from __future__ import annotations

from collections.abc import Callable, Mapping
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

# Step of a time derivative relative to the time scale given: balances the error of the fourth
# order formula, step^4, against rounding, 1e-16 / step^2 for second derivatives.
_RELATIVE_STEP = 2e-3


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
            expression = Expression.parse(component, [*variables, "t"])
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
        self, axis: int, positions: Array, time: float, order: int, time_scale: float
    ) -> Array:
        """Time derivative of order 0, 1 or 2 of a component, by fourth order differences."""
        if order == 0:
            return self.values(axis, positions, time)
        component = self.components[axis]
        if not isinstance(component, str) and not callable(component):
            return np.zeros(len(positions))
        h = _RELATIVE_STEP * time_scale
        f = [self.values(axis, positions, time + k * h) for k in (-2, -1, 0, 1, 2)]
        if order == 1:
            return (f[0] - 8.0 * f[1] + 8.0 * f[3] - f[4]) / (12.0 * h)
        return (-f[0] + 16.0 * f[1] - 30.0 * f[2] + 16.0 * f[3] - f[4]) / (12.0 * h * h)


def _checked(value: Component, what: str) -> Component:
    if isinstance(value, bool) or not (isinstance(value, (int, float, str)) or callable(value)):
        raise SceneError(f"{what}: expected a number or a formula, got {value!r}")
    if isinstance(value, str):
        Expression.parse(value, [*AXES, "t"])
    elif isinstance(value, (int, float)) and not np.isfinite(value):
        raise SceneError(f"{what}: expected a finite number, got {value!r}")
    return value
