"""Beams and a disc that swing, waves in a bar."""

from __future__ import annotations

from collections.abc import Mapping
from math import cos, cosh, factorial, pi, sin, sinh, sqrt

import numpy as np
from scipy.optimize import brentq
from scipy.special import j0, j1

from solidsph.maths.arrays import Array
from solidsph.scene.scene_builder import SceneBuilder
from solidsph_cases._bar_waves import BarWaves, smooth_pulse
from solidsph_cases._finite_waves import FiniteWave, law_of
from tests.bare.beams import FINITE_ELEMENTS, LENGTH, ON_ARC, STRAIGHT, TUREK, turek_hron
from tests.bare.reading import at, period_of
from tests.bare.rings import first_quadrant, with_symmetry
from tests.bare.scene import Bare, Fields, body, elastic, histories

# --- Turek and Hron's beam -----------------------------------------------------------------------


def lowest(times: Array, values: Array) -> float:
    """The minimum of a history, by the parabola through three outputs."""
    k = int(np.clip(np.argmin(values), 1, len(values) - 2))
    a, b, c = np.polyfit(times[k - 1 : k + 2] - times[k], values[k - 1 : k + 2], 2)
    return float(c - 0.25 * b**2 / a)


def _csm3(arc: bool, across: int) -> Mapping[str, float]:
    """Released from rest: the tip is lowest at 0.455 s, where the third mode is seen as well."""
    tip = np.array([[LENGTH, 0.0]])
    times, values = histories(
        turek_hron(ON_ARC if arc else STRAIGHT, "rim" if arc else "left", across),
        *(0.475, 190, lambda fields: at(fields, fields.u, tip)[0, 1]),
    )
    # Turek and Hron's history, and ours for the straight edge (tests/cases/test_beam.py).
    return {"first minimum": lowest(times, values) / (-0.12973 if arc else -0.12866) - 1.0}


# --- A plate -------------------------------------------------------------------------------------

# The period of a plate of 0.2 x 0.02 m in its first bending mode, from quadratic finite elements.
PLATE_PERIOD = 0.2552  # [s]
_KL = 1.8751040687119611  # first root of cos kL cosh kL = -1


def _plate(across: int) -> Mapping[str, float]:
    L, H, E, nu, density = 0.2, 0.02, 2e6, 0.3975, 1000.0
    k = _KL / L
    # Landau & Lifshitz, Theory of Elasticity, section 25: zero with its slope at 0.
    m, n = sin(_KL) + sinh(_KL), cos(_KL) + cosh(_KL)
    end = m * (cos(_KL) - cosh(_KL)) - n * (sin(_KL) - sinh(_KL))
    mode = (
        f"({m / end!r}*(cos({k!r}*X) - cosh({k!r}*X)) - {n / end!r}*(sin({k!r}*X) - sinh({k!r}*X)))"
    )
    tip = np.array([[L, 0.0]])
    times, values = histories(
        body(
            {"type": "box", "lengths": [L, H], "origin": [0.0, -0.5 * H]},
            H / (across - 1),
            elastic("neo-hookean", E, nu, density),
        )
        .boundary("clamp", where="left")
        .initial(velocity={"x": 0.0, "y": f"0.05*{mode}"}),
        *(0.55 * PLATE_PERIOD, 44, lambda fields: at(fields, fields.u, tip)[0, 1]),
    )
    return {"period": period_of(times, values, PLATE_PERIOD) / PLATE_PERIOD - 1.0}


# --- A disc --------------------------------------------------------------------------------------


def breathing_root(nu: float) -> float:
    """First root of x J0(x) / J1(x) = 2 mu / (lambda + 2 mu): x = omega R / c_p in plane strain."""
    ratio = (1.0 - 2.0 * nu) / (1.0 - nu)
    return float(brentq(lambda x: x * j0(x) - ratio * j1(x), 1.0, 2.4))


def _breathing_disc(across: int) -> Mapping[str, float]:
    """Its first radial mode, u = J1(k r), as a series of J1(y) / y in y^2."""
    E, nu = 1.0, 0.3
    k, c = breathing_root(nu), sqrt(E * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu)))
    terms = [(-0.25 * k * k) ** n / (2.0 * factorial(n) * factorial(n + 1)) for n in range(8)]
    series = " + ".join(f"{term!r}*(X*X + Y*Y)**{n}" for n, term in enumerate(terms))
    velocity = {axis: f"1e-4*{axis.upper()}*({series})" for axis in "xy"}
    shape = first_quadrant({"type": "disc", "radius": 1.0}, 1.5)
    period = 2.0 * pi / (k * c)
    times, values = histories(
        with_symmetry(body(shape, 1.0 / (across - 1), elastic("linear-elastic", E, nu))).initial(
            velocity=velocity
        ),
        *(0.6 * period, 40, lambda fields: float(np.sum(fields.u * fields.places))),
    )
    return {"frequency": period / period_of(times, values, period) - 1.0}


# --- Bars ----------------------------------------------------------------------------------------

_L, _E, _NU, _DENSITY = 0.15, 200e9, 0.3, 8000.0  # the paper's bar
_LAW = law_of(_E, _NU, _DENSITY)
_C = _LAW.small_speed


def _bar(particles: int) -> SceneBuilder:
    return body(
        {"type": "interval", "length": _L},
        _L / (particles - 1),
        elastic("neo-hookean", _E, _NU, _DENSITY),
    )


def _wave(particles: int) -> Mapping[str, float]:
    """A smooth pulse of 100 kPa goes to the wall and back twice."""
    pulse, stress = smooth_pulse(10e-6), -100e3
    exact = BarWaves(_L, _C, _DENSITY, stress, pulse)
    places = np.array([[0.05], [0.1], [_L]])
    times, values = histories(
        _bar(particles)
        .boundary("traction", where="left", traction={"x": f"{-stress!r}*{pulse.formula}"})
        .boundary("clamp", where="right"),
        *(3.2 * _L / _C, 600, lambda fields: at(fields, fields.sigma, places)[:, 0, 0]),
    )
    theory = exact.stress(places[:, 0], times[:, None])
    first = times < 1.2 * _L / _C
    found, wanted = values[first, 1] / stress, theory[first, 1] / stress
    return {
        "peak": float(found.max() / wanted.max() - 1.0),
        "peak at the wall": float(values[:, 2].min() / theory[:, 2].min() - 1.0),
        "arrival": _rise(times[first], found) / _rise(times[first], wanted) - 1.0,
        "history": float(np.sqrt(np.mean((values - theory) ** 2) / np.mean(theory**2))),
    }


def _rise(places: Array, values: Array) -> float:
    """Where `values` first pass a half, by a straight line."""
    k = int(np.argmax(values >= 0.5))
    part = (0.5 - values[k - 1]) / (values[k] - values[k - 1])
    return float(places[k - 1] + part * (places[k] - places[k - 1]))


def _finite(push: float, particles: int) -> Mapping[str, float]:
    """An end that is pushed, which sends a shock, or pulled, which sends a fan."""
    v = push * _C
    wave: FiniteWave = _LAW.pushed(v) if v > 0.0 else _LAW.pulled(-v)
    duration = 0.9 * _L / wave.head
    X = np.linspace(0.0, _L, 401)

    def profile(fields: Fields) -> Array:
        order = np.argsort(fields.places[:, 0])
        return np.interp(X, fields.places[order, 0], fields.sigma[order, 0, 0])

    times, values = histories(
        _bar(particles)
        .effect("artificial-viscosity", linear=0.5, quadratic=1.0)
        .boundary("prescribed-motion", where="left", displacement={"x": f"{wave.velocity!r}*t"}),
        *(duration, 100, profile),
    )
    exact, last = wave.stresses(X / times[-1]), values[-1]
    flat = np.abs(X / (wave.tail * times[-1]) - 0.5) < 0.25
    later = times >= 0.4 * times[-1]
    fronts = [X[-1] - _rise(X[-1] - X[::-1], row[::-1] / wave.stress) for row in values[later]]
    speed = np.polyfit(times[later], fronts, 1)[0]
    return {
        "plateau": float(last[flat].mean() / wave.stress - 1.0),
        "speed": float(speed / wave.half_speed - 1.0),
        "profile": float(np.sqrt(np.mean((last - exact) ** 2) / np.mean(exact**2))),
    }


_WAVES = "Rankine-Hugoniot; simple waves"

MOTION = (
    Bare("csm3", TUREK, lambda n: _csm3(True, n), {"first minimum": {5: 0.01}}, (3, 5, 7)),
    Bare(
        "csm3-straight",
        FINITE_ELEMENTS,
        lambda n: _csm3(False, n),
        {"first minimum": {5: 0.01}},
        (3, 5, 7),
    ),
    Bare(
        "cantilever-plate",
        "quadratic finite elements of the plate as a solid",
        _plate,
        {"period": {5: 0.01, 9: 0.003}},
        (5, 7, 9),
        floor=5e-4,
    ),
    Bare(
        "breathing-disc",
        "Bessel functions of the radial mode",
        _breathing_disc,
        {"frequency": {8: 0.01}},
        (5, 8, 15),
    ),
    Bare(
        "wave-bar",
        "d'Alembert",
        _wave,
        {
            "peak": {61: 0.02},
            "peak at the wall": {61: 0.03},
            "arrival": {61: 0.01},
            "history": {241: 0.02},
        },
        (61, 121, 241),
        floor=1e-3,
    ),
    *(
        Bare(
            f"nonlinear-bar-{'push' if push > 0.0 else 'pull'}",
            _WAVES,
            lambda n, push=push: _finite(push, n),
            {"plateau": {201: 0.02}, "speed": {201: 0.01}, "profile": {401: 0.15}},
            (101, 201, 401),
            unordered=("plateau", "speed"),
        )
        for push in (0.3, -0.3)
    ),
)
