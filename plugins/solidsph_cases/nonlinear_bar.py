"""A bar whose end is pushed or pulled at a finite velocity: a shock, or a fan."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import nan
from typing import final

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.maths.arrays import Array
from solidsph.registry.parameters import check_positive, number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.studies.case import Case, Curves, Measurement, Trial
from solidsph_cases._bar import (
    DENSITY,
    LENGTH,
    POISSONS_RATIO,
    YOUNGS_MODULUS,
    along,
    bar,
    first_rise,
    stress_along,
    with_viscosity,
)
from solidsph_cases._compare import alone, compared, finished
from solidsph_cases._finite_waves import FiniteWave, Law, law_of
from solidsph_cases._scene import check_count
from solidsph_cases.drawing.sheet import Panel, Sheet, line, mark, note, theory

# The wave is watched until it has come so far: its exact solution knows no right end.
_END = 0.9  # of the bar

# Speeds are fitted to what happens after this part of the run, when a shock has its shape.
_SETTLED = 0.4

_OUTPUTS = 100
_STEP = 0.5  # of the critical step [-]

_SHOCK = "Rankine-Hugoniot"
_FAN = "simple wave, v = -integral of c ds"


@final
@attrs.frozen
class NonlinearBar(Case):
    """The end of a bar at rest moves at a constant velocity, given in confined wave speeds.

    The law is concave in uniaxial strain, so a push makes a shock and a pull a fan, each with its
    exact solution. Artificial viscosity gives the shock a width; the same runs without it show
    what it is for.
    """

    title = "Waves of finite amplitude in a bar"
    source = "Rankine-Hugoniot conditions and simple waves of Ismail & Reddy's law"
    figures = ("section-6-viscosity",)
    studies = {
        "time_step_factor": "viscosity acts on the velocity of half a step ago: the power that it "
        "takes is off by 2.4 % at the default step with 101 particles, by 1.5 % at this one; and "
        "in a trial, energies within 0.1 % without viscosity need a smaller one",
    }
    sweep = {
        "particles": (51, 101, 201, 401),
        "linear": (0.25, 0.5, 1.0),
        "cover": (1.6, 2.2, 3.0),
    }
    trials = {
        "pushed and pulled suddenly at 0.3 c": Trial(
            {"velocities": (0.3,), "time_step_factor": 0.3}, {"particles": 101}
        ),
        "pushed suddenly at 0.5 c, no viscosity": Trial(
            {"velocities": (0.5,)},
            must_fail="nothing gives a shock a width, so that particles run through each other",
        ),
    }

    velocities: Sequence[float] = (0.1, 0.3, 0.5)  # of pushes and of pulls [confined wave speeds]
    particles: int = 201
    linear: float = number(default=0.5)  # strengths of the artificial viscosity [-]
    quadratic: float = number(default=1.0)
    plateau_tolerance: float = number(default=0.02)  # largest error of a stress that passes [-]
    speed_tolerance: float = number(default=0.01)  # and of a speed

    def __attrs_post_init__(self) -> None:
        check_count("nonlinear-bar", "particles", self.particles, 51)
        for velocity in self.velocities:
            check_positive("nonlinear-bar", "a velocity", velocity, "confined wave speeds")
            # A pull beyond the law's range has no simple wave; the message says so.
            self.wave(-velocity)
            if velocity > 1.0:
                raise SceneError(
                    f"case 'nonlinear-bar': a push at {velocity:g} confined wave speeds halves the "
                    "bar's length several times over; take at most 1"
                )

    @property
    def law(self) -> Law:
        """The bar's, in uniaxial strain."""
        return law_of(YOUNGS_MODULUS, POISSONS_RATIO, DENSITY)

    def wave(self, velocity: float) -> FiniteWave:
        """The exact solution; a push is positive, a pull negative [confined wave speeds]."""
        v = velocity * self.law.small_speed
        return self.law.pushed(v) if v > 0.0 else self.law.pulled(-v)

    @property
    def waves(self) -> Mapping[str, FiniteWave]:
        """Exact solutions by the names of their scenes."""
        signed = [v for velocity in self.velocities for v in (velocity, -velocity)]
        return {_name(v): self.wave(v) for v in signed}

    def priced(self) -> Case:
        """The shock and the fan of 0.3 c_p."""
        return attrs.evolve(self, velocities=(0.3,))

    def accuracy(self, measurements: Sequence[Measurement]) -> Measurement:
        """The largest error of a profile."""
        profiles = [m for m in measurements if "of the profile" in m.quantity]
        worst = max(profiles, key=lambda m: m.value)
        return attrs.evolve(worst, error=worst.value)

    def scenes(self) -> Mapping[str, Scene]:
        scenes = {}
        for name, wave in self.waves.items():
            title = f"{self.title}: {name}"
            motion = {"x": f"{wave.velocity!r}*t"}
            builder = (
                bar(title, particles=self.particles, poissons_ratio=POISSONS_RATIO)
                .boundary("prescribed-motion", where="left", displacement=motion, label="end")
                .integrator(time_step_factor=_STEP)
                .duration(_END * LENGTH / wave.head)
                .outputs(_OUTPUTS)
            )
            scenes[f"{name}-inviscid"] = builder.scene()
            scenes[name] = with_viscosity(builder, self.linear, self.quadratic).scene()
        return scenes

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        return [
            measurement
            for name, wave in self.waves.items()
            for measurement in self._compared(
                name, wave, records[name], records[f"{name}-inviscid"]
            )
        ]

    def pictures(self, records: Mapping[str, Record]) -> Mapping[str, Sheet]:
        """Profiles at the end, pushes above and pulls below, and wave speeds."""
        waves = sorted(self.waves.items(), key=lambda pair: abs(pair[1].velocity))
        pushes, pulls = (
            [
                self._profile(name, wave, records, first=k == 0)
                for k, (name, wave) in enumerate(
                    pair for pair in waves if (pair[1].velocity < 0.0) == pulled
                )
            ]
            for pulled in (False, True)
        )
        profiles = Sheet(
            [pushes, pulls],
            (4.3 * len(pushes), 7.2),
            f"{self.title}: {self.particles} particles",
            key=pushes[0],
        )
        speeds = Sheet([[self._speeds(records)]], (7.0, 4.8), self.title)
        return {"section-6-viscosity-profiles": profiles, "section-6-viscosity-speeds": speeds}

    def _profile(
        self, name: str, wave: FiniteWave, records: Mapping[str, Record], *, first: bool
    ) -> Panel:
        """Stress along the bar at the end of a run."""
        record, inviscid = records[name], records[f"{name}-inviscid"]
        X, end = along(record), float(record.times[-1])
        places = np.linspace(0.0, LENGTH, 3000)
        modulus = self.law.lam + 2.0 * self.law.mu
        without = {"color": "tab:blue", "linewidth": 0.7, "label": "SPH without viscosity"}
        viscous = stress_along(record)[-1] / modulus
        marks = [
            theory(places, wave.stresses(places / end) / modulus),
            line(X, stress_along(inviscid)[-1] / modulus, "-", **without),
            line(X, viscous, "k.", markersize=3, label="SPH with viscosity"),
        ]
        if not finished(inviscid):
            words = f"without viscosity diverged at {1e6 * inviscid.times[-1]:.1f} us"
            marks.append(note(words))
        plateau = wave.stress / modulus
        speed, kind = abs(wave.velocity) / self.law.small_speed, "push" if wave.is_shock else "pull"
        return Panel(
            *marks,
            title=f"{kind} at {speed:g} c_p: stretch {wave.stretch:.4f}, t = {1e6 * end:.1f} us",
            x="X [m]",
            y="T11 / (lambda + 2 mu)" if first else "",
            same_x="X",
            ylim=sorted((1.9 * plateau, -0.6 * plateau)),
        )

    def _speeds(self, records: Mapping[str, Record]) -> Panel:
        """Speeds in the reference configuration over the velocity of the end."""
        law, c = self.law, self.law.small_speed
        largest = 1.1 * max(abs(wave.velocity) for wave in self.waves.values())
        velocities = np.linspace(0.002 * largest, largest, 40)
        v = velocities / c
        shocks = [law.pushed(float(velocity)) for velocity in velocities]
        fans = [law.pulled(float(velocity)) for velocity in velocities]
        tails, heads = ([getattr(w, end) / c for w in fans] for end in ("tail", "head"))
        fan = {"color": "0.88", "label": "fan, from its tail to its head"}
        linear = {"color": "0.5", "linewidth": 0.8, "linestyle": ":", "label": "linear theory"}
        measured = [
            (wave.velocity / c, half_speed(records[name], wave) / c)
            for name, wave in self.waves.items()
        ]
        sph = {"markerfacecolor": "white", "ms": 7, "label": "SPH, level of half the plateau"}
        return Panel(
            line(v, [w.head / c for w in shocks], label="shock"),
            mark("fill_between", -v, tails, heads, **fan),
            line(-v, [w.half_speed / c for w in fans], "k--", label="half of the fan"),
            mark("axhline", 1.0, **linear),
            mark("plot", *np.transpose(measured), "ko", **sph),
            x="velocity of the end / c_p   (pull < 0 < push)",
            y="wave speed / c_p",
            legend={"loc": "upper left", "fontsize": 10},
        )

    def curves(self, records: Mapping[str, Record]) -> Mapping[str, Curves]:
        return {
            f"profile-{name}": {
                "X [m]": along(records[name]),
                "T11 [Pa]": stress_along(records[name])[-1],
                "T11 without viscosity [Pa]": stress_along(records[f"{name}-inviscid"])[-1],
                "exact T11 [Pa]": exact_profile(records[name], wave),
            }
            for name, wave in self.waves.items()
        }

    def _compared(
        self, name: str, wave: FiniteWave, record: Record, inviscid: Record
    ) -> list[Measurement]:
        source = _SHOCK if wave.is_shock else _FAN
        of = "of the shock" if wave.is_shock else "of half the plateau in the fan"
        speed, stress = half_speed(record, wave), plateau(record, wave)
        over, without = overshoot(record, wave), overshoot(inviscid, wave)
        error = f"{name}: root mean square error of the profile at the end, relative"
        found = [
            compared(
                record,
                f"{name}: stress of the plateau",
                *(stress, "Pa", wave.stress, source, self.plateau_tolerance),
            ),
            compared(
                record,
                f"{name}: speed {of}",
                *(speed, "m/s", wave.half_speed, source, self.speed_tolerance),
            ),
            alone(record, error, profile_error(record, wave)),
        ]
        if wave.is_shock:
            found.append(self._power(name, wave, record))
        return [
            *found,
            alone(record, f"{name}: overshoot over the plateau", over),
            # Without viscosity nothing is promised: whether it even finished is the finding.
            attrs.evolve(
                alone(inviscid, f"{name}: overshoot over the plateau, without viscosity", without),
                verdict=inviscid.outcome.partition(":")[0],
                passed=True,
            ),
        ]

    def _power(self, name: str, shock: FiniteWave, record: Record) -> Measurement:
        """Power that the shock takes; nothing of it is in the viscosity's formula."""
        found = compared(
            record,
            f"{name}: power that viscosity takes",
            *(viscous_power(record), "W/m^2", shock.dissipation, _SHOCK, self.plateau_tolerance),
        )
        # A weak shock steepens slowly against viscosity, which dissipates more until it has: with
        # the kinematic viscosity nu = linear c s / 2 that takes some nu / (U - c)^2.
        spacing, c = LENGTH / (self.particles - 1), self.law.small_speed
        steepening = 0.5 * self.linear * c * spacing / (shock.head - c) ** 2
        if 4.0 * steepening < _SETTLED * record.times[-1]:
            return found
        verdict = "not judged: still steepening"
        return attrs.evolve(found, verdict=verdict, passed=finished(record))


def exact_profile(record: Record, wave: FiniteWave) -> Array:
    """Exact stress of the bar's particles at the end, (n,) [Pa]."""
    return wave.stresses(along(record) / record.times[-1])


def plateau(record: Record, wave: FiniteWave) -> float:
    """Mean stress at the end over the middle half of what the wave has left uniform [Pa]."""
    part = along(record) / (wave.tail * record.times[-1])
    middle = (part >= 0.25) & (part <= 0.75)
    return float(stress_along(record)[-1][middle].mean()) if middle.any() else nan


def half_speed(record: Record, wave: FiniteWave) -> float:
    """Slope over time of where the stress is half of that behind the wave [m/s]."""
    X = along(record)
    later = record.times >= _SETTLED * record.times[-1]
    # From the front backwards, so that what rings behind it is not asked.
    places = [
        first_rise(X[::-1], one[::-1] / wave.stress, 0.5) for one in stress_along(record)[later]
    ]
    if len(places) < 2 or not np.all(np.isfinite(places)):  # it diverged, or there is no front
        return nan
    return float(np.polyfit(record.times[later], places, 1)[0])


def overshoot(record: Record, wave: FiniteWave) -> float:
    """By how much the largest stress at the end exceeds the plateau, over it [-]."""
    return float((stress_along(record)[-1] / wave.stress).max() - 1.0)


def profile_error(record: Record, wave: FiniteWave) -> float:
    """Root mean square error of the stress at the end over that of the exact [-]."""
    exact = exact_profile(record, wave)
    return float(np.sqrt(np.mean((stress_along(record)[-1] - exact) ** 2) / np.mean(exact**2)))


def viscous_power(record: Record) -> float:
    """Rate at which artificial viscosity takes energy once the shock has its shape [W/m^2]."""
    later = record.times >= _SETTLED * record.times[-1]
    if later.sum() < 2:
        return nan
    work = record.history["work of viscosity [J]"][later]
    return -float(np.polyfit(record.times[later], work, 1)[0])


def _name(velocity: float) -> str:
    return f"{'push' if velocity > 0.0 else 'pull'}-{abs(velocity):g}"
