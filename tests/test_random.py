"""Random numbers: known answers, distribution, independence, compiled equal to plain Python."""

import numpy as np
import pytest
from scipy import stats

from icing_env import random
from icing_env.jit import kernel


@kernel
def draw_normals(seed, stream, out):
    for i in range(out.shape[0]):
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = random.normal4(seed, stream, i, 0)


@kernel
def philox_row(words):
    return random.philox(words[0], words[1], words[2], words[3], words[4], words[5])


def normals(n: int, seed: int = 5, stream: int = 1) -> np.ndarray:
    out = np.empty((n, 4))
    draw_normals(np.uint64(seed), stream, out)
    return out


@pytest.mark.parametrize(
    ("inputs", "answer"),
    [  # Random123, tests/kat_vectors, "philox4x32 10"
        ("00000000 " * 6, "6627e8d5 e169c58d bc57ac4c 9b00dbd8"),
        ("ffffffff " * 6, "408f276d 41c83b0e a20bc7c6 6d5451fd"),
        ("243f6a88 85a308d3 13198a2e 03707344 a4093822 299f31d0", "d16cfe09 94fdcceb 5001e420 24126ea1"),
    ],
)
def test_philox_known_answers(inputs: str, answer: str) -> None:
    words = np.array([int(w, 16) for w in inputs.split()], np.uint64)
    assert [f"{int(w):08x}" for w in philox_row(words)] == answer.split()


def test_counter_words_do_not_alias() -> None:
    seen = {
        tuple(int(w) for w in random.words4(np.uint64(seed), stream, step, block))
        for seed in (0, 1, 2**32, 2**64 - 1)
        for stream in (1, 2)
        for step in (0, 1, 2**32)
        for block in (0, 1)
    }
    assert len(seen) == 48


def test_normal_is_the_inverse_distribution_to_the_tails() -> None:
    u = np.concatenate([[2.0**-33, 1.0 - 2.0**-33], np.linspace(1e-7, 1.0 - 1e-7, 2001)])
    z = np.array([random.normal(x) for x in u])
    assert np.allclose(z, stats.norm.ppf(u), rtol=1e-6, atol=1e-7)
    assert abs(z[0]) > 6.2
    assert z[0] == -z[1]


def test_normals_have_the_normal_distribution() -> None:
    z = normals(50_000).ravel()
    assert stats.kstest(z, "norm").pvalue > 1e-3
    assert abs(z.mean()) < 4 / np.sqrt(z.size)
    assert abs(z.var() - 1.0) < 4 * np.sqrt(2 / z.size)


def test_streams_lanes_seeds_and_steps_are_independent() -> None:
    n = 50_000
    a = normals(n)
    columns = [*a.T, *normals(n, stream=2).T, *normals(n, seed=6).T, np.roll(a[:, 0], 1)]
    correlation = np.corrcoef(columns) - np.eye(len(columns))
    assert np.abs(correlation).max() < 5 / np.sqrt(n)


def test_compiled_equals_plain() -> None:
    if not hasattr(random.normal4, "py_func"):
        pytest.skip("numba is switched off")
    plain = {name: getattr(random, name) for name in ("philox", "words4", "uniform", "normal")}
    compiled = normals(200, seed=2**63 + 11)
    with pytest.MonkeyPatch.context() as patch:
        for name, function in plain.items():
            patch.setattr(random, name, function.py_func)
        bare = [random.normal4.py_func(np.uint64(2**63 + 11), 1, i, 0) for i in range(200)]
    assert np.array_equal(compiled, bare)
