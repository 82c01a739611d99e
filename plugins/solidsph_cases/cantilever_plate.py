"""A cantilever plate in its first bending mode."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from math import ceil, cos, cosh, nan, pi, sin, sinh, sqrt
from typing import final

import attrs
import numpy as np
from scipy.optimize import least_squares

from solidsph.maths.arrays import Array
from solidsph.maths.formulas import Expression
from solidsph.registry.parameters import number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.simulation import Simulation
from solidsph.statics import frequencies
from solidsph.studies.case import Case, Measurement, Trial
from solidsph_builtin.materials.neo_hookean import NeoHookean
from solidsph_cases._compare import compared
from solidsph_cases._scene import box, check_all_positive, check_count, solid
from solidsph_cases.drawing.sheet import Panel, Sheet, line, theory, zero

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

    title = "An oscillating cantilever plate"
    source = "Landau & Lifshitz, Theory of Elasticity; Gray, Monaghan & Swift (2001)"
    sweep = {
        "across": (5, 7, 11, 15),
        "gradient": ("consistent", "quadratic", "corrected"),
        "cover": (2.2, 2.6, 3.0),
    }
    trials = {
        "Poisson's ratio 0.4999": Trial(
            {"poissons_ratio": 0.4999, "across": 7, "tolerance": 0.05},
            {"across": 4, "tolerance": 0.05},
        ),
    }

    across: int = 20  # particles across the plate
    poissons_ratio: float = number(default=0.3975)
    speed: float = number(default=1e-3)  # of the tip, in bulk sound speeds [-]
    periods: float = number(default=0.55)  # duration, in periods of a thin plate
    tolerance: float = number(default=0.01)  # largest error of the period that passes [-]

    def __attrs_post_init__(self) -> None:
        check_count("cantilever-plate", "across", self.across, 3)
        check_all_positive(
            "cantilever-plate",
            self,
            speed="bulk sound speeds",
            periods="periods of a thin plate",
            tolerance="parts of one",
        )

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
        shape = box(LENGTH, HEIGHT, origin=[0.0, -0.5 * HEIGHT])
        material = NeoHookean(YOUNGS_MODULUS, self.poissons_ratio, DENSITY)
        tags = {"tip": f"X > {LENGTH - 0.1 * spacing!r} and abs(Y) < {0.6 * spacing!r}"}
        velocity: dict[str, float | str] = {"x": 0.0, "y": f"{self.tip_speed!r}*({mode_formula()})"}
        builder = (
            solid(self.title, "plate", shape, spacing, material, tags=tags)
            .boundary("clamp", where="left")
            .initial(velocity=velocity)
            .duration(self.periods * self.thin_plate_period)
            .outputs(ceil(_OUTPUTS * self.periods))
        )
        return {"plate": builder.scene()}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        record = records["plate"]
        known = _SOLID.get(self.poissons_ratio)
        reference = self.thin_plate_period if known is None else known
        source = _THIN_SOURCE if known is None else _SOLID_SOURCE
        compare = partial(
            compared, unit="s", reference=reference, source=source, tolerance=self.tolerance
        )
        period = period_of(record.times, tip_deflection(record), self.thin_plate_period)
        return [
            compare(record, "period, from the tip's history", period),
            compare(record, "period, from natural frequencies", natural_period(record)),
        ]

    def pictures(self, records: Mapping[str, Record]) -> Mapping[str, Sheet]:
        """The deflection of the mid-plane when it is largest, and the tip over time."""
        record = records["plate"]
        particles, tip = record.particles, tip_deflection(record)
        largest, spacing = int(np.argmax(np.abs(tip))), float(particles.spacings[0])
        # The row at mid-height, or the one just above it.
        height = particles.positions[:, 1]
        middle = np.flatnonzero((height > -0.1 * spacing) & (height < 0.6 * spacing))
        middle = middle[:: max(1, len(middle) // 30)]
        X = particles.positions[middle, 0]
        u = (record.positions[largest] - particles.positions)[middle, 1]
        x = np.linspace(0.0, LENGTH, 200)
        mode = Expression.parse(mode_formula(), ("X",))({"X": x})
        shape = Panel(
            theory(x, mode, "beam theory"),
            line(X, u / tip[largest], "ko", markersize=4, label="mid-plane"),
            x="X [m]",
            y="deflection over that of the tip",
            legend={"loc": "upper left"},
        )
        measured, natural = self.measure(records)
        period = measured.reference or nan
        times = np.linspace(0.0, float(record.times[-1]), 400)
        swing = 1e3 * float(np.abs(tip).max()) * np.sin(2.0 * np.pi * times / period)
        label = f"tip: T = {measured.value:.4f} s (natural: {natural.value:.4f} s)"
        history = Panel(
            theory(times, swing, f"reference: T = {period:.4f} s"),
            line(record.times, 1e3 * tip, "ko", markersize=4, label=label),
            zero(),
            x="time [s]",
            y="deflection of the tip [mm]",
            legend={"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "ncols": 2},
        )
        title = f"{self.title}: {particles.count} particles"
        sheet = Sheet([[shape, history]], (11.0, 4.4), title, widths=(1.0, 1.3))
        return {"cantilever-plate": sheet}


def natural_period(record: Record) -> float:
    """Period of the slowest smooth mode [s], by statics of the operators of a run."""
    scene = Scene.from_toml(record.scene)
    # Only matrices are needed, which every engine would have to be asked for.
    simulation = Simulation.builder(attrs.evolve(scene, engine="matrix")).build()
    modes = frequencies(simulation, _MODES)
    smooth = np.flatnonzero(modes.smoothness > _SMOOTH)
    return float(2.0 * pi / modes.angular_frequencies[smooth[0]]) if len(smooth) else nan


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
    X, tip = record.particles.positions, record.particles.tagged("tip")
    return np.asarray(record.positions[:][:, tip, 1].mean(axis=1) - X[tip, 1].mean())


def period_of(times: Array, values: Array, guess: float) -> float:
    """Period [s] of the sine, zero at the start, that fits `values` best; nan if too short."""
    if times[-1] < 0.3 * guess:
        return nan
    scale = float(np.abs(values).max())

    def misfit(p: Array) -> Array:
        return np.asarray(p[1] * np.sin(2.0 * pi * times / (p[0] * guess)) - values / scale)

    return float(least_squares(misfit, [1.0, 1.0], xtol=1e-12, ftol=1e-12).x[0] * guess)
