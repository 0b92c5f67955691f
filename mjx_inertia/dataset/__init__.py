"""Which pushes to run, pushes on disk, sensor noise, splits and real pushes from files."""

from mjx_inertia.dataset.batch import PushBatch, PushConditions, PushTruth

__all__ = ["PushBatch", "PushConditions", "PushTruth"]
