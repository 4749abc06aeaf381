"""The networks' matrix product, compiled by `network`.

Written out instead of left to BLAS: for a handful of windows it is three times as fast, a row's result does not
depend on how many rows there are, and no library starts threads behind the planner's back (docs/decisions/0031).
"""

from __future__ import annotations

from typing import Any

import numpy as np

PANEL = 128
"""Outputs at a time. A tile is 4 rows by 4 inputs by a panel: each accumulator is loaded and stored once for 4
products, and one load of the weights serves 4 rows."""


def affine(x: Any, weights: Any, biases: Any, out: Any) -> None:
    """Fill `out` (M, B, outputs) with x @ weights + biases, member by member.

    x: (M, B, inputs), or (1, B, inputs) for all members; weights: (M, inputs, outputs); biases: (M, outputs).
    """
    members, _, outputs = weights.shape
    tile = np.empty(4 * PANEL, x.dtype)
    for m in range(members):
        rows = x[m % x.shape[0]]
        for panel in range(0, outputs, PANEL):
            first = max(0, min(panel, outputs - PANEL))  # the last overlaps: a narrow one would be computed one by one
            for b in range(0, rows.shape[0], 4):
                _tile(rows, b, weights[m], biases[m], first, tile, out[m])


def _tile(x: Any, b: int, weights: Any, biases: Any, first: int, a: Any, out: Any) -> None:
    """Rows b to b + 3 of `x` and the outputs of one panel; rows beyond the last repeat it."""
    last, inputs, width = x.shape[0] - 1, x.shape[1], min(PANEL, weights.shape[1] - first)
    x0, x1, x2, x3 = x[b], x[min(b + 1, last)], x[min(b + 2, last)], x[min(b + 3, last)]
    for j in range(width):
        a[j] = a[PANEL + j] = a[2 * PANEL + j] = a[3 * PANEL + j] = biases[first + j]
    whole = inputs - inputs % 4
    for i in range(0, whole, 4):
        w0, w1, w2, w3 = weights[i, first:], weights[i + 1, first:], weights[i + 2, first:], weights[i + 3, first:]
        p0, p1, p2, p3 = x0[i], x0[i + 1], x0[i + 2], x0[i + 3]
        q0, q1, q2, q3 = x1[i], x1[i + 1], x1[i + 2], x1[i + 3]
        r0, r1, r2, r3 = x2[i], x2[i + 1], x2[i + 2], x2[i + 3]
        s0, s1, s2, s3 = x3[i], x3[i + 1], x3[i + 2], x3[i + 3]
        for j in range(width):
            a[j] += p0 * w0[j] + p1 * w1[j] + p2 * w2[j] + p3 * w3[j]
            a[PANEL + j] += q0 * w0[j] + q1 * w1[j] + q2 * w2[j] + q3 * w3[j]
            a[2 * PANEL + j] += r0 * w0[j] + r1 * w1[j] + r2 * w2[j] + r3 * w3[j]
            a[3 * PANEL + j] += s0 * w0[j] + s1 * w1[j] + s2 * w2[j] + s3 * w3[j]
    for i in range(whole, inputs):
        w, p, q, r, s = weights[i, first:], x0[i], x1[i], x2[i], x3[i]
        for j in range(width):
            a[j] += p * w[j]
            a[PANEL + j] += q * w[j]
            a[2 * PANEL + j] += r * w[j]
            a[3 * PANEL + j] += s * w[j]
    for k in range(min(4, last + 1 - b)):
        for j in range(width):
            out[b + k, first + j] = a[k * PANEL + j]
