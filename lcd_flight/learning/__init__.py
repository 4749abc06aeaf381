"""Tasks, data, training and evaluation of the learned tracking cost.

Modules are imported where they are used: pyarrow and torch (the extra `train`) are heavy and not needed to evaluate.
"""
