"""A dataset as the rest of the pipeline sees it: pushes to iterate over, truth and splits.

In: `SimulatedSettings` or `MeasuredSettings`. Out: `Source`; simulated and real ones are alike.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import jax
import numpy as np

from mjx_inertia.dataset.batch import PushBatch, PushConditions, PushTruth
from mjx_inertia.dataset.generate import GenerateSettings, generate
from mjx_inertia.dataset.mcube_folder import load_mcube_folder
from mjx_inertia.dataset.splits import (
    Split,
    bodies_split,
    grouped_split,
    leave_one_object_out,
    thesis_split,
)
from mjx_inertia.dataset.store import read_batches
from mjx_inertia.objects import load_mcube_objects


@dataclass(frozen=True)
class Source:
    """Pushes with their truth and the ways to part them.

    Attributes:
      name: of the dataset.
      batches: iterates over all pushes, in the order of `truth` and `conditions`.
      truth: of all pushes.
      conditions: of all pushes.
      splits: folds of row numbers.
      object_labels: names of objects by `object_id`; empty where they have none.
      notes: what a reader of the results must know, one sentence each.
    """

    name: str
    batches: Callable[[], Iterator[PushBatch]]
    truth: PushTruth
    conditions: PushConditions
    splits: tuple[Split, ...]
    object_labels: Mapping[int, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class SimulatedSettings:
    """A dataset to simulate, or to go on with, or to read.

    Attributes:
      name: of the dataset.
      generate: the pushes and their store.
      splits: any of `thesis`, `grouped` and `bodies`.
      grouped_share: of the objects that the last two keep for the test.
      spread: of the sensor noise, three standard deviations over the value.
    """

    name: str
    generate: GenerateSettings
    splits: tuple[str, ...] = ("thesis", "grouped")
    grouped_share: float = 0.1
    spread: float = 0.05

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
    """Real pushes in the layout of the M-dataset.

    Attributes:
      name: of the dataset.
      root: folder that holds `mcube_raw`, or any folder of measurement files.
      objects: YAML table of outlines and truth of other objects than the published ones.
      rate: samples a second, Hz.
      spread: of noise added to the measured signals (0: none).
    """

    name: str
    root: Path
    objects: Path | None = None
    rate: float = 100.0
    spread: float = 0.0


def simulated_source(settings: SimulatedSettings, *, progress: bool = True) -> Source | None:
    """Simulates what the store lacks; None while shards of other jobs are still missing."""
    store = generate(settings.generate, progress=progress)
    if store.missing():
        return None
    truth, conditions = store.plan.truth, store.plan.conditions
    key = jax.random.key(settings.generate.seed + 1)
    return Source(
        name=settings.name,
        batches=lambda: read_batches(store, spread=settings.spread, key=key),
        truth=truth,
        conditions=conditions,
        splits=tuple(settings.split(name, truth, conditions) for name in settings.splits),
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
    return Source(
        name=settings.name,
        batches=lambda: iter([batch]),
        truth=batch.truth,
        conditions=batch.conditions,
        splits=(leave_one_object_out(np.asarray(batch.conditions.object_id)),),
        object_labels=dict(enumerate(folder.objects)),
        notes=tuple(notes),
    )
