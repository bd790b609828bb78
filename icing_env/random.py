"""Random numbers without a hidden state: Philox 4x32-10, a function of (seed, stream, step, block).

Salmon, Moraes, Dror, Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC11 (2011): ten rounds of 32 x 32 bit
multiplication and exclusive or on a counter of four words, keyed by two. Here the key is the 64-bit seed and the
counter is (block, stream, low word of step, high word of step). A draw therefore depends on nothing that was drawn
before: batch size, the order of calls and which subsystems are on change no other draw.

Normal deviates come from one 32-bit uniform each by the percentage points of Wichura, "Algorithm AS 241", Applied
Statistics 37 (1988), form PPND7: relative error below 1e-6, tails to 6.3 sigma, no logarithm for 85 % of the draws.
"""

from __future__ import annotations

import math

import numpy as np

from icing_env.jit import kernel

Word = np.uint64  # holds 32 bits in what follows

# One stream for each use; a new use takes a new number.
STREAM_TURBULENCE = 1
STREAM_TURBULENCE_START = 2
STREAM_CLOUD = 3
STREAM_SHEDDING = 4
STREAM_SENSORS = 5
STREAM_RESET = 6

_MASK = np.uint64(0xFFFFFFFF)
_HALF = np.uint64(32)
_M0, _M1 = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)  # multipliers, Salmon et al. 2011
_W0, _W1 = np.uint64(0x9E3779B9), np.uint64(0xBB67AE85)  # key schedule: golden ratio and sqrt(3) - 1
_TWO_32 = 2.0**-32


@kernel
def philox(c0: Word, c1: Word, c2: Word, c3: Word, k0: Word, k1: Word) -> tuple[Word, Word, Word, Word]:
    """Ten rounds of Philox 4x32 (all arguments and results uint64 holding 32-bit words).

    Args:
        c0, c1, c2, c3: the counter.
        k0, k1: the key.

    Returns:
        Four words.
    """
    for _ in range(10):
        product0 = _M0 * c0
        product1 = _M1 * c2
        c0 = (product1 >> _HALF) ^ c1 ^ k0
        c1 = product1 & _MASK
        c2 = (product0 >> _HALF) ^ c3 ^ k1
        c3 = product0 & _MASK
        k0 = (k0 + _W0) & _MASK
        k1 = (k1 + _W1) & _MASK
    return c0, c1, c2, c3


@kernel
def words4(seed: int, stream: int, step: int, block: int) -> tuple[Word, Word, Word, Word]:
    """Four random 32-bit words (as uint64) of one (seed, stream, step, block), all integers >= 0."""
    key, time = np.uint64(seed), np.uint64(step)
    return philox(np.uint64(block), np.uint64(stream), time & _MASK, time >> _HALF, key & _MASK, key >> _HALF)


@kernel
def uniform(word: Word) -> float:
    """Uniform deviate in (0, 1), both ends excluded, of one 32-bit word."""
    return (float(np.int64(word)) + 0.5) * _TWO_32


@kernel
def normal(u: float) -> float:
    """Standard normal deviate with distribution value `u` in (2^-34, 1 - 2^-34): Wichura 1988, AS 241, PPND7.

    The form's third branch (tails below 1.4e-11) cannot be reached from a 32-bit uniform and is left out.
    """
    q = u - 0.5
    if abs(q) <= 0.425:
        r = 0.180625 - q * q
        above = ((59.109374720 * r + 159.29113202) * r + 50.434271938) * r + 3.3871327179
        return q * above / (((67.187563600 * r + 78.757757664) * r + 17.895169469) * r + 1.0)
    r = math.sqrt(-math.log(0.5 - abs(q))) - 1.6
    above = ((0.17023821103 * r + 1.3067284816) * r + 2.7568153900) * r + 1.4234372777
    return math.copysign(above / ((0.12021132975 * r + 0.73700164250) * r + 1.0), q)


@kernel
def uniform4(seed: int, stream: int, step: int, block: int) -> tuple[float, float, float, float]:
    """Four independent uniform deviates in (0, 1)."""
    a, b, c, d = words4(seed, stream, step, block)
    return uniform(a), uniform(b), uniform(c), uniform(d)


@kernel
def normal4(seed: int, stream: int, step: int, block: int) -> tuple[float, float, float, float]:
    """Four independent standard normal deviates."""
    a, b, c, d = words4(seed, stream, step, block)
    return normal(uniform(a)), normal(uniform(b)), normal(uniform(c)), normal(uniform(d))
