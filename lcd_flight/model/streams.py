"""Counter-based random streams: what is drawn depends on (seed, domain, index, draw) and on nothing else.

So row i of a data set is the same whatever the count, the grouping into shards, the number of cores or the machine.
The generator is SplitMix64 (Steele, Lea and Flood, OOPSLA 2014) in its counter form, one sub-stream for each index.
Domains ("training/noise", "evaluation/noise", ...) are hashed into the key: streams of different domains, and
of different seeds of one domain, have nothing to do with each other.
"""

from __future__ import annotations

import hashlib

import numpy as np

from lcd_flight.model.types import FloatArray, IntArray, SeedArray

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)


class Stream:
    """The random numbers of one (seed, domain)."""

    def __init__(self, seed: int, domain: str) -> None:
        digest = hashlib.blake2b(f"{domain}\0{seed}".encode(), digest_size=8).digest()
        self._key = np.uint64(int.from_bytes(digest, "little"))

    def words(self, indices: IntArray, draws: int, first: int = 0) -> SeedArray:
        """(N, draws) 64-bit words: draws `first`, `first + 1`, ... of each index in `indices` (N,)."""
        with np.errstate(over="ignore"):
            state = _mixed(self._key + indices.astype(np.uint64) * _GOLDEN)
            counter = np.arange(first + 1, first + draws + 1, dtype=np.uint64)
            return _mixed(state[:, None] + counter * _GOLDEN)

    def uniforms(self, indices: IntArray, draws: int, first: int = 0) -> FloatArray:
        """(N, draws) uniform in (0, 1), 53 bits."""
        return ((self.words(indices, draws, first) >> np.uint64(11)).astype(np.float64) + 0.5) * 2.0**-53

    def normals(self, indices: IntArray, draws: int, first: int = 0) -> FloatArray:
        """(N, draws) standard normal (Box and Muller); takes two uniform draws for each."""
        uniform = self.uniforms(indices, 2 * draws, first)
        return np.sqrt(-2.0 * np.log(uniform[:, 0::2])) * np.cos(2.0 * np.pi * uniform[:, 1::2])

    def seeds(self, indices: IntArray) -> SeedArray:
        """(N,) one 64-bit seed for each index, e.g. of a rollout's noise."""
        return self.words(indices, 1)[:, 0]


def _mixed(word: SeedArray) -> SeedArray:
    """SplitMix64's finaliser: a bijection of 64-bit words in which every bit of the input matters."""
    word = (word ^ (word >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    word = (word ^ (word >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return np.asarray(word ^ (word >> np.uint64(31)))
