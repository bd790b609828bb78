"""Every figure of the characteriser in one table: `icing benchmark characterisation`."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from estimators.characterise import online
from estimators.characterise.model import CLASSES, RIVALS, load_models
from testbed.characterisation import evaluate_classes, evaluate_detection, evaluate_protection
from testbed.characterisation.dataset import MODERATE, SEEDS, SEVERE, TURBULENCE

Say = Callable[[str], None]


@dataclass(frozen=True)
class Size:
    """Flights of each part of the benchmark."""

    classes: int  # aircraft per class of turbulence, three windows each
    encounters: int  # aircraft per icing scenario
    seconds: float  # of each encounter
    hours: float  # of clear air in light turbulence
    protected: int  # aircraft with boots


FULL = Size(300, 24, 900.0, 300.0, 48)
QUICK = Size(100, 12, 600.0, 4.0, 24)


def measure(quick: bool, weights: Path | None, say: Say) -> dict[str, Any]:
    """All figures; the machine-readable result of `icing benchmark characterisation`."""
    size, start = QUICK if quick else FULL, time.perf_counter()
    models = {rival: load_models(rival, weights) for rival in RIVALS}
    say("classes and reliability")
    classes = evaluate_classes.evaluate(models, size.classes)
    say("detection of ice in cloud")
    delays = evaluate_detection.delays(models, size.encounters, size.seconds, weights)
    say("false alarms in clear air")
    alarms = evaluate_detection.false_alarms(models, size.hours, weights)
    say("ice protection")
    protection = {rival: evaluate_protection.evaluate(online.load(rival, weights), size.protected) for rival in RIVALS}
    return {"classes": classes, "detection": delays, "false_alarms": alarms, "protection": protection,
            "bands": {"moderate": MODERATE, "severe": SEVERE}, "turbulence": TURBULENCE, "seeds": SEEDS,
            "quick": quick, "seconds": time.perf_counter() - start}


def tables(found: dict[str, Any]) -> list[tuple[str, dict[str, str], list[list[str]]]]:
    """Title, headings and rows of everything that is printed."""
    right = "right"
    classes = [[key.replace("_", ", "), *(f"{100*one[air]['one_window']:.1f} / {100*one[air]['three_windows']:.1f}"
                                          for air in ("calm", "light", "moderate")),
                f"{100*one['moderate']['false_alarms']:.1f}", f"{one['reliability']['gap']:.3f}",
                f"{one['reliability']['ece']:.3f}"] for key, one in found["classes"].items()]
    online_rows = [[key.replace("_", ", "), f"{100*one['within_60_s']:.1f}", f"{one['median_delay_s']:.0f}",
                    f"{one['missed']}/{one['crossings']}", f"{one['onset_median_error_s']:.0f}",
                    f"{found['false_alarms'][key]['per_100_h']:.2f}",
                    f"{found['false_alarms'][key]['upper95_per_100_h']:.2f}"]
                   for key, one in found["detection"].items()]
    hours = next(iter(found["false_alarms"].values()))["hours"]
    out = [
        ("five classes, % right in one window / over three; clean windows told iced, %; reliability",
         {"rival": "left", "calm": right, "light": right, "moderate": right, "false": right, "gap": right,
          "ece": right}, classes),
        (f"ice in cloud, light turbulence; false alarms in {hours:.0f} h of clear air",
         {"rival": "left", "within 60 s %": right, "median delay s": right, "missed": right, "onset error s": right,
          "alarms/100 h": right, "95 % upper": right}, online_rows),
        ("ice protection, boots inflated twice, light turbulence, own reference",
         {"rival": "left", "failed told %": right, "working told %": right, "false failures %": right},
         [[rival, *(f"{100*one[k]:.1f}" for k in ("failed_recognised", "working_recognised", "false_failures"))]
          for rival, one in found["protection"].items()]),
    ]
    for air in ("calm", "moderate"):
        confusion = np.asarray(found["classes"]["network_own"][air]["confusion"])
        out.append((f"network, own reference, {air}: windows by true class (rows) and told class",
                    {"": "left", **{name.replace("_", " "): right for name in CLASSES}},
                    [[name.replace("_", " "), *(str(x) for x in row)]
                     for name, row in zip(CLASSES, confusion, strict=True)]))
    curve = found["classes"]["network_own"]["reliability"]
    out.append(("network, own reference: reliability", {"told": right, "was": right, "windows": right},
                [[f"{t:.3f}", f"{w:.3f}", str(int(c))]
                 for t, w, c in zip(curve["told"], curve["was"], curve["count"], strict=True) if c]))
    return out


def draw(found: dict[str, Any], path: Path) -> None:
    """Reliability of every rival as a figure."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(5.0, 5.0), layout="constrained")
    axes = figure.subplots()
    axes.plot([0, 1], [0, 1], color="0.6", linewidth=1, label="as told")
    axes.fill_between([0, 1], [-0.05, 0.95], [0.05, 1.05], color="0.92", label="within 5 %")
    for key, one in found["classes"].items():
        curve = one["reliability"]
        judged = np.asarray(curve["count"]) >= evaluate_classes.FEWEST
        axes.plot(np.asarray(curve["told"])[judged], np.asarray(curve["was"])[judged], marker="o", markersize=3,
                  label=key.replace("_", ", "))
    axes.set(xlabel="probability that was told", ylabel="share that was so", xlim=(0, 1), ylim=(0, 1))
    axes.legend(fontsize=8)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150)
