"""The craft of the paper: the defaults of plant, control laws and estimators.

Mass and arm are those of the Draganfly IV in the paper. The paper does not give the other values; they are
typical of a craft of that size.
"""

from __future__ import annotations

MASS = 0.5  # kg
ARM = 0.24  # m, l: from the centre to each rotor
INERTIA = (5e-3, 5e-3, 9e-3)  # kg m^2, about roll, pitch and yaw axis
TORQUE_RATIO = 0.016  # m, c: drag torque of a rotor divided by its thrust
MOTOR_LAG = 0.08  # s
THRUST_MAX = 2.0  # N, of a rotor
RADIO_DELAY = 0.022  # s, of a radio frame
DRAG = 0.1  # N s/m, force of the air divided by the speed against it
GRAVITY = 9.81  # m/s^2
