"""Fields of the particles, and columns of the history, that a record holds of each output."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np

from solidsph.errors import PluginError, RecordError
from solidsph.interfaces.terms import EnergyTerm, FieldTerm, Observation, Term
from solidsph.maths.arrays import Array
from solidsph.results.layout import Field, field_name, static_fields
from solidsph.run.energy import BY_BODY, ledger
from solidsph.scene.checks import returned

BASIC_FIELDS = {"velocity": "m/s", "cauchy_stress": "Pa", "volume_ratio": "-"}
"""Fields of every record, and their units."""


def history(observation: Observation, initial: float, terms: Sequence[Term]) -> dict[str, float]:
    """Columns "quantity [unit]": the ledger, by the initial energy [J], then what terms report.

    Raises:
        RecordError: two columns would have one name.
        PluginError: a report is no mapping of numbers.
    """
    columns = dict(ledger(observation, initial, terms))
    for term in terms:
        reported = term.report(observation)
        wrong = returned.check_report(term.label, reported)
        if wrong:
            raise PluginError(f"{wrong}. This is a fault of the part with that label")
        for name, value in reported.items():
            if name in columns:
                raise RecordError(
                    f"{term.label!r} reports {name!r}, which the history holds already; give "
                    "it another label"
                )
            columns[name] = value
    return columns


def fields(observation: Observation, terms: Sequence[Term]) -> Iterator[tuple[Field, Array]]:
    """Every field and its values: those of every record, then those of terms."""
    basic = (observation.state.velocities, stress(observation), observation.volume_ratios)
    for (name, unit), values in zip(BASIC_FIELDS.items(), basic, strict=True):
        yield Field(name, values.shape[1:], unit), values
    for term in terms:
        if isinstance(term, FieldTerm):
            for name, values in term.fields(observation).items():
                quantity, unit = split_unit(name)
                yield Field(field_name(quantity), np.shape(values)[1:], unit), values


def stress(observation: Observation) -> Array:
    """Cauchy stress P F^T / J of every particle, (n, d, d) [Pa]."""
    F, P = observation.deformation_gradients, observation.stresses
    sigma: Array = np.einsum("pik,pjk->pij", P, F) / observation.volume_ratios[:, None, None]
    return sigma


def split_unit(name: str) -> tuple[str, str]:
    """Quantity and unit of "quantity [unit]"."""
    quantity, _, unit = name.rpartition(" [")
    return quantity, unit.rstrip("]")


# Where an extreme is jumps from one sample to the next, so that no curve and no limit shows it.
_PLACE = " maximum at "


def of_probe(label: str, columns: Iterable[str]) -> Iterator[str]:
    """Columns of the probe of this label, but for the places of extremes."""
    return (c for c in columns if c.startswith(f"{label} ") and not c.startswith(label + _PLACE))


def name_clashes(at_rest: Observation, terms: Sequence[Term]) -> Iterator[str]:
    """Problem and remedy for each name that two fields or two columns would have.

    Names do not depend on the state, so one in which nothing has happened yet is enough.
    """
    columns = dict.fromkeys(ledger(at_rest, 0.0), "the energies")
    d = at_rest.particles.dimension
    static = (field.name for field in static_fields(d))
    taken = dict.fromkeys((*BASIC_FIELDS, *static), "every record")
    for term in terms:
        owner = repr(term.label)
        if isinstance(term, EnergyTerm) and term.label in BY_BODY:
            yield _clash(f"column '{term.label} energy [J]'", "the energies", owner)
            continue
        for name in _names(term.report, at_rest):
            if name in columns:
                yield _clash(f"column {name!r}", columns[name], owner)
            columns[name] = owner
        if isinstance(term, FieldTerm):
            for name in _names(term.fields, at_rest):
                field = field_name(split_unit(name)[0])
                if field in taken:
                    yield _clash(f"field {field!r}", taken[field], owner)
                taken[field] = owner


def _names(report: object, at_rest: Observation) -> Sequence[str]:
    """Names that a term reports; none where it needs more than the state at rest holds."""
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            reported: Mapping[str, object] = report(at_rest)  # type: ignore[operator]
            return [name for name in reported if isinstance(name, str)]
    except Exception:  # of any plugin; the first output asks it again, and reports what it raises
        return ()


def _clash(what: str, first: str, second: str) -> str:
    if first == second:  # which no label can mend
        return f"{first} gives a record the {what} twice, which is a fault of that part"
    return f"{first} and {second} would both give a record the {what}; give {second} another label"
