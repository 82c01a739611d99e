"""Picture of a stiff slab on a soft layer."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from solidsph.results.record import Record

if TYPE_CHECKING:
    from solidsph_cases.stiffness_jump import StiffnessJump


def draw_swing(record: Record, case: StiffnessJump, path: Path) -> None:
    """The slab's displacement against time, and the stress along the axis at its farthest."""
    from solidsph_cases.stiffness_jump import LENGTH, SOFT

    figure = Figure(figsize=(10.0, 3.8), layout="constrained")
    motion, stress = figure.subplots(1, 2)
    u, t = case.swing(record), record.times / case.period
    motion.plot(t, u / LENGTH, "k-", label="simulated")
    amplitude = np.abs(u).max() / LENGTH
    motion.plot(
        t,
        amplitude * np.sin(2.0 * np.pi * t),
        color="tab:orange",
        linestyle="--",
        label="a rod with a mass, same amplitude",
    )
    motion.set_xlabel("time [periods of the linear theory]")
    motion.set_ylabel("displacement of the slab [layers]")
    motion.legend(frameon=False, loc="upper center")
    motion.margins(y=0.25)
    k = int(np.argmax(u))
    X = record.particles.positions[:, 0]
    sigma = record.field("cauchy_stress")[k][:, 0, 0]
    modulus = SOFT.density * SOFT.wave_speed**2
    layer = X < LENGTH
    stress.plot(X[layer], sigma[layer] / modulus, "k.", markersize=4, label="layer")
    stress.plot(X[~layer], sigma[~layer] / modulus, "x", color="tab:blue", label="slab")
    stress.axvline(LENGTH, color="0.6", linewidth=0.8)
    stress.set_xlabel("X [m]")
    stress.set_ylabel("Cauchy stress [moduli of the layer]")
    stress.legend(frameon=False)
    figure.suptitle(f"{case.title}: moduli 1:{case.ratio:g}, {record.particles.count} particles")
    figure.savefig(path, dpi=130)
