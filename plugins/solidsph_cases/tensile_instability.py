"""The paper's headline experiment: a bar in tension, perturbed, in both Lagrangian forms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import ceil, inf, nan
from typing import final

import attrs
import numpy as np

from solidsph.conformance.ellipticity import least_stiffness
from solidsph.errors import SceneError
from solidsph.maths.arrays import Array
from solidsph.registry.parameters import number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.simulation import Simulation
from solidsph.studies.case import Case, Curves, Measurement, Picture
from solidsph.studies.spectrum import spectrum
from solidsph.studies.stability_map import StabilityMap
from solidsph_builtin.materials.neo_hookean import NeoHookean
from solidsph_cases._bar import along, displacements
from solidsph_cases._scene import ON_BOUNDARY, solid
from solidsph_cases._stability_map import FORMS, TOTAL, UPDATED, GrowthMaps, onset, stability_map
from solidsph_cases._tensile_pictures import configuration, motions

# How long the growth is watched, in e-foldings of the rate that the spectrum predicts for the
# updated form: from the smallest deviation that rounding leaves clean to the edge of linearity.
_WATCHED_FOLDINGS = 16.0

# Deviations of the linear runs, in spacings: the start is 1e5 times the rounding of positions.
_LINEAR_START = 1e-9
_LINEAR_END = 1e-2

# The rate is read off the last two decades below the end: by then the fastest mode has outgrown
# those that the perturbation of a single particle starts beside it.
_LAST_DECADES = 1e-2

# A deviation that stays below this multiple of its start has not grown: waves that cross add up
# to little more than the start, growth at any rate worth the name passes it within the watch.
_NO_GROWTH = 1.5

# The map: from strong compression to the stretch of section 5.3, past 1 without touching it, and
# from a support that just holds the nearest neighbours to the paper's largest.
_MAP_STRETCHES = tuple(float(s) for s in np.linspace(0.3, 6.0, 39))
_MAP_COVERS = tuple(float(c) for c in np.linspace(1.2, 5.5, 22))

_PAPER = {
    TOTAL: "behaves as expected: all particles track the centre one",
    UPDATED: "particles under increasing tension move closer together at times",
}


STUDIES = {
    "formulation": "both Lagrangian forms are compared",
    **dict.fromkeys(
        ("kernel", "cover", "discretisation", "divergence", "gradient", "integrator"),
        "the paper's own sums in both forms, completed by ghosts; the stability map is of them",
    ),
}


@final
@attrs.frozen
class TensileInstability(Case):
    """A bar held at both ends at a uniform stretch, its centre particle displaced a little more.

    In truth the disturbance spreads as waves. The total Lagrangian form does so; in the updated
    form neighbouring particles attract each other, and the disturbance grows where it started.
    Beside the paper's finite perturbation, one small enough for linear theory is run at several
    stretches, and its growth compared with the spectrum of the discrete system. A map shows, for
    either form, at which stretch and cover the uniform state of an endless bar is unstable.
    """

    title = "A bar in tension, perturbed: total against updated Lagrangian"
    source = "Ismail & Reddy, section 5.2, Figs. 12 to 14"
    figures = ("fig-12", "fig-13", "fig-14")
    studies = STUDIES
    sweep = {"spacing": (5e-3, 2.5e-3, 1.25e-3), "cover": (3.5, 5.5)}

    stretch: float = number(default=1.2)  # of the finite perturbation [-]
    perturbation: float = number(default=0.05)  # of the displacement [-]
    stretches: Sequence[float] = (1.02, 1.2, 1.5)  # at which growth rates are compared [-]
    transits: float = number(default=0.45)  # duration [wave transits]
    length: float = number(default=0.15)  # [m]
    spacing: float = number(default=2.5e-3)  # [m]
    cover: float = number(default=5.5)  # [spacings]
    youngs_modulus: float = number(default=200e9)  # [Pa]
    poissons_ratio: float = number(default=0.3)  # [-]
    density: float = number(default=8000.0)  # [kg/m^3]

    def __attrs_post_init__(self) -> None:
        for name in ("perturbation", "transits", "length", "spacing", "cover"):
            value = getattr(self, name)
            if not 0.0 < value < inf:
                raise SceneError(
                    f"case 'tensile-instability': {name} must be positive and finite, got {value}; "
                    "leave it out for the paper's"
                )
        for stretch in (self.stretch, *self.stretches):
            if not 0.0 < stretch < inf or stretch == 1.0:
                raise SceneError(
                    f"case 'tensile-instability': a stretch must be positive and not 1, got "
                    f"{stretch}; at 1 there is no displacement to perturb"
                )
        cells = self.length / self.spacing
        if abs(cells - 2.0 * round(0.5 * cells)) > 1e-6 or cells < 8.0:
            raise SceneError(
                f"case 'tensile-instability': length / spacing must be even and at least 8, got "
                f"{cells:.6g}, so that a particle lies at the centre with three on either side"
            )

    @property
    def material(self) -> NeoHookean:
        """The bar's material."""
        return NeoHookean(self.youngs_modulus, self.poissons_ratio, self.density)

    @property
    def transit(self) -> float:
        """Time in which a small confined wave crosses the bar [s]."""
        return self.length / self.material.wave_speed

    def priced(self) -> Case:
        """At one stretch."""
        return attrs.evolve(self, stretches=self.stretches[:1])

    def scenes(self) -> Mapping[str, Scene]:
        scenes = {form: self.perturbed(form) for form in FORMS}
        for stretch in self.stretches:
            rate = self.predicted_rate(UPDATED, stretch)
            # Where nothing grows, compression for one, ten transits show it.
            watch = min(_WATCHED_FOLDINGS / max(rate, 1e-300), 20.0 * self.transit)
            small = _LINEAR_START * self.spacing / (0.5 * self.length * abs(stretch - 1.0))
            for form in FORMS:
                scenes[_rate_name(form, stretch)] = self._scene(form, stretch, small, watch)
        return scenes

    def perturbed(self, form: str) -> Scene:
        """One form with the finite perturbation."""
        duration = self.transits * self.transit
        return self._scene(form, self.stretch, self.perturbation, duration)

    def _scene(self, form: str, stretch: float, perturbation: float, duration: float) -> Scene:
        title = f"{self.title}: {form} at stretch {stretch:g}"
        shape = {"type": "interval", "length": self.length}
        centre = f"abs(X - {0.5 * self.length!r}) < {1e-6 * self.spacing!r}"
        lattice = {**ON_BOUNDARY, "ghosts": ceil(self.cover)}
        options = {"discretisation": lattice, "tags": {"centre": centre}}
        uniform = f"{stretch - 1.0!r}*X"
        return (
            solid(title, "bar", shape, self.spacing, self.material, **options)
            .kernel("modified-mollifier", cover=self.cover)
            # Both forms with the paper's sums; differences keep the updated form's strain
            # independent of where the bar stands.
            .formulation(form, gradient="difference", divergence="plain")
            # Under tension the updated form has no energy: its instability is what is measured.
            .energy_tolerance("off" if form == UPDATED else 0.01)
            .boundary("prescribed-motion", where="left", displacement={"x": uniform})
            .boundary("prescribed-motion", where="right", displacement={"x": uniform})
            .boundary("ghost-extension")
            .initial(displacement={"x": uniform})
            .initial(where="centre", displacement={"x": f"{uniform}*{1.0 + perturbation!r}"})
            .integrator("central-difference")
            .duration(duration)
            .outputs(200)
            .scene()
        )

    def predicted_rate(self, form: str, stretch: float) -> float:
        """Growth rate of the fastest mode about the uniform stretch [1/s]."""
        simulation = Simulation.builder(self._scene(form, stretch, 0.0, self.transit)).build()
        return spectrum(simulation.dynamics, simulation.start()).growth_rate

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        return [
            *(self._spread(form, records[form]) for form in FORMS),
            *(
                self._growth(form, stretch, records[_rate_name(form, stretch)])
                for stretch in self.stretches
                for form in FORMS
            ),
            *self._of_the_maps(),
        ]

    def maps(self) -> Mapping[str, StabilityMap]:
        """Growth over stretch and cover, by form."""
        return {
            form: stability_map(form, self.poissons_ratio, _MAP_STRETCHES, _MAP_COVERS)
            for form in FORMS
        }

    def _spread(self, form: str, record: Record) -> Measurement:
        """Largest deviation at the end of the finite perturbation, over that at the start."""
        ratio = spread(record, self.stretch)
        x = along(record) + displacements(record)
        gap = float(np.diff(x, axis=1).min() / self.spacing)
        should_grow = form == UPDATED and self.stretch > 1.1
        return Measurement(
            f"{form}, stretch {self.stretch:g}: deviation at the end over the start",
            ratio,
            "1",
            source="section 5.2: the total form's disturbance spreads, the updated form's clumps",
            verdict=f"{'grew' if ratio > 1.0 else 'spread'}, closest pair {gap:.2f} spacings",
            passed=(ratio > 1.0) == should_grow,
            paper=_PAPER[form],
        )

    def _growth(self, form: str, stretch: float, record: Record) -> Measurement:
        predicted = self.predicted_rate(form, stretch) * self.transit
        times = record.times / self.transit
        amplitudes = np.linalg.norm(deviation(record, stretch), axis=1)
        grew = bool(amplitudes.max() > _NO_GROWTH * amplitudes[0])
        # Without growth, the trend of the whole run: falling, as the disturbance spreads.
        measured = (
            growth_rate(times, amplitudes, _LINEAR_END * self.spacing)
            if grew
            else float(np.polyfit(times, np.log(amplitudes), 1)[0])
        )
        unstable = bool(predicted * times[-1] > np.log(_NO_GROWTH))
        error = abs(measured / predicted - 1.0) if unstable else None
        return Measurement(
            f"{form}, stretch {stretch:g}: growth rate",
            measured,
            "1/transit",
            reference=predicted if unstable else 0.0,
            source="spectrum of the discrete system, linearised numerically",
            error=error,
            verdict="unstable" if grew else "stable",
            passed=grew == unstable == (form == UPDATED) and (error is None or error < 0.1),
        )

    def _of_the_maps(self) -> Sequence[Measurement]:
        total, updated = self.maps().values()
        elliptic = np.array(
            [
                [least_stiffness(self.material, np.array([[s]])).value > 0.0 for s in row]
                for row in total.seen
            ]
        )
        spacings = self.length / self.spacing  # in a transit
        stable = not total.grows[elliptic].any()
        begins = onset(UPDATED, self.poissons_ratio, self.cover, 1.0 / spacings)
        tension = updated.connected & (updated.stretches > 1.0)
        squeezed = np.broadcast_to(updated.stretches < 1.0, tension.shape)
        over = (
            f"stretch {_MAP_STRETCHES[0]:g} to {_MAP_STRETCHES[-1]:g}, "
            f"cover {_MAP_COVERS[0]:g} to {_MAP_COVERS[-1]:g}"
        )
        return [
            Measurement(
                f"{TOTAL}, {over}: fastest growth where the material is stable",
                float(total.rates[elliptic].max()) * spacings,
                "1/transit",
                reference=0.0,
                source="constant operators: s^2 = -P'(stretch) |g(k)|^2 / rho",
                verdict="stable" if stable else "unstable",
                passed=stable,
                paper="the configuration should be totally stable",
            ),
            Measurement(
                f"{UPDATED}, cover {self.cover:g}: stretch from which a transit is an e-folding",
                begins,
                "1",
                verdict="unstable in tension" if begins > 1.0 else "no such stretch up to 2",
                passed=begins > 1.0,
                paper="adjacent particles move out of phase with each other",
            ),
            *(
                Measurement(
                    f"{UPDATED}: unstable part of the map in {name}",
                    float(updated.grows[where].mean()),
                    "1",
                    verdict="where particles still have neighbours",
                )
                for name, where in (("tension", tension), ("compression", squeezed))
            ),
        ]

    def pictures(self, records: Mapping[str, Record]) -> Mapping[str, Picture]:
        """The perturbed bar, how its particles move in both forms, and the map."""
        forms = {form: records[form] for form in FORMS}
        title = (
            "Small deviations from a uniform stretch of an endless bar, "
            f"Poisson's ratio {self.poissons_ratio:g}: where they grow"
        )
        cover = (self.cover, "cover of Figs. 13 and 14")
        return {
            "fig-12-configuration": configuration(forms[TOTAL], self.stretch, self.perturbation),
            "fig-13-14-tensile-instability": motions(
                forms, self.stretch, self.perturbation, self.transit
            ),
            "fig-13-14-stability-map": GrowthMaps(self.maps(), title, cover),
        }

    def curves(self, records: Mapping[str, Record]) -> Mapping[str, Curves]:
        X, start = along(records[TOTAL]), displacements(records[TOTAL])[0]
        curves: dict[str, Curves] = {
            "fig-12-configuration": {
                "X [mm]": 1e3 * X,
                "uniform displacement [mm]": 1e3 * (self.stretch - 1.0) * X,
                "displacement at the start [mm]": 1e3 * start,
            }
        }
        for figure, form in zip(("fig-13", "fig-14"), FORMS, strict=True):
            u = 1e3 * displacements(records[form])
            curves[f"{figure}-{form}"] = {
                "time [transits]": records[form].times / self.transit,
                **{f"u at X = {1e3 * x:g} mm [mm]": u[:, k] for k, x in enumerate(X)},
            }
        maps = self.maps()
        updated = maps[UPDATED]
        covers, stretches = np.meshgrid(updated.covers, updated.stretches, indexing="ij")
        table = {"cover [spacings]": covers.ravel(), "stretch [1]": stretches.ravel()}
        for form, found in maps.items():
            table[f"{form}: growth rate [1/transit of a spacing]"] = found.rates.ravel()
        connected = updated.connected.ravel().astype(np.float64)
        table[f"{UPDATED}: has neighbours [1]"] = connected
        return {**curves, "fig-13-14-stability-map": table}


def _rate_name(form: str, stretch: float) -> str:
    return f"{form}-rate-{stretch:g}"


def deviation(record: Record, stretch: float) -> Array:
    """Displacement from the uniform stretch at every time [m], left to right, (t, n)."""
    return np.asarray(displacements(record) - (stretch - 1.0) * along(record))


def spread(record: Record, stretch: float) -> float:
    """Largest deviation at the end over that at the start [-]."""
    deviations = np.abs(deviation(record, stretch)).max(axis=1)
    return float(deviations[-1] / deviations[0])


def growth_rate(times: Array, amplitudes: Array, end: float) -> float:
    """Slope of the logarithm of `amplitudes` over `times`, in the last decades up to `end`."""
    past_end = np.flatnonzero(amplitudes > end)
    last = int(past_end[0]) if len(past_end) else len(amplitudes)
    chosen = np.zeros(len(amplitudes), dtype=np.bool_)
    chosen[:last] = amplitudes[:last] > _LAST_DECADES * amplitudes[:last].max()
    if chosen.sum() < 3:  # gone past the end between two outputs: the rate cannot be told
        return nan
    return float(np.polyfit(times[chosen], np.log(amplitudes[chosen]), 1)[0])
