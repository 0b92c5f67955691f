"""Measurement files with known content, written by the tests."""

import io
import json
from pathlib import Path

import h5py
import numpy as np

from mjx_inertia.objects import ObjectModel, cuboid

TIP_RADIUS = 0.00475
NAME = "motion_surface=felt_shape=tile_a=0_v=50_i=0.000_s=0.500_t=0.000"
OBJECTS: dict[str, ObjectModel] = {"tile": cuboid((0.1, 0.08, 0.013), 0.9, name="tile")}


class Push:
    """A tile pushed at constant speed and turning at a constant rate, the tip fixed to it.

    The tip touches the tile's side at x = -0.05 of its frame at height 0.01 and moves with it. The
    tile starts at yaw 3.0 and passes π, where a tracker wraps. Absolute time is that of a real
    recording. `rest` seconds stand before and after the motion.
    """

    start = np.array([0.3, -0.1, 3.0])
    twist = np.array([-0.05, 0.02, 0.4])
    reaction = np.array([3.0, -1.0])  # on the pusher, growing with time by 1 N/s along x
    rest = 0.3
    moving = 0.8
    zero = 1.45e9

    def pose(self, t):
        elapsed = np.clip(t - self.rest, 0.0, self.moving)
        return self.start + elapsed[:, None] * self.twist

    def tip(self, t):
        pose = self.pose(t)
        return pose[:, :2] + turned(pose[:, 2], np.array([-0.05 - TIP_RADIUS, 0.01]))

    def wrench(self, t):
        force = self.reaction + np.stack([t, 0.0 * t], axis=-1)
        rng = np.random.default_rng(0)  # a live sensor
        return np.column_stack([force + 1e-6 * rng.standard_normal(force.shape), 7.0 + 0.0 * t])

    def tables(self) -> dict[str, np.ndarray]:
        """Three streams, not synchronised, one row out of order and one repeated stamp."""
        end = 2 * self.rest + self.moving
        streams = {}
        for key, (first, step) in {
            "object_pose": (0.002, 0.0041),
            "tip_pose": (0.0, 0.0039),
            "ft_wrench": (0.007, 0.004),
        }.items():
            t = np.arange(first, end, step)
            if key == "object_pose":
                value = self.pose(t)
                value[:, 2] = (value[:, 2] + np.pi) % (2 * np.pi) - np.pi
            elif key == "tip_pose":
                value = np.column_stack([self.tip(t), 0.0 * t])
            else:
                value = self.wrench(t)
            table = np.column_stack([self.zero + t, value])
            table = np.insert(table, 50, table[49] + [0, 9, 9, 9], axis=0)  # repeated stamp: drop
            table[[120, 121]] = table[[121, 120]]
            streams[key] = table
        return streams


def turned(yaw, p_obj):
    cos, sin = np.cos(yaw), np.sin(yaw)
    return np.stack([cos * p_obj[0] - sin * p_obj[1], sin * p_obj[0] + cos * p_obj[1]], axis=-1)


def h5_bytes(tables) -> bytes:
    buffer = io.BytesIO()
    with h5py.File(buffer, "w") as file:
        for key, table in tables.items():
            file[key] = table
    return buffer.getvalue()


def write_h5(folder: Path, tables, name: str = NAME) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}.h5"
    path.write_bytes(h5_bytes(tables))
    return path


def write_json(folder: Path, tables, name: str = NAME) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}.json"
    path.write_text(json.dumps({key: np.asarray(table).tolist() for key, table in tables.items()}))
    return path
