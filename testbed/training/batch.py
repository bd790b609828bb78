"""Every configured training, side by side in processes of one thread: `python -m testbed.training.batch --out DIR`.

Each is one `icing train`; what is not finished when the minutes are over goes on with --resume. Policies, curves and
configurations are packed into DIR/policies.tar, without the checkpoints.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tarfile
import time
from dataclasses import dataclass
from pathlib import Path

import click

from testbed.training import configuration

PACKED = ("policy.safetensors", "last.safetensors", "curve.csv", "curve.json", "run.json")
LEAST = 0.7  # minutes: a process that begins later learns too little to be worth its start
ENDING = 0.15  # minutes kept for the last checkpoints and the packing


@dataclass(frozen=True)
class Job:
    """One training."""

    algorithm: str
    name: str
    seed: int

    @property
    def label(self) -> str:
        """Name of its run directory."""
        return f"{self.algorithm}_{self.name}_{self.seed}"

    def command(self, out: Path, minutes: float, share: float) -> list[str]:
        """The process that begins it or goes on with it."""
        folder = out/self.label
        how = ["--resume", str(folder)] if (folder/"run.json").exists() else [
            "--config", self.name, "--seed", str(self.seed), "--out", str(folder)]
        if share != 1.0 and "--config" in how:
            _, chosen = configuration.load(self.algorithm, self.name)
            how += ["--steps", str(round(share*chosen.n_timesteps))]
        return [sys.executable, "-m", "testbed.cli", "train", self.algorithm, *how, "--threads", "1",
                "--minutes", f"{minutes:.3f}"]


def jobs(only: str = "") -> list[Job]:
    """Every configured run whose label begins with `only`: first seeds first, slow algorithms before quick ones."""
    found = []
    for algorithm in ("sac", "recurrent_ppo", "ppo"):
        for name in configuration.read(algorithm):
            _, chosen = configuration.load(algorithm, name)
            for k, seed in enumerate(chosen.seeds):
                found.append((k if algorithm == "ppo" else -1, Job(algorithm, name, seed)))
    found.sort(key=lambda pair: pair[0])
    return [job for _, job in found if job.label.startswith(only)]


def finished(job: Job, out: Path) -> bool:
    """Has it been learned to its end?"""
    return (out/job.label/"finished").exists()


def run(waiting: list[Job], out: Path, minutes: float, workers: int, share: float) -> None:
    """Keep `workers` processes busy until all is learned or the minutes are over."""
    until = time.monotonic() + 60.0*(minutes - ENDING)
    one = {"OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1"}
    going: dict[Job, subprocess.Popen[bytes]] = {}
    while waiting or going:
        left = (until - time.monotonic())/60.0
        while waiting and len(going) < workers and left > LEAST:
            job = waiting.pop(0)
            log = (out/f"{job.label}.log").open("ab")
            going[job] = subprocess.Popen(job.command(out, left - 0.3, share), stdout=log, stderr=log,
                                          env=os.environ | one)
        if not going:
            return
        if left < -ENDING:  # the last checkpoint stands
            for process in going.values():
                process.kill()
        for job in [job for job, process in going.items() if process.poll() is not None]:
            code = going.pop(job).returncode
            text = (out/f"{job.label}.log").read_text(errors="replace").strip().splitlines()
            click.echo(f"{job.label}: {'exit ' + str(code) + ': ' if code else ''}{text[-1] if text else ''}")
        time.sleep(0.2)


def pack(out: Path) -> Path:
    """Policies, curves and configurations of all runs in one archive, written whole."""
    part, final = out/"policies.tar.part", out/"policies.tar"
    with tarfile.open(part, "w") as archive:
        for folder in sorted(path for path in out.iterdir() if path.is_dir()):
            for name in PACKED:
                if (folder/name).is_file():
                    archive.add(folder/name, f"{folder.name}/{name}")
    part.replace(final)
    return final


def compile_first() -> None:
    """Fill the cache of compiled code once, before many processes would each do it."""
    from icing_env import scenario
    from testbed.training.evaluate import world_of

    for mode in (None, "surfaces", "targets", "limits"):
        world = world_of(scenario.load("stratiform"), 8, None, observer=True, protection=True, mode=mode)
        world.reset(seeds=list(range(8)))
        world.step()


@click.command()
@click.option("--out", type=click.Path(path_type=Path), required=True, help="Folder of the run directories.")
@click.option("--minutes", type=float, default=60.0, show_default=True, help="Wall clock for this call.")
@click.option("--workers", type=click.IntRange(min=1), default=os.cpu_count() or 1, help="Processes side by side.")
@click.option("--resume", is_flag=True, help="Go on with the runs in DIR; without, DIR must hold none.")
@click.option("--only", default="", help="Only runs whose name begins so.")
@click.option("--share", type=click.FloatRange(min=1e-4), default=1.0, help="Of each run's configured steps.")
def main(out: Path, minutes: float, workers: int, resume: bool, only: str, share: float) -> None:
    """Learn every configuration with every seed."""
    begun = time.monotonic()
    out.mkdir(parents=True, exist_ok=True)
    if not resume and any(path.is_dir() for path in out.iterdir()):
        raise click.UsageError(f"{out} holds runs already: go on with --resume, or choose another --out")
    waiting = [job for job in jobs(only) if not finished(job, out)]
    compile_first()
    click.echo(f"{len(waiting)} runs, {workers} at a time; compiled after {time.monotonic() - begun:.0f} s")
    run(waiting, out, minutes - (time.monotonic() - begun)/60.0, workers, share)
    click.echo(str(pack(out)))


if __name__ == "__main__":
    main()
