"""Fields of position and time as a scene states them: displacements, tractions, velocities."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from functools import cache
from math import inf, isfinite
from typing import TypeAlias

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.maths.arrays import Array
from solidsph.maths.formulas import Expression, names_in
from solidsph.model.regions import AXES

Component: TypeAlias = float | str | Callable[[Array, float], Array]
"""A number, a formula of X, Y, Z and t, or in Python a function of positions (k, d) and time."""

_COMPONENT_NAMES = ("x", "y", "z")

# Weights of the values at t + k step, by k, for first and second derivatives.
_CENTRED = {1: {-1: -0.5, 1: 0.5}, 2: {-1: 1.0, 0: -2.0, 1: 1.0}}
_AT_START = {1: {0: -1.5, 1: 2.0, 2: -0.5}, 2: {0: 2.0, 1: -5.0, 2: 4.0, 3: -1.0}}
_AT_END = {n: {-k: (-1) ** n * w for k, w in _AT_START[n].items()} for n in _AT_START}

# Rounding of a time, a sum of steps, in steps.
_ROUNDING = 1e-3

# Rounding of a time, relative to it.
_OF_TIMES = 1e-9


@attrs.frozen
class VectorField:
    """Some components of a vector as functions of position and time; the others are not set.

    Components are not evaluated before time 0, and beyond the `end` of the duration only in a run
    that has been extended, up to the time that it has reached: they may have no value there.
    """

    components: Mapping[int, Component]
    end: float = inf  # of the duration [s]
    what: str = ""  # name of the field, with which a message begins

    @classmethod
    def of(cls, table: Mapping[str, Component], what: str, *, end: float = inf) -> VectorField:
        """The field of a table such as {x = "0.1*t", y = 0}, in a scene up to `end` [s].

        Raises:
            SceneError: unknown components, or formulas that cannot be read; names all of them.
        """
        if not isinstance(table, Mapping) or not table:
            raise SceneError(
                f'{what} must be a table of components such as {{x = "0.1*X"}}, got {table!r}'
            )
        components: dict[int, Component] = {}
        wrong: list[str] = []
        for name, value in table.items():
            if name not in _COMPONENT_NAMES:
                wrong.append(f"{what}: unknown component {name!r}; expected x, y or z")
                continue
            try:
                components[_COMPONENT_NAMES.index(name)] = _checked(value, f"{what}.{name}")
            except SceneError as cause:
                wrong.append(str(cause))
        if wrong:
            raise SceneError("; ".join(wrong))
        return cls(components, end, what)

    def check_without(self, names: Collection[str], why: str) -> None:
        """Raise SceneError if a formula uses one of the variables `names`, for the reason `why`."""
        for axis, component in self.components.items():
            used = names_in(component) & set(names) if isinstance(component, str) else ()
            for name in sorted(used):
                raise SceneError(
                    f"{self.what}: {_COMPONENT_NAMES[axis]} = {component!r} uses {name}, but {why}"
                )

    def check_dimension(self, dimension: int, what: str) -> None:
        """Raise SceneError if a component or a variable does not exist in this dimension."""
        for axis in self.components:
            if axis >= dimension:
                raise SceneError(
                    f"{what}: component {_COMPONENT_NAMES[axis]!r} in a {dimension}D scene; "
                    "leave it out"
                )

    def varies(self, axis: int) -> bool:
        """True if the component along `axis` may change in time."""
        component = self.components[axis]
        if isinstance(component, str):
            return "t" in names_in(component)
        return callable(component)

    def schedule(self, axis: int, positions: Array, times: Array) -> Array:
        """The component along `axis` at `positions` (k, d) and `times` (t,) [s], (t, k), or (1, k)
        if it does not vary.

        Raises:
            SceneError: a value is not a finite number.
        """
        component, count = self.components[axis], len(positions)
        if not self.varies(axis):
            times = times[:1]
        times = self._asked(times)
        if callable(component):
            values = np.stack([_spread(component(positions, float(t)), count) for t in times])
        elif isinstance(component, str):
            variables = {name: positions[:, k] for k, name in enumerate(AXES[: positions.shape[1]])}
            expression = _parsed(component, (*variables, "t"))
            result = expression({**variables, "t": times[:, None]})
            values = np.broadcast_to(np.asarray(result, dtype=np.float64), (len(times), count))
        else:
            values = np.full((1, count), float(component))
        if not np.all(np.isfinite(values)):
            row, bad = (int(k) for k in np.argwhere(~np.isfinite(values))[0])
            whose = f"{self.what}: " if self.what else ""
            raise SceneError(
                f"{whose}{component!r} is {values[row, bad]} at X = {positions[bad].tolist()}, "
                f"t = {times[row]:.6g} s; it must be finite everywhere it is used"
            )
        return values

    def values(self, axis: int, positions: Array, time: float) -> Array:
        """The component along `axis` at one time [s], (k,)."""
        return np.asarray(self.schedule(axis, positions, np.array([time]))[0])

    def derivative_schedule(
        self, axis: int, positions: Array, times: Array, order: int, step: float
    ) -> Array:
        """Time derivative of order 0, 1 or 2 of a component, by second order differences, (t, k);
        (1, k) if it does not vary.

        Differences are over the time `step` [s] of the run, as the integrators need: a kink in the
        motion, such as the end of a ramp, becomes the impulse that the step delivers, and the work
        of the reaction is right. They are one-sided at the start, and from the end of the duration
        on, where they look back whether or not the run is extended: so its records do not change.
        """
        if order == 0:
            return self.schedule(axis, positions, times)
        if not self.varies(axis):
            return np.zeros((1, len(positions)))
        step = min(step, self.end / 4.0)  # the differences of a shorter run need smaller steps
        times = self._asked(times)
        at_start = times < step * (1.0 - _ROUNDING)
        at_end = times > self.end - step * (1.0 - _ROUNDING)
        # A time that is one step from the end, up to rounding, must not look beyond it.
        inside = np.clip(times, step, self.end - step)
        derivative = np.empty((len(times), len(positions)))
        for chosen, near, weights in (
            (~at_start & ~at_end, inside, _CENTRED[order]),
            (at_start, times, _AT_START[order]),
            (at_end, times, _AT_END[order]),
        ):
            if chosen.any():
                terms = [
                    weight * self.schedule(axis, positions, near[chosen] + k * step)
                    for k, weight in weights.items()
                ]
                derivative[chosen] = np.sum(terms, axis=0) / step**order
        return derivative

    def _asked(self, times: Array) -> Array:
        """Times (t,) at which components are evaluated: without what rounding adds to the end."""
        rounded = times <= self.end * (1.0 + _OF_TIMES)
        return np.asarray(np.maximum(np.where(rounded, np.minimum(times, self.end), times), 0.0))

    def derivative(
        self, axis: int, positions: Array, time: float, order: int, step: float
    ) -> Array:
        """Time derivative of a component at one time, (k,)."""
        times = np.array([time])
        return np.asarray(self.derivative_schedule(axis, positions, times, order, step)[0])


def scheduled_forces(field: VectorField, positions: Array, amounts: Array, times: Array) -> Array:
    """Forces `amounts` (k,) times the field at `positions` (k, d) and `times` (t,), (t, k, d);
    (1, k, d) if no component varies."""
    columns = {axis: field.schedule(axis, positions, times) for axis in field.components}
    rows = max(map(len, columns.values()), default=1)
    forces = np.zeros((rows, *positions.shape))
    for axis, column in columns.items():
        forces[:, :, axis] = amounts * column
    return forces


def _spread(result: object, count: int) -> Array:
    return np.broadcast_to(np.asarray(result, dtype=np.float64), (count,))


@cache
def _parsed(text: str, variables: tuple[str, ...]) -> Expression:
    """A formula, which is evaluated at every step, and parsed once."""
    return Expression.parse(text, variables)


def _checked(value: Component, what: str) -> Component:
    if isinstance(value, bool) or not (isinstance(value, (int, float, str)) or callable(value)):
        raise SceneError(f"{what}: expected a number or a formula, got {value!r}")
    if isinstance(value, str):
        Expression.parse(value, [*AXES, "t"])
    elif isinstance(value, (int, float)) and not _is_finite(value):
        raise SceneError(f"{what}: expected a finite number, got {value!r}")
    return value


def _is_finite(value: float) -> bool:
    try:
        return isfinite(value)
    except OverflowError:  # an integer of hundreds of digits
        return False
