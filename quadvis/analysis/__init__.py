"""Analysis of a diagram's closed loop: linearised, lifted over one hyperperiod, its poles and margins."""
