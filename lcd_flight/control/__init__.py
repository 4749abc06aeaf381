"""Control laws: pure functions on scalars, written once for the tick and for the simulator's kernels."""
