"""Probes of a force and its moment about a point: of an account, or through a face."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from difflib import get_close_matches
from typing import final

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.shape import Shape
from solidsph.interfaces.terms import Observation, Term
from solidsph.maths.arrays import Array
from solidsph.model.particles import Particles
from solidsph.model.regions import Where, select
from solidsph.probes.face_samples import FaceSamples, face_samples
from solidsph.probes.probe import Probe
from solidsph.probes.quantities import COMPONENTS

# Axes about which there is a moment, by dimension.
_TURNS = {1: (), 2: (2,), 3: (0, 1, 2)}


@final
@attrs.frozen(eq=False)
class AccountProbe(Probe):
    """Resultant of the forces that a boundary or an effect exerts on the bodies."""

    account: str  # the label of its account
    about: Sequence[float] | None  # (d,) fixed point of the moment [m]; the origin if None

    def check_place(self, shapes: Mapping[str, Shape], particles: Particles) -> None:
        _point(self.about, particles.dimension)

    def bind(self, model: DiscreteModel, accounts: Collection[str]) -> Term:
        if self.account not in accounts:
            near = get_close_matches(self.account, accounts, 1)
            known = ", ".join(map(repr, accounts)) or "none exerts forces"
            hint = f"did you mean {near[0]!r}?" if near else f"boundaries and effects: {known}"
            raise SceneError(f"there is no account {self.account!r}; {hint}")
        return _OfAccount(self.label, self.account, _point(self.about, model.particles.dimension))


@final
@attrs.frozen(eq=False)
class SurfaceProbe(Probe):
    """Resultant of the stress through a surface: the force on the body behind it."""

    where: Where  # a face such as "right", or a condition on the surface
    about: Sequence[float] | None  # as above

    def check_place(self, shapes: Mapping[str, Shape], particles: Particles) -> None:
        _point(self.about, particles.dimension)
        select(particles, self.where)

    def bind(self, model: DiscreteModel, accounts: Collection[str]) -> Term:
        centre = _point(self.about, model.particles.dimension)
        return _ThroughSurface(self.label, face_samples(model, self.where), centre)


@final
@attrs.frozen(eq=False)
class _OfAccount(Term):
    """Total force of an account, and its moment."""

    label: str
    account: str
    about: Array  # (d,) [m]

    def report(self, observation: Observation) -> Mapping[str, float]:
        state = observation.state
        # A run without an effect, to see what it changes, has no account of it.
        forces = state.applied.get(self.account, np.zeros_like(state.positions))
        return _resultant(self.label, state.positions - self.about, forces)


@final
@attrs.frozen(eq=False)
class _ThroughSurface(Term):
    """Total of P N over a surface, and its moment."""

    label: str
    samples: FaceSamples
    about: Array  # (d,) [m]

    def report(self, observation: Observation) -> Mapping[str, float]:
        at, seen = self.samples.sampling, observation
        chosen = at.particles
        P = at.interpolated(seen.stresses[chosen])
        forces = np.einsum("mij,mj->mi", P, self.samples.area_vectors)
        u = at.interpolated(seen.state.positions[chosen] - seen.particles.positions[chosen])
        return _resultant(self.label, at.points + u - self.about, forces)


def _resultant(label: str, arms: Array, forces: Array) -> Mapping[str, float]:
    """Total of `forces` (k, d) [N] at `arms` (k, d) [m] from the point of the moment."""
    d = forces.shape[1]
    columns = {
        f"{label} force {COMPONENTS[k]} [N]": float(total)
        for k, total in enumerate(forces.sum(axis=0))
    }
    for axis in _TURNS[d]:
        i, j = (axis + 1) % 3, (axis + 2) % 3
        moment = np.sum(arms[:, i] * forces[:, j] - arms[:, j] * forces[:, i])
        columns[f"{label} moment {COMPONENTS[axis]} [N m]"] = float(moment)
    return columns


def _point(about: Sequence[float] | None, dimension: int) -> Array:
    """The point of a moment, (d,) [m].

    Raises:
        SceneError: it has another dimension.
    """
    if about is None:
        return np.zeros(dimension)
    if len(about) != dimension:
        raise SceneError(f"about = {list(about)} must have {dimension} coordinates in this scene")
    return np.array(about, dtype=np.float64)
