"""Whether a push may be used, judged from its signals alone.

In: a batch of records. Out: a `PushStatus` and the usable length of each.
"""

import numpy as np
from jaxtyping import Int

from mjx_inertia.pushing.record import PushRecord, PushStatus

LOST_AFTER = 0.1  # s without any force after which contact counts as lost
STILL = 0.003  # m; an object that moved less did not move
FAR = 5.0  # m; nothing on a table gets there
EXCESSIVE_FORCE = 1e4  # N


def _valid(record: PushRecord) -> np.ndarray:
    return np.arange(record.time.shape[1]) < np.asarray(record.length)[:, None]


def _release(record: PushRecord, rate: float) -> np.ndarray:
    """Sample at which contact ends for good (the planned length where it does not), (n,)."""
    length = np.asarray(record.length)
    touching = (np.abs(np.asarray(record.force)).sum(-1) > 0) & _valid(record)
    t = touching.shape[1]
    last = t - 1 - np.argmax(touching[:, ::-1], axis=1)
    lost = touching.any(1) & (length - 1 - last > LOST_AFTER * rate)
    return np.where(lost, last + 1, length)


def push_length(record: PushRecord, rate: float) -> Int[np.ndarray, " n"]:
    """Samples up to the end of the push or of the contact, whichever comes first."""
    return _release(record, rate).astype(np.int32)


def push_status(record: PushRecord, rate: float) -> Int[np.ndarray, " n"]:
    """Status of each simulated push; the gravest one where several apply."""
    valid = _valid(record)
    pose, force = np.asarray(record.pose), np.asarray(record.force)
    with np.errstate(invalid="ignore", over="ignore"):
        sane = np.isfinite(pose).all(-1) & np.isfinite(force).all(-1)
        sane &= (np.abs(pose[..., :2]) < FAR).all(-1) & (np.abs(force) < EXCESSIVE_FORCE).all(-1)
        squared = np.square(pose[..., :2] - pose[:, :1, :2]).sum(-1)
        moved = np.sqrt(np.where(valid, squared, 0.0).max(1))
    status = np.full(len(pose), int(PushStatus.OK), np.int32)
    status[_release(record, rate) < np.asarray(record.length)] = PushStatus.LOST_CONTACT
    status[moved < STILL] = PushStatus.NEVER_MOVED
    status[~(sane | ~valid).all(1)] = PushStatus.DIVERGED
    return status
