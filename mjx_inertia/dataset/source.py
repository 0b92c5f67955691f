"""A dataset as the rest of the pipeline sees it: pushes to iterate over, truth and splits.

In: `SimulatedSettings` or `MeasuredSettings`. Out: `Source`; simulated and real ones are alike.
Simulated pushes are written to their store block by block while they are made, by a thread of its
own so that the simulation does not wait for the disk; a run that was stopped goes on.
"""

import dataclasses
import platform
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path

import jax
import numpy as np
from tqdm import tqdm

from mjx_inertia.dataset.batch import (
    PushBatch,
    PushConditions,
    PushTruth,
    Split,
    bodies_split,
    grouped_split,
    leave_one_object_out,
    thesis_split,
)
from mjx_inertia.dataset.mcube import TIP_RADIUS, check_sampling
from mjx_inertia.dataset.mcube_folder import load_mcube_folder
from mjx_inertia.dataset.noise import SensorNoise
from mjx_inertia.dataset.plan import (
    Cubes30Protocol,
    CubesProtocol,
    PushPlan,
    cubes30_plan,
    cubes_plan,
    select_pushes,
)
from mjx_inertia.dataset.shapes_plan import ShapesProtocol, shapes_plan
from mjx_inertia.dataset.store import (
    PushStore,
    StoreError,
    create_store,
    read_batches,
    remove_leftovers,
    write_block,
)
from mjx_inertia.objects import ObjectModel, cube, friction_radius, load_mcube_objects
from mjx_inertia.pushing import PushSetup, SceneSettings, build_scene, measured_motion, simulate


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
        if not (type(self.block) is int and self.block >= 1):
            raise ValueError(f"dataset.block={self.block}: must be a whole number, at least 1")
        _shard(self.shard, 1)
        softest, step = self.protocol.tip_time_constant[0], self.scene.timestep
        if softest < 2.0 * step * (1.0 - 1e-6):
            raise ValueError(
                f"dataset.protocol.tip_time_constant={self.protocol.tip_time_constant}: expected "
                f"two time steps ({2.0 * step:g} s) or more; lower dataset.scene.max_timestep"
            )
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
    remove_leftovers(store)
    blocks = _shard(settings.shard, store.blocks)
    todo = store.missing(blocks)
    if not todo:
        return store
    made, here = store.attributes["provenance"].get("device"), provenance()["device"]
    if made != here and len(store.missing()) < store.blocks:
        raise StoreError(
            f"{settings.path}: begun on {made}, this process has {here}; signals would differ in "
            "the last digits of single precision. Go on with as many devices of this kind "
            "(devices=...), or name another folder with dataset.path=..."
        )
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


@dataclass(frozen=True)
class Source:
    """Pushes with their truth and the ways to part them."""

    name: str  # of the dataset
    # iterates over all pushes, in the order of `truth` and `conditions`
    batches: Callable[[], Iterator[PushBatch]]
    truth: PushTruth  # of all pushes
    conditions: PushConditions  # of all pushes
    splits: tuple[Split, ...]  # folds of row numbers
    # names of objects by `object_id`; empty where they have none
    object_labels: Mapping[int, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()  # what a reader of the results must know, one sentence each
    shapes: tuple[ObjectModel, ...] = ()  # known outlines that the pushes' setup refers to


@dataclass(frozen=True)
class SimulatedSettings:
    """A dataset to simulate, or to go on with, or to read."""

    name: str  # of the dataset
    generate: GenerateSettings  # the pushes and their store
    splits: tuple[str, ...] = ("thesis", "grouped")  # any of `thesis`, `grouped` and `bodies`
    grouped_share: float = 0.1  # of the objects that the last two keep for the test
    spread: float = 0.05  # of the sensor noise, three standard deviations over the value
    floor: float = 0.0  # of the sensor noise, times the floors of `SensorNoise`

    def __post_init__(self) -> None:
        """Raises ValueError for noise and splits that cannot be."""
        for name in ("spread", "floor"):
            value = getattr(self, name)
            if not 0.0 <= value < np.inf:
                raise ValueError(f"dataset.{name}={value}: expected zero or more")
        if not 0.0 < self.grouped_share < 1.0:
            raise ValueError(f"dataset.grouped_share={self.grouped_share}: expected 0 to 1")
        known = ("thesis", "grouped", "bodies")
        if not self.splits:
            raise ValueError(f"dataset.splits={self.splits}: expected some of {known}")
        if unknown := [name for name in self.splits if name not in known]:
            raise ValueError(f"dataset.splits has {unknown[0]!r}: choose from {known}")

    def split(self, name: str, truth: PushTruth, conditions: PushConditions) -> Split:
        """The split of that name.

        Raises:
          ValueError: an unknown name.
        """
        seed = self.generate.seed
        if name == "thesis":
            return thesis_split(np.asarray(truth.mass), seed)
        if name == "grouped":
            return grouped_split(np.asarray(conditions.object_id), seed, self.grouped_share)
        if name == "bodies":
            mass, size = np.asarray(truth.mass), np.asarray(conditions.size)
            return bodies_split(mass, size, seed, self.grouped_share)
        raise ValueError(f"dataset.splits has {name!r}: choose 'thesis', 'grouped' or 'bodies'")


@dataclass(frozen=True)
class MeasuredSettings:
    """Real pushes in the layout of the M-dataset."""

    name: str  # of the dataset
    root: Path  # folder that holds `mcube_raw`, or any folder of measurement files
    # YAML table of outlines and truth of other objects than the published ones
    objects: Path | None = None
    rate: float = 100.0  # samples a second, Hz
    spread: float = 0.0  # of noise added to the measured signals (0: none)

    def __post_init__(self) -> None:
        """Raises ValueError for a rate or a noise that cannot be."""
        try:
            check_sampling(self.rate, TIP_RADIUS)
        except ValueError as error:
            raise ValueError(f"dataset.{error}") from None
        if not 0.0 <= self.spread < np.inf:
            raise ValueError(f"dataset.spread={self.spread}: expected zero or more")


def simulated_source(settings: SimulatedSettings, *, progress: bool = True) -> Source | None:
    """Simulates what the store lacks; None while shards of other jobs are still missing."""
    store = generate(settings.generate, progress=progress)
    if store.missing():
        return None
    truth, conditions = store.plan.truth, store.plan.conditions
    key = jax.random.key(settings.generate.seed + 1)
    noise = SensorNoise(settings.spread, settings.floor)
    return Source(
        name=settings.name,
        batches=lambda: read_batches(store, noise=noise, key=key),
        truth=truth,
        conditions=conditions,
        splits=tuple(settings.split(name, truth, conditions) for name in settings.splits),
        shapes=(cube(0.15, 1.0),),
    )


def measured_source(settings: MeasuredSettings, *, progress: bool = True) -> Source:
    """Reads all pushes below a folder; files that cannot be read are listed in the notes."""
    objects = load_mcube_objects(settings.objects)
    folder = load_mcube_folder(settings.root, objects, settings.rate, progress=progress)
    notes = [
        f"{len(folder.files)} real pushes of {len(folder.objects)} objects below {settings.root}; "
        "unless that is the whole published M-dataset, no figure here is one of the whole."
    ]
    if folder.failures:
        listed = "; ".join(f"{f.file}: {f.reason}" for f in folder.failures[:20])
        notes.append(f"{len(folder.failures)} files could not be read: {listed}")
    if folder.duplicates:
        notes.append(f"{len(folder.duplicates)} files repeat a push that was read before.")
    batch = folder.batch
    shapes = tuple(objects[name] for name in folder.objects)
    batch = batch.replace(setup=_measured_setup(batch, shapes))
    return Source(
        name=settings.name,
        batches=lambda: iter([batch]),
        truth=batch.truth,
        conditions=batch.conditions,
        splits=(leave_one_object_out(np.asarray(batch.conditions.object_id)),),
        object_labels=dict(enumerate(folder.objects)),
        notes=tuple(notes),
        shapes=shapes,
    )


def _measured_setup(batch: PushBatch, shapes: tuple[ObjectModel, ...]) -> PushSetup:
    """What was known of real pushes: the outlines, where things stood, and the tip's own path."""
    shape = np.asarray(batch.conditions.object_id).astype(np.int32)
    radius = [friction_radius(obj.support, obj.center[:2]) for obj in shapes]
    return PushSetup(
        motion=measured_motion(batch.records),
        pose=np.asarray(batch.records.pose)[:, 0],
        half_extents=np.stack([obj.half_extents for obj in shapes])[shape],
        friction_radius=np.asarray(radius)[shape],
        shape=shape,
    )
