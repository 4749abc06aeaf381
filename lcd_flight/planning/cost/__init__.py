"""The tracking cost: features of a plan, the networks on them, model files, and the analytic stand-in."""
