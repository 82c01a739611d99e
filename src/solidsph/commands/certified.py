"""A scheme as options name it, and its certificate as people and programs read it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import attrs
import click
import numpy as np

from solidsph.commands.console import say, show_table
from solidsph.commands.target import resolve
from solidsph.errors import SceneError

if TYPE_CHECKING:
    from solidsph.studies.certificate import Certificate, Wave
    from solidsph.studies.scheme import Scheme

Command = TypeVar("Command", bound=Callable[..., Any])


@attrs.frozen
class SchemeOptions:
    """What the options say; what they do not say is a scene's, or the default."""

    scheme: str | None = None
    kernel: str | None = None
    cover: float | None = None
    formulation: str | None = None
    gradient: str | None = None
    divergence: str | None = None
    material: str | None = None
    effect: tuple[str, ...] = ()
    hourglass: float | None = None

    @property
    def given(self) -> bool:
        """Whether they say anything."""
        return self != SchemeOptions()

    def made(self, settings: Sequence[str]) -> Scheme:
        """The scheme; `settings` are parameters of the case that it is taken from.

        Raises:
            SceneError: there is no such scene, case or part.
        """
        from solidsph.registry.construct import describe
        from solidsph.scene.default_cover import kernel_cover
        from solidsph.scene.scene import Scene
        from solidsph.studies.scheme import Scheme
        from solidsph.testing import example_part

        scheme = Scheme()
        if self.scheme is not None:
            target = resolve(self.scheme, settings)
            scene = target if isinstance(target, Scene) else next(iter(target.scenes().values()))
            scheme = Scheme.of(scene)
        elif settings:
            raise SceneError("--set changes the parameters of a part or of a case; name one")
        changes: dict[str, Any] = {}
        if self.kernel is not None:
            changes["kernel"] = example_part("kernels", self.kernel)
            changes["cover"] = kernel_cover(changes["kernel"])
        if self.cover is not None:
            changes["cover"] = self.cover
        if self.material is not None:
            changes["material"] = example_part("materials", self.material)
        operators = {
            key: value
            for key in ("gradient", "divergence")
            if (value := getattr(self, key)) is not None
        }
        if self.formulation is not None:
            changes["formulation"] = {"type": self.formulation, **operators}
        elif operators:
            table = describe("formulations", scheme.formulation)
            changes["formulation"] = {**table, **operators}
        effects = [example_part("effects", name) for name in self.effect]
        if self.hourglass is not None:
            effects.append({"type": "hourglass-control", "strength": self.hourglass})
        if effects:
            changes["effects"] = (*scheme.effects, *effects)
        return attrs.evolve(scheme, **changes)


def scheme_options(command: Command) -> Command:
    """The options of `SchemeOptions`, on a command."""
    options = (
        click.option("--scheme", metavar="SCENE|CASE", help="Certify the scheme of a scene."),
        click.option("--kernel", metavar="NAME", help="Its kernel."),
        click.option("--cover", type=float, metavar="SPACINGS", help="Its support radius."),
        click.option("--formulation", metavar="NAME", help="Its formulation."),
        click.option("--gradient", metavar="NAME", help="The formulation's gradient."),
        click.option("--divergence", metavar="NAME", help="The formulation's divergence."),
        click.option("--material", metavar="NAME", help="A material, with typical values."),
        click.option("--effect", metavar="NAME", multiple=True, help="An effect to be added."),
        click.option(
            "--hourglass", type=float, metavar="STRENGTH", help="Hourglass control to be added."
        ),
    )
    for option in reversed(options):
        command = option(command)
    return command


def stretch_of(text: str) -> float | list[float]:
    """A stretch of all axes, or one for each, from "1.2" or "1.2,1".

    Raises:
        SceneError: it is no number.
    """
    try:
        each = [float(one) for one in text.split(",")]
    except ValueError:
        raise SceneError(
            f'--stretch {text!r} is no number; give "1.2", or "1.2,1" by axis'
        ) from None
    return each[0] if len(each) == 1 else each


def passed(found: Certificate) -> bool:
    """Whether nothing grows that the material does not let grow, and the rule's step is stable."""
    return found.cause in ("", "material") and _stable(found, found.largest_factor)


def show_certificate(found: Certificate, confirmed: Sequence[Sequence[Any]]) -> None:
    """Tables for people; `confirmed` are rows of runs beside predictions."""
    scheme = found.scheme
    stretches = ", ".join(f"{one:g}" for one in found.stretches)
    form = scheme.formulation
    sums = f"{type(form.gradient).__name__}, {type(form.divergence).__name__}"
    say(
        f"{type(form).__name__} ({sums}), {type(scheme.kernel).__name__}, cover {scheme.cover:g}, "
        f"{scheme.material}, effects: {', '.join(_name(one) for one in scheme.effects) or 'none'}"
    )
    rows = [_zero(found), _growth(found), _step(found)]
    if found.free is not None:
        rows.append(_free(found))
    show_table(
        f"{found.dimension}D lattice at stretch {stretches}; unit of time: a wave's transit of a "
        "spacing",
        ["property", "", "found", "where"],
        rows,
    )
    columns = ["wavelength [spacings]", "along [-]", "across [-]", "across, too [-]"]
    show_table(
        "wave speed over the exact one",
        columns[: 1 + found.dimension],
        [
            [f"{length:g}", *(f"{speed:.4f}" if np.isfinite(speed) else "grows" for speed in row)]
            for length, row in zip(found.wavelengths, found.speeds, strict=True)
        ],
    )
    if confirmed:
        show_table("confirmed by runs", ["property", "", "predicted", "run"], confirmed)


def facts(found: Certificate) -> dict[str, Any]:
    """The same for programs; rates and steps in units of a wave's transit of a spacing."""
    free = found.free
    return {
        "dimension": found.dimension,
        "stretches": list(found.stretches),
        "passed": passed(found),
        "zero_energy_waves": [_wave(one) for one in found.zero_modes],
        "growing_waves": [_wave(one) for one in found.growing],
        "cause_of_growth": found.cause,
        "material_is_elliptic": found.elliptic,
        "critical_step": found.critical_step,
        "cfl_step": found.rule_step,
        "time_step_factor_in_use": found.scheme.time_step_factor,
        "largest_time_step_factor": found.largest_factor,
        "free_body": None if free is None else attrs.asdict(free),
        "wavelengths": found.wavelengths.tolist(),
        "speed_ratios": [
            [float(one) if np.isfinite(one) else None for one in row] for row in found.speeds
        ],
    }


def confirmations(found: Certificate) -> list[list[Any]]:
    """Rows of what runs give beside what is predicted."""
    from solidsph.studies.confirm import amplification, measured_growth

    rows: list[list[Any]] = []
    if found.growing:
        rate = measured_growth(found)
        close = abs(rate / found.growth_rate - 1.0) <= 0.05
        rows.append(
            ["growth rate", "pass" if close else "FAIL", f"{found.growth_rate:.4g}", f"{rate:.4g}"]
        )
    else:
        below, above = amplification(found, 0.95), amplification(found, 1.05)
        holds = below < 100.0 < above
        rows.append(
            [
                "critical step",
                "pass" if holds else "FAIL",
                f"{found.critical_step:.4g}",
                f"at 0.95 of it a wave becomes {below:.2g} times its start, at 1.05 {above:.2g}",
            ]
        )
    return rows


def _name(effect: Any) -> str:
    return effect if isinstance(effect, str) else str(effect)


def _stable(found: Certificate, factor: float) -> bool:
    return factor >= found.scheme.time_step_factor


def _zero(found: Certificate) -> list[str]:
    count = sum(one.count for one in found.zero_modes)
    where = "; ".join(_place(one) for one in found.zero_modes)
    remedy = "" if not count or found.scheme.effects else "; hourglass-control resists them"
    told = f"{count} beyond translations{remedy}" if count else "none beyond translations"
    return ["zero-energy waves", "note" if count else "pass", told, where]


def _growth(found: Certificate) -> list[str]:
    if not found.growing:
        return ["growing waves", "pass", "none", ""]
    own = found.cause == "material"
    told = f"{found.growth_rate:.4g} per transit, {found.cause}"
    return [
        "growing waves",
        "note" if own else "FAIL",
        told + (": it has lost ellipticity there" if own else " instability"),
        "; ".join(f"{_place(one)} at {one.growth_rate:.3g}" for one in found.growing[:4]),
    ]


def _step(found: Certificate) -> list[str]:
    factor = found.critical_step / found.rule_step
    return [
        "critical step",
        "pass" if _stable(found, factor) else "FAIL",
        f"{found.critical_step:.4g} transits: time_step_factor {factor:.3g}, "
        f"{found.scheme.time_step_factor:g} in use",
        _place(found.fastest),
    ]


def _free(found: Certificate) -> list[str]:
    free = found.free
    assert free is not None
    factor = free.critical_step / found.rule_step
    rigid = found.dimension * (found.dimension + 1) // 2
    resisted = f"; {rigid - free.rigid_modes} rigid motions meet a force" * (
        free.rigid_modes < rigid
    )
    good = "note" if free.zero_modes or resisted or factor < 1.0 else "pass"
    return [
        f"free body of {free.particles}",
        good if _stable(found, factor) else "FAIL",
        f"{free.zero_modes or 'no'} zero-energy modes beyond rigid ones; critical "
        f"time_step_factor {factor:.3g}{resisted}",
        "its surface included",
    ]


def _place(wave: Wave) -> str:
    """Wave vector in parts of the shortest wave's."""
    parts = ", ".join(f"{round(float(one), 3):g}" for one in wave.wave_vector / np.pi)
    return f"k = ({parts}) pi"


def _wave(wave: Wave) -> dict[str, Any]:
    return {
        "wave_vector": wave.wave_vector.tolist(),
        "wavelength": wave.wavelength,
        "polarisation": wave.polarisation.tolist(),
        "polarisations": wave.count,
        "growth_rate": wave.growth_rate,
        "frequency": wave.frequency,
    }
