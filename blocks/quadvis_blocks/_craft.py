"""The craft of the paper: what plant, laws and estimators take for granted unless a diagram says otherwise.

Mass and arm are the Draganfly IV's of the paper; it does not give the rest, which is of a craft of that size.
"""

from __future__ import annotations

MASS = 0.5  # kg
ARM = 0.24  # m, l: from the centre to each rotor
INERTIA = (5e-3, 5e-3, 9e-3)  # kg m^2, about roll, pitch and yaw axis
TORQUE_RATIO = 0.016  # m, c: a rotor's drag torque over its thrust
MOTOR_LAG = 0.08  # s
THRUST_MAX = 2.0  # N, of a rotor
RADIO_DELAY = 0.022  # s, of a radio frame
GRAVITY = 9.81  # m/s^2
