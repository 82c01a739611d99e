"""A cantilever plate in its first bending mode."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import ceil, cos, cosh, nan, pi, sin, sinh, sqrt
from pathlib import Path
from typing import Any, ClassVar, final

import attrs
import numpy as np
from scipy.optimize import least_squares

from solidsph.maths.arrays import Array
from solidsph.registry.parameters import check_positive, number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.simulation import Simulation
from solidsph.statics import frequencies
from solidsph.studies.case import Case, Measurement, Trial
from solidsph_cases._compare import compared
from solidsph_cases._scheme import check_count, with_scheme

LENGTH = 0.2  # [m]
HEIGHT = 0.02  # [m]
YOUNGS_MODULUS = 2e6  # [Pa]
DENSITY = 1000.0  # [kg/m^3]

# First root of cos kL cosh kL = -1.
KL = 1.8751040687119611

# The period at a finite thickness, from finite elements, at the one ratio where it is known.
_SOLID = {0.3975: 0.2552}  # Poisson's ratio -> [s]
_SOLID_SOURCE = "quadratic finite elements of the plate as a solid, thickness and shear included"
_THIN_SOURCE = "thin plate theory, omega^2 = E H^2 k^4 / (12 rho (1 - nu^2))"

# Slow motions in which neighbours move against each other are no bending modes: so many are looked
# through for one of which the kernel's smoothing leaves more than half.
_MODES = 12
_SMOOTH = 0.5

_OUTPUTS = 80.0  # a period; the second mode, six times as fast, is seen 13 times a period


@final
@attrs.frozen
class CantileverPlate(Case):
    """A plate clamped at one end starts through its straight shape in its first bending mode.

    Its initial velocity is v_y = speed c0 f(x) / f(L), with f the mode of a clamped and free beam
    and c0 the bulk sound speed (Gray, Monaghan & Swift 2001). The default speed keeps the amplitude
    near one per cent of the length, where the period no longer depends on it. The tip's history
    gives the period, and so do, independently, the natural frequencies of the same operators.
    """

    title: ClassVar[str] = "An oscillating cantilever plate"
    source: ClassVar[str] = "Landau & Lifshitz, Theory of Elasticity; Gray, Monaghan & Swift (2001)"
    sweep: ClassVar[Mapping[str, Sequence[Any]]] = {
        "across": (5, 7, 11, 15),
        "gradient": ("consistent", "quadratic", "corrected"),
        "cover": (1.8, 2.2, 2.6),
    }
    trials: ClassVar[Mapping[str, Trial]] = {
        "Poisson's ratio 0.4999": Trial(
            {"poissons_ratio": 0.4999, "across": 7, "tolerance": 0.05},
            {"across": 4, "engine": "matrix", "tolerance": 0.1},
        ),
    }

    across: int = 20  # particles across the plate
    poissons_ratio: float = number(default=0.3975)
    speed: float = number(default=1e-3)  # of the tip, in bulk sound speeds [-]
    periods: float = number(default=0.55)  # duration, in periods of a thin plate
    kernel: str = "cubic-spline"
    cover: float = number(default=2.2)  # [spacings]
    gradient: str = "quadratic"
    hourglass: float = number(default=0.0)  # strength [-]; 0 names none
    engine: str = "auto"
    integrator: str = "central-difference"
    time_step_factor: float = number(default=0.6)  # of the CFL step
    tolerance: float = number(default=0.01)  # largest error of the period that passes [-]

    def __attrs_post_init__(self) -> None:
        check_count("cantilever-plate", "across", self.across, 3)
        for name, unit in (
            ("speed", "bulk sound speeds"),
            ("periods", "periods of a thin plate"),
            ("tolerance", "parts of one"),
        ):
            check_positive("cantilever-plate", name, getattr(self, name), unit)

    @property
    def thin_plate_period(self) -> float:
        """Period of a thin plate in plane strain [s]."""
        stiffness = YOUNGS_MODULUS / (12.0 * DENSITY * (1.0 - self.poissons_ratio**2))
        return 2.0 * pi / (sqrt(stiffness) * HEIGHT * (KL / LENGTH) ** 2)

    @property
    def tip_speed(self) -> float:
        """Initial velocity of the tip [m/s]."""
        bulk = YOUNGS_MODULUS / (3.0 * (1.0 - 2.0 * self.poissons_ratio))
        return self.speed * sqrt(bulk / DENSITY)

    def scenes(self) -> Mapping[str, Scene]:
        spacing = HEIGHT / (self.across - 1)
        builder = with_scheme(
            Simulation.builder()
            .title(self.title)
            .body(
                "plate",
                shape={
                    "type": "box",
                    "lengths": [LENGTH, HEIGHT],
                    "origin": [0.0, -0.5 * HEIGHT],
                },
                spacing=spacing,
                discretisation={
                    "type": "fitted-moments",
                    "of": {"type": "lattice", "on_boundary": True},
                },
                tags={"tip": f"X > {LENGTH - 0.1 * spacing!r} and abs(Y) < {0.6 * spacing!r}"},
            )
            .material(
                "neo-hookean",
                youngs_modulus=YOUNGS_MODULUS,
                poissons_ratio=self.poissons_ratio,
                density=DENSITY,
            )
            .boundary("clamp", where="left")
            .initial(velocity={"x": 0.0, "y": f"{self.tip_speed!r}*({mode_formula()})"})
            .integrator(self.integrator, time_step_factor=self.time_step_factor)
            .duration(self.periods * self.thin_plate_period)
            .outputs(ceil(_OUTPUTS * self.periods)),
            self,
        )
        return {"plate": builder.scene()}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        record = records["plate"]
        known = _SOLID.get(self.poissons_ratio)
        reference = self.thin_plate_period if known is None else known
        source = _THIN_SOURCE if known is None else _SOLID_SOURCE
        found = {
            "period, from the tip's history": period_of(
                record.times, tip_deflection(record), self.thin_plate_period
            ),
            "period, from natural frequencies": self.natural_period(),
        }
        return [
            compared(record, name, value, "s", reference, source, self.tolerance)
            for name, value in found.items()
        ]

    def natural_period(self) -> float:
        """Period of the slowest smooth mode [s], by statics of the same operators."""
        (scene,) = self.scenes().values()
        # Only matrices are needed, which every engine would have to be asked for.
        simulation = Simulation.builder(attrs.evolve(scene, engine="matrix")).build()
        modes = frequencies(simulation, _MODES)
        smooth = np.flatnonzero(modes.smoothness > _SMOOTH)
        return float(2.0 * pi / modes.angular_frequencies[smooth[0]]) if len(smooth) else nan

    def draw(self, records: Mapping[str, Record], folder: Path) -> Sequence[Path]:
        from solidsph_cases._plate_picture import draw_plate

        path = folder / "cantilever-plate.png"
        draw_plate(records["plate"], self.measure(records), self.title, path)
        return [path]


def mode_formula() -> str:
    """f(X) / f(L) of the first mode of a clamped and free beam, in the words of scenes."""
    m = sin(KL) + sinh(KL)
    n = cos(KL) + cosh(KL)
    at_tip = m * (cos(KL) - cosh(KL)) - n * (sin(KL) - sinh(KL))
    k = KL / LENGTH
    return (
        f"{m / at_tip!r}*(cos({k!r}*X) - cosh({k!r}*X))"
        f" - {n / at_tip!r}*(sin({k!r}*X) - sinh({k!r}*X))"
    )


def tip_deflection(record: Record) -> Array:
    """u_y of mid-height at the free end at every time, (t,) [m]."""
    particles = record.particles
    tip = particles.tagged("tip")
    u: Array = record.positions[:][:, tip, 1].mean(axis=1) - particles.positions[tip, 1].mean()
    return u


def period_of(times: Array, values: Array, guess: float) -> float:
    """Period [s] of the sine, zero at the start, that fits `values` best; nan if too short."""
    if times[-1] < 0.3 * guess:
        return nan
    scale = float(np.abs(values).max())

    def misfit(p: Array) -> Array:
        return np.asarray(p[1] * np.sin(2.0 * pi * times / (p[0] * guess)) - values / scale)

    return float(least_squares(misfit, [1.0, 1.0], xtol=1e-12, ftol=1e-12).x[0] * guess)
