"""solidsph stability --map: where small deviations grow, and which steps are stable."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from solidsph.commands.console import say, show_json, show_table
from solidsph.commands.scheme_options import SchemeOptions

# From strong compression to the largest stretch of the paper, past 1 without touching it, and from
# a support that just holds the nearest neighbours to the paper's largest.
_STRETCHES, _COVERS = (0.3, 6.0), (1.2, 5.5)


def draw_map(
    chosen: SchemeOptions, points: tuple[int, int], output: Path, *, as_json: bool
) -> None:
    """Draw and tell growth and critical steps of a scheme on an endless bar, in both forms."""
    import attrs

    from solidsph.studies.stability_map import stability_map
    from solidsph.studies.stability_picture import draw_certificates

    forms: tuple[str, ...] = ("total-lagrangian", "updated-lagrangian")
    if chosen.formulation is not None:
        forms = (chosen.formulation,)
    stretches, covers = (
        np.linspace(*ends, count).tolist()
        for ends, count in zip((_STRETCHES, _COVERS), points, strict=True)
    )
    maps = {
        form: stability_map(attrs.evolve(chosen, formulation=form).made(()), stretches, covers)
        for form in forms
    }
    scheme = attrs.evolve(chosen, formulation=forms[0]).made(())
    words = (
        f"{type(scheme.kernel).__name__}, {type(scheme.formulation.gradient).__name__} gradient, "
        f"{type(scheme.formulation.divergence).__name__} divergence, "
        f"{type(scheme.material).__name__}"
    )
    draw_certificates(
        maps, output, title=f"Small deviations from a uniform stretch of an endless bar: {words}"
    )
    facts = [
        {
            "formulation": form,
            "unstable_in_tension": _part(one.grows, one.connected & (one.stretches > 1.0)),
            "unstable_in_compression": _part(one.grows, one.connected & (one.stretches < 1.0)),
            "fastest_growth": float(np.nanmax(one.rates)),
            "least_factor": float(np.nanmin(np.where(one.connected, one.factors, np.nan))),
        }
        for form, one in maps.items()
    ]
    if as_json:
        show_json({"scheme": words, "maps": facts, "picture": str(output)})
        return
    show_table(
        words,
        [
            "formulation",
            "unstable part in tension [-]",
            "in compression [-]",
            "fastest growth [1/transit]",
            "least stable step [CFL steps]",
        ],
        [list(one.values()) for one in facts],
    )
    say(f"picture: {output}")


def _part(grows: Any, where: Any) -> float:
    """Of the points at `where`, how many are unstable."""
    chosen = grows[where]
    return float(chosen.mean()) if chosen.size else 0.0
