"""The profiles of all kernels that are installed, beside the Gaussian."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import pi, sqrt
from pathlib import Path
from typing import ClassVar, final

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

    title: ClassVar[str] = "Profiles of the kernels beside the Gaussian"
    source: ClassVar[str] = "Ismail & Reddy, section 2.1, Fig. 1, eq. 6"
    figures: ClassVar[tuple[str, ...]] = ("fig-1",)

    def scenes(self) -> Mapping[str, Scene]:
        return {}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        return [*self._papers(), *self._masses()]

    def draw(self, records: Mapping[str, Record], folder: Path) -> Sequence[Path]:
        from solidsph_cases._profile_picture import draw_profiles

        path = folder / "fig-1-kernel-profiles.png"
        draw_profiles(kernels(), path)
        return [path]

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
        for quantity, value, reference in (
            (f"{PAPERS}: ln w at q = 0", start, -1.0),
            (f"{PAPERS}: d ln w / d q^2 at q = 0", curvature, -1.0 / SMOOTHING_LENGTH**2),
        ):
            error = abs(float(value) / reference - 1.0)
            yield Measurement(
                quantity=quantity,
                value=float(value),
                unit="1",
                reference=reference,
                source="Taylor's series of eq. 6: ln w = -1 - 9 q^2 - ...",
                error=error,
                # The fit leaves out q^8, 1e-8 of q^2 at its end.
                passed=error <= 1e-7,
                paper=resembles,
            )
        r = np.linspace(0.0, 1.0, 2001)
        apart = np.abs(kernel.value(r) - gaussian(r)).max() / float(gaussian(np.zeros(1))[0])
        yield Measurement(
            quantity=f"{PAPERS}: largest distance from a Gaussian of equal mass, over its peak",
            value=float(apart),
            unit="1",
            source="smoothing length H / 3",
            paper=resembles,
        )
        yield Measurement(
            quantity=f"{PAPERS}: second moment over the Gaussian's",
            value=of_continuum(kernel).value[2] / (0.5 * SMOOTHING_LENGTH**2),
            unit="1",
            source="smoothing length H / 3: H^2 / 18",
            paper=resembles,
        )

    def _masses(self) -> Iterator[Measurement]:
        """The mass of every kernel, and how far it smooths."""
        for name, kernel in kernels().items():
            moments = of_continuum(kernel)
            expected = 1.0 - kernel.kernel.lost_mass(1)
            error = abs(moments.value[0] / expected - 1.0)
            yield Measurement(
                quantity=f"{name}: mass",
                value=moments.value[0],
                unit="1",
                reference=expected,
                source="eq. 2, less what a cut loses",
                error=error,
                passed=error <= _QUADRATURE,
                paper="normalised numerically" if name == PAPERS else "",
            )
            yield Measurement(
                quantity=f"{name}: second moment over H^2, which smooths",
                value=moments.value[2],
                unit="1",
                source="adaptive quadrature",
            )


def kernels() -> Mapping[str, SmoothingKernel]:
    """Every kernel that is installed and needs no parameter, by name."""
    return {
        name: smoothing_kernel(construct("kernels", name), 1, 1.0)
        for name in registry.names("kernels")
        if all(field.default is not attrs.NOTHING for field in _fields(name))
    }


def _fields(name: str) -> Sequence[attrs.Attribute[object]]:
    kernel = registry.load("kernels", name)
    return tuple(attrs.fields(kernel))


def gaussian(r: Array) -> Array:
    """The whole Gaussian of unit mass and smoothing length 1/3, (n,) [1/m]."""
    result: Array = np.exp(-((r / SMOOTHING_LENGTH) ** 2)) / (SMOOTHING_LENGTH * sqrt(pi))
    return result
