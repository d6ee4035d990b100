"""The models of the tests: of the kinds of the Reference FMUs, and some that show one thing each."""

from __future__ import annotations

from .builder import Model, Var

OUT, IN, PAR = "output", "input", "parameter"
EXACT = "exact"


def state(name: str, start: float, **more: str) -> Var:
    return Var(name, causality=OUT, start=start, initial=EXACT, depends=(), **more)  # type: ignore[arg-type]


DAHLQUIST = Model(
    "Dahlquist",
    [
        state("x", 1.0),
        Var("der(x)", derivative="x", depends=("x",)),
        Var("k", causality=PAR, variability="fixed", start=1.0),
    ],
    update="v_der_x = -v_k * v_x;",
    step="model_update(m); v_x += h * v_der_x;",
)
VAN_DER_POL = Model(
    "VanDerPol",
    [
        state("x0", 2.0),
        Var("der(x0)", derivative="x0", depends=("x1",)),
        state("x1", 0.0),
        Var("der(x1)", derivative="x1", depends=("x0", "x1")),
        Var("mu", causality=PAR, variability="fixed", start=1.0),
    ],
    update="v_der_x0 = v_x1; v_der_x1 = v_mu * (1.0 - v_x0 * v_x0) * v_x1 - v_x0;",
    step="model_update(m); double a = v_der_x0, b = v_der_x1; v_x0 += h * a; v_x1 += h * b;",
)
BALL = Model(
    "BouncingBall",
    [
        state("h", 1.0, unit="m"),
        Var("der(h)", derivative="h", depends=("v",), unit="m/s"),
        state("v", 0.0, unit="m/s"),
        Var("der(v)", derivative="v", depends=("g",), unit="m/s2"),
        Var("g", causality=PAR, variability="fixed", start=-9.81, unit="m/s2"),
        Var("e", causality=PAR, variability="tunable", start=0.7, more={"min": "0.5", "max": "1"}),
    ],
    update="v_der_h = v_v; v_der_v = v_g;",
    step="""int n = (int)(h / 1e-3 + 0.5); for (int k = 0; k < n; k++) {
        v_h += 1e-3 * v_v; v_v += 1e-3 * v_g;
        if (v_h <= 0.0 && v_v < 0.0) {
            v_h = 0.0; v_v = -v_e * v_v;
            if (v_v < 0.1) { v_v = 0.0; v_g = 0.0; } } }""",
    root='numberOfEventIndicators="1"',
    units='<Unit name="m"><BaseUnit m="1"/></Unit><Unit name="m/s"><BaseUnit m="1" s="-1"/></Unit>'
    '<Unit name="m/s2"><BaseUnit m="1" s="-2"/></Unit>',
)
STAIR = Model(
    "Stair",
    [Var("counter", "Int32", OUT, start=1, initial=EXACT, variability="discrete")],
    step="if (TIME + h >= v_counter - 1e-9) v_counter += 1;",
    interfaces=("CoSimulation",),
)
RESOURCE = Model(
    "Resource",
    [Var("y", "Int32", OUT, variability="discrete")],
    start="""char path[2 * ROOM]; resource(m, "y.txt", path); FILE *file = fopen(path, "r");
        if (!file) { say(m, 3, "no resource", 0.0); return 1; } v_y = fgetc(file); fclose(file);""",
    resources={"y.txt": b"a"},
    interfaces=("CoSimulation",),
)
FEEDTHROUGH2 = Model(
    "Feedthrough",
    [
        Var("u", causality=IN, start=0.0), Var("y", causality=OUT, depends=("u",)),
        Var("n_in", "Int32", IN, start=0), Var("n_out", "Int32", OUT, depends=("n_in",)),
        Var("b_in", "Boolean", IN, start=False), Var("b_out", "Boolean", OUT, depends=("b_in",)),
        Var("text", "String", PAR, start="none", variability="fixed"), Var("length", "Int32", OUT),
        Var("gain", causality=PAR, variability="tunable", start=1.0),
        *(Var(f"v[{k}]", causality=IN, start=float(k)) for k in (1, 2, 3)),
        *(Var(f"w[{k}]", causality=OUT) for k in (1, 2, 3)),
    ],
    update="""v_y = v_gain * v_u; v_n_out = v_n_in; v_b_out = v_b_in; v_length = strlen(v_text);
        v_w_1 = v_v_1; v_w_2 = v_v_2; v_w_3 = v_v_3;""",
    interfaces=("CoSimulation",),
)  # fmt: skip
WHOLE = ("Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64")
LIMITS = {
    f"{sign}Int{bits}": (0, 2**bits - 1) if sign else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    for sign in ("", "U")
    for bits in (8, 16, 32, 64)
}
FEEDTHROUGH3 = Model(
    "Feedthrough",
    [
        Var("u", causality=IN, start=0.0), Var("y", causality=OUT, depends=("u",)),
        Var("f_in", "Float32", IN, start=0.0), Var("f_out", "Float32", OUT),
        *(Var(f"{kind}_in", kind, IN, start=0) for kind in WHOLE),
        *(Var(f"{kind}_out", kind, OUT) for kind in WHOLE),
        Var("b_in", "Boolean", IN, start=False), Var("b_out", "Boolean", OUT),
        Var("text", "String", PAR, start="none", variability="fixed"), Var("length", "Int32", OUT),
        Var("gain", causality=PAR, variability="tunable", start=1.0),
        Var("v", causality=IN, start=[1.0, 2.0, 3.0], size=3), Var("w", causality=OUT, size=3),
    ],
    update=f"""v_y = v_gain * v_u; v_f_out = v_f_in; v_b_out = v_b_in; v_length = strlen(v_text);
        {" ".join(f"v_{kind}_out = v_{kind}_in;" for kind in WHOLE)}
        for (int k = 0; k < 3; k++) v_w[k] = v_v[k];""",
    interfaces=("CoSimulation",),
)  # fmt: skip
CLOCKS = Model(
    "Clocks",
    [Var("tick", "Clock", IN, more={"intervalVariability": "constant", "intervalDecimal": "1.0"})],
    interfaces=("ScheduledExecution",),
)
INTEGRATOR = Model(  # of what it is fed, whatever the step: D32
    "Integrator",
    [Var("u", causality=IN, start=0.0), state("x", 0.0), Var("der(x)", derivative="x", depends=("u",))],
    update="v_der_x = v_u;",
    step="v_x += h * v_u;",
)
EXACT_TIME = Model(  # refuses a step that does not begin at the nearest double of k/7: D35
    "ExactTime",
    [Var("time_seen", causality=OUT), Var("late", causality=OUT)],
    step="HIDDEN(0) += 1.0; v_time_seen = TIME; double end = HIDDEN(0) / 7.0;"
    'if (TIME != (HIDDEN(0) - 1.0) / 7.0) { say(m, 3, "not exact", TIME); return 3; } (void)end;',
    near="1e-12",
    interfaces=("CoSimulation",),
)
UNITS = Model(
    "Units",
    [
        Var("T", causality=IN, start=20.0, unit="degC"),
        Var("dT", causality=IN, start=1.0, unit="degC", more={"relativeQuantity": "true"}),
        Var("omega", causality=IN, start=0.0, unit="deg/s"),
        Var("T_out", causality=OUT, unit="degC"),
        Var("dT_out", causality=OUT, unit="degC", more={"relativeQuantity": "true"}),
        Var("omega_out", causality=OUT, unit="deg/s"),
        Var("T_raw", causality=OUT),
        Var("dT_raw", causality=OUT),
        Var("omega_raw", causality=OUT),
        Var(
            "limit",
            causality=PAR,
            variability="fixed",
            start=100.0,
            unit="degC",
            more={"min": "0", "max": "200"},
        ),
    ],
    update="v_T_out = v_T_raw = v_T; v_dT_out = v_dT_raw = v_dT; v_omega_out = v_omega_raw = v_omega;",
    units='<Unit name="degC"><BaseUnit K="1" offset="273.15"/></Unit>'
    '<Unit name="deg/s"><BaseUnit s="-1" rad="1" factor="0.017453292519943295"/>'
    '<DisplayUnit name="rpm" factor="6"/></Unit>',
    interfaces=("CoSimulation",),
)
