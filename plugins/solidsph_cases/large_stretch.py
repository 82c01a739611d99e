"""Section 5.3: a bar and strips pulled to six times their length."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf
from pathlib import Path
from typing import Any, ClassVar, final

import attrs
import numpy as np
from scipy.optimize import brentq, minimize_scalar

from solidsph.conformance.ellipticity import least_stiffness, losses_of_ellipticity
from solidsph.maths.arrays import Array
from solidsph.registry.parameters import check_positive, number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.simulation import Simulation
from solidsph.studies.case import Case, Curves, Measurement, Trial
from solidsph_builtin.materials.neo_hookean import NeoHookean
from solidsph_cases import _stretch_theory as theory
from solidsph_cases._compare import FINISHED, compared
from solidsph_cases._scheme import check_count, with_scheme
from solidsph_cases._stretch_history import History, StressCurve

BAR, MOVING, PLAIN = "bar", "bar-in-motion", "bar-plain-sums"

# The paper's sums need complete supports, and a cover at which they make 1 of a gradient of 1.
_PLAIN_COVER = 5.5

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

    title: ClassVar[str] = "A bar and strips pulled to six times their length"
    source: ClassVar[str] = "Ismail & Reddy, section 5.3, Fig. 15"
    figures: ClassVar[tuple[str, ...]] = ("fig-15",)
    sweep: ClassVar[Mapping[str, Sequence[Any]]] = {
        "particles": (16, 31, 61),
        "gradient": ("consistent", "quadratic"),
        "cover": (2.2, 2.5, 3.5),
    }
    trials: ClassVar[Mapping[str, Trial]] = {
        "to six times the length": Trial({"across": ()}, {"particles": 16}),
    }

    stretch: float = number(default=6.0)  # at the end [-]
    across: Sequence[float] = (0.75, 1.25, 1.5)  # stretches held across the pull of strips [-]
    transits: float = number(default=30.0)  # duration [wave transits of the unstretched bar]
    length: float = number(default=15e-3)  # [m]
    youngs_modulus: float = number(default=70e6)  # [Pa]; the paper gives no moduli here
    poissons_ratio: float = number(default=0.3)  # [-]
    density: float = number(default=1000.0)  # [kg/m^3]
    particles: int = 31  # along the pull
    width: int = 7  # particles across a strip
    kernel: str = "modified-mollifier"
    cover: float = number(default=2.5)  # [spacings]
    gradient: str = "consistent"
    hourglass: float = number(default=0.0)  # strength [-]; 0 names none
    engine: str = "auto"
    time_step_factor: float = number(default=0.5)  # of the CFL step
    tolerance: float = number(default=0.02)  # largest error of the mean stress that passes [-]

    def __attrs_post_init__(self) -> None:
        check_count("large-stretch", "particles", self.particles, 11)
        check_count("large-stretch", "width", self.width, 3)
        for name, unit in (
            ("transits", "wave transits"),
            ("length", "m"),
            ("tolerance", "parts of one"),
        ):
            check_positive("case 'large-stretch'", name, getattr(self, name), unit)
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
            BAR: with_scheme(self._bar(), self).scene(),
            MOVING: with_scheme(self._bar().initial(velocity=moving), self).scene(),
            PLAIN: self._bar(ghosts=6)
            .kernel(self.kernel, cover=_PLAIN_COVER)
            .formulation("total-lagrangian", gradient="standard", divergence="plain")
            .boundary("ghost-extension")
            # These sums have no energy near the ends: that is what the scene is to show.
            .energy_tolerance("off")
            .engine(self.engine)
            .scene(),
            **{_strip(held): with_scheme(self._strip(held), self).scene() for held in self.across},
        }

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        smallest = min(
            float(np.min(record.field("volume_ratio")[:])) for record in records.values()
        )
        whole = smallest > 0.0 and all(one.outcome == FINISHED for one in records.values())
        return [
            *(self._mean(name, record) for name, record in records.items() if name != MOVING),
            self._exact(records[MOVING]),
            self._first_wave(records[BAR]),
            *(
                self._swing(name, record)
                for name, record in records.items()
                if name != MOVING and self.stretch > _SETTLED
            ),
            Measurement(
                quantity="smallest J of any particle in any scene",
                value=smallest,
                unit="1",
                verdict="no particle turned over" if whole else "turned over, or ended early",
                passed=whole,
                paper="large stretches achieved without any re-discretisation",
            ),
            *(self._ellipticity(name, held) for name, held in self._held().items()),
            self._critical_ratio(),
        ]

    def draw(self, records: Mapping[str, Record], folder: Path) -> Sequence[Path]:
        from solidsph_cases._stretch_picture import draw_stretch

        path = folder / "fig-15-large-stretch.png"
        draw_stretch(
            {name: self.history(name, record) for name, record in records.items()},
            {_label(name): self._curve(held) for name, held in self._held().items()},
            self.stretch,
            {_label(name): self.losses(held) for name, held in self._held().items()},
            path,
        )
        return [path]

    def curves(self, records: Mapping[str, Record]) -> Mapping[str, Curves]:
        stretches = np.linspace(1.0, self.stretch, 201)
        tables: dict[str, Curves] = {
            "fig-15-curves": {
                "stretch [1]": stretches,
                **{
                    f"{_label(name)} [MPa]": 1e-6 * self._curve(held)(stretches)
                    for name, held in self._held().items()
                },
            }
        }
        for name, record in records.items():
            history = self.history(name, record)
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

    def losses(self, held: float | None) -> list[float]:
        """Stretches at which ellipticity is lost or regained on the way, by the acoustic tensor.

        Of a strip waves in all directions of the plane count, though its particles, held across,
        follow only those along the pull.
        """

        def path(stretch: float) -> Array:
            if held is None:
                return np.array([[stretch]])
            return np.diag([stretch, held])

        return losses_of_ellipticity(self.material, path, 1.0, self.stretch)

    def _held(self) -> Mapping[str, float | None]:
        """What is held across the pull, by scene; nothing can move across a bar."""
        return {BAR: None, **{_strip(held): held for held in self.across}}

    def _curve(self, held: float | None) -> StressCurve:
        return StressCurve(1.0 if held is None else held, *self.material.lame_parameters)

    def _bar(self, ghosts: int = 0) -> SceneBuilder:
        return self._pulled(
            {"type": "interval", "length": self.length}, f"{self.title}: bar", ghosts
        )

    def _strip(self, held: float) -> SceneBuilder:
        breadth = (self.width - 1) * self.length / (self.particles - 1)
        across = f"{held - 1.0!r}*Y"
        return (
            self._pulled(
                {
                    "type": "box",
                    "lengths": [self.length, breadth],
                    "origin": [0.0, -0.5 * breadth],
                },
                f"{self.title}: strip held at {held:g} across",
            )
            .boundary("prescribed-motion", where="all", displacement={"y": across})
            .initial(displacement={"x": 0.0, "y": across})
        )

    def _pulled(self, shape: Mapping[str, object], title: str, ghosts: int = 0) -> SceneBuilder:
        return (
            Simulation.builder()
            .title(title)
            .body(
                "sheet",
                shape=shape,
                spacing=self.length / (self.particles - 1),
                discretisation={"type": "lattice", "on_boundary": True, "ghosts": ghosts},
            )
            .material(self.material)
            .boundary("prescribed-motion", where="left", displacement={"x": 0.0})
            .boundary("prescribed-motion", where="right", displacement={"x": f"{self.speed!r}*t"})
            .integrator("central-difference", time_step_factor=self.time_step_factor)
            .duration(self.transits * self.transit)
            .outputs(max(20, round(_OUTPUTS_A_TRANSIT * self.transits)))
        )

    def _mean(self, name: str, record: Record) -> Measurement:
        history = self.history(name, record)
        losses = self.losses(self._held().get(name))
        at, mean = history.averaged(self.length, self.density, losses[0] if losses else inf)
        curve = history.curve(at)
        errors = np.abs(mean - curve) / (curve - history.curve(np.array([1.0])))
        worst = int(np.argmax(errors)) if len(errors) else None
        # What comes after the loss is not compared, nor asked to come to an end.
        complete = worst is not None and (bool(losses) or record.outcome == FINISHED)
        error = float(errors[worst]) if worst is not None else inf
        within = error <= self.tolerance
        told = f"{'within' if within else 'NOT within'} {100.0 * self.tolerance:g} %"
        reached = f" at stretch {at[worst]:.3g}, where it is worst" if worst is not None else ""
        return Measurement(
            quantity=f"{name}: mean Cauchy stress{reached}",
            value=1e-6 * float(mean[worst]) if worst is not None else float("nan"),
            unit="MPa",
            reference=1e-6 * float(curve[worst]) if worst is not None else None,
            source=_CURVES,
            error=error,
            verdict=told if complete else record.outcome,
            passed=complete and within,
            paper="a close correlation with the static curves",
        )

    def _exact(self, record: Record) -> Measurement:
        history = self.history(MOVING, record)
        losses = self.losses(None)
        elastic = history.stretches <= (losses[0] if losses else inf)
        missed = np.abs(history.stresses - history.curve(history.stretches)[:, None])
        error = float(missed[elastic].max() / history.curve(history.stretches[elastic]).max())
        return Measurement(
            quantity=f"{MOVING}: largest error of the stress of any particle",
            value=error,
            unit="1",
            reference=0.0,
            source="the homogeneous motion is exact",
            error=error,
            verdict="on the curve" if error <= _EXACT else "off the curve",
            passed=error <= _EXACT,
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
        return compared(
            record, f"{BAR}: stretch behind the first wave", found, "1", behind, source, 0.01
        )

    def _swing(self, name: str, record: Record) -> Measurement:
        history = self.history(name, record)
        settled = history.stretches >= _SETTLED
        curve = history.curve(history.stretches[settled])[:, None]
        swings = np.abs(history.stresses[settled] / curve - 1.0)
        return Measurement(
            quantity=f"{name}: largest swing of a particle about the curve beyond stretch "
            f"{_SETTLED:g}",
            value=float(swings.max()) if len(swings) else float("nan"),
            unit="1",
            paper="dynamic effects cause the oscillations about the analytical curves",
        )

    def _ellipticity(self, name: str, held: float | None) -> Measurement:
        lost = self.losses(held)
        expected = theory.losses(held, *self.material.lame_parameters, self.stretch)
        agree = len(lost) == len(expected) and np.allclose(lost, expected, rtol=1e-6, atol=0.0)
        if lost:
            return Measurement(
                quantity=f"{name}: stretch at which the material loses ellipticity",
                value=lost[0],
                unit="1",
                reference=expected[0] if expected else None,
                source=_CLOSED_FORM,
                error=abs(lost[0] / expected[0] - 1.0) if expected else inf,
                verdict="beyond it the MATERIAL localises, whatever the method",
                passed=agree,
            )
        F = np.array([[self.stretch]]) if held is None else np.diag([self.stretch, held])
        _, mu = self.material.lame_parameters
        return Measurement(
            quantity=f"{name}: least stiffness against a wave at the end, in shear moduli",
            value=least_stiffness(self.material, F).value / mu,
            unit="1",
            verdict="elliptic all the way",
            passed=agree,
        )

    def _critical_ratio(self) -> Measurement:
        """Poisson's ratio from which a pull in uniaxial strain softens, by the acoustic tensor."""

        def softest(ratio: float) -> float:
            material = attrs.evolve(self.material, poissons_ratio=ratio)

            def stiffness(stretch: float) -> float:
                F = np.array([[stretch]])
                return least_stiffness(material, F).value / self.youngs_modulus

            return float(minimize_scalar(stiffness, bounds=(1.0, 20.0)).fun)

        found = float(brentq(softest, 0.4, 0.499, xtol=1e-10))
        ratio = theory.critical_ratio()
        reference = 0.5 * ratio / (ratio + 1.0)
        error = abs(found / reference - 1.0)
        return Measurement(
            quantity="Poisson's ratio beyond which a bar softens on the way",
            value=found,
            unit="1",
            reference=reference,
            source=f"P' = 0 at some stretch: lambda / mu > {ratio:.2f}",
            error=error,
            passed=error < 1e-6,
            paper="a slightly compressible material; no moduli are given",
        )


def _strip(held: float) -> str:
    return f"strip-{held:g}"


def _label(name: str) -> str:
    """A curve's name by the stretch across: that of a bar is 1."""
    return f"lambda_2 = {name.removeprefix('strip-') if name != BAR else '1'}"
