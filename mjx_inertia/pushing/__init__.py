"""The MJX experiment: an object on a table, pushed by a tip."""

from mjx_inertia.pushing.record import PushRecord, PushStatus

__all__ = ["PushRecord", "PushStatus"]
