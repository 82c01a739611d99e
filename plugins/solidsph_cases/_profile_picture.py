"""Fig. 1: kernels of equal mass and support beside the Gaussian."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from solidsph.interfaces.smoothing_kernel import SmoothingKernel
from solidsph_cases.kernel_profiles import PAPERS, gaussian

_STYLES = ("--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 3)))


def draw_profiles(kernels: Mapping[str, SmoothingKernel], path: Path) -> None:
    """Left all profiles, right the logarithms of the paper's and the Gaussian, over q^2."""
    figure = Figure(figsize=(12.0, 5.0), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.4, 1.0))
    r = np.linspace(-1.0, 1.0, 801)
    whole = "Gaussian, smoothing length H/3"
    left.plot(r, gaussian(r), color="0.8", linewidth=5.0, label=whole)
    left.plot(r, kernels[PAPERS].value(np.abs(r)), "k-", linewidth=1.8, label=PAPERS)
    others = [name for name in kernels if name != PAPERS]
    for k, name in enumerate(others):
        left.plot(
            r,
            kernels[name].value(np.abs(r)),
            color="0.25",
            linestyle=_STYLES[k % len(_STYLES)],
            linewidth=1.2,
            label=name,
        )
    left.set_xlabel("r / H [1]")
    left.set_ylabel("H W [1], of unit mass")
    left.legend(loc="upper right", frameon=False, fontsize=8)
    left.grid(color="0.93")

    q = np.linspace(0.0, 0.95, 400)
    kernel = kernels[PAPERS].kernel
    right.plot(q**2, -1.0 - 9.0 * q**2, color="0.8", linewidth=5.0, label="$-1 - 9 q^2$")
    right.plot(q**2, np.log(kernel.profile(q, kernel.params)), "k-", linewidth=1.8, label="ln w")
    right.set_xlabel("$q^2$, with q = r / H [1]")
    right.set_ylabel(f"logarithm of the {PAPERS} [1]")
    right.legend(loc="lower left", frameon=False)
    right.grid(color="0.93")
    figure.suptitle(
        "Kernels of unit mass and support H, in 1D; Ismail & Reddy, Fig. 1", fontsize=11
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150)
