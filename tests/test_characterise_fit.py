"""Fits of the characteriser: gradients are slopes, probabilities are calibrated, overconfidence shows."""

from __future__ import annotations

import numpy as np
import pytest

from estimators.characterise.features import FEATURES
from estimators.characterise.model import CLASSES, PARTS
from testbed.characterisation.dataset import Windows
from testbed.characterisation.evaluate_classes import curve
from testbed.characterisation.fit import SHAPES, class_loss, fit, iced_loss, severity_loss, spread_loss, temper


def made_up(n, seed):
    """Windows whose classes lie on one feature each, with noise: what a fit must find."""
    rng = np.random.default_rng(seed)
    label = rng.integers(0, len(CLASSES), n)
    x = rng.normal(0.0, 1.0, (n, len(FEATURES)))
    x[np.arange(n), label] += 2.5
    eta = np.maximum(0.0, 0.1*x[:, :len(PARTS)] + rng.normal(0.0, 0.02, (n, len(PARTS))))
    return Windows(x, x, label, (label > 0).astype(float), eta, np.zeros(n))


def test_gradient_of_every_loss_is_its_slope():
    data = made_up(6, 0)
    for loss, width in ((class_loss(data.label), 5), (iced_loss(data.iced), 1), (severity_loss(data.eta), 4),
                        (spread_loss(data.eta + 0.3), 4)):
        out = np.random.default_rng(1).normal(0.0, 1.0, (6, width))
        _, gradient = loss(out)
        for i in range(6):
            for j in range(width):
                step = np.zeros_like(out)
                step[i, j] = 1e-6
                slope = (loss(out + step)[0] - loss(out - step)[0])/2e-6
                assert slope == pytest.approx(gradient[i, j], abs=1e-7)


@pytest.mark.parametrize("rival", ["logistic", "network"])
def test_a_fit_is_calibrated_on_data_it_has_not_seen(rival):
    data, check, test = made_up(1500, 1), made_up(1500, 2), made_up(4000, 3)
    raw = fit(SHAPES[rival], data.type, data, 0, 60)
    model = temper(raw, check.type, check)
    p = model.judge(test.type).classes
    assert (p.argmax(axis=1) == test.label).mean() > 0.8
    was = (test.label[:, None] == np.arange(len(CLASSES))).ravel()
    assert curve(p.ravel(), was)["ece"] < 0.02


def test_overconfidence_shows_in_the_reliability_curve():
    rng = np.random.default_rng(0)
    p = rng.uniform(0.0, 1.0, 20000)
    was = rng.random(20000) < p
    assert curve(p, was)["gap"] < 0.05
    assert curve(np.clip(2.0*p - 0.5, 0.0, 1.0), was)["gap"] > 0.1
