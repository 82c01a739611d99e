"""Whether a kernel that is not symmetric makes SPH for solids upwind."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import pi
from typing import final

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.maths.arrays import Array
from solidsph.registry.parameters import check_positive, number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.simulation import Simulation
from solidsph.studies.case import Case, Curves, Measurement
from solidsph.studies.spectrum import spectrum
from solidsph_cases._scene import ON_BOUNDARY, check_count
from solidsph_cases.drawing.sheet import Mark, Panel, Sheet, line, mark

# A growth by less than this in the time of a wave across a spacing is rounding of the spectrum.
_NO_GROWTH = 1e-4

# The plain divergence has no energy near surfaces, and something grows there slowly without any
# skew; by what factor it must grow faster to be laid to the skew.
_BY_SKEW = 5.0

# What a motion that alternates from particle to particle should have, in wave speeds a spacing.
_ALTERNATING = pi
# Below this part of it the gradient is blind to that motion.
_BLIND = 0.1

_SECTION = "section 6: methods like upwinding may be possible by non-symmetric cover functions"


@final
@attrs.frozen
class Upwinding(Case):
    """A bar whose gradient weighs neighbours on one side more, in both divergences.

    Upwinding damps what a scheme does not resolve, in the direction of the wave. Waves in a solid
    run both ways, and the spectrum of the discrete bar tells what becomes of them: a mode that
    grows, one that decays, and the motion that alternates from particle to particle, which a
    symmetric gradient does not see.
    """

    title = "Upwinding by a kernel that is not symmetric"
    source = "Ismail & Reddy, section 6; the spectrum of the discrete bar"
    figures = ("section-6-upwinding",)
    sweep = {"particles": (30, 60, 120), "cover": (2.5, 3.5, 5.5)}

    skews: Sequence[float] = (0.0, 0.25, 0.5, 0.75)
    particles: int = 60
    kernel: str = "modified-mollifier"
    cover: float = number(default=3.5)  # [spacings]

    def __attrs_post_init__(self) -> None:
        check_count("upwinding", "particles", self.particles, 12)
        check_positive("upwinding", "cover", self.cover, "spacings")
        if not any(skew == 0.0 for skew in self.skews) or len(self.skews) < 2:
            raise SceneError(
                f"case 'upwinding': skews must hold 0, to compare with, and another, got "
                f"{list(self.skews)}"
            )

    def accuracy(self, measurements: Sequence[Measurement]) -> Measurement:
        """How far the fastest wave is from what it should be, at the largest skew."""
        return [m for m in measurements if m.error is not None][-1]

    @property
    def resolution(self) -> float:
        """Over the length of the bar."""
        return 1.0 / self.particles

    def scenes(self) -> Mapping[str, Scene]:
        return {}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        growths, alternating = (values.tolist() for values in self._modes("variational"))
        plain = dict(zip(self.skews, self._modes("plain")[0].tolist(), strict=True))
        measured = []
        for skew, growth, seen in zip(self.skews, growths, alternating, strict=True):
            name = f"variational divergence, skew {skew:g}"
            blind = seen < _BLIND * _ALTERNATING
            measured += [
                Measurement(
                    f"{name}: fastest growth",
                    growth,
                    "c/spacing",
                    reference=0.0,
                    source="the forces derive from an energy: nothing grows, and nothing decays",
                    verdict="no energy lost or won",
                    passed=abs(growth) < _NO_GROWTH,
                    paper=_SECTION if skew == max(self.skews) else "",
                ),
                Measurement(
                    f"{name}: alternating motion",
                    seen,
                    "c/spacing",
                    reference=_ALTERNATING,
                    source="a wave of two spacings",
                    error=abs(seen / _ALTERNATING - 1.0),
                    verdict="not seen" if blind else "seen",
                    passed=blind == (skew == 0.0),
                ),
            ]
        for skew, growth in plain.items():
            grows = growth > max(_NO_GROWTH, _BY_SKEW * plain[0.0])
            measured.append(
                Measurement(
                    f"plain divergence, skew {skew:g}: fastest growth",
                    growth,
                    "c/spacing",
                    source=_SECTION,
                    verdict="waves against the axis grow" if grows else "no more than at a surface",
                    passed=grows == (skew != 0.0),
                )
            )
        return measured

    def pictures(self, records: Mapping[str, Record]) -> Mapping[str, Sheet]:
        """The growth and the frequency of the alternating motion over the skew."""
        table = self.curves(records)["upwinding"]
        skew = table["skew [-]"]

        def curves(quantity: str) -> list[Mark]:
            styles = {"variational": ("o-", "black"), "plain": ("s--", "0.5")}
            return [
                line(
                    *(skew, table[f"{quantity}, {name} [c/spacing]"], style),
                    color=color,
                    label=f"{name} divergence",
                )
                for name, (style, color) in styles.items()
            ]

        wave = {"color": "0.7", "linewidth": 3.0, "zorder": 0, "label": "a wave of two spacings"}
        growth = Panel(
            *curves("growth"),
            x="skew of the kernel [-]",
            y="fastest growth [wave speed / spacing]",
            legend={},
        )
        seen = Panel(
            *curves("alternating motion"),
            mark("axhline", _ALTERNATING, **wave),
            x="skew of the kernel [-]",
            y="alternating motion: frequency\n[wave speed / spacing]",
            ylim=(0.0, None),
            legend={},
        )
        return {"section-6-upwinding": Sheet([[growth, seen]], (11.0, 4.2), self.title)}

    def curves(self, records: Mapping[str, Record]) -> Mapping[str, Curves]:
        variational, plain = self._modes("variational"), self._modes("plain")
        return {
            "upwinding": {
                "skew [-]": np.array(self.skews),
                "growth, variational [c/spacing]": variational[0],
                "growth, plain [c/spacing]": plain[0],
                "alternating motion, variational [c/spacing]": variational[1],
                "alternating motion, plain [c/spacing]": plain[1],
            }
        }

    def _modes(self, divergence: str) -> tuple[Array, Array]:
        """Fastest growth and frequency of the alternating motion, by skew, in wave speeds over
        the spacing."""
        growths, own = [], []
        for skew in self.skews:
            simulation = self._bar(skew, divergence)
            spacing = float(simulation.particles.spacings[0])
            scale = spacing / simulation.model.bodies[0].material.wave_speed
            growths.append(scale * spectrum(simulation.dynamics, simulation.start()).growth_rate)
            own.append(scale * _alternating_frequency(simulation))
        return np.array(growths), np.array(own)

    def _bar(self, skew: float, divergence: str) -> Simulation:
        """Held at its ends, so that no rigid motion is among the modes."""
        return (
            Simulation.builder()
            .body(
                "bar",
                shape={"type": "interval", "length": 1.0},
                spacing=1.0 / (self.particles - 1),
                discretisation=ON_BOUNDARY,
            )
            .kernel(self.kernel, cover=self.cover)
            .material("neo-hookean", youngs_modulus=1.0, poissons_ratio=0.0, density=1.0)
            .formulation(
                "total-lagrangian",
                gradient={"type": "skewed", "skew": skew},
                divergence=divergence,
            )
            .boundary("clamp", where="left")
            .boundary("clamp", where="right")
            .duration(1.0)
            .build()
        )


def _alternating_frequency(simulation: Simulation) -> float:
    """Angular frequency [rad/s] of the motion that alternates, by its Rayleigh quotient inside."""
    X = simulation.particles.positions
    spacing = float(simulation.particles.spacings[0])
    signs = np.where(np.rint(X[:, 0] / spacing) % 2, -1.0, 1.0)[:, None]
    u = 1e-6 * spacing * signs
    a = simulation.dynamics.respond(0.0, X + u, np.zeros_like(X)).accelerations
    reach = 2.0 * simulation.model.bodies[0].smoothing.support_radius
    inside = np.minimum(X, X.max() - X)[:, 0] > reach
    quotient = -float(np.vdot(u[inside], a[inside]) / np.vdot(u[inside], u[inside]))
    return float(np.sqrt(max(quotient, 0.0)))
