"""Linear systems, controllers and estimators for every plant: filters, PID, LQR, Kalman, statistics."""
