"""Probes at a point, along a line and on a face."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import final

import attrs
import numpy as np
from numpy.typing import ArrayLike

from solidsph.interfaces.body import Body
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.shape import Shape
from solidsph.interfaces.terms import Observation, Term
from solidsph.maths.arrays import Array
from solidsph.model.particles import Particles
from solidsph.model.regions import AXES, Where, select
from solidsph.probes.face_samples import face_samples
from solidsph.probes.probe import Probe
from solidsph.probes.quantities import Measure, Sampled
from solidsph.probes.sampling import Sampling, located


@final
@attrs.frozen(eq=False)
class PointProbe(Probe):
    """A quantity at one point, component by component."""

    measure: Measure
    point: Sequence[float]  # (d,) [m]
    body: str | None  # where several touch

    def check_place(self, shapes: Mapping[str, Shape], particles: Particles) -> None:
        located(shapes, particles, [self.point], self.body)
        self.measure.check_dimension(particles.dimension)

    def bind(self, model: DiscreteModel, accounts: Collection[str]) -> Term:
        sampling = _sampling(model, self.measure, [self.point], self.body)
        return _AtPoint(self.label, self.measure, sampling, model.bodies)


@final
@attrs.frozen(eq=False)
class LineProbe(Probe):
    """Mean, maximum and minimum of one number along a straight line, and where the maximum is."""

    measure: Measure
    start: Sequence[float]  # (d,) [m]
    end: Sequence[float]  # (d,) [m]
    count: int  # of points, both ends included
    body: str | None  # where several touch

    def check_place(self, shapes: Mapping[str, Shape], particles: Particles) -> None:
        located(shapes, particles, self._points(), self.body)
        self.measure.check_dimension(particles.dimension)

    def bind(self, model: DiscreteModel, accounts: Collection[str]) -> Term:
        sampling = _sampling(model, self.measure, self._points(), self.body)
        shares = np.ones(self.count)
        shares[[0, -1]] = 0.5  # the trapezoidal rule
        shares /= shares.sum()
        return _OverPoints(self.label, self.measure, sampling, model.bodies, shares)

    def _points(self) -> Array:
        return np.linspace(self.start, self.end, self.count)


@final
@attrs.frozen(eq=False)
class FaceProbe(Probe):
    """Mean, maximum and minimum of one number on a surface, and where the maximum is."""

    measure: Measure
    where: Where  # a face such as "right", or a condition on the surface

    def check_place(self, shapes: Mapping[str, Shape], particles: Particles) -> None:
        self.measure.check_dimension(particles.dimension)
        select(particles, self.where)

    def bind(self, model: DiscreteModel, accounts: Collection[str]) -> Term:
        self.measure.check(model)
        samples = face_samples(model, self.where, slopes=self.measure.quantity.is_gradient)
        areas = np.linalg.norm(samples.area_vectors, axis=1)
        shares = areas / areas.sum()
        return _OverPoints(self.label, self.measure, samples.sampling, model.bodies, shares)


@final
@attrs.frozen(eq=False)
class _AtPoint(Term):
    """The numbers of a measure at one point."""

    label: str
    measure: Measure
    sampling: Sampling
    bodies: Sequence[Body]

    def report(self, observation: Observation) -> Mapping[str, float]:
        values = self.measure.values(Sampled(observation, self.sampling, self.bodies))[0]
        names = self.measure.names(self.sampling.points.shape[1])
        unit = self.measure.quantity.unit
        return {
            f"{self.label} {name} [{unit}]": float(value)
            for name, value in zip(names, values, strict=True)
        }


@final
@attrs.frozen(eq=False)
class _OverPoints(Term):
    """Mean and extremes of one number over several points."""

    label: str
    measure: Measure
    sampling: Sampling
    bodies: Sequence[Body]
    shares: Array  # (m,) of the points in the mean; they add up to 1

    def report(self, observation: Observation) -> Mapping[str, float]:
        values = self.measure.values(Sampled(observation, self.sampling, self.bodies))[:, 0]
        points = self.sampling.points
        (name,) = self.measure.names(points.shape[1])
        what = f"{name} [{self.measure.quantity.unit}]"
        highest = int(values.argmax())
        return {
            f"{self.label} mean {what}": float(self.shares @ values),
            f"{self.label} minimum {what}": float(values.min()),
            f"{self.label} maximum {what}": float(values[highest]),
            **{
                f"{self.label} maximum at {axis} [m]": float(x)
                for axis, x in zip(AXES, points[highest], strict=False)
            },
        }


def _sampling(
    model: DiscreteModel, measure: Measure, points: ArrayLike, body: str | None
) -> Sampling:
    """The sampling for a measure at points (m, d) of a body.

    Raises:
        SceneError: a point is outside, or the measure is not known of this model.
    """
    shapes = {own.name: own.shape for own in model.bodies}
    found = located(shapes, model.particles, points, body)
    measure.check(model)
    slopes = measure.quantity.is_gradient
    return Sampling.of(shapes, model.particles, *found, slopes=slopes)
