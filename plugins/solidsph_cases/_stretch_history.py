"""Stress and stretch of a pulled body over time."""

from __future__ import annotations

from typing import final

import attrs
import numpy as np

from solidsph.maths.arrays import Array
from solidsph.results.record import Record
from solidsph_cases import _stretch_theory as theory


@final
@attrs.frozen
class StressCurve:
    """sigma_11 over the stretch, with the stretch across held."""

    across: float  # [-]
    lam: float  # [Pa]
    mu: float  # [Pa]

    def __call__(self, stretches: Array) -> Array:
        """Cauchy stress [Pa]."""
        return theory.cauchy_stress(stretches, self.across, self.lam, self.mu)


@final
@attrs.frozen(eq=False)
class History:
    """Real particles over time, beside the static curve."""

    times: Array  # (t,) [s]
    stretches: Array  # (t,) of the whole body, from its ends [-]
    stresses: Array  # (t, n) sigma_11 of every particle [Pa]
    local: Array  # (t, n) stretch of every particle along the pull [-]
    shares: Array  # (n,) of the particles in the volume [-]
    middle: int  # the particle in the middle of the body
    curve: StressCurve

    @classmethod
    def of(cls, record: Record, curve: StressCurve) -> History:
        """From the record of a body between x = 0, held, and the end that is pulled."""
        particles = record.particles
        real = np.flatnonzero(~particles.ghosts)
        X = particles.positions[real]
        centre = 0.5 * (X.min(axis=0) + X.max(axis=0))
        volumes = particles.volumes[real]
        ends = record.positions[:][:, real, 0].max(axis=1)
        return cls(
            times=record.times,
            stretches=ends / float(X[:, 0].max()),
            stresses=record.field("cauchy_stress")[:][:, real, 0, 0],
            local=record.field("volume_ratio")[:][:, real] / curve.across,
            shares=volumes / volumes.sum(),
            middle=int(np.argmin(np.linalg.norm(X - centre, axis=1))),
            curve=curve,
        )

    @property
    def mean(self) -> Array:
        """Over all particles, by volume, (t,) [Pa]."""
        return np.asarray(self.stresses @ self.shares)

    @property
    def static(self) -> Array:
        """The static curve at the stretches of the whole, (t,) [Pa]."""
        return self.curve(self.stretches)

    @property
    def amid(self) -> Array:
        """Of the particle in the middle, (t,) [Pa]."""
        return self.stresses[:, self.middle]

    def averaged(self, length: float, density: float, limit: float) -> tuple[Array, Array]:
        """Stretches (k,) and the mean stress about each (k,) [Pa], up to a stretch's `limit`.

        The difference of the mean and the curve is averaged over the time in which a small wave,
        at that stretch, passes the body there and back: the period of its slowest vibration. Where
        it does not fit into the run, or a particle has met the limit, there is none.
        """
        beyond = np.flatnonzero(self.local.max(axis=1) >= limit)
        end = self.times[beyond[0] if len(beyond) else -1]
        inside = self.stretches < limit
        t, s = self.times[inside], self.stretches[inside]
        law = (self.curve.across, self.curve.lam, self.curve.mu)
        stiffness = np.array([theory.stiffness(x, *law) for x in s])
        half = length / np.sqrt(stiffness / density)
        missed = self.mean - self.static
        steps = 0.5 * (missed[1:] + missed[:-1]) * np.diff(self.times)
        integral = np.concatenate([[0.0], np.cumsum(steps)])
        whole = (t - half >= 0.0) & (t + half <= end)
        t, s, half = t[whole], s[whole], half[whole]
        over = np.interp(t + half, self.times, integral) - np.interp(t - half, self.times, integral)
        return s, self.curve(s) + over / (2.0 * half)
