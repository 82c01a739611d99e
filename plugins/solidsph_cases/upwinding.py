"""Whether a kernel that is not symmetric makes SPH for solids upwind."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import pi
from pathlib import Path
from typing import Any, ClassVar, final

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
from solidsph_cases._scheme import check_count

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

    title: ClassVar[str] = "Upwinding by a kernel that is not symmetric"
    source: ClassVar[str] = "Ismail & Reddy, section 6; the spectrum of the discrete bar"
    figures: ClassVar[tuple[str, ...]] = ("section-6-upwinding",)
    sweep: ClassVar[Mapping[str, Sequence[Any]]] = {
        "particles": (30, 60, 120),
        "cover": (2.5, 3.5, 5.5),
    }

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
        found = {name: self._modes(name) for name in ("variational", "plain")}
        most = max(self.skews)
        measured = []
        variational = (values.tolist() for values in found["variational"])
        for skew, growth, own in zip(self.skews, *variational, strict=True):
            measured += [
                Measurement(
                    quantity=f"variational divergence, skew {skew:g}: fastest growth",
                    value=growth,
                    unit="c/spacing",
                    reference=0.0,
                    source="the forces derive from an energy: nothing grows, and nothing decays",
                    verdict="no energy lost or won",
                    passed=abs(growth) < _NO_GROWTH,
                    paper=_SECTION if skew == most else "",
                ),
                Measurement(
                    quantity=f"variational divergence, skew {skew:g}: alternating motion",
                    value=own,
                    unit="c/spacing",
                    reference=_ALTERNATING,
                    source="a wave of two spacings",
                    error=abs(own / _ALTERNATING - 1.0),
                    verdict="not seen" if own < _BLIND * _ALTERNATING else "seen",
                    passed=(own < _BLIND * _ALTERNATING) == (skew == 0.0),
                ),
            ]
        growths = dict(zip(self.skews, found["plain"][0].tolist(), strict=True))
        for skew, growth in growths.items():
            grows = growth > max(_NO_GROWTH, _BY_SKEW * growths[0.0])
            measured.append(
                Measurement(
                    quantity=f"plain divergence, skew {skew:g}: fastest growth",
                    value=growth,
                    unit="c/spacing",
                    reference=None,
                    source=_SECTION,
                    verdict="waves against the axis grow" if grows else "no more than at a surface",
                    passed=grows == (skew != 0.0),
                )
            )
        return measured

    def draw(self, records: Mapping[str, Record], folder: Path) -> Sequence[Path]:
        from solidsph_cases._upwinding_picture import draw_modes

        path = folder / "section-6-upwinding.png"
        draw_modes(self.curves(records)["upwinding"], _ALTERNATING, self.title, path)
        return [path]

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
                discretisation={"type": "lattice", "on_boundary": True},
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
