"""What a record shows of an output: fields of every particle, and columns of its history."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from solidsph.errors import PluginError, RecordError
from solidsph.interfaces.terms import (
    EnergyTerm,
    FieldTerm,
    Observation,
    Term,
)
from solidsph.maths.arrays import Array
from solidsph.results.layout import field_name, static_fields, tag_name
from solidsph.run.energy import BY_BODY, ledger
from solidsph.scene.checks.returned import check_report

OWN = {"velocity": "m/s", "cauchy_stress": "Pa", "volume_ratio": "-"}
"""Fields of every record, and their units."""


def history(
    observation: Observation, initial: float, conditions: Sequence[Term]
) -> dict[str, float]:
    """Columns "quantity [unit]": the ledger, then what conditions report.

    Raises:
        RecordError: two would have one name.
        PluginError: a report is no mapping of numbers.
    """
    columns = dict(ledger(observation, initial, conditions))
    for condition in conditions:
        reported = condition.report(observation)
        wrong = check_report(condition.label, reported)
        if wrong:
            raise PluginError(f"{wrong}. This is a fault of the part with that label")
        for name, value in reported.items():
            if name in columns:
                raise RecordError(
                    f"{condition.label!r} reports {name!r}, which the history holds already; give "
                    "it another label"
                )
            columns[name] = value
    return columns


def fields(
    observation: Observation, conditions: Sequence[Term]
) -> Iterator[tuple[str, str, Array]]:
    """Name, unit and values of every field that conditions have to show."""
    for condition in conditions:
        if isinstance(condition, FieldTerm):
            for name, values in condition.fields(observation).items():
                quantity, unit = parted(name)
                yield field_name(quantity), unit, values


def parted(name: str) -> tuple[str, str]:
    """Quantity and unit of "quantity [unit]"."""
    quantity, _, unit = name.rpartition(" [")
    return quantity, unit.rstrip("]")


def clashes(at_rest: Observation, conditions: Sequence[Term]) -> Iterator[str]:
    """Names that two fields or two columns would have, each with its remedy.

    Args:
        at_rest: a state in which nothing has happened yet: names do not depend on it.
        conditions: of the scene.
    """
    columns = dict.fromkeys(ledger(at_rest, 0.0), "the energies")
    d = at_rest.particles.dimension
    taken = dict.fromkeys((*OWN, *(one.name for one in static_fields(d))), "every record")
    taken |= {tag_name(tag): f"tag {tag!r}" for tag in at_rest.particles.tags}
    for condition in conditions:
        whose = repr(condition.label)
        if isinstance(condition, EnergyTerm) and condition.label in BY_BODY:
            yield _clash(f"column '{condition.label} energy [J]'", "the energies", whose)
            continue
        for name in _names(condition.report, at_rest):
            if name in columns:
                yield _clash(f"column {name!r}", columns[name], whose)
            columns[name] = whose
        if isinstance(condition, FieldTerm):
            for name in _names(condition.fields, at_rest):
                field = field_name(parted(name)[0])
                if field in taken:
                    yield _clash(f"field {field!r}", taken[field], whose)
                taken[field] = whose


def _names(shown: object, at_rest: Observation) -> Sequence[str]:
    """Of what a condition shows; none where it needs more than the state at rest holds."""
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            found: Mapping[str, object] = shown(at_rest)  # type: ignore[operator]
            return [name for name in found if isinstance(name, str)]
    except Exception:  # a part of anyone's; the first output asks it again, and tells what it says
        return ()


def _clash(what: str, one: str, other: str) -> str:
    if one == other:  # which no label can mend
        return f"{one} gives a record the {what} twice, which is a fault of that part"
    return f"{one} and {other} would both give a record the {what}; give {other} another label"
