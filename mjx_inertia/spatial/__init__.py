"""Rigid-body facts without objects or simulation, and the conventions of the whole library.

SI units. A frame is in the name: `T_new_old` maps coordinates in `old` to coordinates in `new`.
Quaternions are wxyz. Twists and wrenches are (linear, angular): a twist is the velocity of the
frame's origin (m/s) and the angular velocity (rad/s), a wrench the force (N) and the moment about
the frame's origin (N m), both in the axes of the frame. Functions are written for one body.
"""

from mjx_inertia.spatial.arrays import AnyArray as AnyArray
from mjx_inertia.spatial.consistency import (
    Consistency as Consistency,
    check_consistency as check_consistency,
    explain_consistency as explain_consistency,
)
from mjx_inertia.spatial.float64 import (
    change_frame_float64 as change_frame_float64,
    combine_float64 as combine_float64,
    inertial_float64 as inertial_float64,
)
from mjx_inertia.spatial.inertia import (
    InertialParameters as InertialParameters,
    change_frame as change_frame,
    combine as combine,
)
from mjx_inertia.spatial.planar import (
    PlanarInertia as PlanarInertia,
    planar_cross as planar_cross,
    planar_rotate as planar_rotate,
    to_planar as to_planar,
)
from mjx_inertia.spatial.pose import Pose as Pose
from mjx_inertia.spatial.representations import (
    from_log_cholesky as from_log_cholesky,
    from_pseudo_inertia as from_pseudo_inertia,
    from_ten_vector as from_ten_vector,
    inertia_from_second_moment as inertia_from_second_moment,
    second_moment_from_inertia as second_moment_from_inertia,
    to_log_cholesky as to_log_cholesky,
    to_pseudo_inertia as to_pseudo_inertia,
    to_ten_vector as to_ten_vector,
)
