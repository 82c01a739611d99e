"""Conformance kits: checks of every kind of part, for plugin authors and `solidsph check`.

`solidsph.testing.strategies` is a separate import: it needs Hypothesis, which nothing here does.
"""

from solidsph.conformance.check import Check, CheckResult
from solidsph.conformance.kernel import MASS_TOLERANCE, smoothed_mass
from solidsph.testing.examples import example_part
from solidsph.testing.kits import checks, conformance, kits

__all__ = [
    "MASS_TOLERANCE",
    "Check",
    "CheckResult",
    "checks",
    "conformance",
    "example_part",
    "kits",
    "smoothed_mass",
]
