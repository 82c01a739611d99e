"""The profiles of all kernels that are installed, beside the Gaussian."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import pi, sqrt
from typing import final

import attrs
import numpy as np

from solidsph.interfaces.smoothing_kernel import SmoothingKernel, smoothing_kernel
from solidsph.maths.arrays import Array
from solidsph.registry import registry
from solidsph.registry.construct import construct
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.studies.case import Case, Curves, Measurement
from solidsph_cases._moments import of_continuum
from solidsph_cases.drawing.profiles import STYLES
from solidsph_cases.drawing.sheet import Panel, Sheet, line, mark, theory

PAPERS = "modified-mollifier"

# Smoothing length of the Gaussian that the paper's kernel is near r = 0, in support radii: its
# logarithm is -1 - 9 q^2 - 5 q^4 - ...
SMOOTHING_LENGTH = 1.0 / 3.0

# Where the logarithm is fitted by a cubic in q^2; what is left out is q^8, below 1e-8 of 9 q^2.
_NEAR = 0.05

# Quadratures to some ten digits on either side.
_QUADRATURE = 1e-9


@final
@attrs.frozen
class KernelProfiles(Case):
    """Every kernel that is installed, in one dimension, with unit support radius and mass.

    The paper draws its modified mollifier beside a Gaussian. It is one of smoothing length H / 3
    near its middle, and narrower beyond, since it ends at H.
    """

    title = "Profiles of the kernels beside the Gaussian"
    source = "Ismail & Reddy, section 2.1, Fig. 1, eq. 6"
    figures = ("fig-1",)

    def scenes(self) -> Mapping[str, Scene]:
        return {}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        return [*self._papers(), *self._masses()]

    def pictures(self, records: Mapping[str, Record]) -> Mapping[str, Sheet]:
        """All profiles, and the logarithms of the paper's and the Gaussian over q^2."""
        found = kernels()
        r, q = np.linspace(-1.0, 1.0, 801), np.linspace(0.0, 0.95, 400)
        others = [name for name in found if name != PAPERS]
        left = Panel(
            theory(r, gaussian(r), "Gaussian, smoothing length H/3"),
            line(r, found[PAPERS].value(np.abs(r)), linewidth=1.8, label=PAPERS),
            *(
                mark(
                    *("plot", r, found[name].value(np.abs(r))),
                    color="0.25",
                    linestyle=STYLES[1 + k % (len(STYLES) - 1)],
                    linewidth=1.2,
                    label=name,
                )
                for k, name in enumerate(others)
            ),
            x="r / H [1]",
            y="H W [1], of unit mass",
            legend={"loc": "upper right", "fontsize": 8},
            grid=True,
        )
        kernel = found[PAPERS].kernel
        right = Panel(
            theory(q**2, -1.0 - 9.0 * q**2, "$-1 - 9 q^2$"),
            line(q**2, np.log(kernel.profile(q, kernel.params)), linewidth=1.8, label="ln w"),
            x="$q^2$, with q = r / H [1]",
            y=f"logarithm of the {PAPERS} [1]",
            legend={"loc": "lower left"},
            grid=True,
        )
        title = "Kernels of unit mass and support H, in 1D; Ismail & Reddy, Fig. 1"
        sheet = Sheet([[left, right]], (12.0, 5.0), title, widths=(1.4, 1.0))
        return {"fig-1-kernel-profiles": sheet}

    def curves(self, records: Mapping[str, Record]) -> Mapping[str, Curves]:
        r = np.linspace(-1.0, 1.0, 401)
        table = {"r / H [1]": r, "Gaussian of smoothing length H / 3 [1/H]": gaussian(r)}
        for name, kernel in kernels().items():
            table[f"{name} [1/H]"] = kernel.value(np.abs(r))
        return {"fig-1-kernel-profiles": table}

    def _papers(self) -> Iterator[Measurement]:
        """How like a Gaussian the modified mollifier is."""
        kernel = smoothing_kernel(construct("kernels", PAPERS), 1, 1.0)
        resembles = "bears close resemblance to the Gaussian function"
        q = np.linspace(0.0, _NEAR, 51)
        logarithm = np.log(kernel.kernel.profile(q, kernel.kernel.params))
        curvature, start = np.polyfit(q**2, logarithm, 3)[-2:]
        source = "Taylor's series of eq. 6: ln w = -1 - 9 q^2 - ..."
        for quantity, value, reference in (
            ("ln w at q = 0", float(start), -1.0),
            ("d ln w / d q^2 at q = 0", float(curvature), -1.0 / SMOOTHING_LENGTH**2),
        ):
            error = abs(value / reference - 1.0)
            passed = error <= 1e-7  # the fit leaves out q^8, 1e-8 of q^2 at its end
            name, verdict = f"{PAPERS}: {quantity}", ""
            yield Measurement(
                name, value, "1", reference, source, error, verdict, passed, resembles
            )
        r = np.linspace(0.0, 1.0, 2001)
        apart = np.abs(kernel.value(r) - gaussian(r)).max() / float(gaussian(np.zeros(1))[0])
        yield Measurement(
            f"{PAPERS}: largest distance from a Gaussian of equal mass, over its peak",
            float(apart),
            "1",
            source="smoothing length H / 3",
            paper=resembles,
        )
        yield Measurement(
            f"{PAPERS}: second moment over the Gaussian's",
            of_continuum(kernel).value[2] / (0.5 * SMOOTHING_LENGTH**2),
            "1",
            source="smoothing length H / 3: H^2 / 18",
            paper=resembles,
        )

    def _masses(self) -> Iterator[Measurement]:
        """The mass of every kernel, and its second moment."""
        for name, kernel in kernels().items():
            mass, _, second, *_ = of_continuum(kernel).value
            expected = 1.0 - kernel.kernel.lost_mass(1)
            error = abs(mass / expected - 1.0)
            source = "eq. 2, less what a cut loses"
            paper = "normalised numerically" if name == PAPERS else ""
            passed = error <= _QUADRATURE
            yield Measurement(
                f"{name}: mass", mass, "1", expected, source, error, "", passed, paper
            )
            quantity = f"{name}: second moment over H^2, which smooths"
            yield Measurement(quantity, second, "1", source="adaptive quadrature")


def kernels() -> Mapping[str, SmoothingKernel]:
    """Every kernel that is installed and needs no parameter, by name."""
    return {
        name: smoothing_kernel(construct("kernels", name), 1, 1.0)
        for name in registry.names("kernels")
        if all(
            field.default is not attrs.NOTHING
            for field in attrs.fields(registry.load("kernels", name))
        )
    }


def gaussian(r: Array) -> Array:
    """The whole Gaussian of unit mass and smoothing length 1/3, (n,) [1/m]."""
    return np.asarray(np.exp(-((r / SMOOTHING_LENGTH) ** 2)) / (SMOOTHING_LENGTH * sqrt(pi)))
