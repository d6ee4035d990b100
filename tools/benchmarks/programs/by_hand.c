/* Tasks a, b and c of tasks.py by hand: what the machine can do. programs/c.py has the flags. */
#include <math.h>

static const double MASS = 0.5, GRAVITY = 9.81;

static double limited(double value, double limit) {
    return value < -limit ? -limit : value > limit ? limit : value;
}

static double nested(double rate, double angle, double speed, double place) {
    double part = limited(rate + 3 * angle + 3 * speed / GRAVITY + place / GRAVITY, 0.19);
    part = limited(rate + 2 * angle + speed / GRAVITY + part, 0.4);
    part = limited(rate + angle + part, 0.9);
    return -limited(rate + part, 2);
}

static void law(const double *s, double *u) {
    u[0] = (-2 * s[8] - 2 * (s[2] - 1) + MASS * GRAVITY) / (cos(s[4]) * cos(s[5]));
    u[1] = -4 * s[9] - 4 * s[3];
    u[2] = nested(s[10], s[4], -s[6], -s[0]);
    u[3] = nested(s[11], s[5], s[7], s[1]);
}

static void slopes(const double *s, const double *u, double *rates) {
    double pull = u[0] / MASS, level = pull * cos(s[4]);
    for (int i = 0; i < 6; i++) rates[i] = s[6 + i];
    rates[6] = -pull * sin(s[4]);
    rates[7] = level * sin(s[5]);
    rates[8] = level * cos(s[5]) - GRAVITY;
    for (int i = 0; i < 3; i++) rates[9 + i] = u[1 + i];
}

/* s: 12 states, which end where the loop ends. */
void hybrid(double *s, long steps, long substeps, double h) {
    double u[4], t[12], k1[12], k2[12], k3[12], k4[12];
    for (long k = 0; k < steps; k++) {
        if (k % substeps == 0) law(s, u);
        slopes(s, u, k1);
        for (int i = 0; i < 12; i++) t[i] = s[i] + 0.5 * h * k1[i];
        slopes(t, u, k2);
        for (int i = 0; i < 12; i++) t[i] = s[i] + 0.5 * h * k2[i];
        slopes(t, u, k3);
        for (int i = 0; i < 12; i++) t[i] = s[i] + h * k3[i];
        slopes(t, u, k4);
        for (int i = 0; i < 12; i++) s[i] += h / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]);
    }
}

void discrete(double *s, long steps, double h) {
    double u[4], held[4] = {0}, rates[12];
    for (long k = 0; k < steps; k++) {
        law(s, u);
        slopes(s, held, rates);
        for (int i = 0; i < 12; i++) s[i] += h * rates[i];
        for (int i = 0; i < 4; i++) held[i] = u[i];
    }
}

/* delays: one value for each gain and the delay behind it. */
void chain(double *delays, long count, long steps, double factor) {
    for (long k = 0; k < steps; k++) {
        double value = 1;
        for (long i = 0; i < count; i++) {
            double late = delays[i];
            delays[i] = value * factor;
            value = late;
        }
    }
}
