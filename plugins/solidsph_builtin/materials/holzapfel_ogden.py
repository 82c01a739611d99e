"""Heart muscle: a matrix, fibres, sheets and their coupling."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, final

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.interfaces.material import Material
from solidsph.maths.arrays import Scalar, Tensor, Vector
from solidsph.maths.dilatation import POWER, Dilatation
from solidsph.maths.tensors import (
    add,
    contraction,
    determinant,
    dot,
    identity,
    inverse_transpose,
    scale,
)
from solidsph.registry.parameters import check_positive, number
from solidsph_builtin.materials._isochoric import (
    bulk_energy,
    bulk_stress,
    bulk_tangent,
    stress_of,
    tangent_of,
)
from solidsph_builtin.materials._wide import narrowed, widened, widened_change

_RIGHT_ANGLE = 1e-9


def _direction(given: Any, field: attrs.Attribute[Any]) -> tuple[float, ...]:
    """A unit vector of three components."""
    try:
        vector = np.array([*given], dtype=np.float64)
    except (TypeError, ValueError):
        vector = np.zeros(0)
    length = float(np.linalg.norm(vector)) if vector.shape == (3,) else 0.0
    if not 0.0 < length < np.inf:
        raise SceneError(
            f"holzapfel-ogden: {field.name} must be a direction such as [1, 0, 0], got {given!r}; "
            "all three components are needed in two dimensions too"
        )
    return tuple(float(x) / length for x in vector)


def direction(default: tuple[float, float, float]) -> Any:
    """A field that holds a unit vector."""
    return attrs.field(default=default, converter=attrs.Converter(_direction, takes_field=True))


@final
@attrs.frozen
class HolzapfelOgden(Material):
    """The law of passive myocardium, Holzapfel & Ogden (2009), eq. 5.38, made compressible.

        psi = a/(2 b) (exp(b (J^(-2/3) I1 - 3)) - 1)
              + sum over i = f, s of a_i/(2 b_i) (exp(b_i <I4i - 1>^2) - 1)
              + a_fs/(2 b_fs) (exp(b_fs I8fs^2) - 1) + kappa/2 ((J^2 - 1)/2 - ln J)

    with I4i = i . C i for the fibres f and the sheets s at right angles to them, I8fs = f . C s and
    <x> = max(x, 0): fibres carry tension only. These two invariants are not freed of volume, so
    that a fibre responds to its full stretch (Sansour, 2008). The directions are uniform.

    `lame_parameters` are those of an isotropic solid that is as stiff as the fibres in every
    direction: the stable step and the scale of hourglass control follow from them.
    """

    matrix_stiffness: float = number()  # a [Pa], the shear modulus
    matrix_exponent: float = number()  # b [-]
    fibre_stiffness: float = number()  # a_f [Pa]
    fibre_exponent: float = number()  # b_f [-]
    sheet_stiffness: float = number()  # a_s [Pa]
    sheet_exponent: float = number()  # b_s [-]
    coupling_stiffness: float = number()  # a_fs [Pa]
    coupling_exponent: float = number()  # b_fs [-]
    bulk_modulus: float = number()  # kappa [Pa]
    density: float = number()  # rho_0 [kg/m^3]
    fibre: tuple[float, ...] = direction((1.0, 0.0, 0.0))
    sheet: tuple[float, ...] = direction((0.0, 1.0, 0.0))

    # Fibres of the stiffness of rubber: real ones stiffen so fast that at the 40 % of strain of the
    # conformance kit their stress would be a million times its scale.
    dilatation: ClassVar[Dilatation | None] = POWER
    example: ClassVar[Mapping[str, Any]] = {
        "matrix_stiffness": 3e5,
        "matrix_exponent": 0.5,
        "fibre_stiffness": 2e5,
        "fibre_exponent": 0.6,
        "sheet_stiffness": 1e5,
        "sheet_exponent": 0.4,
        "coupling_stiffness": 0.5e5,
        "coupling_exponent": 0.3,
        "bulk_modulus": 1e6 / 1.2,
        "density": 1000.0,
        "fibre": [0.8, 0.6, 0.0],
        "sheet": [-0.36, 0.48, 0.8],
    }

    isotropic: ClassVar[bool] = False
    smooth: ClassVar[bool] = False

    def __attrs_post_init__(self) -> None:
        law = "material 'holzapfel-ogden'"
        for part in ("matrix", "fibre", "sheet", "coupling"):
            check_positive(law, f"{part}_exponent", getattr(self, f"{part}_exponent"), "1")
        for part in ("fibre", "sheet", "coupling"):
            value = getattr(self, f"{part}_stiffness")
            if not 0.0 <= value < 1e100:
                raise SceneError(f"{law}: {part}_stiffness must not be negative, got {value} Pa")
        check_positive(law, "matrix_stiffness", self.matrix_stiffness, "Pa")
        check_positive(law, "bulk_modulus", self.bulk_modulus, "Pa")
        check_positive(law, "density", self.density, "kg/m^3")
        if abs(np.dot(self.fibre, self.sheet)) > _RIGHT_ANGLE:
            raise SceneError(
                f"{law}: sheet {list(self.sheet)} must be at right angles to fibre "
                f"{list(self.fibre)}; their product is {np.dot(self.fibre, self.sheet):.3g}"
            )

    @property
    def lame_parameters(self) -> tuple[float, float]:
        a = self.matrix_stiffness
        along = max(2.0 * self.fibre_stiffness, 2.0 * self.sheet_stiffness)
        return (
            self.bulk_modulus - 2.0 / 3.0 * a,
            a + max(along, self.coupling_stiffness),
        )

    @property
    def params(self) -> tuple[float, ...]:
        """a and b of matrix, fibres, sheets and coupling, kappa, then both directions."""
        return (
            self.matrix_stiffness,
            self.matrix_exponent,
            self.fibre_stiffness,
            self.fibre_exponent,
            self.sheet_stiffness,
            self.sheet_exponent,
            self.coupling_stiffness,
            self.coupling_exponent,
            self.bulk_modulus,
            *self.fibre,
            *self.sheet,
        )

    @staticmethod
    def energy(F: Tensor, params: tuple[float, ...]) -> Scalar:
        wide, J = widened(F), determinant(F)
        f, s = _turned(wide, params[9:12]), _turned(wide, params[12:15])
        first = J ** (-2.0 / 3.0) * contraction(wide, wide) - 3.0
        return (
            0.5 * params[0] / params[1] * np.expm1(params[1] * first)
            + _stored(_tension(f), params[2], params[3])
            + _stored(_tension(s), params[4], params[5])
            + _stored(dot(f, s), params[6], params[7])
            + bulk_energy(J, params[8])
        )

    @staticmethod
    def first_piola(F: Tensor, params: tuple[float, ...]) -> Tensor:
        wide, J = widened(F), determinant(F)
        f0, s0 = params[9:12], params[12:15]
        f, s = _turned(wide, f0), _turned(wide, s0)
        first = J ** (-2.0 / 3.0) * contraction(wide, wide) - 3.0
        rise = params[0] * np.exp(params[1] * first)
        matrix = scale(rise, stress_of(wide, identity(wide), 0.0, 1.0))
        fibres = scale(2.0 * _force(_tension(f), params[2], params[3]), _outer(f, f0))
        sheets = scale(2.0 * _force(_tension(s), params[4], params[5]), _outer(s, s0))
        both = add(_outer(s, f0), _outer(f, s0))
        coupling = scale(_force(dot(f, s), params[6], params[7]), both)
        bulk = bulk_stress(J, inverse_transpose(wide), params[8])
        return narrowed(add(add(matrix, bulk), add(add(fibres, sheets), coupling)), F)

    @staticmethod
    def tangent(F: Tensor, dF: Tensor, params: tuple[float, ...]) -> Tensor:
        wide, along, J = widened(F), widened_change(dF), determinant(F)
        f0, s0 = params[9:12], params[12:15]
        f, s = _turned(wide, f0), _turned(wide, s0)
        df, ds = _turned(along, f0), _turned(along, s0)
        first = J ** (-2.0 / 3.0) * contraction(wide, wide) - 3.0
        rise = params[0] * np.exp(params[1] * first)
        deviator = stress_of(wide, identity(wide), 0.0, 1.0)
        matrix = add(
            scale(rise, tangent_of(wide, along, 0.0, 1.0)),
            scale(2.0 * rise * params[1] * contraction(deviator, along), deviator),
        )
        fibres = _change_of_fibres(f, df, f0, params[2], params[3])
        sheets = _change_of_fibres(s, ds, s0, params[4], params[5])
        together, both = dot(f, s), add(_outer(s, f0), _outer(f, s0))
        change = _stiffness(together, params[6], params[7]) * (dot(df, s) + dot(f, ds))
        dboth = add(_outer(ds, f0), _outer(df, s0))
        coupling = add(scale(change, both), scale(_force(together, params[6], params[7]), dboth))
        bulk = bulk_tangent(J, inverse_transpose(wide), along, params[8])
        return narrowed(add(add(matrix, bulk), add(add(fibres, sheets), coupling)), F)


def _turned(F: Tensor, v: Vector) -> Vector:
    """F v."""
    return (dot(F[0], v), dot(F[1], v), dot(F[2], v))


def _outer(v: Vector, w: Vector) -> Tensor:
    """v (x) w."""
    return (
        (v[0] * w[0], v[0] * w[1], v[0] * w[2]),
        (v[1] * w[0], v[1] * w[1], v[1] * w[2]),
        (v[2] * w[0], v[2] * w[1], v[2] * w[2]),
    )


def _tension(f: Vector) -> Scalar:
    """<I4 - 1> of a fibre that is deformed to f."""
    return np.maximum(dot(f, f) - 1.0, 0.0)


def _stored(x: Scalar, a: float, b: float) -> Scalar:
    """a/(2 b) (exp(b x^2) - 1)."""
    return 0.5 * a / b * np.expm1(b * x**2)


def _force(x: Scalar, a: float, b: float) -> Scalar:
    """Derivative of the stored energy by x."""
    return a * x * np.exp(b * x**2)


def _stiffness(x: Scalar, a: float, b: float) -> Scalar:
    """Second derivative of the stored energy by x."""
    return a * (1.0 + 2.0 * b * x**2) * np.exp(b * x**2)


def _change_of_fibres(f: Vector, df: Vector, f0: Vector, a: float, b: float) -> Tensor:
    """Change of the stress of fibres along f0, deformed to f, with a change df."""
    x = _tension(f)
    taut = 1.0 * (x > 0.0)
    change = taut * _stiffness(x, a, b) * 2.0 * dot(f, df)
    return add(scale(2.0 * change, _outer(f, f0)), scale(2.0 * _force(x, a, b), _outer(df, f0)))
