"""A recorder's low pass of second or higher order, brought to the first-order one that the simulated instruments have.

Of one that is as late the phase is another but at low frequencies, and after every edge of a doublet rates, angles and
surfaces are apart from attitudes, which it does not act on, by more than noise. What a record has passed is known, so
that it is passed on here by the rest: in frequency, where all of the record is at hand and nothing need be causal. No
frequency gains by it, for beyond its cut a low pass has left little but noise. White noise of the samples is weaker at
some frequencies then, and what came before would foretell it: what it lacks is put back, drawn from the record itself.
"""

from __future__ import annotations

import math
import zlib

import numpy as np
from scipy.signal import butter, freqs

from icing_env.record import FloatArray
from sim2real.records.noise import white

BEYOND = 2.0  # s by which a series is prolonged at both ends, mirrored: many times as long as a low pass remembers


def in_first_order(values: FloatArray, cut: float, order: int, first: float, dt: float) -> FloatArray:
    """A series behind a Butterworth low pass, as it would be behind one of first order.

    Args:
        values: the series [N], without blanks.
        cut, order: of the low pass that it passed, Hz.
        first: cut-off of the one of first order that shows a slow change as late, Hz; updated at every sample with its
            newest value.
        dt: from sample to sample, s.
    """
    more = min(round(BEYOND / dt), len(values) - 1)
    longer = np.pad(values, more, mode="reflect", reflect_type="odd")
    line = np.linspace(longer[0], longer[-1], len(longer))  # goes through as it is; what is left begins where it ends
    omega = 2.0 * math.pi * np.fft.rfftfreq(len(longer), dt)
    passed = freqs(*butter(order, 2.0 * math.pi * cut, analog=True), worN=omega)[1]
    kept = math.exp(-2.0 * math.pi * first * dt)
    rest = (1.0 - kept) / (1.0 - kept * np.exp(-1j * omega * dt)) / passed
    rest /= np.maximum(np.abs(rest), 1.0)
    drawn = np.random.default_rng(zlib.crc32(np.ascontiguousarray(values).tobytes())).standard_normal(len(longer))
    lacks = np.fft.rfft(white(values) * drawn) * np.sqrt(np.maximum(1.0 - np.abs(rest) ** 2, 0.0))
    passed_on = np.fft.irfft(np.fft.rfft(longer - line) * rest + lacks, len(longer)) + line
    return np.asarray(passed_on[more : more + len(values)])
