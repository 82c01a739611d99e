"""Section 5.3: a bar and strips pulled to six times their length."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf, nan
from typing import final

import attrs
import numpy as np
from scipy.optimize import brentq, minimize_scalar

from solidsph.conformance.ellipticity import least_stiffness, losses_of_ellipticity
from solidsph.maths.arrays import Array
from solidsph.registry.parameters import check_positive, number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.scene.scene_data import PartLike
from solidsph.studies.case import Case, Curves, Measurement, Trial
from solidsph_builtin.materials.neo_hookean import NeoHookean
from solidsph_cases import _stretch_theory as theory
from solidsph_cases._compare import compared, finished
from solidsph_cases._scene import ON_BOUNDARY, box, check_all_positive, check_count, solid
from solidsph_cases._stretch_history import History, StressCurve
from solidsph_cases._stretch_pictures import stress_over_stretch
from solidsph_cases.drawing.sheet import Sheet

BAR, MOVING, PLAIN = "bar", "bar-in-motion", "bar-plain-sums"

# The paper's sums need complete supports, of 5.5 spacings.
_GHOSTS = {**ON_BOUNDARY, "ghosts": 6}

_OUTPUTS_A_TRANSIT = 10

# The first wave is looked at before it comes back, [transits] after the start.
_FIRST_WAVE = 0.8

# From here on the waves of the start have spread, and their size means something [stretch].
_SETTLED = 2.0

# What the weights of a consistent gradient are solved to, 1e-12, grows with a hundred periods.
_EXACT = 1e-8

_CURVES = "eqs. 21 and 22; mean over particles and one passage of a wave there and back"
_CLOSED_FORM = "closed form of the acoustic tensor, mu + k / s^2 = 0"


@final
@attrs.frozen
class LargeStretch(Case):
    """A bar pulled at constant speed, without any new discretisation, to six times its length.

    The Cauchy stress follows the static curve and, because the pull is fast, swings about it: the
    first wave alone brings a stretch of 1.18. The paper's family of curves, for fixed stretches
    across the pull, is followed by strips in plane strain: stretched across at first, then held so
    and pulled. As the paper says, all motion is along the axes: every particle is held across.

    Beside the bar that starts from rest, one starts with the velocity of the homogeneous pull, for
    which the curve is exact; and one takes the paper's own sums. The mean stress is that of all
    particles, by volume, and of the time in which a wave passes there and back; its error is in
    proportion to the stress that the pull has added.
    """

    title = "A bar and strips pulled to six times their length"
    source = "Ismail & Reddy, section 5.3, Fig. 15"
    figures = ("fig-15",)
    studies = dict.fromkeys(("scheme", "discretisation"), "one scene has the paper's own sums")
    sweep = {
        "particles": (16, 31, 61),
        "gradient": ("consistent", "quadratic"),
        "cover": (2.2, 2.5, 3.5),
    }
    trials = {"to six times the length": Trial({"across": ()}, {"particles": 16})}

    stretch: float = number(default=6.0)  # at the end [-]
    across: Sequence[float] = (0.75, 1.25, 1.5)  # stretches held across the pull of strips [-]
    transits: float = number(default=30.0)  # duration [wave transits of the unstretched bar]
    length: float = number(default=15e-3)  # [m]
    youngs_modulus: float = number(default=70e6)  # [Pa]; the paper gives no moduli here
    poissons_ratio: float = number(default=0.3)  # [-]
    density: float = number(default=1000.0)  # [kg/m^3]
    particles: int = 31  # along the pull
    width: int = 7  # particles across a strip
    tolerance: float = number(default=0.02)  # largest error of the mean stress that passes [-]

    def __attrs_post_init__(self) -> None:
        check_count("large-stretch", "particles", self.particles, 11)
        check_count("large-stretch", "width", self.width, 3)
        check_all_positive(
            "case 'large-stretch'",
            self,
            transits="wave transits",
            length="m",
            tolerance="parts of one",
        )
        check_positive("case 'large-stretch'", "stretch - 1", self.stretch - 1.0, "parts of one")
        for held in self.across:
            check_positive("case 'large-stretch'", "a stretch across", held, "parts of one")

    @property
    def material(self) -> NeoHookean:
        """The material of all scenes."""
        return NeoHookean(self.youngs_modulus, self.poissons_ratio, self.density)

    @property
    def transit(self) -> float:
        """Time in which a small wave crosses the unstretched bar [s]."""
        return self.length / self.material.wave_speed

    @property
    def speed(self) -> float:
        """Of the pulled end [m/s]."""
        return (self.stretch - 1.0) * self.length / (self.transits * self.transit)

    def priced(self) -> Case:
        """The bar, without the strips."""
        return attrs.evolve(self, across=())

    def scenes(self) -> Mapping[str, Scene]:
        moving = {"x": f"{self.speed / self.length!r}*X"}
        return {
            BAR: self._bar().scene(),
            MOVING: self._bar().initial(velocity=moving).scene(),
            PLAIN: self._bar(discretisation=_GHOSTS)
            .scheme("paper")
            .boundary("ghost-extension")
            # These sums have no energy near the ends: that is what the scene is to show.
            .energy_tolerance("off")
            .scene(),
            **{_strip(held): self._strip(held).scene() for held in self.across},
        }

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        smallest = min(
            float(np.min(record.field("volume_ratio")[:])) for record in records.values()
        )
        whole = smallest > 0.0 and finished(*records.values())
        histories = self._histories(records)
        loaded = {name: history for name, history in histories.items() if name != MOVING}
        return [
            *(self._mean(name, history, records[name]) for name, history in loaded.items()),
            self._exact(histories[MOVING]),
            self._first_wave(records[BAR]),
            *(
                self._swing(name, history)
                for name, history in loaded.items()
                if self.stretch > _SETTLED
            ),
            Measurement(
                "smallest J of any particle in any scene",
                smallest,
                "1",
                verdict="no particle turned over" if whole else "turned over, or ended early",
                passed=whole,
                paper="large stretches achieved without any re-discretisation",
            ),
            *(self._ellipticity(name, held) for name, held in self._held().items()),
            self._critical_ratio(),
        ]

    def pictures(self, records: Mapping[str, Record]) -> Mapping[str, Sheet]:
        """Fig. 15."""
        held = self._held()
        sheet = stress_over_stretch(
            {name: one for name, one in self._histories(records).items() if name in held},
            {_label(name): self._curve(across) for name, across in held.items()},
            {_label(name): self.losses(across) for name, across in held.items()},
            self.stretch,
        )
        return {"fig-15-large-stretch": sheet}

    def curves(self, records: Mapping[str, Record]) -> Mapping[str, Curves]:
        stretches = np.linspace(1.0, self.stretch, 201)
        static = {"stretch [1]": stretches}
        for name, held in self._held().items():
            static[f"{_label(name)} [MPa]"] = 1e-6 * self._curve(held)(stretches)
        tables = {"fig-15-curves": static}
        for name, history in self._histories(records).items():
            tables[f"fig-15-{name}"] = {
                "time [transits]": history.times / self.transit,
                "stretch [1]": history.stretches,
                "mean Cauchy stress [MPa]": 1e-6 * history.mean,
                "Cauchy stress amid the bar [MPa]": 1e-6 * history.amid,
                "least Cauchy stress [MPa]": 1e-6 * history.stresses.min(axis=1),
                "greatest Cauchy stress [MPa]": 1e-6 * history.stresses.max(axis=1),
            }
        return tables

    def history(self, name: str, record: Record) -> History:
        """Stress and stretch over the time of a scene."""
        return History.of(record, self._curve(self._held().get(name)))

    def _histories(self, records: Mapping[str, Record]) -> Mapping[str, History]:
        return {name: self.history(name, record) for name, record in records.items()}

    def losses(self, held: float | None) -> list[float]:
        """Stretches at which ellipticity is lost or regained on the way, by the acoustic tensor.

        Of a strip waves in all directions of the plane count, though its particles, held across,
        follow only those along the pull.
        """

        return losses_of_ellipticity(
            self.material, lambda stretch: _pull(stretch, held), 1.0, self.stretch
        )

    def _held(self) -> Mapping[str, float | None]:
        """What is held across the pull, by scene; nothing can move across a bar."""
        return {BAR: None, **{_strip(held): held for held in self.across}}

    def _curve(self, held: float | None) -> StressCurve:
        return StressCurve(1.0 if held is None else held, *self.material.lame_parameters)

    def _bar(self, discretisation: PartLike | None = None) -> SceneBuilder:
        shape = {"type": "interval", "length": self.length}
        return self._pulled(shape, f"{self.title}: bar", discretisation)

    def _strip(self, held: float) -> SceneBuilder:
        breadth = (self.width - 1) * self.length / (self.particles - 1)
        shape = box(self.length, breadth, origin=[0.0, -0.5 * breadth])
        across = f"{held - 1.0!r}*Y"
        return (
            self._pulled(shape, f"{self.title}: strip held at {held:g} across")
            .boundary("prescribed-motion", where="all", displacement={"y": across})
            .initial(displacement={"x": 0.0, "y": across})
        )

    def _pulled(
        self, shape: PartLike, title: str, discretisation: PartLike | None = None
    ) -> SceneBuilder:
        spacing = self.length / (self.particles - 1)
        return (
            solid(title, "sheet", shape, spacing, self.material, discretisation=discretisation)
            .boundary("prescribed-motion", where="left", displacement={"x": 0.0})
            .boundary("prescribed-motion", where="right", displacement={"x": f"{self.speed!r}*t"})
            .duration(self.transits * self.transit)
            .outputs(max(20, round(_OUTPUTS_A_TRANSIT * self.transits)))
        )

    def _mean(self, name: str, history: History, record: Record) -> Measurement:
        losses = self.losses(self._held().get(name))
        at, mean = history.averaged(self.length, self.density, losses[0] if losses else inf)
        curve = history.curve(at)
        source, paper = _CURVES, "a close correlation with the static curves"
        quantity = f"{name}: mean Cauchy stress"
        if not len(at):
            return Measurement(
                quantity, nan, "MPa", None, source, inf, record.outcome, False, paper
            )
        errors = np.abs(mean - curve) / (curve - history.curve(np.array([1.0])))
        worst = int(np.argmax(errors))
        # What comes after the loss is not compared, nor asked to come to an end.
        complete = bool(losses) or finished(record)
        error = float(errors[worst])
        within = error <= self.tolerance
        verdict = f"{'within' if within else 'NOT within'} {100.0 * self.tolerance:g} %"
        return Measurement(
            f"{quantity} at stretch {at[worst]:.3g}, where it is worst",
            1e-6 * float(mean[worst]),
            "MPa",
            reference=1e-6 * float(curve[worst]),
            source=source,
            error=error,
            verdict=verdict if complete else record.outcome,
            passed=complete and within,
            paper=paper,
        )

    def _exact(self, history: History) -> Measurement:
        losses = self.losses(None)
        elastic = history.stretches <= (losses[0] if losses else inf)
        missed = np.abs(history.stresses - history.static[:, None])
        error = float(missed[elastic].max() / history.curve(history.stretches[elastic]).max())
        on_curve = error <= _EXACT
        return Measurement(
            f"{MOVING}: largest error of the stress of any particle",
            error,
            "1",
            reference=0.0,
            source="the homogeneous motion is exact",
            error=error,
            verdict="on the curve" if on_curve else "off the curve",
            passed=on_curve,
        )

    def _first_wave(self, record: Record) -> Measurement:
        lam, mu = self.material.lame_parameters
        behind = theory.behind_first_wave(self.speed, lam, mu, self.density)
        step = int(np.argmin(np.abs(record.times - _FIRST_WAVE * self.transit)))
        slowest = np.sqrt(theory.stiffness(behind, 1.0, lam, mu) / self.density)
        depth = self.length - record.particles.positions[:, 0]
        # Behind the fan, not in the ringing at its foot nor beside the end.
        inside = depth < 0.7 * slowest * record.times[step]
        inside &= depth > 1.5 * self.length / (self.particles - 1)
        found = float(record.field("volume_ratio")[step][inside].mean())
        source = "simple wave: the end's speed is the integral of c(s) ds"
        quantity = f"{BAR}: stretch behind the first wave"
        return compared(record, quantity, found, "1", behind, source, 0.01)

    def _swing(self, name: str, history: History) -> Measurement:
        settled = history.stretches >= _SETTLED
        curve = history.curve(history.stretches[settled])[:, None]
        swings = np.abs(history.stresses[settled] / curve - 1.0)
        return Measurement(
            f"{name}: largest swing of a particle about the curve beyond stretch {_SETTLED:g}",
            float(swings.max()) if len(swings) else nan,
            "1",
            paper="dynamic effects cause the oscillations about the analytical curves",
        )

    def _ellipticity(self, name: str, held: float | None) -> Measurement:
        lam, mu = self.material.lame_parameters
        lost = self.losses(held)
        expected = theory.losses(held, lam, mu, self.stretch)
        agree = len(lost) == len(expected) and np.allclose(lost, expected, rtol=1e-6, atol=0.0)
        if lost:
            return Measurement(
                f"{name}: stretch at which the material loses ellipticity",
                lost[0],
                "1",
                reference=expected[0] if expected else None,
                source=_CLOSED_FORM,
                error=abs(lost[0] / expected[0] - 1.0) if expected else inf,
                verdict="beyond it the MATERIAL localises, whatever the method",
                passed=agree,
            )
        return Measurement(
            f"{name}: least stiffness against a wave at the end, in shear moduli",
            least_stiffness(self.material, _pull(self.stretch, held)).value / mu,
            "1",
            verdict="elliptic all the way",
            passed=agree,
        )

    def _critical_ratio(self) -> Measurement:
        """Poisson's ratio from which a pull in uniaxial strain softens, by the acoustic tensor."""

        def softest(ratio: float) -> float:
            material = attrs.evolve(self.material, poissons_ratio=ratio)

            def stiffness(stretch: float) -> float:
                return least_stiffness(material, _pull(stretch, None)).value / self.youngs_modulus

            return float(minimize_scalar(stiffness, bounds=(1.0, 20.0)).fun)

        found = float(brentq(softest, 0.4, 0.499, xtol=1e-10))
        ratio = theory.critical_ratio()
        reference = 0.5 * ratio / (ratio + 1.0)
        error = abs(found / reference - 1.0)
        return Measurement(
            "Poisson's ratio beyond which a bar softens on the way",
            found,
            "1",
            reference=reference,
            source=f"P' = 0 at some stretch: lambda / mu > {ratio:.2f}",
            error=error,
            passed=error < 1e-6,
            paper="a slightly compressible material; no moduli are given",
        )


def _pull(stretch: float, held: float | None) -> Array:
    """F of a stretch along the axis, and of the stretch held across, if any."""
    return np.array([[stretch]]) if held is None else np.diag([stretch, held])


def _strip(held: float) -> str:
    return f"strip-{held:g}"


def _label(name: str) -> str:
    """A curve's name by the stretch across: that of a bar is 1."""
    return f"lambda_2 = {name.removeprefix('strip-') if name != BAR else '1'}"
