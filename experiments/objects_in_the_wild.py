"""Object files as they are found: mass, CoM and tensor of each against an independent reader.

    python experiments/objects_in_the_wild.py root=FOLDER [kinds=[urdf,mjcf]] [files=200]

Imports the URDF, MJCF and mesh files below a folder (each content once; `files` of them drawn at
random), meshes with 1000 kg/m³. References: the stated inertials summed by Pinocchio for URDF, C
MuJoCo for MJCF, `trimesh` for watertight meshes. Files are read in a process of their own, which
ends when a file takes too long. Prints what each kind of file came to, and every file that was read
wrongly or ended in a traceback; `files.csv` has a row for each. Needs the extra `test`.
"""

import collections
import csv
import hashlib
import multiprocessing
import re
import time
import traceback
import warnings
from collections.abc import Iterator
from dataclasses import asdict, dataclass, fields
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, Literal

import mujoco
import numpy as np
import pinocchio
import trimesh
from numpy import ndarray
from tqdm import tqdm

from mjx_inertia import runtime
from mjx_inertia.command import aligned
from mjx_inertia.experiment import experiment
from mjx_inertia.objects import ObjectModel, import_object

DENSITY = 1000.0  # kg/m³, of meshes
MESHES = (".obj", ".stl", ".ply", ".off", ".glb", ".gltf", ".dae", ".3mf")
# relative; overlaps in a mesh below 0.1 % of its volume are a warning of the import
TOLERANCE = {"mesh": 2e-3, "urdf": 1e-6, "mjcf": 1e-6}
START_S = 120.0  # until a reading process is ready
REFUSALS = {
    r"moves \(": "a joint that moves",
    r"expected one body in the world|not joined into one": "several bodies",
    r"is not a solid: ([a-z -]+):": "no solid",
    r"give `density`": "no inertia, and meshes alone",
    r"no such file|expected a mesh file|Error opening file": "a file that is missing",
    r"MuJoCo cannot compile": "MuJoCo cannot compile it",
    r"not an XML file": "no XML",
    r"apart as seen from above": "bodies apart",
    r"bounds no solid|is flat|unknown shape": "a shape without volume",
    r"is none of the links|one shape, found|finite number": "XML that is no URDF",
    r"no link with mass or shape|no visual and no collision": "no shape",
    r"expected a mesh": "no mesh",
}

Reference = tuple[float, ndarray, ndarray, int]  # kg, m, kg m², and how many axes of the CoM


@dataclass(frozen=True)
class Options:
    """Command-line options."""

    root: str | None = None  # folder to walk
    kinds: tuple[Literal["urdf", "mjcf", "mesh"], ...] = ("urdf", "mjcf", "mesh")  # to read
    files: int = 0  # to read; all if 0
    limit_s: float = 60.0  # for one file
    seed: int = 0  # of the files drawn


@dataclass(frozen=True)
class Row:
    """What one file came to."""

    file: str
    kind: str  # urdf, mjcf or mesh
    outcome: str  # right, refused, wrong, traceback, out of time, no reference
    why: str = ""  # the kind of a refusal, or what is wrong
    message: str = ""  # of the error
    warned: int = 0  # times
    difference: float = float("nan")  # relative, the largest
    seconds: float = 0.0


def kind_of(path: Path) -> str | None:
    """Of a file that describes an object."""
    suffix = path.suffix.lower()
    if suffix in MESHES:
        return "mesh"
    if suffix == ".urdf":
        return "urdf"
    if suffix == ".xml" and re.search(rb"<mujoco[\s>]", path.read_bytes()):
        return "mjcf"
    return None


def found_files(root: Path, kinds: tuple[str, ...]) -> dict[Path, str]:
    """Files of some kinds below a folder; each content once."""
    contents: set[bytes] = set()
    files = {}
    for path in sorted(root.rglob("*")):
        if path.is_file() and (kind := kind_of(path)) in kinds:
            content = hashlib.sha256(path.read_bytes()).digest()
            if content not in contents:
                contents.add(content)
                files[path] = kind
    return files


def of_urdf(path: Path) -> Reference:
    """Links that are fixed to the root, as Pinocchio sums them; the CoM but for its height."""
    body = pinocchio.buildModelFromUrdf(str(path), pinocchio.JointModelFreeFlyer()).inertias[1]
    return body.mass, body.lever, body.inertia, 2


def of_mjcf(path: Path) -> Reference:
    """The body in the world with all that it carries, in its own frame; as above."""
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    outer = int(np.flatnonzero(model.body_parentid[1:] == 0)[0]) + 1
    mass, com = float(model.body_subtreemass[outer]), data.subtree_com[outer]
    tensor = np.zeros((3, 3))
    for i in np.flatnonzero(model.body_rootid == outer):
        axes, arm = data.ximat[i].reshape(3, 3), data.xipos[i] - com
        tensor += axes @ np.diag(model.body_inertia[i]) @ axes.T
        tensor += model.body_mass[i] * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    R = data.xmat[outer].reshape(3, 3)
    return mass, R.T @ (com - data.xpos[outer]), R.T @ tensor @ R, 2


def of_mesh(path: Path) -> Reference | None:
    """The signed integrals over a surface that `trimesh` takes to be closed."""
    scene = trimesh.load_scene(path)
    mesh = scene.to_mesh()
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    if not mesh.is_volume:
        return None
    if scene.units:
        mesh.apply_scale(trimesh.units.unit_conversion(scene.units, "meters"))
    mesh.density = DENSITY
    body = mesh.mass_properties
    return body.mass, body.center_mass - [0.0, 0.0, mesh.bounds[0, 2]], body.inertia, 3


def compared(obj: ObjectModel, reference: Reference) -> float:
    """Largest difference relative to the mass, the size and the largest entry of the tensor."""
    mass, com, tensor, axes = reference
    found, size = obj.inertial, 2.0 * float(obj.half_extents.max())
    return max(
        abs(float(found.mass) / mass - 1.0),
        float(np.abs(np.asarray(found.com) - com)[:axes].max()) / size,
        float(np.abs(np.asarray(found.inertia) - tensor).max() / np.abs(tensor).max()),
    )


def read(path: Path, kind: str) -> Row:
    """Imports a file and compares it."""
    begin = time.perf_counter()

    def row(outcome: str, **more: Any) -> Row:
        seconds = round(time.perf_counter() - begin, 2)
        return Row(str(path), kind, outcome, warned=len(caught), seconds=seconds, **more)

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", UserWarning)
        try:
            obj = import_object(path, density=DENSITY if kind == "mesh" else None)
        except (ValueError, FileNotFoundError) as error:
            text = str(error)
            known = (name for key, name in REFUSALS.items() if re.search(key, text))
            return row("refused", why=next(known, "other"), message=text)
        except Exception as error:
            return row("traceback", why=type(error).__name__, message=traceback.format_exc())
        taken = row("no reference")  # the reference's time and warnings do not count
        try:
            reference = {"urdf": of_urdf, "mjcf": of_mjcf, "mesh": of_mesh}[kind](path)
        except Exception as error:  # rivals read less, and raise whatever they meet
            reference, taken = None, row("no reference", message=str(error))
    if reference is None:
        return taken
    difference = compared(obj, reference)
    outcome = "right" if difference <= TOLERANCE[kind] else "wrong"
    return Row(
        str(path), kind, outcome, difference=difference, warned=taken.warned, seconds=taken.seconds
    )


def serve(pipe: Connection) -> None:
    """Reads the files that a pipe names until it ends."""
    runtime.configure(devices=1, float64=True)
    pipe.send("ready")
    while True:
        pipe.send(read(*pipe.recv()))


class Reader:
    """A process that reads files, and another one when it does not answer."""

    def __init__(self) -> None:
        """Starts the process."""
        self.context = multiprocessing.get_context("spawn")
        self.start()

    def start(self) -> None:
        """Waits until a new process is ready."""
        self.pipe, other = self.context.Pipe()
        self.process = self.context.Process(target=serve, args=(other,), daemon=True)
        self.process.start()
        other.close()
        if not self.pipe.poll(START_S):
            raise ValueError(f"no reading process within {START_S:g} s")
        self.pipe.recv()

    def stop(self) -> None:
        """Ends the process."""
        self.process.kill()
        self.process.join()

    def row(self, path: Path, kind: str, limit_s: float) -> Row:
        """What a file comes to within its time."""
        self.pipe.send((path, kind))
        try:
            if self.pipe.poll(limit_s):
                return self.pipe.recv()
            row = Row(str(path), kind, "out of time", why=f"{limit_s:g} s", seconds=limit_s)
        except EOFError:
            row = Row(str(path), kind, "traceback", why="the process died")
        self.stop()
        self.start()
        return row


def read_all(files: dict[Path, str], limit_s: float) -> Iterator[Row]:
    """A row for each file, with a progress bar."""
    reader = Reader()
    try:
        for path, kind in tqdm(files.items(), unit="file"):
            yield reader.row(path, kind, limit_s)
    finally:
        reader.stop()


def table(rows: list[Row]) -> str:
    """How often each outcome came, by kind of file."""
    kinds = ("urdf", "mjcf", "mesh")
    counts = collections.Counter(
        (f"{row.outcome}: {row.why}" if row.outcome == "refused" else row.outcome, row.kind)
        for row in rows
    )
    names = sorted({name for name, _ in counts})
    names.sort(key=lambda name: -sum(counts[name, kind] for kind in kinds))
    lines = [(name, *(str(counts[name, kind]) for kind in kinds)) for name in names]
    return "\n".join(aligned([("outcome", *kinds), *lines]))


@experiment(Options)
def main(options: Options, folder: Path) -> dict[str, Any]:
    """Reads the files and writes what they came to."""
    if options.root is None or not Path(options.root).is_dir():
        raise ValueError(f"root={options.root}: expected a folder to walk")
    root = Path(options.root).resolve()
    files = found_files(root, options.kinds)
    if not files:
        raise ValueError(
            f"root={options.root}: no file of the kinds {list(options.kinds)} below it"
        )
    known = len(files)
    if 0 < options.files < known:
        drawn = np.random.default_rng(options.seed).choice(known, options.files, replace=False)
        names = list(files)
        files = {names[i]: files[names[i]] for i in np.sort(drawn)}
    rows = []
    with (folder / "files.csv").open("w", newline="", buffering=1) as stream:
        writer = csv.DictWriter(stream, [field.name for field in fields(Row)])
        writer.writeheader()
        for row in read_all(files, options.limit_s):
            rows.append(row)
            writer.writerow(asdict(row))
    print(table(rows))
    for row in rows:
        if row.outcome in ("wrong", "traceback", "out of time"):
            print(row.outcome, Path(row.file).relative_to(root), row.why, row.difference)
            print(row.message, end="")
    counts = collections.Counter(row.outcome for row in rows)
    right = [row.difference for row in rows if row.outcome == "right"]
    return {
        "experiment": "objects_in_the_wild",
        "files_found": known,
        "files_read": len(rows),
        "outcomes": dict(counts),
        "refused": dict(collections.Counter(r.why for r in rows if r.outcome == "refused")),
        "median_difference_of_right": float(np.median(right)) if right else None,
        "median_s": float(np.median([row.seconds for row in rows])),
    }


if __name__ == "__main__":
    main()
