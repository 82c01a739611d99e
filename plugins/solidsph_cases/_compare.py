"""A measured number beside its reference, as every benchmark states it."""

from __future__ import annotations

from math import isfinite

from solidsph.results.record import Record
from solidsph.studies.case import Measurement

FINISHED = "finished"

# Sums of a few dozen terms on spacings of 1e-2, differentiated twice: rounding is below 1e-11.
ROUNDING = 1e-9


def compared(
    record: Record,
    quantity: str,
    value: float,
    unit: str,
    reference: float | None,
    source: str,
    tolerance: float,
) -> Measurement:
    """`value` against `reference`; None stands alone. Only a run that finished can pass.

    Args:
        tolerance: largest relative error that passes [-].
    """
    value = float(value)
    complete = record.outcome == FINISHED and isfinite(value)
    if reference is None:
        return Measurement(
            quantity, value, unit, verdict="" if complete else record.outcome, passed=complete
        )
    error = abs(value / reference - 1.0)
    within = error <= tolerance
    verdict = f"{'within' if within else 'NOT within'} {100.0 * tolerance:g} %"
    return Measurement(
        quantity=quantity,
        value=value,
        unit=unit,
        reference=reference,
        source=source,
        error=error,
        verdict=verdict if complete else record.outcome,
        passed=within and complete,
    )


def closed_form(
    quantity: str,
    value: float,
    reference: float,
    *,
    source: str,
    paper: str,
    allowed: float = ROUNDING,
) -> Measurement:
    """A number [-] that no run made, beside its closed form, which it has but for rounding.

    Args:
        allowed: largest error that passes, relative to the reference or to 1 if that is smaller.
    """
    value, reference = float(value), float(reference)
    error = abs(value - reference) / max(abs(reference), 1.0)
    return Measurement(
        quantity=quantity,
        value=value,
        unit="1",
        reference=reference,
        source=source,
        error=error,
        verdict="as the closed form" if error <= allowed else "NOT as the closed form",
        passed=error <= allowed,
        paper=paper,
    )
