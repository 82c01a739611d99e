"""Types of the arrays that interfaces use.

Public arrays are particle-first: X (n, d), F (n, d, d). Pointwise functions get component axes
first, F (d, d, n), so that the same source works for arrays and for scalars.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
Mask: TypeAlias = NDArray[np.bool_]
Indices: TypeAlias = NDArray[np.intp]

# A number at one point, or an array of them at many points: a pointwise function takes both.
Scalar: TypeAlias = Any
# d of such scalars: a tuple, or an array with component axes first.
Vector: TypeAlias = Any
# A d x d matrix of such scalars: nested tuples, or an array with component axes first.
Tensor: TypeAlias = Any
