"""Richer hyperelastic laws against closed forms: Mooney-Rivlin, Holzapfel-Ogden."""

from __future__ import annotations

from collections.abc import Callable

import attrs
import numpy as np
import pytest

from solidsph.errors import SceneError
from solidsph.interfaces.material import Material
from solidsph.maths.tensors import cauchy_stress
from solidsph.registry import registry
from solidsph.testing import conformance, example_part
from solidsph_builtin.materials.holzapfel_ogden import HolzapfelOgden
from solidsph_builtin.materials.mooney_rivlin import MooneyRivlin

C10, C01 = 1.6e5, 0.4e5  # [Pa]
RUBBER = MooneyRivlin(c10=C10, c01=C01, bulk_modulus=1e8, density=1000.0)

# Holzapfel & Ogden (2009), table 1, first row: fitted to the shear tests of Dokos et al. (2002).
MYOCARDIUM = HolzapfelOgden(
    matrix_stiffness=59.0,
    matrix_exponent=8.023,
    fibre_stiffness=18472.0,
    fibre_exponent=16.026,
    sheet_stiffness=2481.0,
    sheet_exponent=11.120,
    coupling_stiffness=216.0,
    coupling_exponent=11.436,
    bulk_modulus=1e5,
    density=1060.0,
)


def sigma(material: Material, F: np.ndarray) -> np.ndarray:
    return np.array(cauchy_stress(F, np.array(material.first_piola(F, material.params))))


# At constant volume the difference of two principal stresses does not know the bulk modulus, and is
# that of the incompressible law to rounding: of the bulk modulus, whose stress cancels.
ROUNDING = 1e-14 * 1e8


@pytest.mark.parametrize("stretch", [0.5, 0.9, 1.2, 2.0, 4.0])
def test_mooney_rivlin_uniaxial_biaxial_and_shear(stretch: float) -> None:
    """Rivlin (1948): 2 (s^2 - 1/s) (C10 + C01/s), 2 (s^2 - 1/s^4) (C10 + C01 s^2), and the shear
    modulus 2 (C10 + C01) with both normal stress differences."""
    s = stretch
    one = sigma(RUBBER, np.diag([s, s**-0.5, s**-0.5]))
    assert one[0, 0] - one[1, 1] == pytest.approx(
        2.0 * (s**2 - 1.0 / s) * (C10 + C01 / s), abs=20.0 * ROUNDING
    )
    two = sigma(RUBBER, np.diag([s, s, s**-2]))
    assert two[0, 0] - two[2, 2] == pytest.approx(
        2.0 * (s**2 - s**-4) * (C10 + C01 * s**2), abs=20.0 * ROUNDING
    )
    g = s - 1.0
    shear = sigma(RUBBER, np.array([[1.0, g, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]))
    assert shear[0, 1] == pytest.approx(2.0 * (C10 + C01) * g, abs=ROUNDING)
    assert shear[0, 0] - shear[1, 1] == pytest.approx(2.0 * (C10 + C01) * g**2, abs=ROUNDING)
    assert shear[1, 1] - shear[2, 2] == pytest.approx(-2.0 * C01 * g**2, abs=ROUNDING)


def test_mooney_rivlin_under_pressure() -> None:
    """F = s I: the pressure is the bulk law's alone, kappa/2 (J^2 - 1) / J."""
    for s in (0.8, 1.1):
        J = s**3
        found = sigma(RUBBER, s * np.eye(3))
        assert np.allclose(found, 0.5e8 * (J - 1.0 / J) * np.eye(3), atol=ROUNDING)


@pytest.mark.parametrize("g", [-0.4, 0.1, 0.25, 0.5])
def test_the_six_simple_shears_of_myocardium(g: float) -> None:
    """Holzapfel & Ogden (2009), section 5(c): (ij) shifts along j the planes normal to i."""
    a, b, a_f, b_f, a_s, b_s, a_fs, b_fs = MYOCARDIUM.params[:8]
    matrix = a * np.exp(b * g**2) * g
    fibres = 2.0 * a_f * g**3 * np.exp(b_f * g**4)
    sheets = 2.0 * a_s * g**3 * np.exp(b_s * g**4)
    coupling = a_fs * g * np.exp(b_fs * g**2)
    f, s, n = 0, 1, 2
    expected = {
        (f, s): matrix + fibres + coupling,
        (f, n): matrix + fibres,
        (s, f): matrix + sheets + coupling,
        (s, n): matrix + sheets,
        (n, f): matrix,
        (n, s): matrix,
    }
    for (i, j), stress in expected.items():
        F = np.eye(3)
        F[j, i] = g
        # Rounding of the largest of the stresses.
        assert sigma(MYOCARDIUM, F)[j, i] == pytest.approx(stress, abs=1e-13 * abs(fibres) + 1e-9)


def test_fibres_carry_tension_only() -> None:
    """Shortened along both, the tissue is its matrix; stretched, it is not."""
    bare = attrs.evolve(MYOCARDIUM, fibre_stiffness=0.0, sheet_stiffness=0.0)
    short, long = (np.diag([s, s, s**-2]) for s in (0.95, 1.05))
    assert np.array_equal(sigma(MYOCARDIUM, short), sigma(bare, short))
    assert sigma(MYOCARDIUM, long)[0, 0] > 2.0 * sigma(bare, long)[0, 0]


def test_fibres_act_along_themselves_in_the_plane_too() -> None:
    """A strip at an angle in 2D is the 3D tissue, and turning the fibres turns the stress."""
    c, s = np.cos(0.4), np.sin(0.4)
    Q = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    turned = attrs.evolve(MYOCARDIUM, fibre=Q[:, 0].tolist(), sheet=Q[:, 1].tolist())
    F = np.diag([1.1, 0.95, 1.0])
    expected = Q @ sigma(MYOCARDIUM, F) @ Q.T
    found = sigma(turned, Q @ F @ Q.T)
    assert np.allclose(found, expected, atol=1e-12 * np.abs(expected).max())
    flat = (Q @ F @ Q.T)[:2, :2]
    P = np.array(turned.first_piola(flat, turned.params))
    whole = np.array(turned.first_piola(Q @ F @ Q.T, turned.params))
    assert np.allclose(P, whole[:2, :2], atol=1e-12 * np.abs(whole).max())


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: attrs.evolve(RUBBER, c01=-C10), "must be positive"),
        (lambda: attrs.evolve(RUBBER, bulk_modulus=0.0), "bulk_modulus must be positive"),
        (lambda: attrs.evolve(MYOCARDIUM, sheet=[1.0, 1.0, 0.0]), "at right angles"),
        (lambda: attrs.evolve(MYOCARDIUM, fibre="x"), "must be a direction"),
        (lambda: attrs.evolve(MYOCARDIUM, fibre_stiffness=-1.0), "must not be negative"),
        (lambda: attrs.evolve(MYOCARDIUM, coupling_exponent=0.0), "must be positive"),
    ],
)
def test_wrong_constants_are_refused_in_one_line(make: Callable[[], object], said: str) -> None:
    with pytest.raises(SceneError, match=said):
        make()


# --- What the kit holds anisotropic laws to ------------------------------------------------------


@attrs.frozen
class Pretender(registry.load("materials", "neo-hookean")):  # type: ignore[misc]
    """Wrong: it declares directions, and has none."""

    isotropic = False


@attrs.frozen
class Soft(registry.load("materials", "holzapfel-ogden")):  # type: ignore[misc]
    """Wrong: its Lame parameters are those of the matrix, which its fibres are stiffer than."""

    @property
    def lame_parameters(self) -> tuple[float, float]:
        a = self.matrix_stiffness
        return self.bulk_modulus - 2.0 / 3.0 * a, a


@attrs.frozen
class Off(registry.load("materials", "holzapfel-ogden")):  # type: ignore[misc]
    """Wrong: the stress is not the derivative of this energy, a tenth of a per cent off."""

    @staticmethod
    def energy(F: object, params: tuple[float, ...]) -> object:
        return 1.001 * HolzapfelOgden.energy(F, params)


@pytest.mark.parametrize(
    ("cls", "expected"),
    [
        (Pretender, {"small strain"}),
        (Soft, {"small strain", "wave speed"}),
        (Off, {"stress", "stress measures"}),
    ],
)
def test_the_kit_catches(cls: type[Material], expected: set[str]) -> None:
    name = "neo-hookean" if cls is Pretender else "holzapfel-ogden"
    values = attrs.asdict(example_part("materials", name))
    failed = {one.name for one in conformance("materials", cls(**values)) if not one.passed}
    assert failed == expected
