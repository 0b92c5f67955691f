"""MJX without the notice that its import prints where Warp is not installed.

Out: `mjx`. Every module of the package that needs MJX takes it from here.
"""

import contextlib
import io

with contextlib.redirect_stdout(io.StringIO()):
    from mujoco import mjx

__all__ = ["mjx"]
