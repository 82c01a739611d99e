"""The paper's bar of section 5.1, which the cases of waves have in common."""

from __future__ import annotations

from math import nan

import numpy as np

from solidsph.maths.arrays import Array
from solidsph.results.record import Record
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.simulation import Simulation
from solidsph_cases._scheme import Scheme, with_scheme

LENGTH = 0.15  # [m]
YOUNGS_MODULUS = 200e9  # [Pa]
POISSONS_RATIO = 0.3  # [-]
DENSITY = 8000.0  # [kg/m^3]


def bar(title: str, *, particles: int, poissons_ratio: float, scheme: Scheme) -> SceneBuilder:
    """A bar in one dimension, in uniaxial strain, with a particle on each end."""
    builder = (
        Simulation.builder()
        .title(title)
        .body(
            "bar",
            shape={"type": "interval", "length": LENGTH},
            spacing=LENGTH / (particles - 1),
            discretisation={"type": "lattice", "on_boundary": True},
        )
        .material(
            "neo-hookean",
            youngs_modulus=YOUNGS_MODULUS,
            poissons_ratio=poissons_ratio,
            density=DENSITY,
        )
    )
    return with_scheme(builder, scheme)


def with_viscosity(builder: SceneBuilder, linear: float, quadratic: float) -> SceneBuilder:
    """`builder` with artificial viscosity of these strengths."""
    return builder.effect(
        "artificial-viscosity", label="viscosity", linear=linear, quadratic=quadratic
    )


def along(record: Record) -> Array:
    """X of the bar's particles from left to right, (n,) [m]."""
    particles = record.particles
    return np.sort(particles.positions[~particles.ghosts, 0])


def stress_along(record: Record) -> Array:
    """T11 of the same particles at every time, (t, n) [Pa].

    In uniaxial strain it is P11 as well: the area across the bar does not change.
    """
    particles = record.particles
    real = np.flatnonzero(~particles.ghosts)
    order = real[np.argsort(particles.positions[real, 0])]
    stress: Array = record.field("cauchy_stress")[:][:, order, 0, 0]
    return stress


def first_rise(places: Array, values: Array, level: float) -> float:
    """Where `values` (k,) first pass `level` from below, by a straight line; nan if nowhere."""
    above = np.flatnonzero((values[1:] >= level) & (values[:-1] < level))
    if not len(above):
        return nan
    i = above[0]
    part = (level - values[i]) / (values[i + 1] - values[i])
    return float(places[i] + part * (places[i + 1] - places[i]))
