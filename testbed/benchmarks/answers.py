"""Let a solver answer the cases of a set: in processes that are told paths of records and nothing else.

The key folder is closed to reading meanwhile. Every answer is written as soon as it is there, so that an interrupted
run goes on where it stopped.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import as_completed
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from icing_env.errors import InputError
from icing_env.record import FlightRecord
from testbed.memory import give_back_memory
from testbed.withheld.files import read_json, write_text
from testbed.workers import processes

OPEN = 0o700  # of the key folder outside the diagnosis
Progress = Callable[[str], None]


def answer_all(out: Path, folder: str, jobs: Mapping[str, tuple[Any, ...]], workers: int, progress: Progress,
               solver: Callable[..., dict[str, Any]]) -> None:  # fmt: skip
    """Answers to the cases of `jobs`, whose values the solver is told beside the records, into a folder of `out`.

    Args:
        solver: of the folder of a case's records and what the job holds; it runs in another process.

    Raises:
        InputError: another diagnosis (other sources) gave the answers that are there.
    """
    answers, names = out / folder, list(jobs)
    answers.mkdir(parents=True, exist_ok=True)
    there = {name: path for name in names if (path := answers / f"{name}.json").is_file()}
    left = [name for name in names if name not in there]
    of_one_solver(there.values())
    with closed(out / "keys"), processes(workers) as pool:
        running = {pool.submit(solver, out / "records" / name, *jobs[name]): name for name in left}
        for k, task in enumerate(as_completed(running), start=len(names) - len(left) + 1):
            write_text(answers / f"{running[task]}.json", json.dumps(task.result(), allow_nan=False))
            progress(f"{folder}: {k} of {len(names)}")


def of_one_solver(given: Iterable[Path]) -> None:
    """Check that today's diagnosis gave some answers; those of no diagnosis (a rival's, refused records) are any's.

    Raises:
        InputError: another one did; what was scored with them would be told as today's.
    """
    from icing_env.jit import source_hash

    own = source_hash("sim2real")
    for path in given:
        sources = read_json(path).get("provenance", {}).get("sources", own)
        if sources != own:
            raise InputError(f"{path}: the answer of another solver (sources {sources}, these are {own}): give another "
                             "--out, or remove the answers, to have the cases answered again")


@contextmanager
def closed(folder: Path) -> Iterator[None]:
    """No permission to read `folder` while the context lasts (which does not hold the system's administrator)."""
    folder.chmod(0)
    try:
        yield
    finally:
        folder.chmod(OPEN)


def diagnosis_of(records: Sequence[FlightRecord], held_out: Sequence[FlightRecord] = (),
                 references: Sequence[FlightRecord] = (), without: tuple[str, ...] = ()) -> dict[str, Any]:  # fmt: skip
    """What `icing diagnose --json` prints of these records, some effects left out of the library."""
    from sim2real.diagnosis import diagnose
    from testbed.commands.common import plain
    from testbed.commands.diagnose import answer

    told: dict[str, Any] = plain(answer(diagnose(records, held_out, references, without=without)))
    return told


def solve_by_role(case: Path) -> dict[str, Any]:
    """The diagnosis of a folder of records, each taken as its side file says; {"error": why} where there is none."""
    from icing_env.record import read

    def work() -> dict[str, Any]:
        records = [read(path) for path in sorted(case.glob("*.csv"))]
        of = {role: [r for r in records if r.meta.role == role] for role in ("diagnose", "held_out", "reference")}
        return diagnosis_of(of["diagnose"], of["held_out"], of["reference"])

    return answered(work, case)


def answered(work: Callable[[], dict[str, Any]], case: Path) -> dict[str, Any]:
    """One case's answer; where a record is refused or `work` fails, why: it must not cost other cases their answers.

    Args:
        case: the folder of its records, which the answer does not name: it may be published, from any machine.

    Raises:
        ImportError: the installation lacks something, which says nothing of the case.
    """
    try:
        return work()
    except ImportError:
        raise
    except InputError as error:
        why = str(error)
    except Exception as error:
        why = f"{type(error).__name__}: {error}"
    finally:
        give_back_memory()
    return {"error": why.replace(f"{case}/", "")}
