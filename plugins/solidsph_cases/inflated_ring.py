"""A thick rubber ring inflated by a pressure that follows its inner surface."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import log
from typing import final

import attrs
import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from solidsph.maths.arrays import Array
from solidsph.registry.parameters import number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.simulation import Simulation
from solidsph.studies.case import Case, Measurement, Trial
from solidsph_builtin.materials.neo_hookean import NeoHookean
from solidsph_cases._compare import compared
from solidsph_cases._energy import smallest_volume_ratio

INNER, OUTER = 0.5, 1.0  # radii [m]
RUBBER = NeoHookean(youngs_modulus=1e6, poissons_ratio=0.49, density=1000.0)


def pressure_that_stretches(ratio: float) -> float:
    """Of an incompressible ring whose inner radius grows by this ratio, over the shear modulus [-].

    In plane strain ln(a / b) + (1 / b^2 - 1 / a^2) / 2 with the stretches a inside and b outside,
    by integrating the balance across the ring. It grows up to ln(OUTER / INNER): the ring has no
    equilibrium beyond.
    """
    outside = float(np.sqrt(1.0 + (INNER / OUTER) ** 2 * (ratio**2 - 1.0)))
    return log(ratio / outside) + 0.5 * (outside**-2 - ratio**-2)


@final
@attrs.frozen
class InflatedRing(Case):
    """In plane strain, at rest, at ever higher pressure.

    The pressure that doubles the hole is 0.574 of the shear modulus, and 0.693 is the most that
    any hole holds: to inflate by pressure works up to there.
    """

    title = "A thick rubber ring under pressure"
    source = "the balance of a ring of the same law, integrated across it"
    sweep = {"across": (4, 6, 9)}
    trials = {
        "until it doubles": Trial(brief={"across": 5}),
        "beyond the limit load": Trial(
            {"pressure": 0.8},
            {"across": 4},
            must_fail="no ring holds more than ln 2 of the shear modulus: there is no equilibrium",
        ),
    }

    pressure: float = number(default=pressure_that_stretches(2.0))  # at the end [shear moduli]
    across: int = 6  # spacings across the ring
    tolerance: float = number(default=0.02)  # largest error of the pressure that passes [-]

    def scenes(self) -> Mapping[str, Scene]:
        builder = (
            Simulation.builder()
            .title(self.title)
            .body(
                "ring",
                shape={"type": "annulus", "inner_radius": INNER, "outer_radius": OUTER},
                spacing=(OUTER - INNER) / self.across,
            )
            .material(
                "neo-hookean",
                youngs_modulus=RUBBER.youngs_modulus,
                poissons_ratio=RUBBER.poissons_ratio,
                density=RUBBER.density,
            )
            .boundary("symmetry", axis="x")
            .boundary("symmetry", axis="y")
            .boundary("pressure", where="inner", pressure=f"{self.most!r}*t", label="air")
            .statics(load_steps=8)
            .duration(1.0)
        )
        return {"ring": builder.scene()}

    @property
    def most(self) -> float:
        """The pressure at the end [Pa]."""
        return self.pressure * RUBBER.lame_parameters[1]

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        record = records["ring"]
        hole = record.particles.tagged("inner")
        grown = float(np.linalg.norm(record.positions[-1][hole], axis=1).mean()) / INNER
        modulus = RUBBER.lame_parameters[1]
        return [
            compared(
                record,
                "pressure over the shear modulus, for the hole that it makes",
                float(record.history["air asked [Pa]"][-1]) / modulus,
                "1",
                pressure_inside(grown) / modulus,
                self.source,
                self.tolerance,
            ),
            Measurement("radius of the hole over that at the start", grown, "1"),
            smallest_volume_ratio(record),
        ]


def pressure_inside(ratio: float) -> float:
    """Pressure [Pa] under which the hole grows by this ratio, by shooting to the free outside."""

    def law(radial: float, hoop: float) -> tuple[float, float]:
        """P in both directions [Pa]."""
        P = RUBBER.first_piola(np.diag([radial, hoop]), RUBBER.params)
        return float(np.asarray(P[0][0])), float(np.asarray(P[1][1]))

    def slopes(R: float, y: Array) -> list[float]:
        """Of the radius and of the radial P, by the reference radius."""
        hoop = y[0] / R
        radial = brentq(lambda radial: law(radial, hoop)[0] - y[1], 0.02, 20.0)
        return [radial, (law(radial, hoop)[1] - y[1]) / R]

    def left(pressure: float) -> float:
        """Radial P at the outer surface [Pa]."""
        inside = [ratio * INNER, -pressure * ratio]
        return float(solve_ivp(slopes, (INNER, OUTER), inside, rtol=1e-7, atol=1e-7).y[1, -1])

    about = pressure_that_stretches(ratio) * RUBBER.lame_parameters[1]
    return float(brentq(left, 0.9 * about, 1.1 * about))
