"""The controller of task a."""

from __future__ import annotations

from benchmarks.tasks import law
from quadvis.block import Block, In, Out


class Law(Block):
    """Thrust and torques: equations (17) to (23) of the paper."""

    x, y, z = In(), In(), In()
    psi, theta, phi = In(), In(), In()
    vx, vy, vz = In(), In(), In()
    wpsi, wtheta, wphi = In(), In(), In()
    thrust, yaw, pitch, roll = Out(doc="N"), Out(doc="rad/s^2"), Out(doc="rad/s^2"), Out(doc="rad/s^2")

    def output(
        self,
        x: float, y: float, z: float, psi: float, theta: float, phi: float,
        vx: float, vy: float, vz: float, wpsi: float, wtheta: float, wphi: float,
    ) -> tuple[float, float, float, float]:  # fmt: skip
        """Return thrust and torques."""
        return law((x, y, z, psi, theta, phi, vx, vy, vz, wpsi, wtheta, wphi))
