"""Fills a store with simulated pushes, all of them or one shard, going on where it was stopped.

In: a `GenerateSettings`. Out: a `PushStore`. Written while running, one block at a time, by a
thread of its own so that the simulation does not wait for the disk.
"""

import dataclasses
import platform
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path

import jax
from tqdm import tqdm

from mjx_inertia.dataset.plan import (
    Cubes30Protocol,
    CubesProtocol,
    PushPlan,
    cubes30_plan,
    cubes_plan,
    select_pushes,
)
from mjx_inertia.dataset.shapes_plan import ShapesProtocol, shapes_plan
from mjx_inertia.dataset.store import PushStore, create_store, write_block
from mjx_inertia.objects import cube
from mjx_inertia.pushing import SceneSettings, build_scene, simulate


@dataclass(frozen=True)
class GenerateSettings:
    """Which pushes to simulate, and where they go."""

    path: Path  # of the store
    protocol: CubesProtocol | Cubes30Protocol | ShapesProtocol  # the pushes
    scene: SceneSettings = field(default_factory=SceneSettings)  # table, rate and time step
    seed: int = 0  # of everything drawn
    block: int = 600  # pushes simulated and stored at once; more suits a GPU
    shard: str = "0/1"  # "i/n": do the i-th of n parts of the blocks ("0/1": all)

    def __post_init__(self) -> None:
        """Raises ValueError for settings that contradict each other."""
        if self.block < 1:
            raise ValueError(f"dataset.block={self.block}: must be at least 1")
        if isinstance(self.protocol, ShapesProtocol) and self.scene.table != "limit_surface":
            raise ValueError(
                f"dataset.scene.table={self.scene.table!r}: objects of many shapes share one scene "
                "on the table 'limit_surface' only"
            )
        radii = self.protocol.tip_radius, self.scene.tip_radius
        if radii[0] != radii[1]:
            raise ValueError(
                f"dataset.protocol.tip_radius={radii[0]} and dataset.scene.tip_radius={radii[1]}: "
                "one places the tip and the other makes it; set both"
            )

    def config(self) -> dict:
        """What decides the signals."""
        return {
            "protocol": type(self.protocol).__name__,
            **dataclasses.asdict(self.protocol),
            "scene": dataclasses.asdict(self.scene),
        }

    def plan(self) -> PushPlan:
        """The pushes."""
        if isinstance(self.protocol, CubesProtocol):
            return cubes_plan(self.protocol, self.seed)
        if isinstance(self.protocol, ShapesProtocol):
            return shapes_plan(self.protocol, self.seed, self.scene.tip_height)
        return cubes30_plan(self.protocol, self.seed)


def provenance() -> dict[str, str]:
    """Versions and device of this run."""
    packages = ("mjx_inertia", "mujoco", "mujoco-mjx", "jax", "jaxlib", "numpy", "xgboost-cpu")
    device = jax.devices()[0]
    return {
        **{name: version(name) for name in packages},
        "python": platform.python_version(),
        "device": f"{len(jax.devices())} x {device.device_kind}",
    }


def _shard(text: str, blocks: int) -> range:
    try:
        index, count = (int(part) for part in text.split("/"))
    except ValueError:
        index, count = 0, 0
    if not 0 <= index < count:
        raise ValueError(f"dataset.shard={text!r}: expected i/n with 0 <= i < n, such as 0/2")
    return range(index * blocks // count, (index + 1) * blocks // count)


def generate(settings: GenerateSettings, *, progress: bool = True) -> PushStore:
    """Simulates the pushes that a store lacks.

    Args:
      settings: which pushes, and where they go.
      progress: show a bar with the time left.

    Returns:
      The store; complete if all shards have been done.

    Raises:
      StoreError: see `create_store` and `write_block`; what is stored stays stored.
      ValueError: settings that make no sense.
    """
    store = create_store(
        settings.path,
        settings.plan(),
        settings.config(),
        rate=settings.scene.rate,
        block=settings.block,
        seed=settings.seed,
        provenance=provenance(),
    )
    blocks = _shard(settings.shard, store.blocks)
    todo = store.missing(blocks)
    if not todo:
        return store
    scene = build_scene(cube(0.15, 1.0), settings.scene)
    pushes = sum(len(store.rows(b)) for b in blocks)
    done = pushes - sum(len(store.rows(b)) for b in todo)
    bar = tqdm(total=pushes, initial=done, unit="push", desc="simulate", disable=not progress)
    writing: Future | None = None
    with bar, ThreadPoolExecutor(1) as writer:
        for block in todo:
            part = select_pushes(store.plan, store.rows(block))
            record = simulate(
                scene,
                part.parameters,
                part.motion,
                contact_point=part.contact_point,
                contact_normal=part.contact_normal,
            )
            if writing:
                writing.result()
            writing = writer.submit(write_block, store, block, record)
            bar.update(len(part))
        if writing:
            writing.result()
    return store
