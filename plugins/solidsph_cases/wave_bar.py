"""The paper's validation: a small pulse in a bar, its reflections, and its stress histories."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import ceil, sqrt
from typing import final

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.registry.parameters import number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.studies.case import Case, Curves, Measurement
from solidsph_builtin.materials.neo_hookean import NeoHookean
from solidsph_cases import _wave_measures as measures
from solidsph_cases._bar import (
    DENSITY,
    LENGTH,
    POISSONS_RATIO,
    YOUNGS_MODULUS,
    along,
    bar,
    stress_along,
    with_viscosity,
)
from solidsph_cases._bar_histories import SOURCE, Histories
from solidsph_cases._bar_pictures import Column, histories_sheet
from solidsph_cases._bar_waves import FREE, HELD, BarWaves, Pulse, smooth_pulse, square_pulse
from solidsph_cases._compare import alone, finished
from solidsph_cases._scene import ON_BOUNDARY, check_all_positive, check_count, solid
from solidsph_cases._wave_measures import STATIONS, TRAVELLING
from solidsph_cases.drawing.convergence import errors_panel
from solidsph_cases.drawing.sheet import Sheet

# Every step with up to 241 particles: the particle at the loaded end vibrates with a period of five
# steps and nearly the height of the pulse, and a mean over fewer outputs may miss the same phase of
# each period.
_OUTPUTS = 1300

# Scenes that go by no reading and pulse alone.
_MOVED, _PAPER_SUMS = "uniaxial-strain-smooth-moved", "paper-speed-square-paper-sums"

# With an error h^2 k^3 of each wave number k, and sin^2 of Fourier coefficients k^-3: all below
# h^(-2/3) are right, and what lies beyond has the norm k^(-5/2), so h^(5/3).
_ORDER = 5.0 / 3.0


@final
@attrs.frozen
class Reading:
    """How the text is read: what the bar's Poisson's ratio is, and so its wave speed."""

    name: str
    label: str
    poissons_ratio: float

    @property
    def speed(self) -> float:
        """sqrt((lambda + 2 mu) / rho) [m/s]."""
        nu = self.poissons_ratio
        confined = YOUNGS_MODULUS * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu))
        return sqrt(confined / DENSITY)


STRAIN = Reading("uniaxial-strain", "uniaxial strain, nu = 0.3", POISSONS_RATIO)
PAPER = Reading("paper-speed", "the paper's c^2 = E/rho, nu = 0", 0.0)
READINGS = (STRAIN, PAPER)


@final
@attrs.frozen
class WaveBar(Case):
    """A pulse of -100 kPa enters a bar at the left and is reflected at its fixed right end.

    The paper confines the bar to its axis, where waves travel at sqrt((lambda + 2 mu) / rho), and
    names E / rho the square of its speed, which is that of a bar free to contract. Both are run:
    the first as it stands, the second with nu = 0, for which the two speeds are one. The pulse is
    a traction, square and smooth; the paper imposes a strain, which is a motion of the left end,
    and after which that end is held and not free: one scene shows it. Another runs the paper's own
    sums with ghosts, on which nothing is judged.
    """

    title = "A small stress wave in a bar"
    source = "Ismail & Reddy, section 5.1, Figs. 10 and 11"
    figures = ("fig-10", "fig-11")
    studies = dict.fromkeys(
        ("scheme", "kernel", "cover", "discretisation"),
        "one scene has the paper's own sums, completed by ghosts",
    )

    particles: int = 61
    stress: float = number(default=-100e3)  # of the pulse [Pa]
    pulse: float = number(default=10e-6)  # its duration [s]
    transits: float = number(default=3.2)  # duration [wave transits of the bar]
    convergence: Sequence[int] = (61, 121, 241)  # particles, of the smooth pulse
    paper_cover: float = number(default=3.5)  # of the paper's own sums [spacings]
    linear: float = number(default=0.5)  # strengths of the artificial viscosity [-]
    quadratic: float = number(default=1.0)

    def __attrs_post_init__(self) -> None:
        for count in (self.particles, *self.convergence):
            check_count("wave-bar", "a number of particles", count, 31)
            if (count - 1) % 3:
                raise SceneError(
                    f"case 'wave-bar': {count} particles leave none at 0.05 and 0.10 m, where "
                    "stresses are read; take one more than a multiple of three, such as 61"
                )
        check_all_positive("wave-bar", self, pulse="seconds", paper_cover="particle spacings")
        longest = 2.0 * (LENGTH - STATIONS[2]) / STRAIN.speed
        if self.pulse > longest:
            raise SceneError(
                f"case 'wave-bar': a pulse of {self.pulse:.4g} s has not passed 0.10 m when it "
                f"comes back from the wall; take at most {longest:.4g} s"
            )
        if not -1e8 <= self.stress < 0.0:
            raise SceneError(
                f"case 'wave-bar': stress must be compressive and at most 1e8 Pa, for which the "
                f"law is linear to some 1e-3, got {self.stress}; the paper's is -1e5"
            )
        shortest = self.pulse * STRAIN.speed / LENGTH + 2.0 + TRAVELLING / LENGTH
        if not self.transits >= shortest:
            raise SceneError(
                f"case 'wave-bar': after {self.transits} transits the pulse has not come back from "
                f"the left end; take at least {shortest:.3g}"
            )

    @property
    def pulses(self) -> tuple[Pulse, Pulse]:
        """Smooth and square."""
        return smooth_pulse(self.pulse), square_pulse(self.pulse)

    def exact(self, reading: Reading, pulse: Pulse, left: float = FREE) -> BarWaves:
        """The solution of one scene; `left` says what the left end is after the pulse."""
        return BarWaves(LENGTH, reading.speed, DENSITY, self.stress, pulse, left)

    def priced(self) -> Case:
        """The smooth pulse alone."""
        return SmoothPulse(self.particles)

    def scenes(self) -> Mapping[str, Scene]:
        smooth, square = self.pulses
        scenes = {}
        for reading in READINGS:
            for pulse in self.pulses:
                loaded = self.loaded(reading, pulse, self.particles)
                scenes[f"{reading.name}-{pulse.name}"] = loaded.scene()
            viscous = self.loaded(reading, square, self.particles)
            viscous = with_viscosity(viscous, self.linear, self.quadratic)
            scenes[f"{reading.name}-square-viscous"] = viscous.scene()
        moved = self._bar(STRAIN, smooth, self.particles)
        scenes[_MOVED] = self._with_moved_end(moved, STRAIN, smooth).scene()
        scenes[_PAPER_SUMS] = self._paper_sums(square).scene()
        for count in self.convergence:
            scenes[_convergence_name(count)] = self.loaded(STRAIN, smooth, count).scene()
        return scenes

    def loaded(self, reading: Reading, pulse: Pulse, particles: int) -> SceneBuilder:
        """The pulse as a traction: the normal of the left end points to the left."""
        return self._bar(reading, pulse, particles).boundary(
            "traction", where="left", traction={"x": f"{-self.stress!r}*{pulse.formula}"}
        )

    def _bar(self, reading: Reading, pulse: Pulse, particles: int) -> SceneBuilder:
        title = f"{self.title}: {pulse.name} pulse, {reading.label}"
        nu = reading.poissons_ratio
        return (
            bar(title, particles=particles, poissons_ratio=nu)
            .boundary("clamp", where="right")
            .duration(self.transits * LENGTH / reading.speed)
            .outputs(_OUTPUTS)
        )

    def _with_moved_end(
        self, builder: SceneBuilder, reading: Reading, pulse: Pulse
    ) -> SceneBuilder:
        """The pulse as a strain, the paper's way: v = -T / (rho c) of the left end sends it."""
        height = -self.stress / (DENSITY * reading.speed)
        motion = {"x": f"{height!r}*{pulse.integral_formula}"}
        return builder.boundary("prescribed-motion", where="left", displacement=motion)

    def _paper_sums(self, pulse: Pulse) -> SceneBuilder:
        """The same with the paper's kernel and plain sums, completed by ghosts."""
        title = f"{self.title}: {pulse.name} pulse of strain, the paper's sums"
        shape, spacing = {"type": "interval", "length": LENGTH}, LENGTH / (self.particles - 1)
        material = NeoHookean(YOUNGS_MODULUS, PAPER.poissons_ratio, DENSITY)
        lattice = {**ON_BOUNDARY, "ghosts": ceil(self.paper_cover)}
        builder = (
            solid(title, "bar", shape, spacing, material, discretisation=lattice)
            .scheme("paper")
            .kernel("modified-mollifier", cover=self.paper_cover)
            # The paper's sums have no energy near the ends, and what it shows is the wave.
            .energy_tolerance("off")
            .boundary("clamp", where="right")
        )
        return (
            self._with_moved_end(builder, PAPER, pulse)
            .boundary("ghost-extension")
            .duration(self.transits * LENGTH / PAPER.speed)
            .outputs(_OUTPUTS)
        )

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        smooth, square = self.pulses
        found = []
        for reading in READINGS:
            pulse = f"{reading.label}, smooth pulse"
            record = records[f"{reading.name}-smooth"]
            histories = Histories.of(record, self.exact(reading, smooth))
            found += measures.smooth_pulse(histories, pulse)
            for tail, words in (("", ""), ("-viscous", " with viscosity")):
                record = records[f"{reading.name}-square{tail}"]
                histories = Histories.of(record, self.exact(reading, square))
                pulse = f"{reading.label}, square pulse{words}"
                found += measures.square_pulse(histories, pulse, viscous=bool(tail))
        moved = Histories.of(records[_MOVED], self.exact(STRAIN, smooth, HELD))
        found += measures.returned_pulse(moved, f"{STRAIN.label}, smooth pulse of strain")
        paper = Histories.of(records[_PAPER_SUMS], self.exact(PAPER, square, HELD))
        sums = f"the paper's sums, cover {self.paper_cover:g}, square pulse of strain"
        return [*found, *measures.paper_noise(paper, sums), *self._order(records)]

    def _order(self, records: Mapping[str, Record]) -> list[Measurement]:
        runs = [records[_convergence_name(count)] for count in self.convergence]
        errors = [self.error(record) for record in runs]
        error = "root mean square error of all stresses, relative"
        found = [
            alone(record, f"{STRAIN.label}, smooth pulse, {count} particles: {error}", value)
            for record, count, value in zip(runs, self.convergence, errors, strict=True)
        ]
        if len(runs) < 2:
            return found
        spacings = np.log(np.array(self.convergence) - 1)
        order = -float(np.polyfit(spacings, np.log(errors), 1)[0])
        above = order > _ORDER
        return [
            *found,
            Measurement(
                "fitted order of that error",
                order,
                "1",
                reference=_ORDER,
                source="dispersion of the second order, for a stress whose second derivative jumps",
                error=abs(order / _ORDER - 1.0),
                verdict="at least that" if above else "BELOW it",
                passed=above and finished(*runs),
                paper="section 6 asks for convergence with the number of particles",
            ),
        ]

    def error(self, record: Record) -> float:
        """Root mean square error of the smooth pulse's stress over all particles and times,
        relative to the root mean square of the exact."""
        exact = self.exact(STRAIN, self.pulses[0])
        theory = exact.stress(along(record), record.times[:, None])
        return float(np.sqrt(np.mean((stress_along(record) - theory) ** 2) / np.mean(theory**2)))

    def pictures(self, records: Mapping[str, Record]) -> Mapping[str, Sheet]:
        """Histories at the stations, those by the paper's sums, and the convergence."""
        smooth, square = self.pulses
        columns = [
            Column(
                f"{pulse.name} pulse\n{reading.label}\n"
                f"c = {reading.speed:.0f} m/s, {1e6 * LENGTH / reading.speed:.2f} us to the wall",
                self.exact(reading, pulse),
                records[f"{reading.name}-{pulse.name}"],
                records.get(f"{reading.name}-{pulse.name}-viscous"),
            )
            for pulse in (square, smooth)
            for reading in READINGS
        ]
        heading = (
            f"the paper's sums, cover {self.paper_cover:g} spacings\n"
            f"square pulse of strain, {PAPER.label}"
        )
        paper = Column(heading, self.exact(PAPER, square, HELD), records[_PAPER_SUMS])
        sheets = {
            "fig-10-11-wave-bar": histories_sheet(columns, STATIONS, self.title),
            "fig-11-wave-bar-paper-sums": histories_sheet([paper], STATIONS, self.title),
        }
        if len(self.convergence) >= 2:
            runs = (records[_convergence_name(count)] for count in self.convergence)
            errors = np.array([self.error(record) for record in runs])
            spacings = 1e3 * LENGTH / (np.array(self.convergence) - 1)
            converging = errors_panel(
                spacings,
                {"smooth pulse, all particles and times": errors},
                (_ORDER, 2),
                [f"{spacing:.3g}" for spacing in spacings],
                "particle spacing [mm]",
                "root mean square error of T11, relative",
            )
            sheets["wave-bar-convergence"] = Sheet([[converging]], (5.6, 4.4))
        return sheets

    def curves(self, records: Mapping[str, Record]) -> Mapping[str, Curves]:
        smooth, square = self.pulses
        exact = {
            f"{reading.name}-{pulse.name}{tail}": self.exact(reading, pulse)
            for reading in READINGS
            for pulse in self.pulses
            for tail in ("", "-viscous")
        }
        exact[_MOVED] = self.exact(STRAIN, smooth, HELD)
        exact[_PAPER_SUMS] = self.exact(PAPER, square, HELD)
        return {
            f"histories-{name}": _table(records[name], solution)
            for name, solution in exact.items()
            if name in records
        }


@final
@attrs.frozen
class SmoothPulse(Case):
    """What of `wave-bar` is held against cost: its smooth pulse, to the wall and back."""

    title = "A small, smooth stress wave in a bar"
    source = SOURCE
    sweep = {
        "particles": (61, 121, 241, 481, 961),
        "gradient": ("consistent", "quadratic", "corrected"),
        "cover": (1.6, 2.2, 3.5),
    }

    particles: int = 61

    @property
    def _case(self) -> WaveBar:
        return WaveBar(particles=self.particles, convergence=())

    def scenes(self) -> Mapping[str, Scene]:
        case = self._case
        return {"pulse": case.loaded(STRAIN, case.pulses[0], self.particles).scene()}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        record = records["pulse"]
        error = self._case.error(record)
        found = alone(record, "root mean square error of all stresses, relative", error)
        return [attrs.evolve(found, source=SOURCE, error=error)]


def _table(record: Record, exact: BarWaves) -> Curves:
    """Histories at the stations, computed and exact."""
    histories = Histories.of(record, exact)
    columns = {"t [s]": record.times}
    for station in STATIONS:
        columns[f"T11 at {station:g} m [Pa]"] = histories.at(station)
        columns[f"exact T11 at {station:g} m [Pa]"] = exact.stress(np.array(station), record.times)
    return columns


def _convergence_name(count: int) -> str:
    return f"convergence-{count}"
