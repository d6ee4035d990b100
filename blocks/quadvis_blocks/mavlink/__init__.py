"""Autopilots that speak MAVLink 2: what they say, what is asked of them, set-points, and a model of one."""
