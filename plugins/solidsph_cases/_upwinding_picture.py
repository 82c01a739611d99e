"""What skewing the kernel does to the modes of a bar."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

from solidsph.studies.case import Curves


def draw_modes(curves: Curves, wanted: float, title: str, path: Path) -> None:
    """Growth on the left, the frequency of the alternating motion on the right, over the skew."""
    figure = Figure(figsize=(11.0, 4.2), layout="constrained")
    growth, own = figure.subplots(1, 2)
    skew, *values = curves.values()
    styles = {"variational": ("black", "-", "o"), "plain": ("0.5", "--", "s")}
    for (name, (color, line, marker)), grown, seen in zip(
        styles.items(), values[:2], values[2:], strict=True
    ):
        look = {"color": color, "linestyle": line, "marker": marker, "label": f"{name} divergence"}
        growth.plot(skew, grown, **look)
        own.plot(skew, seen, **look)
    own.axhline(wanted, color="0.7", linewidth=3.0, zorder=0, label="a wave of two spacings")
    growth.set_ylabel("fastest growth [wave speed / spacing]")
    own.set_ylabel("alternating motion: frequency\n[wave speed / spacing]")
    for axis in (growth, own):
        axis.set_xlabel("skew of the kernel [-]")
        axis.legend(frameon=False, fontsize=9)
    own.set_ylim(bottom=0.0)
    figure.suptitle(title, fontsize=11)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150)
