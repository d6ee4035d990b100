"""Standard messages of ROS 2: their definitions, for files without, and the units that REP 103 gives them.

Source: the packages common_interfaces and rcl_interfaces of ROS 2; https://www.ros.org/reps/rep-0103.html
"""

from __future__ import annotations

# Fields as in .msg files, divided by semicolons.
DEFINITIONS = {
    "builtin_interfaces/Time": "int32 sec; uint32 nanosec",
    "builtin_interfaces/Duration": "int32 sec; uint32 nanosec",
    "std_msgs/Header": "builtin_interfaces/Time stamp; string frame_id",
    "std_msgs/Bool": "bool data",
    "std_msgs/Float32": "float32 data",
    "std_msgs/Float64": "float64 data",
    "std_msgs/Int32": "int32 data",
    "std_msgs/Int64": "int64 data",
    "geometry_msgs/Vector3": "float64 x; float64 y; float64 z",
    "geometry_msgs/Point": "float64 x; float64 y; float64 z",
    "geometry_msgs/Quaternion": "float64 x; float64 y; float64 z; float64 w",
    "geometry_msgs/Pose": "Point position; Quaternion orientation",
    "geometry_msgs/PoseWithCovariance": "Pose pose; float64[36] covariance",
    "geometry_msgs/Twist": "Vector3 linear; Vector3 angular",
    "geometry_msgs/TwistWithCovariance": "Twist twist; float64[36] covariance",
    "geometry_msgs/Accel": "Vector3 linear; Vector3 angular",
    "geometry_msgs/Wrench": "Vector3 force; Vector3 torque",
    "geometry_msgs/Transform": "Vector3 translation; Quaternion rotation",
    "geometry_msgs/Vector3Stamped": "std_msgs/Header header; Vector3 vector",
    "geometry_msgs/PointStamped": "std_msgs/Header header; Point point",
    "geometry_msgs/QuaternionStamped": "std_msgs/Header header; Quaternion quaternion",
    "geometry_msgs/PoseStamped": "std_msgs/Header header; Pose pose",
    "geometry_msgs/PoseWithCovarianceStamped": "std_msgs/Header header; PoseWithCovariance pose",
    "geometry_msgs/TwistStamped": "std_msgs/Header header; Twist twist",
    "geometry_msgs/TwistWithCovarianceStamped": "std_msgs/Header header; TwistWithCovariance twist",
    "geometry_msgs/AccelStamped": "std_msgs/Header header; Accel accel",
    "geometry_msgs/WrenchStamped": "std_msgs/Header header; Wrench wrench",
    "geometry_msgs/TransformStamped": "std_msgs/Header header; string child_frame_id; Transform transform",
    "sensor_msgs/Imu": "std_msgs/Header header;"
    "geometry_msgs/Quaternion orientation; float64[9] orientation_covariance;"
    "geometry_msgs/Vector3 angular_velocity; float64[9] angular_velocity_covariance;"
    "geometry_msgs/Vector3 linear_acceleration; float64[9] linear_acceleration_covariance",
    "nav_msgs/Odometry": "std_msgs/Header header; string child_frame_id;"
    "geometry_msgs/PoseWithCovariance pose; geometry_msgs/TwistWithCovariance twist",
}

UNITS = {
    ("geometry_msgs/Pose", "position"): "m",
    ("geometry_msgs/PointStamped", "point"): "m",
    ("geometry_msgs/Transform", "translation"): "m",
    ("geometry_msgs/Twist", "linear"): "m/s",
    ("geometry_msgs/Twist", "angular"): "rad/s",
    ("geometry_msgs/Accel", "linear"): "m/s^2",
    ("geometry_msgs/Accel", "angular"): "rad/s^2",
    ("geometry_msgs/Wrench", "force"): "N",
    ("geometry_msgs/Wrench", "torque"): "N m",
    ("sensor_msgs/Imu", "angular_velocity"): "rad/s",
    ("sensor_msgs/Imu", "linear_acceleration"): "m/s^2",
    ("sensor_msgs/Range", "range"): "m",
    ("sensor_msgs/FluidPressure", "fluid_pressure"): "Pa",
    ("sensor_msgs/MagneticField", "magnetic_field"): "T",
    ("sensor_msgs/NavSatFix", "latitude"): "deg",
    ("sensor_msgs/NavSatFix", "longitude"): "deg",
    ("sensor_msgs/NavSatFix", "altitude"): "m",
    ("sensor_msgs/BatteryState", "voltage"): "V",
    ("sensor_msgs/BatteryState", "current"): "A",
    ("builtin_interfaces/Time", "sec"): "s",
    ("builtin_interfaces/Duration", "sec"): "s",
}
