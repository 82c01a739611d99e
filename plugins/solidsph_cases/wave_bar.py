"""The paper's validation: a small pulse in a bar, its reflections, and its stress histories."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import ceil, sqrt
from pathlib import Path
from typing import ClassVar, final

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.registry.parameters import check_positive, number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.simulation import Simulation
from solidsph.studies.case import Case, Curves, Measurement
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
from solidsph_cases._bar_waves import FREE, HELD, BarWaves, Pulse, Smooth, Square
from solidsph_cases._compare import FINISHED, compared
from solidsph_cases._scheme import check_count

STATIONS = (0.0, 0.05, 0.10, 0.15)  # of the histories [m]

_OUTPUTS = 600
_TRAVELLING = 0.05  # [m], a station that sees each passage of the pulse by itself

# Scenes that go by no reading and pulse alone.
_MOVED, _PAPER_SUMS = "uniaxial-strain-smooth-moved", "paper-speed-square-paper-sums"

# Largest relative errors that pass.
_ARRIVAL, _PEAK, _WALL, _PLATEAU = 0.01, 0.02, 0.03, 0.02


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

    title: ClassVar[str] = "A small stress wave in a bar"
    source: ClassVar[str] = "Ismail & Reddy, section 5.1, Figs. 10 and 11"
    figures: ClassVar[tuple[str, ...]] = ("fig-10", "fig-11")

    particles: int = 61
    stress: float = number(default=-100e3)  # of the pulse [Pa]
    pulse: float = number(default=10e-6)  # its duration [s]
    transits: float = number(default=3.2)  # duration [wave transits of the bar]
    convergence: Sequence[int] = (61, 121, 241)  # particles, of the smooth pulse
    paper_cover: float = number(default=3.5)  # of the paper's own sums [spacings]
    linear: float = number(default=0.5)  # strengths of the artificial viscosity [-]
    quadratic: float = number(default=1.0)
    kernel: str = "cubic-spline"
    cover: float = number(default=2.2)  # [spacings]
    gradient: str = "consistent"
    hourglass: float = number(default=0.0)  # strength [-]; 0 names none
    engine: str = "auto"
    integrator: str = "central-difference"
    time_step_factor: float = number(default=0.5)  # of the CFL step

    def __attrs_post_init__(self) -> None:
        for count in (self.particles, *self.convergence):
            check_count("wave-bar", "a number of particles", count, 31)
            if (count - 1) % 3:
                raise SceneError(
                    f"case 'wave-bar': {count} particles leave none at 0.05 and 0.10 m, where "
                    "stresses are read; take one more than a multiple of three, such as 61"
                )
        check_positive("wave-bar", "pulse", self.pulse, "seconds")
        check_positive("wave-bar", "paper_cover", self.paper_cover, "particle spacings")
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
        shortest = self.pulse * STRAIN.speed / LENGTH + 2.0 + _TRAVELLING / LENGTH
        if not self.transits >= shortest:
            raise SceneError(
                f"case 'wave-bar': after {self.transits} transits the pulse has not come back from "
                f"the left end; take at least {shortest:.3g}"
            )

    @property
    def pulses(self) -> tuple[Pulse, Pulse]:
        """Smooth and square."""
        return Smooth(self.pulse), Square(self.pulse)

    def exact(self, reading: Reading, pulse: Pulse, left: float = FREE) -> BarWaves:
        """The solution of one scene; `left` tells what the left end is after the pulse."""
        return BarWaves(LENGTH, reading.speed, DENSITY, self.stress, pulse, left)

    def priced(self) -> Case:
        """The smooth pulse alone."""
        from solidsph_cases._smooth_pulse import SmoothPulse  # which is made of this one

        return SmoothPulse.of(self)

    def scenes(self) -> Mapping[str, Scene]:
        scenes = {}
        for reading in READINGS:
            for pulse in self.pulses:
                loaded = self.loaded(reading, pulse, self.particles)
                scenes[f"{reading.name}-{pulse.name}"] = loaded.scene()
            viscous = with_viscosity(
                self.loaded(reading, self.pulses[1], self.particles), self.linear, self.quadratic
            )
            scenes[f"{reading.name}-square-viscous"] = viscous.scene()
        scenes[_MOVED] = self._moved(self.pulses[0]).scene()
        scenes[_PAPER_SUMS] = self._paper_sums(self.pulses[1]).scene()
        for count in self.convergence:
            scenes[_convergence_name(count)] = self.loaded(STRAIN, self.pulses[0], count).scene()
        return scenes

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        found = [
            measurement
            for reading in READINGS
            for measurement in (
                *self._smooth(reading, records[f"{reading.name}-smooth"]),
                *self._square(reading, records[f"{reading.name}-square"], viscous=False),
                *self._square(reading, records[f"{reading.name}-square-viscous"], viscous=True),
            )
        ]
        found += self._returned(records[_MOVED])
        found += self._paper_noise(records[_PAPER_SUMS])
        return [*found, *self._order(records)]

    def draw(self, records: Mapping[str, Record], folder: Path) -> Sequence[Path]:
        from solidsph_cases._wave_picture import draw_convergence, draw_histories

        smooth, square = self.pulses
        panels = [
            (
                f"{pulse.name} pulse\n{reading.label}\n"
                f"c = {reading.speed:.0f} m/s, {1e6 * LENGTH / reading.speed:.2f} us to the wall",
                self.exact(reading, pulse),
                records[f"{reading.name}-{pulse.name}"],
                records.get(f"{reading.name}-{pulse.name}-viscous"),
            )
            for pulse in (square, smooth)
            for reading in READINGS
        ]
        histories = folder / "fig-10-11-wave-bar.png"
        draw_histories(panels, STATIONS, self.title, histories)
        own = (
            f"the paper's sums, cover {self.paper_cover:g} spacings\n"
            f"square pulse of strain, {PAPER.label}",
            self.exact(PAPER, square, HELD),
            records[_PAPER_SUMS],
            None,
        )
        noise = folder / "fig-11-wave-bar-paper-sums.png"
        draw_histories([own], STATIONS, self.title, noise)
        if len(self.convergence) < 2:
            return [histories, noise]
        converging = folder / "wave-bar-convergence.png"
        counts = list(self.convergence)
        errors = [self.error(records[_convergence_name(count)]) for count in counts]
        draw_convergence(counts, errors, converging)
        return [histories, noise, converging]

    def curves(self, records: Mapping[str, Record]) -> Mapping[str, Curves]:
        tables = {}
        for reading in READINGS:
            for pulse in self.pulses:
                exact = self.exact(reading, pulse)
                for tail in ("", "-viscous"):
                    name = f"{reading.name}-{pulse.name}{tail}"
                    if name in records:
                        tables[f"histories-{name}"] = _table(records[name], exact)
        held = {_MOVED: (STRAIN, self.pulses[0]), _PAPER_SUMS: (PAPER, self.pulses[1])}
        for name, (reading, pulse) in held.items():
            tables[f"histories-{name}"] = _table(records[name], self.exact(reading, pulse, HELD))
        return tables

    def loaded(self, reading: Reading, pulse: Pulse, particles: int) -> SceneBuilder:
        """The pulse as a traction: the normal of the left end points to the left."""
        return self._bar(reading, pulse, particles).boundary(
            "traction", where="left", traction={"x": f"{-self.stress!r}*{pulse.formula}"}
        )

    def _moved(self, pulse: Pulse) -> SceneBuilder:
        """The pulse as a strain, the paper's way."""
        return self._bar(STRAIN, pulse, self.particles).boundary(
            "prescribed-motion", where="left", displacement={"x": self._motion(STRAIN, pulse)}
        )

    def _paper_sums(self, pulse: Pulse) -> SceneBuilder:
        """The same with the paper's kernel and plain sums, completed by ghosts."""
        return (
            Simulation.builder()
            .title(f"{self.title}: {pulse.name} pulse of strain, the paper's sums")
            .body(
                "bar",
                shape={"type": "interval", "length": LENGTH},
                spacing=LENGTH / (self.particles - 1),
                discretisation={
                    "type": "lattice",
                    "on_boundary": True,
                    "ghosts": ceil(self.paper_cover),
                },
            )
            .kernel("modified-mollifier", cover=self.paper_cover)
            .material(
                "neo-hookean",
                youngs_modulus=YOUNGS_MODULUS,
                poissons_ratio=PAPER.poissons_ratio,
                density=DENSITY,
            )
            .formulation("total-lagrangian", gradient="standard", divergence="plain")
            # The paper's sums have no energy near the ends, and what it shows is the wave.
            .energy_tolerance("off")
            .boundary("clamp", where="right")
            .boundary(
                "prescribed-motion", where="left", displacement={"x": self._motion(PAPER, pulse)}
            )
            .boundary("ghost-extension")
            .integrator("central-difference", time_step_factor=0.5)
            .duration(self.transits * LENGTH / PAPER.speed)
            .outputs(_OUTPUTS)
            .engine(self.engine)
        )

    def _motion(self, reading: Reading, pulse: Pulse) -> str:
        """Displacement of the left end that sends the pulse: v = -T / (rho c)."""
        return f"{-self.stress / (DENSITY * reading.speed)!r}*{pulse.integral_formula}"

    def _bar(self, reading: Reading, pulse: Pulse, particles: int) -> SceneBuilder:
        return (
            bar(
                f"{self.title}: {pulse.name} pulse, {reading.label}",
                particles=particles,
                poissons_ratio=reading.poissons_ratio,
                scheme=self,
            )
            .boundary("clamp", where="right")
            .integrator(self.integrator, time_step_factor=self.time_step_factor)
            .duration(self.transits * LENGTH / reading.speed)
            .outputs(_OUTPUTS)
        )

    def _smooth(self, reading: Reading, record: Record) -> list[Measurement]:
        exact = self.exact(reading, self.pulses[0])
        histories = Histories.of(record, exact)
        what = f"{reading.label}, smooth pulse"
        back = histories.peak_of_passage(_TRAVELLING, 2)
        return [
            histories.worst(f"{what}: peak", "Pa", _PEAK, Histories.peak, STATIONS[:3]),
            histories.worst(f"{what}: peak at the wall", "Pa", _WALL, Histories.peak, [LENGTH]),
            compared(
                record,
                f"{what}: peak at {_TRAVELLING:g} m, back from the free end with the other sign",
                back[0],
                "Pa",
                back[1],
                SOURCE,
                _PEAK,
            ),
            attrs.evolve(
                histories.worst(
                    f"{what}: arrival, at half the peak",
                    "s",
                    _ARRIVAL,
                    Histories.arrival,
                    STATIONS[1:],
                ),
                paper="c = sqrt(E/rho) (eq. 20): 30 us to the wall",
            ),
        ]

    def _square(self, reading: Reading, record: Record, *, viscous: bool) -> list[Measurement]:
        exact = self.exact(reading, self.pulses[1])
        histories = Histories.of(record, exact)
        what = f"{reading.label}, square pulse{' with viscosity' if viscous else ''}"
        arrival = histories.worst(
            f"{what}: arrival, at half the plateau",
            "s",
            _ARRIVAL,
            Histories.arrival,
            STATIONS[1:],
        )
        if not viscous:
            # Without viscosity short waves run apart from the front, so that its half wanders by
            # the power 2/3 of the spacing: told, and judged where the front has a width.
            arrival = attrs.evolve(
                arrival, verdict="not judged: the front disperses", passed=_complete(record)
            )
        return [
            histories.worst(f"{what}: plateau", "Pa", _PLATEAU, Histories.plateau, STATIONS[:3]),
            attrs.evolve(
                histories.worst(
                    f"{what}: plateau at the wall", "Pa", _WALL, Histories.plateau, [LENGTH]
                ),
                paper="total reflection of any wave at the fixed end",
            ),
            arrival,
            attrs.evolve(
                _overshoot(histories, what),
                paper="" if viscous else "noise, unless some numerical damping is considered",
            ),
        ]

    def _returned(self, record: Record) -> list[Measurement]:
        """The left end is held after a pulse of strain: it returns the wave with its sign."""
        histories = Histories.of(record, self.exact(STRAIN, self.pulses[0], HELD))
        what = f"{STRAIN.label}, smooth pulse of strain"
        back = histories.peak_of_passage(_TRAVELLING, 2)
        return [
            attrs.evolve(
                histories.worst(f"{what}: peak", "Pa", _PEAK, Histories.peak, STATIONS[:3]),
                paper="a strain pulse equivalent to T11 = -100 kPa",
            ),
            compared(
                record,
                f"{what}: peak at {_TRAVELLING:g} m, back from the held end with its sign",
                back[0],
                "Pa",
                back[1],
                SOURCE,
                _PEAK,
            ),
        ]

    def _paper_noise(self, record: Record) -> list[Measurement]:
        """What the paper's own sums make of the square pulse; nothing of it is judged."""
        histories = Histories.of(record, self.exact(PAPER, self.pulses[1], HELD))
        what = f"the paper's sums, cover {self.paper_cover:g}, square pulse of strain"
        found = [
            histories.worst(
                f"{what}: arrival, at half the plateau",
                "s",
                _ARRIVAL,
                Histories.arrival,
                STATIONS[1:],
            ),
            histories.worst(f"{what}: plateau", "Pa", _PLATEAU, Histories.plateau, STATIONS[:3]),
            histories.worst(
                f"{what}: plateau at the wall", "Pa", _WALL, Histories.plateau, [LENGTH]
            ),
        ]
        return [
            *(attrs.evolve(m, verdict="not judged", passed=_complete(record)) for m in found),
            attrs.evolve(
                _overshoot(histories, what), paper="noise, common to all approximations (Fig. 11)"
            ),
        ]

    def _order(self, records: Mapping[str, Record]) -> list[Measurement]:
        counts = np.array(self.convergence)
        runs = [records[_convergence_name(count)] for count in self.convergence]
        errors = np.array([self.error(record) for record in runs])
        found = [
            compared(
                record,
                f"{STRAIN.label}, smooth pulse, {count} particles: root mean square "
                "error of all stresses, relative",
                error,
                "1",
                None,
                "",
                0.0,
            )
            for record, count, error in zip(runs, counts, errors, strict=True)
        ]
        if len(counts) < 2:
            return found
        order = -float(np.polyfit(np.log(counts - 1), np.log(errors), 1)[0])
        return [
            *found,
            Measurement(
                quantity="fitted order of that error",
                value=order,
                unit="1",
                reference=_ORDER,
                source="dispersion of the second order, for a stress whose second derivative jumps",
                error=abs(order / _ORDER - 1.0),
                verdict="at least that" if order > _ORDER else "BELOW it",
                passed=order > _ORDER and all(_complete(record) for record in runs),
                paper="section 6 asks for convergence with the number of particles",
            ),
        ]

    def error(self, record: Record) -> float:
        """Root mean square error of the smooth pulse's stress over all particles and times,
        relative to the root mean square of the exact."""
        exact = self.exact(STRAIN, self.pulses[0])
        theory = exact.stress(along(record), record.times[:, None])
        return float(np.sqrt(np.mean((stress_along(record) - theory) ** 2) / np.mean(theory**2)))


# With an error h^2 k^3 of each wave number k, and sin^2 of Fourier coefficients k^-3: all below
# h^(-2/3) are right, and what lies beyond has the norm k^(-5/2), so h^(5/3).
_ORDER = 5.0 / 3.0


def _overshoot(histories: Histories, what: str) -> Measurement:
    largest = max(histories.overshoot(station) for station in STATIONS)
    quantity = f"{what}: largest overshoot of the plateau, over it"
    return compared(histories.record, quantity, largest, "1", None, "", 0.0)


def _complete(record: Record) -> bool:
    return record.outcome == FINISHED


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
