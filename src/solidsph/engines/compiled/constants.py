"""Constants of the compiled engine that its plan needs without the compiler."""

STRIDE = {1: 1, 2: 2, 3: 4}
"""Numbers stored per vector in flat fields, by dimension."""

WORTH_A_THREAD = 200_000
"""Operations of about a nanosecond from which on a second thread pays: to wake it takes some tens
of microseconds in every pass."""

PER_PARTICLE = 10
"""Operations per particle in a step of the compiled loop, besides those for pairs."""
