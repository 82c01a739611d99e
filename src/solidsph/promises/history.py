"""What every material that remembers must keep, along a path of deformation that turns back."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps

import numpy as np

from solidsph.interfaces.history import History, HistoryMaterial
from solidsph.interfaces.material import Material
from solidsph.maths.arrays import Array
from solidsph.maths.tensors import particles_first
from solidsph.promises.check import Check, Verdict, at_most, check, more_than, not_promised
from solidsph.promises.samples import ANGLES, central_difference, random_rotation, rotation, seeded

_COUNT = 8  # paths in each dimension
_STEPS = 200
_LARGEST = 0.15  # displacement gradient, far beyond what any metal takes elastically

# Durations of a path [s], since nothing is known of the times that a law has.
_DURATIONS = (1e-5, 1e-2, 10.0)

_ROUNDING = 1e-12
# Scalar equations within an update may be solved to less than rounding.
_SOLVED = 1e-9

_DIFFERENCE_STEP, _DIFFERENCE_TOLERANCE = 2e-3, 1e-10

# The trapezoidal rule, on a path of 200 steps through a kink of the law.
_BALANCE = 2e-3


def _of_history(measure: Callable[[HistoryMaterial], Verdict]) -> Check:
    """A check of materials that remember; no other promises it."""

    @wraps(measure)
    def asked(material: Material) -> Verdict:
        if not isinstance(material, HistoryMaterial):
            return not_promised("the law remembers nothing")
        return measure(material)

    return check(asked)


class _Path:
    """Deformation gradients (d, d, n) that grow, turn back and go beyond where they began."""

    def __init__(self, dimension: int, rng: np.random.Generator) -> None:
        self.dimension = dimension
        self._direction = rng.normal(size=(dimension, dimension, _COUNT))
        self._direction /= np.linalg.norm(self._direction, axis=(0, 1))
        self._other = rng.normal(size=(dimension, dimension, _COUNT))
        self._other /= np.linalg.norm(self._other, axis=(0, 1))

    def at(self, t: float) -> Array:
        """F at 0 <= t <= 1."""
        size = _LARGEST * np.sin(1.5 * np.pi * t), 0.4 * _LARGEST * t
        H = size[0] * self._direction + size[1] * self._other
        return np.asarray(np.eye(self.dimension)[:, :, None] + H)


class _Follower:
    """A material that is led along a path."""

    def __init__(self, material: HistoryMaterial, dimension: int, count: int = _COUNT) -> None:
        self.material = material
        start = material.initial_history(dimension).values()
        self.history: History = tuple(np.full(count, value) for value in start)

    def lead(self, F: Array, step: float) -> None:
        self.history = tuple(
            np.broadcast_to(one, F.shape[2:])
            for one in self.material.advance(F, self.history, step, self.material.params)
        )

    def stress(self, F: Array) -> Array:
        found = self.material.stress(F, self.history, self.material.params)
        return np.moveaxis(particles_first(found, F.shape[2]), 0, -1)

    def stored(self, F: Array) -> Array:
        found = self.material.stored(F, self.history, self.material.params)
        return np.broadcast_to(np.asarray(found, dtype=np.float64), F.shape[2:])

    @property
    def dissipated(self) -> Array:
        return np.asarray(self.material.dissipated(self.history), dtype=np.float64)


def _led(material: HistoryMaterial, path: _Path, duration: float, steps: int) -> _Follower:
    """One at the end of a path."""
    follower = _Follower(material, path.dimension)
    for k in range(1, steps + 1):
        follower.lead(path.at(k / steps), duration / steps)
    return follower


@_of_history
def virgin_state(material: HistoryMaterial) -> Verdict:
    """At the initial history stress and stored energy are those of `first_piola` and `energy`, and
    nothing is dissipated."""
    errors = []
    for d, rng in seeded():
        follower, F = _Follower(material, d), _Path(d, rng).at(0.2)
        P = np.moveaxis(particles_first(material.first_piola(F, material.params), _COUNT), 0, -1)
        errors += [
            np.abs(follower.stress(F) - P).max(),
            np.abs(follower.stored(F) - material.energy(F, material.params)).max(),
            np.abs(follower.dissipated).max(),
        ]
    return at_most(max(errors) / _stiffness(material), _ROUNDING)


@_of_history
def stress_with_history(material: HistoryMaterial) -> Verdict:
    """The stress is the derivative of the stored energy by F, the history held."""
    errors = []
    for d, rng in seeded():
        path = _Path(d, rng)
        for duration in _DURATIONS:
            follower = _led(material, path, duration, 20)
            F, dF = path.at(0.9), rng.normal(size=(d, d, _COUNT))
            power = np.einsum("ijn,ijn->n", follower.stress(F), dF)
            found = central_difference(follower.stored, F, dF, _DIFFERENCE_STEP)
            errors.append(np.abs(found - power).max())
    return at_most(max(errors) / _stiffness(material), _DIFFERENCE_TOLERANCE)


@_of_history
def dissipation(material: HistoryMaterial) -> Verdict:
    """What is dissipated never grows less."""
    worst = -np.inf
    for d, rng in seeded():
        path = _Path(d, rng)
        for duration in _DURATIONS:
            follower = _Follower(material, d)
            for k in range(1, _STEPS + 1):
                before = follower.dissipated
                follower.lead(path.at(k / _STEPS), duration / _STEPS)
                worst = max(worst, float((before - follower.dissipated).max()))
    return at_most(worst / _stiffness(material), _ROUNDING)


@_of_history
def energy_balance(material: HistoryMaterial) -> Verdict:
    """The work of the stress along a path is what is stored and what is dissipated."""
    worst = 0.0
    for d, rng in seeded():
        path = _Path(d, rng)
        for duration in _DURATIONS:
            follower = _Follower(material, d)
            F, work = path.at(0.0), np.zeros(_COUNT)
            P, largest = follower.stress(F), np.zeros(_COUNT)
            for k in range(1, _STEPS + 1):
                F_before, P_before, F = F, P, path.at(k / _STEPS)
                follower.lead(F, duration / _STEPS)
                P = follower.stress(F)
                work += 0.5 * np.einsum("ijn,ijn->n", P_before + P, F - F_before)
                largest = np.maximum(largest, np.abs(work))
            missing = np.abs(work - follower.stored(F) - follower.dissipated)
            worst = max(worst, float((missing / largest).max()))
    return at_most(worst, _BALANCE)


@_of_history
def objectivity_of_history(material: HistoryMaterial) -> Verdict:
    """Turning all the while changes neither energies nor what is dissipated, and turns the
    stress."""
    errors = []
    for d, rng in seeded():
        path, end = _Path(d, rng), random_rotation(rng, d)
        for duration in _DURATIONS:
            still, turning = _Follower(material, d), _Follower(material, d)
            Q = np.eye(d)
            for k in range(1, 41):
                F = path.at(k / 40)
                Q = rotation(d, [0.1 * k] * ANGLES[d]) @ end
                still.lead(F, duration / 40)
                turning.lead(np.einsum("ij,jkn->ikn", Q, F), duration / 40)
            QF, QP = (np.einsum("ij,jkn->ikn", Q, one) for one in (F, still.stress(F)))
            errors += [
                np.abs(turning.stress(QF) - QP).max(),
                np.abs(turning.stored(QF) - still.stored(F)).max(),
                np.abs(turning.dissipated - still.dissipated).max(),
            ]
    return at_most(max(errors) / _stiffness(material), _SOLVED)


@_of_history
def angular_momentum_of_history(material: HistoryMaterial) -> Verdict:
    """The Cauchy stress stays symmetric, P F^T = F P^T, whatever has been."""
    errors = []
    for d, rng in seeded():
        path = _Path(d, rng)
        for duration in _DURATIONS:
            follower, F = _led(material, path, duration, 40), path.at(1.0)
            turn = np.einsum("ikn,jkn->ijn", follower.stress(F), F)
            errors.append(np.abs(turn - turn.transpose(1, 0, 2)).max())
    return at_most(max(errors) / _stiffness(material), _SOLVED)


@_of_history
def missing_dimensions_of_history(material: HistoryMaterial) -> Verdict:
    """In 1D and 2D it remembers what the 3D law does with the missing stretches 1."""
    errors = []
    for d, rng in seeded():
        path = _Path(d, rng)
        for duration in _DURATIONS:
            flat, whole = _Follower(material, d), _Follower(material, 3)
            for k in range(1, 41):
                F = path.at(k / 40)
                G = np.repeat(np.eye(3)[:, :, None], _COUNT, axis=2)
                G[:d, :d] = F
                flat.lead(F, duration / 40)
                whole.lead(G, duration / 40)
            errors += [
                np.abs(flat.stress(F) - whole.stress(G)[:d, :d]).max(),
                np.abs(flat.dissipated - whole.dissipated).max(),
            ]
    return at_most(max(errors) / _stiffness(material), _SOLVED)


@_of_history
def rate_dependence(material: HistoryMaterial) -> Verdict:
    """How long a path takes matters if and only if the law declares that it does."""
    changes = []
    for d, rng in seeded():
        path = _Path(d, rng)
        ends = [_led(material, path, time, 40).stress(path.at(1.0)) for time in _DURATIONS]
        largest = max(np.abs(P).max() for P in ends)
        changes.append(max(np.abs(P - ends[0]).max() for P in ends) / largest)
    if material.rate_dependent:
        return more_than(max(changes), 1e-6)
    return at_most(max(changes), _SOLVED)


@_of_history
def pointwise_history(material: HistoryMaterial) -> Verdict:
    """Histories and stresses of single points are those of arrays."""
    errors = []
    for d, rng in seeded():
        path = _Path(d, rng)
        follower = _led(material, path, _DURATIONS[1], 10)
        F, params = path.at(1.0), material.params
        follower.lead(F, 1e-3)
        P = follower.stress(F)
        before = _led(material, path, _DURATIONS[1], 10).history
        for n in range(_COUNT):
            one = tuple(tuple(float(a) for a in row) for row in F[:, :, n])
            h: History = tuple(float(values[n]) for values in before)
            h = material.advance(one, h, 1e-3, params)
            found = np.array(material.stress(one, h, params))
            errors.append(np.abs(found - P[:, :, n]).max() / _stiffness(material))
            scales = [max(1.0, float(np.abs(values).max())) for values in follower.history]
            errors += [
                abs(float(a) - float(values[n])) / size
                for a, values, size in zip(h, follower.history, scales, strict=True)
            ]
    return at_most(max(errors), _SOLVED)


@_of_history
def shown_variables(material: HistoryMaterial) -> Verdict:
    """What records are to show are names among the internal variables, each with its unit."""
    names = list(material.initial_history(3))
    missing = [one for one in material.shown if one not in names]
    bare = [one for one in material.shown if not (" [" in one and one.endswith("]"))]
    told = f"{missing} not among {names}" if missing else f"{bare} without a unit"
    return Verdict(not missing and not bare, told if missing or bare else ", ".join(material.shown))


@_of_history
def leaves_its_history(material: HistoryMaterial) -> Verdict:
    """A step leaves the history before it as it was: what is tried may be tried again."""
    for d, rng in seeded():
        path = _Path(d, rng)
        follower = _led(material, path, _DURATIONS[1], 10)
        given = tuple(np.array(one) for one in follower.history)  # which can be written to
        F = path.at(1.0)
        material.advance(F, given, 1e-3, material.params)
        material.stress(F, given, material.params)
        pairs = zip(given, follower.history, strict=True)
        if not all(np.array_equal(a, b) for a, b in pairs):
            return Verdict(False, f"{d}D: it was changed in place")
    return Verdict(True, "untouched")


CHECKS: tuple[Check, ...] = (
    shown_variables,
    leaves_its_history,
    virgin_state,
    stress_with_history,
    dissipation,
    energy_balance,
    objectivity_of_history,
    angular_momentum_of_history,
    missing_dimensions_of_history,
    rate_dependence,
    pointwise_history,
)


def _stiffness(material: Material) -> float:
    lam, mu = material.lame_parameters
    return lam + 2.0 * mu
