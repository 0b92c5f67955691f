"""Robot files as they are found: every chain against Pinocchio (URDF) and C MuJoCo (MJCF).

    python experiments/robots_in_the_wild.py root=FOLDER [chains=20] [states=3] [seconds=60]

Walks FOLDER for URDF and MJCF files. Each chain of joints from the base to a leaf is loaded by
`load_robot`; mass matrix and gravity torques at random states are compared with the reference, the
other joints at their reference position. A chain that hangs on a free joint starts behind it. What
is printed: chains by outcome, refusals by reason, and every chain that is wrong or fails in
another way than by a sentence that names the file. Needs `pip install -e '.[test]'`.
"""

import multiprocessing
import resource
import warnings
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import mujoco

from mjx_inertia import runtime
from mjx_inertia.command import aligned
from mjx_inertia.experiment import experiment
from parts.robot_files import (
    NO_REFERENCE,
    OUTCOMES,
    REFUSED,
    RIGHT,
    RIGHT_UNCOUPLED,
    TRACEBACK,
    WRONG,
    Outcome,
    compare_file,
    kind_of_file,
)

SUFFIXES = (".urdf", ".xml", ".mjcf")
MEMORY = 16 << 30  # bytes of address space in which a file is read


@dataclass(frozen=True)
class Options:
    """Command-line options."""

    root: str | None = None  # of the files; links to folders are not followed
    chains: int = 20  # of a file, at most
    states: int = 3  # of a chain
    seconds: float = 60.0  # for a file


def robot_files(root: Path) -> list[Path]:
    """URDF and MJCF files of a folder and those in it."""
    files = sorted(p for p in root.rglob("*") if p.suffix.lower() in SUFFIXES and p.is_file())
    return [path for path in files if kind_of_file(path)]


def serve(pipe: Connection, chains: int, states: int) -> None:
    """Compares each file that comes through the pipe, in a process that may be ended."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    warnings.simplefilter("ignore")
    mujoco.set_mju_user_warning(lambda message: None)  # its own writes a file to this folder
    runtime.configure(devices=1, float64=True)
    while True:
        pipe.send(compare_file(pipe.recv(), chains, states))


def outcomes(files: list[Path], options: Options) -> Iterator[list[Outcome]]:
    """Of each file, those that take too long or end the process included."""
    context = multiprocessing.get_context("spawn")
    process = None
    for path in files:
        if process is None or not process.is_alive():
            pipe, end = context.Pipe()
            arguments = (end, options.chains, options.states)
            process = context.Process(target=serve, args=arguments, daemon=True)
            process.start()
            end.close()
        pipe.send(path)
        try:
            if not pipe.poll(options.seconds):
                raise EOFError(f"more than {options.seconds:g} s")
            yield pipe.recv()
        except EOFError as error:
            process.kill()
            process.join()
            reason = str(error) or "the process ended"
            yield [Outcome(str(path), "", TRACEBACK, reason)]
    if process is not None:
        process.kill()


@experiment(Options)
def main(options: Options, _folder: Path) -> dict[str, Any]:
    """Prints the table and what is wrong."""
    if options.root is None or not Path(options.root).is_dir():
        raise ValueError(f"root={options.root}: expected a folder with robot files")
    files = robot_files(Path(options.root))
    if not files:
        raise ValueError(f"root={options.root}: no URDF or MJCF file below it")
    found: list[Outcome] = []
    for rows in outcomes(files, options):
        found.extend(rows)
        for row in rows:
            if row.kind in (WRONG, TRACEBACK):
                print(f"{row.kind}: {row.file}, {row.end or 'file'}: {row.detail}", flush=True)
    count = Counter(row.kind for row in found)
    reasons = Counter(
        (row.kind, row.detail) for row in found if row.kind in (REFUSED, NO_REFERENCE)
    )
    table = [["outcome", "chains", "reason"]]
    table += [[kind, str(count[kind]), ""] for kind in OUTCOMES]
    table += [[kind, str(n), detail] for (kind, detail), n in reasons.most_common()]
    print(*aligned(table, left=(0, 2)), sep="\n")
    right = count[RIGHT] + count[RIGHT_UNCOUPLED]
    compared = sum(count.values()) - count[NO_REFERENCE]
    return {
        "files": len(files),
        "chains": compared,
        **{kind.replace(" ", "_"): count[kind] for kind in OUTCOMES},
        "right_percent": round(100.0 * right / max(compared, 1), 2),
    }


if __name__ == "__main__":
    main()
