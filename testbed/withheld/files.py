"""Records, keys and the manifest: written whole or not at all, and checked again by their hashes."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.withheld import instruments
from testbed.withheld.plant import DT
from testbed.withheld.published import PUBLISHED

COMMANDS = ("elevator_command", "aileron_command", "rudder_command", "throttle_left", "throttle_right")


def write_text(path: Path, text: str) -> None:
    """Write a file whole or not at all."""
    part = path.with_name(f".{path.name}.{os.getpid()}")
    part.write_text(text, encoding="utf-8")
    os.replace(part, path)


def record_text(channels: Mapping[str, NDArray], commands: NDArray) -> str:
    """A record as CSV; blank between the samples of slow channels and where nan; absent ones are left out."""
    still = np.zeros(len(commands))  # the flap
    known = [n for n in instruments.FAST if n in channels]
    fast = [np.arange(len(commands)) * DT, *(channels[n] for n in known), still, *commands.T]
    header = ["time", *known, "flap", *COMMANDS, *instruments.SLOW]
    slow = [channels[n] for n in instruments.SLOW]
    table, sparse = np.column_stack(fast).tolist(), np.column_stack(slow).tolist()
    short = ",".join(["%.7g"] * len(fast))
    blank = "," * len(slow)
    lines = [",".join(header)]
    for k, row in enumerate(table):
        line = short % tuple(row)
        if k % instruments.SLOW_EVERY == 0:
            lines.append(line + "," + ",".join(f"{v:.8g}" for v in sparse[k]))
        else:
            lines.append(line + blank)
    return "\n".join(lines).replace("nan", "") + "\n"


def side_text(flight: str, role: str) -> str:
    """The TOML beside a record: what the aircraft's papers say, which is the published aircraft."""
    n = PUBLISHED
    return "\n".join([
        'aircraft = "twin_otter"', f'flight = "{flight}"', f'role = "{role}"', f"mass = {n['mass']}",
        "cg = [0.0, 0.0, 0.0]", "", "[sensors.thrust]", 'source = "measured"', "", "[inertia]",
        *(f"{a} = {n[f'inertia_{a}']}" for a in ("xx", "yy", "zz", "xz")), "",
        "[geometry]", *(f"{a} = {n[a]}" for a in ("wing_area", "span", "chord")), ""])


def write_case(folder: Path, texts: Mapping[str, str]) -> None:
    """All files of a case, as a folder that appears at once."""
    part = folder.with_name(f".{folder.name}.{os.getpid()}")
    shutil.rmtree(part, ignore_errors=True)
    part.mkdir(parents=True)
    for name, text in texts.items():
        (part / name).write_text(text, encoding="utf-8")
    os.replace(part, folder)


def digest_of(path: Path) -> str:
    """SHA-256 of a file, or of a folder's file names and contents."""
    total = hashlib.sha256()
    for file in sorted(path.iterdir()) if path.is_dir() else [path]:
        total.update(file.name.encode() + b"\0" + hashlib.sha256(file.read_bytes()).digest())
    return total.hexdigest()


def manifest(records: Path, keys: Path, names: list[str]) -> dict[str, Any]:
    """Hashes of every case's records and of its salted key: what is made public before anything is solved."""
    return {"cases": {name: {"records": digest_of(records / name), "key": digest_of(keys / f"{name}.json")}
                      for name in sorted(names)}}


def tampered(records: Path | None, keys: Path, committed: Mapping[str, Any]) -> list[str]:
    """Cases whose records (unless None, where they are not at hand) or key are not those of the manifest.

    What is missing is not.
    """
    wrong = []
    for name, hashes in committed["cases"].items():
        there = [(keys / f"{name}.json", hashes["key"])]
        there += [] if records is None else [(records / name, hashes["records"])]
        if any(not path.exists() or digest_of(path) != wanted for path, wanted in there):
            wrong.append(name)
    return wrong


def read_json(path: Path) -> Any:
    """Contents of a JSON file."""
    return json.loads(path.read_text(encoding="utf-8"))
