"""What an autopilot gives and takes: the ports of the device and of its model."""

from __future__ import annotations

from quadvis.block import In, Out


class AutopilotPorts:
    """The ports of every block that is an autopilot, or stands for one."""

    arm = In("bool", default=False, doc="whether the autopilot should be armed; it acts when this changes")
    valid = Out("bool", doc="whether there is an attitude, no older than ``max_age``")
    roll = Out(unit="rad", nan=True, doc="right side down")
    pitch = Out(unit="rad", nan=True, doc="nose up")
    yaw = Out(unit="rad", nan=True, doc="clockwise from north, from above")
    rates = Out("float64[3]", unit="rad/s", nan=True, doc="about roll, pitch and yaw axis")
    imu_age = Out(unit="s", nan=True, doc="time since gyro and specific force came")
    gyro = Out("float64[3]", unit="rad/s", nan=True, doc="about roll, pitch and yaw axis")
    specific_force = Out(
        "float64[3]", unit="m/s^2", nan=True, doc="acceleration without gravity: forward, right, down"
    )
    position_age = Out(unit="s", nan=True, doc="time since position and velocity came")
    position = Out("float64[3]", unit="m", nan=True, doc="north, east, and height above the origin")
    velocity = Out("float64[3]", unit="m/s", nan=True, doc="rate of change of the position")
    heartbeat_age = Out(unit="s", nan=True, doc="time since mode and armed came")
    mode = Out("int64", doc="the autopilot's own number of its mode; 0 before the first heartbeat")
    armed = Out("bool", doc="whether its motors may turn")
    arming = Out(
        "int64",
        doc="0: nothing is asked; 1: its time-outs are read; 2: its mode is asked for; 3: it is asked to arm "
        "or disarm; 4: it is armed as asked; 5: it has not done so, and is not asked again",
    )
    timeout = Out(unit="s", nan=True, doc="the longest of the time-outs that were read; NaN before")
    system = Out("int64", doc="number of its system; 0 as long as it is not known")
    requests = Out("int64", doc="how often rates of messages were asked for")
    foreign = Out("int64", doc="messages of others, which touch no signal")
    unknown = Out("int64", doc="whole messages with numbers that the dialect has not")
    differs = Out("int64", doc="whole messages whose definition is not the dialect's")
    rejected = Out("int64", doc="whole messages whose signature is missing, wrong or old")
