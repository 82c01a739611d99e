"""What the bare scenes are held against: finite elements against closed forms, and the reverse."""

from __future__ import annotations

from collections.abc import Callable
from math import cosh, pi, sinh, sqrt, tanh

import numpy as np
import pytest
from scipy.integrate import dblquad
from scipy.special import jv, spherical_jn

from solidsph.maths.arrays import Array
from solidsph.maths.formulas import Expression
from solidsph_builtin.materials.neo_hookean import NeoHookean
from solidsph_cases._sheet import EXTENSION, PEAK
from tests.bare import balls, motion, rings, torsion
from tests.bare.beams import Timoshenko, curved_bar_hoop
from tests.bare.blocks import COOK, COOK_MODULUS, COOK_SHEAR, COOK_SIZE, squeezed
from tests.bare.finite_elements import Map, Mesh, Solid, Solution, graded
from tests.bare.holes import HOLE, SHEETS, kirsch, kirsch_opening
from tests.bare.references import cook, sector, sheet
from tests.bare.uniform import pulled_gradient

# Loads are 1e-5 of the modulus: the law of finite strain then errs by some 1e-5, times a few where
# stresses concentrate.
SMALL = 2e-4


def formula(text: str) -> Callable[[Array], Array]:
    expression = Expression.parse(text, ("X", "Y"))
    return lambda x: np.asarray(expression({"X": x[:, 0], "Y": x[:, 1]})) + 0.0 * x[:, 0]


def tractions(x: str, y: str) -> Callable[[Array], Array]:
    both = formula(x), formula(y)
    return lambda points: np.stack([one(points) for one in both], axis=1)


def box(length: float, height: float, cells: tuple[int, int]) -> Mesh:
    def place(s: Array, t: Array) -> tuple[Array, Array]:
        return length * s, height * t

    return Mesh.of([(place, graded(cells[0]), graded(cells[1]))])


def near(mesh: Mesh, x: float, y: float) -> int:
    return int(np.argmin(np.hypot(*(mesh.nodes - [x, y]).T)))


def ring(cells: int, inner: float = rings.INNER, outer: float = rings.OUTER) -> Mesh:
    place: Map = sector(0.0, 0.5 * pi, inner, lambda ray: outer)
    return Mesh.of([(place, graded(cells), graded(cells))])


def solved(mesh: Mesh, nu: float, held: Array, loads: Array, E: float = 1.0) -> Solution:
    return Solid.of(mesh, E, nu).equilibrium(held, loads)


# --- Finite elements against closed forms --------------------------------------------------------

# Stresses at nodes converge with the square of the size of cells: a fifth to half a per cent here.


@pytest.mark.parametrize("nu", [0.3, 0.4999])
def test_timoshenkos_cantilever(nu: float) -> None:
    theory = Timoshenko(nu)
    mesh = box(theory.L, 1.0, (12, 4))
    x, y = mesh.nodes[:, 0], mesh.nodes[:, 1] - 0.5
    right = theory.L - x < 1e-9
    loads = mesh.side_loads(right, tractions("0", f"{-6.0 * theory.P!r}*(Y - Y*Y)"))
    held = np.repeat(x[:, None] < 1e-9, 2, axis=1)
    root = np.stack(
        [
            theory.c * (2.0 + theory.ratio) * y * (y * y - 0.25),
            -3.0 * theory.c * theory.ratio * theory.L * y * y,
        ],
        axis=1,
    )
    solution = Solid.of(mesh, theory.E, nu).equilibrium(held, loads, root)
    # The beam bends by a tenth of a per cent of its length.
    assert solution.u[near(mesh, theory.L, 0.5), 1] == pytest.approx(theory.tip, rel=2e-3)


def test_a_pressed_ring() -> None:
    p, mesh = 1e-5, ring(8)
    exact = rings.pressed_ring(p)
    inner = np.hypot(*mesh.nodes.T) < rings.INNER + 1e-9
    loads = mesh.side_loads(inner, lambda x: p * x / np.hypot(*x.T)[:, None])
    solution = solved(mesh, rings.NU, mesh.nodes < 1e-9, loads)
    for r in (rings.INNER, rings.OUTER):
        node = near(mesh, r, 0.0)
        assert solution.u[node, 0] == pytest.approx(exact.growth(r), rel=SMALL)
        assert solution.cauchy(node)[1, 1] == pytest.approx(exact.hoop(r), rel=3e-3)


@pytest.mark.parametrize("nu", [0.3, 0.4999])
def test_an_inflated_ring(nu: float) -> None:
    """A pressure that follows the hole is a dead traction, larger as the hole is."""
    E, p, mesh = 1e6, 2e5, ring(8)
    inner, outer = rings.inflated(E, nu, p)
    assert inner > 0.1  # far from small strains
    dead = p * (1.0 + inner / rings.INNER)
    chosen = np.hypot(*mesh.nodes.T) < rings.INNER + 1e-9
    loads = mesh.side_loads(chosen, lambda x: dead * x / np.hypot(*x.T)[:, None])
    solution = solved(mesh, nu, mesh.nodes < 1e-9, loads, E)
    # Dead loads make the ring softer near its limit, and errors as much larger.
    assert solution.u[near(mesh, rings.INNER, 0.0), 0] == pytest.approx(inner, rel=2e-3)
    assert solution.u[near(mesh, 0.0, rings.OUTER), 1] == pytest.approx(outer, rel=2e-3)


def test_a_curved_bar() -> None:
    a, b, mesh = rings.INNER, rings.OUTER, ring(16)
    hoop = curved_bar_hoop(1e-5, a, b)
    loads = mesh.side_loads(mesh.nodes[:, 0] < 1e-9, tractions(f"-({hoop})", "0"))
    held = np.stack([np.arange(len(mesh.nodes)) == near(mesh, a, 0.0), mesh.nodes[:, 1] < 1e-9], 1)
    solution = solved(mesh, 0.3, held, loads)
    for r in (a, b):
        node = near(mesh, r * sqrt(0.5), r * sqrt(0.5))
        found = np.array([-1.0, 1.0]) @ solution.cauchy(node) @ np.array([-1.0, 1.0]) / 2.0
        assert found == pytest.approx(float(formula(hoop)(np.array([[0.0, r]]))[0]), rel=5e-3)


def test_kirschs_hole() -> None:
    S, nu = 1e-5, 0.3
    s, t = graded(16, 1.5), graded(16)
    halves = [
        sector(first, first + 0.25 * pi, HOLE, lambda ray: 1.0 / np.abs(ray).max(axis=0))
        for first in (0.0, 0.25 * pi)
    ]
    mesh = Mesh.of([(half, s, t) for half in halves])
    xx, yy, xy = kirsch(S)
    loads = mesh.side_loads(mesh.nodes[:, 0] > 1.0 - 1e-9, tractions(xx, xy))
    loads += mesh.side_loads(mesh.nodes[:, 1] > 1.0 - 1e-9, tractions(xy, yy))
    solution = solved(mesh, nu, mesh.nodes < 1e-9, loads)
    aside, above = near(mesh, HOLE, 0.0), near(mesh, 0.0, HOLE)
    opening, closing = kirsch_opening(nu, 1.0, S)
    assert solution.u[aside, 0] == pytest.approx(opening, rel=1e-3)
    assert solution.u[above, 1] == pytest.approx(closing, rel=1e-3)
    assert solution.cauchy(above)[0, 0] == pytest.approx(3.0 * S, rel=3e-3)
    assert solution.cauchy(aside)[1, 1] == pytest.approx(-S, rel=6e-3)


@pytest.mark.parametrize("nu", [0.3, 0.49, 0.4999])
def test_a_squeezed_block(nu: float) -> None:
    p, mesh = 1e-5, box(1.0, 1.0, (16, 16))
    top = mesh.nodes[:, 1] > 1.0 - 1e-9
    loads = mesh.side_loads(top, tractions("0", f"{-0.5 * p!r}*(1 + cos(pi*X))"))
    held = mesh.nodes < 1e-9
    held[:, 0] |= mesh.nodes[:, 0] > 1.0 - 1e-9
    solution = solved(mesh, nu, held, loads)
    dip, half_way = squeezed(nu, 1.0, p)
    u = solution.u[:, 1]
    assert u[near(mesh, 0.0, 1.0)] - u[near(mesh, 1.0, 1.0)] == pytest.approx(dip, rel=SMALL)
    left, right = (-0.5 * np.trace(solution.cauchy(near(mesh, x, 0.5))) for x in (0.0, 1.0))
    assert left - right == pytest.approx(half_way, rel=3e-3)


# --- Finite elements against other programs, and the figures of the scenes -----------------------


@pytest.mark.validation
def test_the_sheets() -> None:
    """The figures of the case are of spectral elements as well, written independently."""
    assert SHEETS[0.49] == pytest.approx((EXTENSION, PEAK), rel=1e-9)
    for nu, figures in SHEETS.items():
        # With 24 cells the peak is within 0.02 % of these, with 16 within 0.05 %.
        assert sheet(16, nu) == pytest.approx(figures, rel=1e-3)


@pytest.mark.validation
@pytest.mark.parametrize("nu", COOK)
def test_cooks_membrane(nu: float) -> None:
    found = cook(16, nu, COOK_MODULUS, COOK_SHEAR, COOK_SIZE)
    assert found == pytest.approx(COOK[nu], rel=5e-4)  # the singular corner


# --- Closed forms against their own equations ----------------------------------------------------


def slope(f: Callable[[float], float], r: float) -> float:
    return (f(r + 1e-4) - f(r - 1e-4)) / 2e-4


@pytest.mark.parametrize(
    ("exact", "pull"),
    [(rings.pressed_ring(1.0), 0.0), (rings.spinning_ring(1.0), 1.0)],
    ids=["pressed", "spinning"],
)
def test_rings_obey_hooke_and_balance(exact: rings.Ring, pull: float) -> None:
    lam, mu = balls.LAMBDA, balls.MU
    assert (rings.E, rings.NU) == (balls.E, balls.NU)
    assert exact.radial(rings.OUTER) == pytest.approx(0.0, abs=1e-12)
    for r in (1.1, 1.4, 1.8):
        e_r, e_t = slope(exact.growth, r), exact.growth(r) / r
        trace = lam * (e_r + e_t)
        assert exact.radial(r) == pytest.approx(trace + 2.0 * mu * e_r, rel=1e-6)
        assert exact.hoop(r) == pytest.approx(trace + 2.0 * mu * e_t, rel=1e-6)
        balance = slope(exact.radial, r) + (exact.radial(r) - exact.hoop(r)) / r + pull * r
        assert balance == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(
    ("exact", "pull"),
    [(balls.hollow_ball(1.0, 1.0, 2.0), 0.0), (balls.heavy_ball(1.0), -1.0)],
    ids=["hollow", "heavy"],
)
def test_balls_obey_hooke_and_balance(exact: balls.Ball, pull: float) -> None:
    lam, mu = balls.LAMBDA, balls.MU
    surface = 1.0 if pull else 2.0
    assert exact.radial(surface) == pytest.approx(0.0, abs=1e-12)
    for r in (0.3, 0.6, 0.9):
        e_r, e_t = slope(exact.growth, r), exact.growth(r) / r
        trace = lam * (e_r + 2.0 * e_t)
        assert exact.radial(r) == pytest.approx(trace + 2.0 * mu * e_r, rel=1e-5)
        assert exact.hoop(r) == pytest.approx(trace + 2.0 * mu * e_t, rel=1e-5)
        balance = slope(exact.radial, r) + 2.0 * (exact.radial(r) - exact.hoop(r)) / r + pull * r
        assert balance == pytest.approx(0.0, abs=1e-5 * max(1.0, abs(slope(exact.radial, r))))


def test_breathing_modes_leave_the_surface_free() -> None:
    lam, M = balls.LAMBDA, balls.M
    k = balls.breathing_root()
    strain = k * spherical_jn(1, k, derivative=True)
    assert M * strain + 2.0 * lam * spherical_jn(1, k) == pytest.approx(0.0, abs=1e-9)
    # The first: no lower one changes sign. A ball of nu = 0.25 has 0.8160 pi (Lamb 1882).
    assert 2.0 < k < 0.9 * pi
    k = motion.breathing_root(balls.NU)
    strain = 0.5 * k * (jv(0, k) - jv(2, k))
    assert M * strain + lam * jv(1, k) == pytest.approx(0.0, abs=1e-9)
    assert 1.8412 < k < 2.4048  # of a disc without shear stiffness, and of one held at its rim


def test_a_uniform_stretch_bears_its_load() -> None:
    E, nu, pull = 1e6, 0.3, 1e5
    params = NeoHookean(E, nu, 1.0).params
    for d in (1, 2, 3):
        F = np.eye(d) + pulled_gradient(E, nu, pull, d)
        P = np.array(NeoHookean.first_piola(tuple(map(tuple, F)), params))
        wanted = np.zeros((d, d))
        wanted[0, 0] = pull
        assert pytest.approx(wanted, abs=1e-6 * pull) == P


# --- Torsion -------------------------------------------------------------------------------------


def test_the_torsion_constant_of_a_square() -> None:
    odd = np.arange(1, 40, 2)
    series = sum(tanh(0.5 * n * pi) / n**5 for n in odd)
    constant = (1.0 - 192.0 / pi**5 * series) / 3.0
    assert pytest.approx(constant, abs=1e-6) == torsion.SQUARE


def test_the_warping_constant_of_a_square() -> None:
    def warping(y: float, x: float) -> float:
        total = x * y
        for n in range(12):
            k = (2 * n + 1) * pi
            total -= (
                8.0 / pi**3 * (-1) ** n / (2 * n + 1) ** 3
                * np.sin(k * x) * sinh(k * y) / cosh(0.5 * k)
            )  # fmt: skip
        return float(total)

    square, _ = dblquad(lambda y, x: warping(y, x) ** 2, -0.5, 0.5, -0.5, 0.5, epsrel=1e-4)
    assert pytest.approx(square, rel=0.01) == torsion.WARPING
    # It moves the frequency by 0.1 % at most: a per cent of it is nothing.
    plain = sqrt(torsion.SQUARE * 6.0) / 8.0
    assert torsion.square_bar_frequency(2.0) == pytest.approx(plain, rel=1e-3)
