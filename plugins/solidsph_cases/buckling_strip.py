"""A strip pressed together along its length until it buckles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import final

import attrs
import numpy as np
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

from solidsph.registry.parameters import number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.simulation import Simulation
from solidsph.studies.case import Case, Measurement, Trial
from solidsph_cases._compare import compared
from solidsph_cases._energy import smallest_volume_ratio

LENGTH = 1.0  # [m]
YOUNGS_MODULUS, POISSONS_RATIO = 1e6, 0.3  # [Pa], [-]


@final
@attrs.frozen
class BucklingStrip(Case):
    """Both ends are clamped; one comes closer, and a small push says to which side to buckle.

    The push is gone at the end, so what is left is Euler's elastica: four times the quarter of
    a wave, under a force (4 K / length)^2 E I, with K the complete elliptic integral. It is not
    quite inextensible, by the strain that the force makes.
    """

    title = "A strip that buckles"
    source = "Euler's elastica (Love 1927, article 263)"
    sweep = {"across": (3, 5, 7)}
    trials = {"shortened by a tenth": Trial(brief={"across": 3})}

    shortening: float = number(default=0.1)  # of the length at the end [-]
    slenderness: float = number(default=25.0)  # length over thickness [-]
    across: int = 4  # spacings through the thickness
    push: float = number(default=5.0)  # half way [m/s^2]
    tolerance: float = number(default=0.02)  # largest error that passes [-]

    @property
    def thickness(self) -> float:
        """[m]"""
        return LENGTH / self.slenderness

    def scenes(self) -> Mapping[str, Scene]:
        t = self.thickness
        builder = (
            Simulation.builder()
            .title(self.title)
            .body(
                "strip",
                shape={"type": "box", "lengths": [LENGTH, t], "origin": [0.0, -0.5 * t]},
                spacing=t / self.across,
            )
            .material(
                "neo-hookean",
                youngs_modulus=YOUNGS_MODULUS,
                poissons_ratio=POISSONS_RATIO,
                density=1000.0,
            )
            .boundary("clamp", where="left")
            .boundary(
                "prescribed-motion",
                where="right",
                displacement={"x": f"-{self.shortening * LENGTH!r}*t", "y": 0.0},
                label="press",
            )
            .effect("body-force", acceleration={"y": f"{self.push!r}*4*t*(1 - t)"}, label="push")
            .statics(load_steps=20)
            .duration(1.0)
        )
        return {"strip": builder.scene()}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        record = records["strip"]
        X = record.particles.positions
        middle = np.argmin(np.hypot(X[:, 0] - 0.5 * LENGTH, X[:, 1]))
        aside = float((record.positions[-1] - X)[middle, 1])
        force = -float(record.history["press reaction x [N]"][-1])
        load, way = self.elastica()
        compare = partial(compared, record, source=self.source, tolerance=self.tolerance)
        return [
            compare("way of the middle aside", aside, "m", way),
            compare("force", force, "N", load),
            smallest_volume_ratio(record),
        ]

    def elastica(self) -> tuple[float, float]:
        """Force [N], in plane strain, and the way of the middle aside [m]."""
        plate = YOUNGS_MODULUS / (1.0 - POISSONS_RATIO**2)
        bending, stretching = plate * self.thickness**3 / 12.0, plate * self.thickness

        def force(m: float) -> float:
            return float((4.0 * ellipk(m) / LENGTH) ** 2 * bending)

        def missed(m: float) -> float:
            bent = 2.0 - 2.0 * float(ellipe(m) / ellipk(m))
            return bent + force(m) / stretching - self.shortening

        m = brentq(missed, 1e-9, 0.9)
        return force(m), float(np.sqrt(m) / ellipk(m)) * LENGTH
