"""Measurements of the pulses in the wave bar."""

from __future__ import annotations

from collections.abc import Sequence

import attrs

from solidsph.studies.case import Measurement
from solidsph_cases._bar import LENGTH
from solidsph_cases._bar_histories import SOURCE, Histories
from solidsph_cases._compare import alone, compared, finished

STATIONS = (0.0, 0.05, 0.10, 0.15)  # of the histories [m]
TRAVELLING = 0.05  # [m], a station that sees each passage of the pulse by itself

# Largest relative errors that pass.
_ARRIVAL, _PEAK, _WALL, _PLATEAU = 0.01, 0.02, 0.03, 0.02


def smooth_pulse(histories: Histories, what: str) -> list[Measurement]:
    """Peaks and arrivals of the smooth pulse."""
    return [
        histories.worst(f"{what}: peak", "Pa", _PEAK, Histories.peak, STATIONS[:3]),
        histories.worst(f"{what}: peak at the wall", "Pa", _WALL, Histories.peak, [LENGTH]),
        _back(histories, what, "free end with the other sign"),
        attrs.evolve(
            _arrival(histories, f"{what}: arrival, at half the peak"),
            paper="c = sqrt(E/rho) (eq. 20): 30 us to the wall",
        ),
    ]


def square_pulse(histories: Histories, what: str, *, viscous: bool) -> list[Measurement]:
    """Plateaus, arrivals and the overshoot of the square pulse."""
    plateau, wall, arrival = _plateaus(histories, what)
    if not viscous:
        # Without viscosity short waves run apart from the front, so that its half wanders by
        # the power 2/3 of the spacing: given, and judged where the front has a width.
        arrival = _unjudged(arrival, histories, "not judged: the front disperses")
    noise = "" if viscous else "noise, unless some numerical damping is considered"
    return [
        plateau,
        attrs.evolve(wall, paper="total reflection of any wave at the fixed end"),
        arrival,
        attrs.evolve(_overshoot(histories, what), paper=noise),
    ]


def returned_pulse(histories: Histories, what: str) -> list[Measurement]:
    """After a pulse of strain the left end is held: it returns the wave with its sign."""
    peak = histories.worst(f"{what}: peak", "Pa", _PEAK, Histories.peak, STATIONS[:3])
    return [
        attrs.evolve(peak, paper="a strain pulse equivalent to T11 = -100 kPa"),
        _back(histories, what, "held end with its sign"),
    ]


def paper_noise(histories: Histories, what: str) -> list[Measurement]:
    """The square pulse by the paper's own sums; nothing of it is judged."""
    plateau, wall, arrival = _plateaus(histories, what)
    noise = "noise, common to all approximations (Fig. 11)"
    return [
        *(_unjudged(one, histories, "not judged") for one in (arrival, plateau, wall)),
        attrs.evolve(_overshoot(histories, what), paper=noise),
    ]


def _plateaus(histories: Histories, what: str) -> Sequence[Measurement]:
    """The plateau, that at the wall, and the arrival."""
    read = Histories.plateau
    return (
        histories.worst(f"{what}: plateau", "Pa", _PLATEAU, read, STATIONS[:3]),
        histories.worst(f"{what}: plateau at the wall", "Pa", _WALL, read, [LENGTH]),
        _arrival(histories, f"{what}: arrival, at half the plateau"),
    )


def _arrival(histories: Histories, quantity: str) -> Measurement:
    return histories.worst(quantity, "s", _ARRIVAL, Histories.arrival, STATIONS[1:])


def _back(histories: Histories, what: str, end: str) -> Measurement:
    value, reference = histories.peak_of_passage(TRAVELLING, 2)
    quantity = f"{what}: peak at {TRAVELLING:g} m, back from the {end}"
    return compared(histories.record, quantity, value, "Pa", reference, SOURCE, _PEAK)


def _overshoot(histories: Histories, what: str) -> Measurement:
    largest = max(histories.overshoot(station) for station in STATIONS)
    return alone(histories.record, f"{what}: largest overshoot of the plateau, over it", largest)


def _unjudged(measured: Measurement, histories: Histories, verdict: str) -> Measurement:
    return attrs.evolve(measured, verdict=verdict, passed=finished(histories.record))
