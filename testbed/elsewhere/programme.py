"""What is flown on each record: five cards to diagnose with, two held out, up to two references, of about 40 s."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from testbed.elsewhere import manoeuvres as m

Card = Callable[[m.Plan, np.random.Generator], None]
Flight = tuple[str, Card, float, int]  # role, card, true airspeed m/s, flight number


def longitudinal(plan: m.Plan, rng: np.random.Generator) -> None:
    """Elevator 3-2-1-1 both ways, then a pull and push."""
    sign = rng.choice([-1, 1])
    at = m.three_two_one_one(plan, "elevator", 2.5, sign * rng.uniform(2.0, 3.0), rng.uniform(0.4, 0.6))
    at = m.doublet(plan, "elevator", at + 1.0, -sign * rng.uniform(1.8, 2.6), rng.uniform(0.8, 1.1))
    at = m.pull(plan, at + 2.0, rng.uniform(1.8, 2.6))
    m.doublet(plan, "elevator", at + 1.0, sign * rng.uniform(1.5, 2.5), rng.uniform(0.5, 0.7))


def lateral(plan: m.Plan, rng: np.random.Generator) -> None:
    """Rudder and aileron doublets, then a rudder 2-1-1 and an aileron 2-1-1."""
    at = m.rudder_aileron(plan, 2.5, rng.choice([-1, 1]) * rng.uniform(2.5, 4.0), rng.uniform(4.0, 6.0))
    at = m.steps(plan, "rudder", at + 1.5, 0.7, rng.uniform(2.5, 4.0), (2, -1, 1))
    m.steps(plan, "aileron", at + 1.5, 0.6, -rng.uniform(4.0, 6.0), (2, -1, 1))


def power(plan: m.Plan, rng: np.random.Generator) -> None:
    """Throttle steps, elevator doublet at each power, a rudder doublet at low power."""
    at = m.throttle_steps(plan, 3.0, rng.uniform(0.18, 0.28), rng.uniform(4.0, 5.5))
    at = m.doublet(plan, "elevator", at + 1.0, -rng.uniform(1.8, 2.6), 0.7)
    at = m.deceleration(plan, at + 1.0, 10.0, rng.uniform(0.15, 0.25))
    m.doublet(plan, "rudder", at - 5.0, rng.uniform(2.5, 3.5), 0.9)


def turning(plan: m.Plan, rng: np.random.Generator) -> None:
    """Turns both ways with aileron inputs in between, a pull in the second turn."""
    bank = rng.choice([-1, 1]) * rng.uniform(20.0, 30.0)
    at = m.turn(plan, 2.5, bank, 9.0)
    at = m.doublet(plan, "aileron", at, rng.uniform(4.0, 6.0), 0.9)
    m.turn(plan, at, -bank, 11.0)
    m.doublet(plan, "elevator", at + 5.0, -rng.uniform(1.5, 2.2), 0.6)


def sweeps(plan: m.Plan, rng: np.random.Generator) -> None:
    """Sweep of the elevator, then of the aileron or the rudder."""
    at = m.sweep(plan, "elevator", 2.5, rng.uniform(1.2, 1.8))
    axis, size = ("aileron", 4.0) if rng.random() < 0.5 else ("rudder", 2.2)
    m.sweep(plan, axis, at + 1.0, size * rng.uniform(0.8, 1.2), 15.0)


def mixed(plan: m.Plan, rng: np.random.Generator) -> None:
    """A little of each axis and of power."""
    at = m.doublet(plan, "elevator", 2.5, rng.choice([-1, 1]) * rng.uniform(2.0, 3.0), rng.uniform(0.5, 0.8))
    at = m.rudder_aileron(plan, at + 1.0, rng.uniform(2.5, 3.5), -rng.uniform(4.0, 6.0))
    at = m.throttle_steps(plan, at + 1.0, rng.uniform(0.15, 0.22), 3.5)
    m.three_two_one_one(plan, "elevator", at + 0.5, -rng.uniform(1.8, 2.6), 0.45)


def cards(rng: np.random.Generator, references: bool) -> list[Flight]:
    """List of (role, card, true airspeed m/s, flight number) of one case; the order is shuffled within a role."""
    base = rng.uniform(62.0, 68.0)
    held = base + rng.choice([-1, 1]) * rng.uniform(6.0, 9.0)
    standard: list[Card] = [longitudinal, lateral, power, turning, sweeps, mixed]
    rng.shuffle(standard)  # type: ignore[arg-type]  # a list too
    flown: list[Flight] = [("diagnose", card, base + rng.uniform(-4.0, 4.0), 0) for card in standard[:4]]
    needed = [c for c in (longitudinal, lateral, mixed) if c not in standard[:4]] or [mixed]
    flown.append(("diagnose", needed[0], base - rng.uniform(5.0, 9.0), 0))
    second: Card = (longitudinal, lateral, power)[rng.integers(3)]
    flown += [("held_out", mixed, held, 1), ("held_out", second, held + 1.5, 1)]
    if references:
        flown += [("reference", longitudinal, base + rng.uniform(-3, 3), 2), ("reference", lateral, base - 2.0, 2)]
    return flown
