"""Measured numbers beside their references."""

from __future__ import annotations

from math import isfinite

from solidsph.results.record import Record
from solidsph.studies.case import Measurement

FINISHED = "finished"

# Sums of a few dozen terms on spacings of 1e-2, differentiated twice: rounding is below 1e-11.
ROUNDING = 1e-9


def finished(*records: Record) -> bool:
    """True if all these runs came to their end."""
    return all(record.outcome == FINISHED for record in records)


def compared(
    record: Record,
    quantity: str,
    value: float,
    unit: str,
    reference: float | None,
    source: str,
    tolerance: float,
) -> Measurement:
    """`value` against `reference`, or alone if that is None. Only a run that finished can pass.

    Args:
        tolerance: largest relative error that passes [-].
    """
    value = float(value)
    complete = finished(record) and isfinite(value)
    if reference is None:
        verdict = "" if complete else record.outcome
        return Measurement(quantity, value, unit, verdict=verdict, passed=complete)
    error = abs(value / reference - 1.0)
    within = error <= tolerance
    verdict = f"{'within' if within else 'NOT within'} {100.0 * tolerance:g} %"
    return Measurement(
        *(quantity, value, unit, reference, source, error),
        verdict=verdict if complete else record.outcome,
        passed=within and complete,
    )


def alone(record: Record, quantity: str, value: float) -> Measurement:
    """A number [-] without a reference."""
    return compared(record, quantity, value, "1", None, "", 0.0)


def vanishing(
    record: Record,
    quantity: str,
    value: float,
    tolerance: float,
    source: str,
    *,
    unit: str = "1",
    verdict: str = "",
) -> Measurement:
    """`value` against 0; its size is its error, which passes up to `tolerance`."""
    error = abs(float(value))
    passed = finished(record) and error <= tolerance
    return Measurement(quantity, float(value), unit, 0.0, source, error, verdict, passed)


def closed_form(
    quantity: str,
    value: float,
    reference: float,
    *,
    source: str,
    paper: str,
    allowed: float = ROUNDING,
) -> Measurement:
    """A number [-] that needs no run, beside its closed form, which it equals up to rounding.

    Args:
        allowed: largest error that passes, relative to the reference or to 1 if that is smaller.
    """
    value, reference = float(value), float(reference)
    error = abs(value - reference) / max(abs(reference), 1.0)
    passed = error <= allowed
    verdict = "as the closed form" if passed else "NOT as the closed form"
    return Measurement(quantity, value, "1", reference, source, error, verdict, passed, paper)
