"""What is unknown of a measured push, the noise of its signals, and the errors of the model.

Every prior is a normal law; a standard deviation of 0 holds a parameter at its centre.
"""

from dataclasses import dataclass

# The first five are the body's, shared by all of its pushes; the others are of each push.
UNKNOWNS = (
    "mass",  # logarithm, kg
    "inertia",  # logarithm of I_zz over that of uniform density
    "com_x",  # from the prior's CoM, m, object frame
    "com_y",
    "friction_radius",  # logarithm of c over that of uniform pressure
    "friction_force",  # logarithm, N
    "bias_x",  # of the force, N, world axes
    "bias_y",
    "shift",  # of the contact point along the face, to the left of the inward normal, m
)
SHARED = 5


@dataclass(frozen=True)
class ForceDrivenSettings:
    """Priors, noise, disturbances and choice of samples."""

    # standard deviations of the priors
    log_mass: float = 1.0  # about the mass that Newton's law finds roughly
    log_inertia: float = 0.0  # I_zz about uniform density; 0: held
    com: float = 0.0  # m, each axis; 0: the CoM is known
    # of c: support on the rim gives 1.4 times that of uniform pressure, on a middle point none
    log_friction_radius: float = 0.3
    log_friction_force: float = 0.7
    bias: float = 0.1  # N
    shift: float = 5e-4  # m; frames of tracker and robot are about 1 mm apart
    # white noise: of the force (N, at 250 samples a second, and a share of it), of the pose
    force_noise: float = 0.1
    relative_force_noise: float = 0.05
    position_noise: float = 4e-5  # m
    yaw_noise: float = 5e-4  # rad
    # disturbances, Gauss-Markov processes in the path slid
    friction_field: float = 0.15  # share of the friction force
    lateral_field: float = 0.10  # of the friction force, across the direction of sliding
    moment_field: float = 0.10  # of f c
    correlation_length: float = 0.010  # m
    # choice of samples
    creep: float = 1e-3  # speed that stands for sticking, m/s
    least_force: float = 0.3  # N; below it the tip does not touch
    tip_share: float = 0.9  # of its steady speed below which the tip slows down
    stop_before: float = 0.012  # s before the tip slows down
    memory: float = 0.1  # s beyond which prediction errors are not correlated
    iterations: int = 25  # of Gauss-Newton, at most

    def __post_init__(self) -> None:
        """Refuses what cannot be meant."""
        positive = ("log_mass", "log_friction_force", "position_noise", "yaw_noise")
        positive += ("correlation_length", "creep", "memory", "force_noise", "iterations")
        for name in positive:
            if not getattr(self, name) > 0:
                raise ValueError(f"{name}={getattr(self, name)} is not positive")
        others = ("log_inertia", "com", "log_friction_radius", "bias", "shift", "stop_before")
        others += ("relative_force_noise", "friction_field", "lateral_field", "moment_field")
        for name in (*others, "least_force"):
            if not getattr(self, name) >= 0:
                raise ValueError(f"{name}={getattr(self, name)} is negative")
        if not 0 < self.tip_share < 1:
            raise ValueError(f"tip_share={self.tip_share} is not between 0 and 1")

    @property
    def deviations(self) -> tuple[float, ...]:
        """Standard deviations of the priors, in the order of `UNKNOWNS`."""
        body = (self.log_mass, self.log_inertia, self.com, self.com, self.log_friction_radius)
        return (*body, self.log_friction_force, self.bias, self.bias, self.shift)
