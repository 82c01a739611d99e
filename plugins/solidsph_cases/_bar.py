"""The paper's bar of section 5.1, and quantities along any bar."""

from __future__ import annotations

from math import nan

import numpy as np

from solidsph.maths.arrays import Array, Indices
from solidsph.results.record import Record
from solidsph.scene.scene_builder import SceneBuilder
from solidsph_builtin.materials.neo_hookean import NeoHookean
from solidsph_cases._scene import solid

LENGTH = 0.15  # [m]
YOUNGS_MODULUS = 200e9  # [Pa]
POISSONS_RATIO = 0.3  # [-]
DENSITY = 8000.0  # [kg/m^3]


def bar(title: str, *, particles: int, poissons_ratio: float) -> SceneBuilder:
    """A bar in one dimension, in uniaxial strain, with a particle on each end."""
    shape = {"type": "interval", "length": LENGTH}
    material = NeoHookean(YOUNGS_MODULUS, poissons_ratio, DENSITY)
    spacing = LENGTH / (particles - 1)
    return solid(title, "bar", shape, spacing, material)


def with_viscosity(builder: SceneBuilder, linear: float, quadratic: float) -> SceneBuilder:
    """`builder` with artificial viscosity of these strengths."""
    return builder.effect(
        "artificial-viscosity", label="viscosity", linear=linear, quadratic=quadratic
    )


def in_order(record: Record) -> Indices:
    """The bar's particles from left to right, without ghosts, (n,)."""
    particles = record.particles
    real = np.flatnonzero(~particles.ghosts)
    return np.asarray(real[np.argsort(particles.positions[real, 0])], dtype=np.intp)


def along(record: Record) -> Array:
    """X of the bar's particles from left to right, (n,) [m]."""
    return np.asarray(record.particles.positions[in_order(record), 0])


def displacements(record: Record) -> Array:
    """Of the same particles at every time, (t, n) [m]."""
    return np.asarray(record.positions[:][:, in_order(record), 0] - along(record))


def stress_along(record: Record) -> Array:
    """T11 of the same particles at every time, (t, n) [Pa].

    In uniaxial strain it is P11 as well: the area across the bar does not change.
    """
    return np.asarray(record.field("cauchy_stress")[:][:, in_order(record), 0, 0])


def first_rise(places: Array, values: Array, level: float) -> float:
    """Where `values` (k,) first pass `level` from below, by a straight line; nan if nowhere."""
    above = np.flatnonzero((values[1:] >= level) & (values[:-1] < level))
    if not len(above):
        return nan
    i = above[0]
    part = (level - values[i]) / (values[i + 1] - values[i])
    return float(places[i] + part * (places[i + 1] - places[i]))
