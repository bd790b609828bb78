"""Random numbers without a hidden state: Philox 4x32-10, a function of (seed, stream, step, block).

Salmon, Moraes, Dror, Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC11 (2011): ten rounds of 32 x 32 bit
multiplication and exclusive or on a counter of four words, keyed by two. Here the key is the 64-bit seed and the
counter is (block, stream, low word of step, high word of step). A draw therefore depends on nothing that was drawn
before: batch size, the order of calls and which subsystems are on change no other draw.

Normal deviates come from one 32-bit uniform each by a rational approximation of the inverse normal distribution
function: the tails of P. J. Acklam, "An algorithm for computing the inverse normal cumulative distribution function"
(2003), and a centre of fewer terms. Relative error below 1e-6, tails to 6.3 sigma, no logarithm for 98 % of the draws.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from icing_env.jit import kernel

Word = np.uint64  # holds 32 bits in what follows

# One stream for each use; a new use takes a new number. Streams and blocks are NumPy's unsigned numbers: for each plain
# integer constant numba would compile the called function anew.
STREAM_TURBULENCE, STREAM_TURBULENCE_START, STREAM_CLOUD, STREAM_SHEDDING, STREAM_SENSORS, STREAM_RESET = (
    np.uint64(i) for i in range(1, 7))
BLOCK = tuple(np.uint64(i) for i in range(8))

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
def words4(seed: Any, stream: Any, step: Any, block: Any) -> tuple[Word, Word, Word, Word]:
    """Four random 32-bit words (as uint64) of one (seed, stream, step, block), all integers >= 0."""
    key, time = np.uint64(seed), np.uint64(step)
    return philox(np.uint64(block), np.uint64(stream), time & _MASK, time >> _HALF, key & _MASK, key >> _HALF)


@kernel
def uniform(word: Word) -> float:
    """Uniform deviate in (0, 1), both ends excluded, of one 32-bit word."""
    return (float(np.int64(word)) + 0.5) * _TWO_32


@kernel
def normal(u: float) -> float:
    """Standard normal deviate with distribution value `u` in (2^-34, 1 - 2^-34).

    The centre, 98 % of the draws, is a rational function of (u - 1/2)^2, fitted here for the least largest relative
    error (7e-7, Lawson's iteration); the tails are Acklam's, in sqrt(-2 log(tail)).
    """
    q = u - 0.5
    if abs(q) <= 0.49:
        r = q * q
        above = (((40.7745758371 * r - 124.266887975) * r + 92.8701538615) * r - 26.1083996812) * r + 2.50663005455
        below = (((42.9482545195 * r - 78.2983729052) * r + 46.7452510119) * r - 11.4627976783) * r + 1.0
        return q * above / below
    r = math.sqrt(-2.0 * math.log(0.5 - abs(q)))
    above = ((-0.007784894002430293 * r - 0.3223964580411365) * r - 2.400758277161838) * r - 2.549732539343734
    below = ((0.007784695709041462 * r + 0.3224671290700398) * r + 2.445134137142996) * r + 3.754408661907416
    return math.copysign(((above * r + 4.374664141464968) * r + 2.938163982698783) / (below * r + 1.0), q)


@kernel
def uniform4(seed: Any, stream: Any, step: Any, block: Any) -> tuple[float, float, float, float]:
    """Four independent uniform deviates in (0, 1)."""
    a, b, c, d = words4(seed, stream, step, block)
    return uniform(a), uniform(b), uniform(c), uniform(d)


@kernel
def normal4(seed: Any, stream: Any, step: Any, block: Any) -> tuple[float, float, float, float]:
    """Four independent standard normal deviates."""
    a, b, c, d = words4(seed, stream, step, block)
    return normal(uniform(a)), normal(uniform(b)), normal(uniform(c)), normal(uniform(d))
