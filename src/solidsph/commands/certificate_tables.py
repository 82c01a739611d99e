"""Certificate of a scheme as tables and as the facts of a JSON object."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import attrs
import numpy as np

from solidsph.commands.console import Table
from solidsph.commands.scheme_options import part_name, scheme_name
from solidsph.studies.certificate import Certificate, Wave
from solidsph.studies.certificate_runs import amplification, measured_growth

# Of the growing waves, this many are named in the table.
_NAMED = 4

# A run confirms a growth rate to this part.
_RATE_ERROR = 0.05

# A wave that is stable stays below this many times its start, one that grows exceeds it.
_AMPLIFIED = 100.0


def passed(certificate: Certificate) -> bool:
    """Whether waves grow at most where the material is unstable. The step follows the scheme."""
    return certificate.cause in ("", "material")


def certificate_facts(certificate: Certificate) -> dict[str, Any]:
    """Facts for programs; rates and steps in units of a wave's transit of a spacing."""
    free = certificate.free
    return {
        "dimension": certificate.dimension,
        "stretches": list(certificate.stretches),
        "passed": passed(certificate),
        "zero_energy_waves": [_wave(wave) for wave in certificate.zero_modes],
        "growing_waves": [_wave(wave) for wave in certificate.growing],
        "cause_of_growth": certificate.cause,
        "material_is_elliptic": certificate.elliptic,
        "critical_step": certificate.critical_step,
        "cfl_step": certificate.rule_step,
        "time_step_factor_in_use": certificate.scheme.time_step_factor,
        "critical_step_over_cfl_step": certificate.of_cfl,
        "free_body": None if free is None else attrs.asdict(free),
        "wavelengths": certificate.wavelengths.tolist(),
        "speed_ratios": [
            [float(speed) if np.isfinite(speed) else None for speed in row]
            for row in certificate.speeds
        ],
    }


def _wave(wave: Wave) -> dict[str, Any]:
    return {
        "wave_vector": wave.wave_vector.tolist(),
        "wavelength": wave.wavelength,
        "polarisation": wave.polarisation.tolist(),
        "polarisations": wave.count,
        "growth_rate": wave.growth_rate,
        "frequency": wave.frequency,
    }


def certificate_text(
    certificate: Certificate, confirmed: Sequence[Sequence[Any]]
) -> Iterator[Table | str]:
    """Tables for people; `confirmed` are rows of `confirmations`."""
    scheme = certificate.scheme
    effects = ", ".join(str(effect) for effect in scheme.effects) or "none"
    yield (
        f"{part_name('formulations', scheme.formulation)}, {scheme_name(scheme)}, "
        f"cover {scheme.cover:g}, effects: {effects}"
    )
    yield f"material: {scheme.material}"
    rows = [_zero(certificate), _growth(certificate), _step(certificate)]
    if certificate.free is not None:
        rows.append(_free(certificate))
    stretches = ", ".join(f"{stretch:g}" for stretch in certificate.stretches)
    yield Table(
        f"{certificate.dimension}D lattice at stretch {stretches}; unit of time: the transit of a "
        "wave over one spacing",
        ["property", "", "result", "where"],
        rows,
    )
    columns = ["wavelength [spacings]", "along [-]", "across [-]", "across, too [-]"]
    yield Table(
        "wave speed over the exact one",
        columns[: 1 + certificate.dimension],
        [
            [f"{length:g}", *(f"{speed:.4f}" if np.isfinite(speed) else "grows" for speed in row)]
            for length, row in zip(certificate.wavelengths, certificate.speeds, strict=True)
        ],
    )
    if confirmed:
        yield Table("confirmed by runs", ["property", "", "predicted", "run"], confirmed)


def confirmations(certificate: Certificate) -> list[list[str]]:
    """Rows that compare a prediction with a run: property, verdict, predicted, run."""
    if certificate.growing:
        rate = measured_growth(certificate)
        close = abs(rate / certificate.growth_rate - 1.0) <= _RATE_ERROR
        return [["growth rate", _verdict(close), f"{certificate.growth_rate:.4g}", f"{rate:.4g}"]]
    below, above = amplification(certificate, 0.95), amplification(certificate, 1.05)
    holds = below < _AMPLIFIED < above
    run = f"at 0.95 of it a wave becomes {below:.2g} times its start, at 1.05 {above:.2g}"
    return [["critical step", _verdict(holds), f"{certificate.critical_step:.4g}", run]]


def _verdict(good: bool) -> str:
    return "pass" if good else "FAIL"


def _zero(certificate: Certificate) -> list[str]:
    count = sum(wave.count for wave in certificate.zero_modes)
    where = "; ".join(_place(wave) for wave in certificate.zero_modes)
    remedy = "" if not count or certificate.scheme.effects else "; hourglass-control resists them"
    result = f"{count} beyond translations{remedy}" if count else "none beyond translations"
    return ["zero-energy waves", "note" if count else "pass", result, where]


def _growth(certificate: Certificate) -> list[str]:
    if not certificate.growing:
        return ["growing waves", "pass", "none", ""]
    material = certificate.cause == "material"
    reason = ": it has lost ellipticity there" if material else " instability"
    return [
        "growing waves",
        "note" if material else "FAIL",
        f"{certificate.growth_rate:.4g} per transit, {certificate.cause}{reason}",
        "; ".join(
            f"{_place(wave)} at {wave.growth_rate:.3g}" for wave in certificate.growing[:_NAMED]
        ),
    ]


def _step(certificate: Certificate) -> list[str]:
    factor = certificate.critical_step / certificate.rule_step
    return [
        "critical step",
        "pass",
        f"{certificate.critical_step:.4g} transits, {factor:.3g} CFL steps",
        _place(certificate.fastest),
    ]


def _free(certificate: Certificate) -> list[str]:
    free = certificate.free
    assert free is not None
    factor = free.critical_step / certificate.rule_step
    resisted = certificate.dimension * (certificate.dimension + 1) // 2 - free.rigid_modes
    rigid = f"; {resisted} rigid motions meet a force" if resisted else ""
    good = "note" if free.zero_modes or resisted or factor < 1.0 else "pass"
    return [
        f"free body of {free.particles}",
        good,
        f"{free.zero_modes or 'no'} zero-energy modes beyond rigid ones; critical "
        f"{factor:.3g} CFL steps{rigid}",
        "its surface included",
    ]


def _place(wave: Wave) -> str:
    """Wave vector in multiples of pi."""
    parts = ", ".join(f"{round(float(part), 3):g}" for part in wave.wave_vector / np.pi)
    return f"k = ({parts}) pi"
