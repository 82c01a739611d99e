"""solidsph stability --map: where small deviations grow, and which steps are stable."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from solidsph.commands.console import Table, present
from solidsph.commands.scheme_options import SchemeOptions, scheme_name
from solidsph.studies.stability_map import stability_map

# Stretches from strong compression to the largest of the paper, never exactly 1. Covers from one
# that just holds the nearest neighbours to the paper's largest.
_STRETCHES, _COVERS = (0.3, 6.0), (1.2, 5.5)

_HEADINGS = {
    "formulation": "formulation",
    "unstable_in_tension": "unstable part in tension [-]",
    "unstable_in_compression": "in compression [-]",
    "fastest_growth": "fastest growth [1/transit]",
    "least_factor": "least stable step [CFL steps]",
}


def draw_map(
    options: SchemeOptions, points: tuple[int, int], output: Path, *, as_json: bool
) -> None:
    """Draw and print growth and critical steps of a scheme on an endless bar.

    Both formulations are compared unless the options name one.
    """
    from solidsph.studies.stability_picture import draw_certificates

    forms: tuple[str, ...] = ("total-lagrangian", "updated-lagrangian")
    if options.formulation is not None:
        forms = (options.formulation,)
    schemes = {form: attrs.evolve(options, formulation=form).build() for form in forms}
    stretches, covers = (
        np.linspace(*ends, count).tolist()
        for ends, count in zip((_STRETCHES, _COVERS), points, strict=True)
    )
    maps = {form: stability_map(scheme, stretches, covers) for form, scheme in schemes.items()}
    name = scheme_name(schemes[forms[0]])
    draw_certificates(
        maps, output, title=f"Small deviations from a uniform stretch of an endless bar: {name}"
    )
    rows = [
        {
            "formulation": form,
            "unstable_in_tension": _part(m.grows, m.connected & (m.stretches > 1.0)),
            "unstable_in_compression": _part(m.grows, m.connected & (m.stretches < 1.0)),
            "fastest_growth": float(np.nanmax(m.rates)),
            "least_factor": float(np.nanmin(np.where(m.connected, m.factors, np.nan))),
        }
        for form, m in maps.items()
    ]
    facts = {"scheme": name, "maps": rows, "picture": str(output)}
    present(facts, _text(facts), as_json=as_json)


def _text(facts: Mapping[str, Any]) -> Iterator[Table | str]:
    yield Table.of(facts["scheme"], facts["maps"], list(_HEADINGS), _HEADINGS)
    yield f"picture: {facts['picture']}"


def _part(grows: Any, where: Any) -> float:
    """Share of the points at `where` that are unstable."""
    chosen = grows[where]
    return float(chosen.mean()) if chosen.size else 0.0
