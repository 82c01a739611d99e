"""Checks of a material with history, along a path of deformation that reverses."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from solidsph.conformance.check import Broken, Kit, NotPromised, Verdict, at_most, more_than
from solidsph.conformance.samples import (
    ANGLES,
    as_tuples,
    central_difference,
    in_space,
    random_rotation,
    relative_error,
    rotation,
    seeded,
    stiffness,
)
from solidsph.interfaces.history import History, HistoryMaterial
from solidsph.interfaces.material import Material
from solidsph.maths.arrays import Array
from solidsph.maths.tensors import particles_first

_COUNT = 8  # paths in each dimension
_STEPS = 200
_LARGEST = 0.15  # displacement gradient, far beyond what any metal takes elastically

# Durations of a path [s], since the relaxation times of a law are not known.
_DURATIONS = (1e-5, 1e-2, 10.0)

_ROUNDING = 1e-12
# Scalar equations within an update may be solved to less than rounding.
_SOLVED = 1e-9

_DIFFERENCE_STEP, _DIFFERENCE_TOLERANCE = 2e-3, 1e-10

# The trapezoidal rule, on a path of 200 steps through a kink of the law.
_BALANCE = 2e-3

KIT = Kit()


class _Path:
    """Deformation gradients (d, d, n) that grow, reverse and go beyond where they began."""

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


class _Sample:
    """A material and its history at the points of a path."""

    def __init__(self, material: Material, dimension: int) -> None:
        if not isinstance(material, HistoryMaterial):
            raise NotPromised("the law has no history")
        self.material = material
        start = material.initial_history(dimension).values()
        self.history: History = tuple(np.full(_COUNT, value) for value in start)

    def advance(self, F: Array, step: float) -> None:
        self.history = tuple(
            np.broadcast_to(values, F.shape[2:])
            for values in self.material.advance(F, self.history, step, self.material.params)
        )

    def follow(self, path: _Path, duration: float, steps: int) -> _Sample:
        """Advance along a whole path; returns itself."""
        for k in range(1, steps + 1):
            self.advance(path.at(k / steps), duration / steps)
        return self

    def stress(self, F: Array) -> Array:
        P = self.material.stress(F, self.history, self.material.params)
        return np.moveaxis(particles_first(P, F.shape[2]), 0, -1)

    def stored(self, F: Array) -> Array:
        psi = self.material.stored(F, self.history, self.material.params)
        return np.broadcast_to(np.asarray(psi, dtype=np.float64), F.shape[2:])

    @property
    def dissipated(self) -> Array:
        return np.asarray(self.material.dissipated(self.history), dtype=np.float64)


def _paths() -> Iterator[tuple[np.random.Generator, _Path, float]]:
    """Paths in each dimension, each with several durations [s], and random numbers."""
    for d, rng in seeded():
        path = _Path(d, rng)
        for duration in _DURATIONS:
            yield rng, path, duration


@KIT.check
def shown_variables(material: Material) -> Verdict:
    """The variables shown in records are internal variables, each with its unit."""
    history = _Sample(material, 3).material
    names = list(history.initial_history(3))
    missing = [name for name in history.shown if name not in names]
    bare = [name for name in history.shown if not (" [" in name and name.endswith("]"))]
    if missing or bare:
        raise Broken(f"{missing} not among {names}" if missing else f"{bare} without a unit")
    return Verdict(True, ", ".join(history.shown))


@KIT.problems("untouched")
def leaves_its_history(material: Material) -> Iterator[str]:
    """A step does not change the history before it in place, so that it can be repeated."""
    for d, rng in seeded():
        path = _Path(d, rng)
        sample = _Sample(material, d).follow(path, _DURATIONS[1], 10)
        given = tuple(np.array(values) for values in sample.history)  # which can be written to
        F, params = path.at(1.0), sample.material.params
        sample.material.advance(F, given, 1e-3, params)
        sample.material.stress(F, given, params)
        pairs = zip(given, sample.history, strict=True)
        same = all(np.array_equal(a, b) for a, b in pairs)
        yield "" if same else f"{d}D: it was changed in place"


@KIT.errors(_ROUNDING)
def virgin_state(material: Material) -> Iterator[float]:
    """At the initial history stress and stored energy are those of `first_piola` and `energy`, and
    nothing is dissipated."""
    for d, rng in seeded():
        sample, F = _Sample(material, d), _Path(d, rng).at(0.2)
        P = np.moveaxis(particles_first(material.first_piola(F, material.params), _COUNT), 0, -1)
        yield relative_error(material, sample.stress(F) - P)
        yield relative_error(material, sample.stored(F) - material.energy(F, material.params))
        yield relative_error(material, sample.dissipated)


@KIT.errors(_DIFFERENCE_TOLERANCE)
def stress_with_history(material: Material) -> Iterator[float]:
    """The stress is the derivative of the stored energy by F at constant history."""
    for rng, path, duration in _paths():
        d = path.dimension
        sample = _Sample(material, d).follow(path, duration, 20)
        F, dF = path.at(0.9), rng.normal(size=(d, d, _COUNT))
        power = np.einsum("ijn,ijn->n", sample.stress(F), dF)
        found = central_difference(sample.stored, F, dF, _DIFFERENCE_STEP)
        yield relative_error(material, found - power)


@KIT.errors(_ROUNDING)
def dissipation(material: Material) -> Iterator[float]:
    """The dissipated energy never decreases."""
    for _, path, duration in _paths():
        sample = _Sample(material, path.dimension)
        for k in range(1, _STEPS + 1):
            before = sample.dissipated
            sample.advance(path.at(k / _STEPS), duration / _STEPS)
            yield float((before - sample.dissipated).max()) / stiffness(material)


@KIT.errors(_BALANCE)
def energy_balance(material: Material) -> Iterator[float]:
    """The work of the stress along a path is the sum of stored and dissipated energy."""
    for _, path, duration in _paths():
        sample = _Sample(material, path.dimension)
        F, work = path.at(0.0), np.zeros(_COUNT)
        P, largest = sample.stress(F), np.zeros(_COUNT)
        for k in range(1, _STEPS + 1):
            F_before, P_before, F = F, P, path.at(k / _STEPS)
            sample.advance(F, duration / _STEPS)
            P = sample.stress(F)
            work += 0.5 * np.einsum("ijn,ijn->n", P_before + P, F - F_before)
            largest = np.maximum(largest, np.abs(work))
        missing = np.abs(work - sample.stored(F) - sample.dissipated)
        yield float((missing / largest).max())


@KIT.errors(_SOLVED)
def objectivity_of_history(material: Material) -> Iterator[float]:
    """A rotation that goes on during the path changes neither stored nor dissipated energy, and
    turns the stress."""
    for d, rng in seeded():
        path, end = _Path(d, rng), random_rotation(rng, d)
        for duration in _DURATIONS:
            still, turning = _Sample(material, d), _Sample(material, d)
            for k in range(1, 41):
                F, Q = path.at(k / 40), rotation(d, [0.1 * k] * ANGLES[d]) @ end
                still.advance(F, duration / 40)
                turning.advance(np.einsum("ij,jkn->ikn", Q, F), duration / 40)
            QF, QP = (np.einsum("ij,jkn->ikn", Q, A) for A in (F, still.stress(F)))
            yield relative_error(material, turning.stress(QF) - QP)
            yield relative_error(material, turning.stored(QF) - still.stored(F))
            yield relative_error(material, turning.dissipated - still.dissipated)


@KIT.errors(_SOLVED)
def angular_momentum_of_history(material: Material) -> Iterator[float]:
    """The Cauchy stress stays symmetric, P F^T = F P^T, after any history."""
    for _, path, duration in _paths():
        sample, F = _Sample(material, path.dimension).follow(path, duration, 40), path.at(1.0)
        PF = np.einsum("ikn,jkn->ijn", sample.stress(F), F)
        yield relative_error(material, PF - PF.transpose(1, 0, 2))


@KIT.errors(_SOLVED)
def missing_dimensions_of_history(material: Material) -> Iterator[float]:
    """In 1D and 2D its history is that of the 3D law with the missing stretches 1."""
    for _, path, duration in _paths():
        d = path.dimension
        flat, whole = _Sample(material, d), _Sample(material, 3)
        for k in range(1, 41):
            F = path.at(k / 40)
            flat.advance(F, duration / 40)
            whole.advance(in_space(F), duration / 40)
        yield relative_error(material, flat.stress(F) - whole.stress(in_space(F))[:d, :d])
        yield relative_error(material, flat.dissipated - whole.dissipated)


@KIT.check
def rate_dependence(material: Material) -> Verdict:
    """The duration of a path matters if and only if the law declares that it does."""
    changes = []
    for d, rng in seeded():
        path = _Path(d, rng)
        samples = [_Sample(material, d).follow(path, time, 40) for time in _DURATIONS]
        ends = [sample.stress(path.at(1.0)) for sample in samples]
        largest = max(np.abs(P).max() for P in ends)
        changes.append(max(np.abs(P - ends[0]).max() for P in ends) / largest)
    if samples[0].material.rate_dependent:
        return more_than(max(changes), 1e-6)
    return at_most(max(changes), _SOLVED)


@KIT.errors(_SOLVED)
def pointwise_history(material: Material) -> Iterator[float]:
    """Histories and stresses are the same for single points as for arrays."""
    for d, rng in seeded():
        path = _Path(d, rng)
        sample = _Sample(material, d).follow(path, _DURATIONS[1], 10)
        law, before = sample.material, sample.history
        F, params = path.at(1.0), material.params
        sample.advance(F, 1e-3)
        P = sample.stress(F)
        for n in range(_COUNT):
            point = as_tuples(F[:, :, n])
            h: History = tuple(float(values[n]) for values in before)
            h = law.advance(point, h, 1e-3, params)
            yield relative_error(material, np.array(law.stress(point, h, params)) - P[:, :, n])
            for alone, values in zip(h, sample.history, strict=True):
                size = max(1.0, float(np.abs(values).max()))
                yield abs(float(alone) - float(values[n])) / size
