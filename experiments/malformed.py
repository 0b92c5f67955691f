"""Damaged files, arguments and settings: how many are refused, and whether any passes silently.

    python experiments/malformed.py [mutations=160] [seconds=60] [seed=0]

Every loader gets the same number of random damages (`experiments/parts/mutations.py`), one after
the other in a process of its own with 8 GiB of memory; what takes longer than `seconds` is ended
and counts as a hang. Outcomes: `right` (what is accepted can be, physically; for stores and arrays
it is what was written), `refused` (one error of the library or of Hydra), `status` (of a push, or
a remark in a robot's note), `silent` (a value that cannot be, without a word), `traceback` (any
other error, or a crash), `hang`.
"""

import collections
import multiprocessing
import resource
import tempfile
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np
from hydra.errors import HydraException
from omegaconf.errors import OmegaConfBaseException

from mjx_inertia.command import aligned
from mjx_inertia.dataset.store import StoreError
from mjx_inertia.experiment import experiment
from parts.malformed_loaders import LOADERS

OUTCOMES = ("right", "refused", "status", "silent", "traceback", "hang")
_MEMORY = 8 << 30  # bytes of a process
_REFUSALS = (ValueError, FileNotFoundError, StoreError, HydraException, OmegaConfBaseException)


@dataclass(frozen=True)
class Options:
    """Command-line options."""

    mutations: int = 160  # of each loader
    seconds: float = 60.0  # for one of them, the first one's compilation included
    seed: int = 0  # of the damages


def _outcome(attempt: Any, rng: np.random.Generator) -> tuple[str, str]:
    """What came of one damage, and the error where it is none of the library's."""
    try:
        return attempt(rng), ""
    except _REFUSALS as error:
        return "refused" if str(error).strip() else "traceback", repr(error)
    except Exception as error:
        return "traceback", repr(error)


def _worker(connection: Connection, name: str, folder: str, seed: int) -> None:
    """Answers each number of a damage with its outcome."""
    resource.setrlimit(resource.RLIMIT_DATA, (_MEMORY, _MEMORY))
    attempt = LOADERS[name](Path(folder))
    while True:
        connection.send(_outcome(attempt, np.random.default_rng([seed, connection.recv()])))


def outcomes(name: str, options: Options) -> tuple[collections.Counter[str], list[str]]:
    """How often each outcome came of the damages of one loader, and those that must not be."""
    context = multiprocessing.get_context("spawn")
    counts: collections.Counter[str] = collections.Counter()
    wrong: list[str] = []
    process: Any = None
    with tempfile.TemporaryDirectory() as folder:
        for number in range(options.mutations):
            if process is None:  # the first, or the one before was ended
                here, there = context.Pipe()
                fresh = tempfile.mkdtemp(dir=folder)
                arguments = (there, name, fresh, options.seed)
                process = context.Process(target=_worker, args=arguments, daemon=True)
                process.start()
                there.close()
            here.send(number)
            try:
                outcome, told = here.recv() if here.poll(options.seconds) else ("hang", "")
            except EOFError:
                outcome, told = "traceback", "the process crashed"
            if outcome in ("silent", "traceback", "hang"):
                wrong.append(f"{name} {number}: {outcome} {told}"[:200])
            if outcome == "hang" or not process.is_alive():
                process.kill()
                process = None
            counts[outcome] += 1
        if process is not None:
            process.kill()
    return counts, wrong


@experiment(Options)
def main(options: Options, folder: Path) -> dict[str, Any]:
    """Damages the input of every loader and prints a table of what came of it."""
    rows = [["loader", *OUTCOMES]]
    total: collections.Counter[str] = collections.Counter()
    wrong: list[str] = []
    for name in LOADERS:
        counts, more = outcomes(name, options)
        total += counts
        wrong += more
        rows.append([name, *(str(counts[outcome]) for outcome in OUTCOMES)])
    print(*aligned(rows), *wrong, sep="\n")
    (folder / "wrong.txt").write_text("\n".join(wrong) + "\n")
    return {
        "experiment": "malformed",
        "mutations": sum(total.values()),
        **{outcome: total[outcome] for outcome in OUTCOMES},
    }


if __name__ == "__main__":
    main()
