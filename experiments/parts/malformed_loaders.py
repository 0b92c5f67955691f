"""What is fed with damaged input, and what may come out of it.

In: a folder to write to. Out: for each loader a function from a generator of random numbers to an
outcome: "right", "status" (of a push, or a remark in a robot's note), "silent" (a value that cannot
be was accepted), or the error it raises.
"""

import io
import json
import zipfile
from collections.abc import Callable
from importlib import resources
from pathlib import Path
from typing import Any

import h5py
import jax
import numpy as np
import trimesh
from numpy.random import Generator

from mjx_inertia.dataset import CubesProtocol, cubes_plan, open_store
from mjx_inertia.dataset.mcube import load_mcube
from mjx_inertia.dataset.plan import Range, select_pushes
from mjx_inertia.dataset.recording import read_push
from mjx_inertia.dataset.store import create_store, read_block, write_block
from mjx_inertia.files import read_arrays, write_arrays
from mjx_inertia.objects import cube, cuboid, import_object, load_mcube_objects
from mjx_inertia.pushing import PushRecord, PushStatus, SceneSettings, build_scene, simulate
from mjx_inertia.robots import load_robot
from mjx_inertia.settings import compose
from mjx_inertia.spatial import InertialParameters
from parts.mutations import mutate_bytes, mutate_text

Attempt = Callable[[Generator], str]
URDF = b"""<robot name="arm">
<link name="base"/>
<link name="upper"><inertial><origin xyz="0 0 0.2" rpy="0 0 0"/><mass value="2.0"/>
<inertia ixx="0.03" iyy="0.03" izz="0.004" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="hand"><inertial><origin xyz="0 0 0.05" rpy="0 0 0"/><mass value="0.5"/>
<inertia ixx="0.002" iyy="0.002" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="a" type="revolute"><parent link="base"/><child link="upper"/>
<origin xyz="0 0 0.1" rpy="0 0 0"/><axis xyz="0 1 0"/>
<limit lower="-2" upper="2" effort="50" velocity="2"/></joint>
<joint name="b" type="revolute"><parent link="upper"/><child link="hand"/>
<origin xyz="0 0 0.4" rpy="0 0 0"/><axis xyz="1 0 0"/>
<limit lower="-1" upper="1" effort="20" velocity="3"/></joint>
</robot>"""
MJCF = b"""<mujoco model="arm">
<compiler angle="radian"/>
<worldbody>
<body name="upper" pos="0 0 0.1">
<joint name="a" type="hinge" axis="0 1 0" range="-2 2" limited="true"/>
<inertial pos="0 0 0.2" mass="2.0" diaginertia="0.03 0.03 0.004"/>
<body name="hand" pos="0 0 0.4">
<joint name="b" type="hinge" axis="1 0 0" range="-1 1" limited="true"/>
<inertial pos="0 0 0.05" mass="0.5" diaginertia="0.002 0.002 0.001"/>
</body>
</body>
</worldbody>
</mujoco>"""
TABLE = b"""height: 0.02
objects:
  plate:
    mass: 1.5
    inertia_zz: 0.002
    outline: [[-0.1, -0.05], [0.1, -0.05], [0.1, 0.05], [-0.1, 0.05]]
  coin:
    mass: 0.5
    inertia_zz: 0.0003
    ellipse: [0.05, 0.04]
"""
OVERRIDES = (
    "seed", "dataset.block", "dataset.shard", "dataset.path", "dataset.kind", "dataset.splits",
    "dataset.spread", "dataset.floor", "dataset.grouped_share", "dataset.scene.rate",
    "dataset.scene.max_timestep", "dataset.scene.tip_radius", "dataset.scene.table",
    "dataset.protocol.mass.low", "dataset.protocol.mass.count", "dataset.protocol.friction.high",
    "dataset.protocol.edge.low", "dataset.protocol.points", "dataset.protocol.speeds",
    "dataset.protocol.length", "dataset.protocol.pushes_per_cube",
    "dataset.protocol.tip_friction", "dataset.protocol.tip_time_constant",
)  # fmt: skip
VALUES = (
    "nan", "inf", "-1", "0", "1e300", "1e-300", "x", "null", "[]", "[1]", "[nan,1]", "[0.1,-1]",
    "true", "1.5", "{a:1}",
)  # fmt: skip
NUMBERS = (np.nan, np.inf, -np.inf, -1.0, 0.0, 1e30, -1e-3, 1e6, 3.0)
NAME = "motion_surface=felt_shape=tile_a=0_v=50_i=0.000_s=0.500_t=0.000"
TILE = {"tile": cuboid((0.1, 0.08, 0.013), 0.9, name="tile")}


def _possible(body: InertialParameters) -> bool:
    """Whether masses are positive and the tensors' principal moments form triangles."""
    mass, inertia = np.asarray(body.mass, float), np.asarray(body.inertia, float)
    if not all(np.isfinite(x).all() for x in (mass, inertia, np.asarray(body.com))):
        return False
    moments = np.linalg.eigvalsh(inertia)
    largest = moments[..., 2]
    triangle = moments[..., 0] + moments[..., 1] >= largest * (1.0 - 1e-4)
    return bool(
        np.all(mass > 0.0) and np.all(moments[..., 0] >= -1e-6 * largest) and triangle.all()
    )


def _file(folder: Path, name: str, content: bytes, read: Callable, mutate: Callable) -> Attempt:
    """Damages a file and reads it; what is read says itself whether it can be."""
    path = folder / name

    def attempt(rng: Generator) -> str:
        path.write_bytes(mutate(content, rng))
        return read(path)

    return attempt


def _robot(path: Path) -> str:
    robot = load_robot(path, "hand")
    if "no body has" in robot.note:
        return "status"  # the file's figures are kept, and the note says so
    known = (robot.lower, robot.upper, robot.axis, robot.armature)
    fine = all(not np.isnan(np.asarray(x)).any() for x in known)
    fine &= bool(np.all(np.asarray(robot.lower) <= np.asarray(robot.upper)))
    # links that no mass moves are merged: their mass may be zero
    links = jax.tree.map(lambda x: np.asarray(x)[np.asarray(robot.links.mass) > 0], robot.links)
    return "right" if fine and _possible(links) else "silent"


def _object(path: Path) -> str:
    density = None if path.suffix == ".urdf" else 500.0
    return "right" if _possible(import_object(path, density=density).inertial) else "silent"


def _table(path: Path) -> str:
    bodies = [obj.inertial for obj in load_mcube_objects(path).values()]
    planar = [(b.mass, b.inertia[2, 2]) for b in bodies]
    fine = all(0.0 < float(x) < np.inf for pair in planar for x in pair)
    return "right" if fine else "silent"


def _push(path: Path) -> str:
    record = load_mcube(path, TILE)
    fine = all(np.isfinite(np.asarray(leaf)).all() for leaf in jax.tree.leaves(record))
    if record.status != PushStatus.OK:
        return "status"
    work = np.sum(np.asarray(record.force) * np.asarray(record.tip_velocity))
    near = np.abs(np.asarray(record.pose)[:, :2]).max() < 5.0
    return "right" if fine and work > 0.0 and near else "silent"


def _tables() -> dict[str, np.ndarray]:
    """A tile pushed along its x axis at 50 mm/s."""
    rng = np.random.default_rng(0)
    t = np.arange(0.0, 1.4, 0.004)
    way = 0.05 * np.clip(t - 0.3, 0.0, 0.8)
    zero = np.zeros_like(t)
    force = 3.0 + 0.01 * rng.standard_normal((len(t), 2)) * [1.0, 1.0] - [0.0, 3.0]
    return {
        "object_pose": np.column_stack([1.45e9 + t, way, zero, zero]),
        "tip_pose": np.column_stack([1.45e9 + t, way - 0.05475, zero, zero]),
        "ft_wrench": np.column_stack([1.45e9 + t, -force, zero]),
    }


def _hdf5(folder: Path) -> Attempt:
    """Values swapped and rows moved inside the tables, or bytes of the file damaged."""
    buffer = io.BytesIO()
    with h5py.File(buffer, "w") as file:
        for key, table in _tables().items():
            file[key] = table
    content, path = buffer.getvalue(), folder / f"{NAME}.h5"

    def attempt(rng: Generator) -> str:
        if rng.integers(2):
            path.write_bytes(mutate_bytes(content, rng))
            return _push(path)
        tables: dict[str, Any] = _tables()
        key = list(tables)[int(rng.integers(3))]
        row, column = int(rng.integers(len(tables[key]))), int(rng.integers(4))
        match int(rng.integers(4)):
            case 0:
                tables[key][row:, column] = NUMBERS[int(rng.integers(len(NUMBERS)))]
            case 1:
                del tables[key]
            case 2:
                tables[key] = tables[key][:row]
            case _:
                tables[key] = tables[key].T if rng.integers(2) else np.array(["a"] * 9, "S1")
        with h5py.File(path, "w") as file:
            for name, table in tables.items():
                file[name] = table
        return _push(path)

    return attempt


def _json(folder: Path) -> Attempt:
    text = json.dumps({key: table.tolist() for key, table in _tables().items()}).encode()
    return _file(folder, f"{NAME}.json", text, _push, mutate_text)


def _zip(folder: Path) -> Attempt:
    """In an archive of each kind of packing."""
    text = json.dumps({key: table.tolist() for key, table in _tables().items()})
    packed = []
    for kind in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA):
        buffer = io.BytesIO()
        with zipfile.ZipFile(buffer, "w", kind) as archive:
            archive.writestr(f"{NAME}.json", text)
        packed.append(buffer.getvalue())
    path = folder / "pushes.zip"

    def attempt(rng: Generator) -> str:
        path.write_bytes(mutate_bytes(packed[int(rng.integers(4))], rng))
        return _push(path / f"{NAME}.json")

    return attempt


def _npz(folder: Path) -> Attempt:
    path = folder / "arrays.npz"
    arrays = {"a": np.arange(20.0), "b": np.ones((3, 2), np.int32), "c": np.array("text")}
    write_arrays(path, arrays)
    content = path.read_bytes()

    def attempt(rng: Generator) -> str:
        path.write_bytes(mutate_bytes(content, rng))
        with read_arrays(path, "arrays") as found:
            same = all(np.array_equal(found[name], value) for name, value in arrays.items())
        return "right" if same else "silent"

    return attempt


def _store(folder: Path) -> Attempt:
    """Any file of a store of two blocks, metadata and chunks alike."""
    small = CubesProtocol(
        mass=Range(1, 2, 2), friction=Range(0.3, 0.3, 1), edge=Range(0.1, 0.1, 1), pushes_per_cube=4
    )
    plan, n, t = cubes_plan(small, 0), 4, 10
    options = {"rate": 100.0, "block": n, "seed": 0, "provenance": {}}
    store = create_store(folder / "s.zarr", plan, {"a": 1}, **options)
    rng = np.random.default_rng(1)
    shapes = {"force": (2,), "moment": (), "pose": (3,), "twist": (3,)}
    shapes |= dict.fromkeys(("tip_position", "tip_velocity"), (2,))
    signals = {k: rng.normal(size=(n, t, *s)).astype(np.float32) for k, s in shapes.items()}
    record = PushRecord(
        time=np.tile(np.arange(1, t + 1, dtype=np.float32) / 100, (n, 1)),
        contact_point=np.zeros((n, 2), np.float32),
        contact_normal=np.zeros((n, 2), np.float32),
        length=np.full(n, t, np.int32),
        status=np.zeros(n, np.int32),
        **signals,
    )
    for block in range(store.blocks):
        write_block(store, block, record)
    files = sorted(path for path in store.path.rglob("*") if path.is_file())

    def attempt(rng: Generator) -> str:
        path = files[int(rng.integers(len(files)))]
        content = path.read_bytes()
        mutate = mutate_text if path.suffix == ".json" else mutate_bytes
        path.write_bytes(mutate(content, rng))
        try:
            found = open_store(store.path)
            blocks = [read_block(found, block) for block in range(store.blocks)]
        finally:
            path.write_bytes(content)
        same = all(np.array_equal(getattr(b, k), v) for b in blocks for k, v in signals.items())
        same &= all(map(np.array_equal, jax.tree.leaves(found.plan), jax.tree.leaves(plan)))
        return "right" if same else "silent"

    return attempt


def _simulate(_: Path) -> Attempt:
    """One argument of the middle one of three pushes, or the length of an array."""
    small = CubesProtocol(speeds=(0.05,), pushes_per_cube=1, length=0.15)
    plan = select_pushes(cubes_plan(small, 0), np.arange(3))
    plan = plan.replace(motion=plan.motion.replace(duration=np.full(3, 0.3)))
    scene = build_scene(cube(0.15, 1.0), SceneSettings())

    def attempt(rng: Generator) -> str:
        leaves, structure = jax.tree.flatten(
            (plan.parameters, plan.motion, plan.contact_point, plan.contact_normal)
        )
        chosen = int(rng.integers(len(leaves)))
        changed = np.array(leaves[chosen], float)
        if rng.integers(8) == 0:
            changed = changed[:2]
        else:
            place = int(rng.integers(changed[1].size))
            changed[1].reshape(-1)[place : place + 1] = NUMBERS[int(rng.integers(len(NUMBERS)))]
            if changed.ndim == 1:
                changed[1] = NUMBERS[int(rng.integers(len(NUMBERS)))]
        leaves[chosen] = changed
        parameters, motion, point, normal = jax.tree.unflatten(structure, leaves)
        record = simulate(scene, parameters, motion, contact_point=point, contact_normal=normal)
        signals = np.concatenate([np.asarray(record.force), np.asarray(record.pose)], 2)
        good = np.array([np.isfinite(one).all() for one in signals])
        if not good[[0, 2]].all() or record.status[[0, 2]].any():
            return "silent"
        if record.status[1] != PushStatus.OK:
            return "status"
        return "right" if good[1] else "silent"

    return attempt


def _configs(folder: Path) -> Attempt:
    """An override of the main job; what is accepted is planned."""

    def attempt(rng: Generator) -> str:
        name = OVERRIDES[int(rng.integers(len(OVERRIDES)))]
        value = VALUES[int(rng.integers(len(VALUES)))]
        path = [] if name == "dataset.path" else [f"dataset.path={folder / 's.zarr'}"]
        settings = compose([*path, f"{name}={value}"])
        leaves = jax.tree.leaves(settings.dataset.generate.plan())  # type: ignore[union-attr]
        return "right" if all(np.isfinite(leaf).all() for leaf in leaves) else "silent"

    return attempt


def _recording(path: Path) -> str:
    """The recording of the package, its description beside it."""
    description = resources.files("mjx_inertia.identify").joinpath("example.yaml")
    push = read_push(path, description=Path(str(description)))
    if int(push.record.status) != PushStatus.OK:
        return "status"
    signals = (push.record.force, push.record.pose, push.record.tip_position)
    return "right" if all(np.isfinite(x).all() for x in signals) else "silent"


def _example() -> bytes:
    return resources.files("mjx_inertia.identify").joinpath("example_push.csv").read_bytes()


def _meshes() -> dict[str, bytes]:
    box = trimesh.creation.box((0.1, 0.08, 0.05))
    return {kind: _encoded(box.export(file_type=kind)) for kind in ("obj", "stl", "ply")}


def _encoded(content: Any) -> bytes:
    return content.encode() if isinstance(content, str) else content


LOADERS: dict[str, Callable[[Path], Attempt]] = {
    "robot URDF": lambda f: _file(f, "arm.urdf", URDF, _robot, mutate_text),
    "robot MJCF": lambda f: _file(f, "arm.xml", MJCF, _robot, mutate_text),
    "object OBJ": lambda f: _file(f, "box.obj", _meshes()["obj"], _object, mutate_text),
    "object STL": lambda f: _file(f, "box.stl", _meshes()["stl"], _object, mutate_bytes),
    "object PLY": lambda f: _file(f, "box.ply", _meshes()["ply"], _object, mutate_bytes),
    "object table YAML": lambda f: _file(f, "table.yaml", TABLE, _table, mutate_text),
    "push HDF5": _hdf5,
    "push JSON": _json,
    "push in zip": _zip,
    "arrays npz": _npz,
    "store zarr": _store,
    "recording CSV": lambda f: _file(f, "push.csv", _example(), _recording, mutate_text),
    "simulate": _simulate,
    "configuration": _configs,
}
