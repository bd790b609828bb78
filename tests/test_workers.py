"""Worker processes start with a core each, and the user's own settings stand."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from icing_env.errors import InputError
from testbed.benchmarks.answers import answered
from testbed.commands.diagnose import cost
from testbed.memory import peak_memory_gb
from testbed.workers import START, a_core_each, processes

KILLED = """
import os, time
from testbed.workers import processes
if __name__ == "__main__":
    with processes(1, {start!r}) as pool:
        print(pool.submit(os.getpid).result(), flush=True)
        time.sleep(600)
"""

KEPT = """
import numpy as np
from testbed.memory import give_back_memory, keep_freed_memory

def now():
    with open("/proc/self/status") as status:
        return next(int(line.split()[1]) for line in status if line.startswith("VmRSS")) * 1024 / 1e9

keep_freed_memory()
print(now())
held = np.ones(50_000_000)
del held
print(now())
give_back_memory()
print(now())
"""


def told(name: str) -> str | None:
    return os.environ.get(name)


def test_workers_start_with_it_and_nobody_else(monkeypatch):
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    with a_core_each(), processes(1) as pool:
        assert list(pool.map(told, START)) == ["1"]
    assert "OMP_NUM_THREADS" not in os.environ


def test_what_the_user_set_stands(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "2")
    with a_core_each(), processes(1) as pool:
        assert pool.submit(told, "OMP_NUM_THREADS").result() == "2"
    assert os.environ["OMP_NUM_THREADS"] == "2"


@pytest.mark.skipif(sys.platform == "win32", reason="signals of another kind")
@pytest.mark.parametrize("start", ["spawn", None])
@pytest.mark.parametrize("how", [signal.SIGTERM, signal.SIGKILL])
def test_workers_end_with_a_command_that_is_killed(tmp_path, start, how):
    (tmp_path / "command.py").write_text(KILLED.format(start=start))
    command = subprocess.Popen([sys.executable, tmp_path / "command.py"], stdout=subprocess.PIPE, text=True)
    worker = int(command.stdout.readline())
    assert there(worker)
    command.send_signal(how)
    command.wait()
    command.stdout.close()
    until = time.monotonic() + 30.0
    while there(worker) and time.monotonic() < until:
        time.sleep(0.05)
    assert not there(worker)


def there(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    told = Path(f"/proc/{process}/stat")  # ended, but nobody has asked how: in a container perhaps for ever
    return not (told.is_file() and told.read_text().rpartition(")")[2].split()[0] == "Z")


def test_a_case_that_fails_is_an_answer_and_costs_no_other_its_own():
    case = Path("anywhere/records/0a1b")
    assert answered(lambda: {"verdict": "no_gap"}, case) == {"verdict": "no_gap"}
    assert answered(lambda: refused("x"), case) == {"error": "no number: x"}
    assert answered(lambda: {}["lacking"], case) == {"error": "KeyError: 'lacking'"}
    assert answered(lambda: refused(f"{case}/1.csv"), case) == {"error": "no number: 1.csv"}  # it may be published


def test_an_installation_that_lacks_something_is_no_answer():
    with pytest.raises(ImportError, match="sim2real_of_another_version"):
        answered(lambda: vars(import_module("sim2real_of_another_version")), Path("case"))


def refused(text: str) -> dict[str, object]:
    raise InputError(f"no number: {text}")


@pytest.mark.skipif(sys.platform == "win32", reason="the system does not say")
def test_memory_is_told_in_gigabytes():
    held = np.ones(50_000_000)
    assert held.nbytes / 1e9 <= peak_memory_gb() < 50.0
    assert cost(27.3).startswith("Took 27 s and ") and cost(27.3).endswith(" GB of memory at most.")


@pytest.mark.skipif(sys.platform != "linux", reason="of GNU's C library")
@pytest.mark.parametrize(("trim", "kept"), [(None, True), ("131072", False)])
def test_freed_memory_is_kept_until_it_is_given_back(trim, kept):
    """By a process of its own: how the C library keeps memory is not to be undone."""
    own = {"MALLOC_MMAP_THRESHOLD_": str(2**30), "MALLOC_TRIM_THRESHOLD_": trim} if trim else {}
    user = {name: value for name, value in os.environ.items() if not name.startswith("MALLOC_")}
    said = subprocess.run([sys.executable, "-c", KEPT], env=user | own, capture_output=True, text=True, check=True)
    before, freed, given_back = map(float, said.stdout.split())
    assert (freed - before > 0.3) is kept
    assert given_back - before < 0.1
