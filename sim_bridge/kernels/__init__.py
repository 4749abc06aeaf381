"""What is compiled: scalar functions that run on many vehicles side by side, and the two loops that drive them.

Everything in this folder is part of the key of the compiled code (`sim_bridge.compiled`); nothing here imports numba.
"""
