"""`mjx.step` with derivatives that hold through contact, for any scene with elliptic cones.

    from mjx_inertia.pushing import differentiable_step
    jax.jacfwd(lambda mass: rollout(model.replace(...mass...), data))(mass)

The stages are MJX's own but the constraint solve, whose derivative follows from its optimality
condition (`contact_solver.py`). Contacts of condim 3, 4 and 6 (MJX itself refuses 1 with elliptic
cones), equalities and joint limits; forward and reverse mode, `scan`, `vmap`, float64 and float32.
It knows nothing of pushes.

The motion has a kink at the instant of a first contact, and where a contact changes from sticking
to sliding. There the derivative is one-sided (docs/gradients.md has a table of where it can be
trusted). A parameter of the model that MuJoCo
compiles into others (mass into `body_invweight0`, say) must be changed in all of them.
"""

from typing import cast

import mujoco

from mjx_inertia.pushing.contact_solver import solve
from mjx_inertia.pushing.quiet_mjx import mjx

_INTEGRATORS = {
    int(mujoco.mjtIntegrator.mjINT_EULER): mjx.euler,
    int(mujoco.mjtIntegrator.mjINT_IMPLICITFAST): mjx.implicit,
}


def differentiable_step(
    model: mjx.Model, data: mjx.Data, iterations: int = 100, line_search: int = 30
) -> mjx.Data:
    """Advances a scene by one time step, like `mjx.step` with a converged solver.

    Args:
      model: with `cone="elliptic"` and the integrator Euler or implicitfast.
      data: its state.
      iterations: Newton steps of the constraint solver at most; they end when it has converged.
      line_search: evaluations along each at most.

    Raises:
      ValueError: for another cone or integrator, or for friction loss in joints or tendons.
    """
    integrator = int(model.opt.integrator)
    if integrator not in _INTEGRATORS:
        raise ValueError(f"integrator {integrator}: choose Euler or implicitfast")
    data = mjx.sensor_pos(model, mjx.fwd_position(model, data))
    data = mjx.sensor_vel(model, mjx.fwd_velocity(model, data))
    data = mjx.fwd_acceleration(model, mjx.fwd_actuation(model, data))
    if data._impl.efc_J.size == 0:
        data = data.replace(qacc=data.qacc_smooth)
    else:
        data = solve(model, data, data.qfrc_smooth, iterations=iterations, line_search=line_search)
        data = mjx.sensor_acc(model, data)
    return cast(mjx.Data, _INTEGRATORS[integrator](model, data))
