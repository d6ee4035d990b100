"""Words of other programs for things that quadvis calls otherwise: "sample_time" for rate.

A word is looked up without case, blanks, `-` and `_`; its meaning depends on the words that are allowed
there.
"""

from __future__ import annotations

import re
from collections.abc import Collection

_MEANT = {
    # keys of diagrams and parts
    "quadvis": "version formatversion schemaversion",
    "name": "title model modelname",
    "doc": "description comment comments help about note notes summary",
    "base": "extends inherits inherit parent template derivedfrom",
    "without": "remove removes delete drop exclude disable",
    "params": "parameters parameter constants variables workspace vars with",
    "rates": "sampletimes clocks tasks periods frequencies rate",
    "solver": "integrator solvers",
    "stop_time": "stoptime duration tstop tend tfinal endtime simulationtime simtime stop end",
    "seed": "randomseed rngseed",
    "variants": "configurations configs alternatives variantsubsystems modes",
    "log": "logging record recording tofile toworkspace datalogging logs",
    "expect": "expectations asserts assertions assert tests checks requirements criteria",
    "summary": "statistics stats metrics results",
    "figures": "plots plot scopes scope figure graphs charts",
    "analyse": "analyze analysis linearise linearize",
    "blocks": "components nodes systems subsystems elements",
    "ports": "interface io terminals",
    # keys of blocks and wires
    "block": "type kind class blocktype blockname sourceblock",
    "part": "subsystem model include import file referencedmodel modelreference system",
    "rate": "freq frequency sampletime sampleperiod samplingtime samplerate period ts fs dt hz clock task",
    "with": "params parameters parameter param args arguments settings values set options config",
    "in": "inputs input inport inports connections connect wires wire lines from signals inp",
    "out": "outputs output outport outports",
    "slot": "variant replaceable",
    "when": "enable enabled enableif if enableport",
    "triggered": "trigger triggerport on",
    "reset": "resetport resettable",
    "from": "source src signal wire origin",
    "across": "crossing transition ratetransition via mode sampling",
    # solver, rates, values
    "method": "solver type algorithm name",
    "rtol": "reltol relativetolerance relerr tolerance",
    "atol": "abstol absolutetolerance abserr",
    "step": "dt stepsize fixedstep fixedstepsize timestep h ts",
    "offset": "phase delay start",
    "bias": "offset dcoffset",
    "unit": "units",
    "value": "val values number",
    # expectations, summaries, figures
    "signal": "name port of output variable",
    "signals": "signal lines names y",
    "within": "tolerance tol abs absolute maxabs error band",
    "below": "max maximum upper less lessthan atmost le lt under",
    "above": "min minimum lower greater greaterthan atleast ge gt over",
    "rms": "rmse std",
    "count": "times number",
    "after": "start begin since tstart t0",
    "before": "end until till tend",
    "of": "target reference setpoint ref around desired",
    "show": "statistics stats values",
    "title": "name caption heading",
    "panels": "axes subplots plots",
    "every": "decimation decimate downsample",
    "cuts": "cut openings loops",
    "limits": "ranges vary",
    "max": "maximum peak maxabs",
    "mean": "average avg",
    "lowest": "min minimum",
    "highest": "maximum",
    "final": "last end",
    # blocks of the library
    "signal.concatenate": "mux vectorconcatenate stack join vector",
    "signal.select": "selector index demux element",
    "signal.sum": "add subtract adder summer",
    "signal.saturation": "saturate limiter clip clamp",
    "signal.dead_zone": "deadband",
    "signal.backlash": "play",
    "signal.relay": "hysteresis schmitt schmitttrigger bangbang",
    "signal.quantizer": "quantize quantiser quantization quantisation",
    "signal.friction": "coulombfriction coulombandviscousfriction",
    "plant.sliding_mass": "stickslip stiction massonbelt masswithfriction masswithstopandfriction",
    "signal.lookup_1d": "lookup lookuptable 1dlookuptable lookuptable1d interpolate interp1",
    "signal.lookup_2d": "2dlookuptable lookuptable2d interp2",
    "signal.unit_delay": "memory onestepdelay",
    "signal.delay": "samplesdelay delaysamples zn",
    "signal.transport_delay": "deadtime timedelay puredelay",
    "signal.derivative": "discretederivative differentiator differentiate",
    "signal.rate_limiter": "slewrate slewratelimiter",
    "signal.discrete_integrator": "discretetimeintegrator",
    "signal.trapezoidal_integrator": "tustinintegrator trapezoidal",
    "math.product": "multiply divide mult prod",
    "math.dot": "dotproduct innerproduct",
    "math.cross": "crossproduct",
    "math.matrix_gain": "matrixmultiply matrixmultiplication statefeedback",
    "math.expression": "fcn matlabfunction matlabfcn interpretedmatlabfunction formula equation",
    "math.function": "mathfunction trigonometricfunction roundingfunction trigonometry sin cos tan asin acos "
    "atan sinh cosh tanh exp log log10 abs sign signum square sqrt reciprocal floor ceil round fix",
    "math.atan2": "arctan2",
    "math.power": "pow",
    "math.min_max": "minmax minimum maximum min max extremum",
    "math.modulo": "mod rem remainder fmod",
    "math.convert": "datatypeconversion conversion cast typecast",
    "logic.state_machine": "stateflow chart statechart fsm finitestatemachine statetransitiontable",
    "logic.compare": "relationaloperator relational comparison comparetoconstant comparetozero",
    "logic.gate": "logicaloperator logical and or not xor nand nor",
    "logic.switch": "ifelse selectsignal",
    "logic.multiport_switch": "multiportswitch indexvector multiplexer",
    "logic.edge": "edgedetector detectchange detectrisepositive detectrisenonnegative risingedge",
    "logic.latch": "flipflop srflipflop",
    "logic.counter": "counterlimited counterfreerunning count",
    "logic.on_delay": "ton timer timeron debounce",
    "sources.sine": "sinewave",
    "sources.pulse": "pulsegenerator squarewave",
    "sources.noise": "randomnumber whitenoise bandlimitedwhitenoise gaussiannoise",
    "sources.table": "fromworkspace waveform piecewise",
    "sources.repeating_sequence": "repeatingsequencestair repeatingtable",
    "sources.clock": "time digitalclock",
    "sources.chirp": "chirpsignal sweep",
    "sources.prbs": "pseudorandombinarysequence",
    "sources.uniform_noise": "uniformrandomnumber random",
    "systems.pid": "pidcontroller discretepidcontroller pi pd pidcontroller2dof pid2 antiwindup windup",
    "systems.state_space": "ss ltiss discretestatespace statespacemodel",
    "systems.zero_pole_gain": "zeropole zpk discretezeropole polezero",
    "systems.butterworth": "butter analogfilterdesign lowpassfilter highpassfilter bandpassfilter",
    "systems.biquad": "sos biquadfilter secondordersection notch iir",
    "systems.fir": "firfilter discretefirfilter dfir",
    "systems.moving_average": "movingmean runningmean runningaverage movavg",
    "systems.lqr": "dlqr lq linearquadraticregulator statefeedbackcontroller fullstatefeedback",
    "systems.kalman": "kalmanfilter observer luenberger luenbergerobserver stateestimator estimator lqe dlqe",
    "systems.statistics": "rms runningrms movingrms peakdetector variance",
    "systems.spectrum": "fft spectrumanalyzer spectrumanalyser fourier goertzel dft",
    "rotation.representation": "quaternion dcm euler eulerangles rpy tr2rpy rpy2tr directioncosinematrix "
    "quaterniontorotationangles quaternionstorotationangles rotationanglestoquaternion "
    "rotationanglestodirectioncosinematrix directioncosinematrixtorotationangles "
    "directioncosinematrixtoquaternions quaternionstodirectioncosinematrix",
    "rotation.rotate": "quaternionrotation rotatevector transformvector",
    "rotation.normalise": "normalize quaternionnormalize unitvector normalizevector",
    "rotation.quaternion_product": "quaternionmultiplication quaternionmultiply quatmultiply",
    "rotation.attitude_from_rates": "attitudeintegrator quaternionintegrator",
    "plant.rigid_body": "6dof sixdof rigidbody 6dofquaternion 6dofeulerangles multirotor",
    "plant.bicycle": "car vehicle ackermann bicyclemodel kinematicbicycle",
    "systems.transfer_function": "transferfcn transferfunction tf ltisiso discretetransferfcn discretefilter "
    "leadlag leadcompensator lagcompensator",
}  # fmt: skip
_STANDS_FOR: dict[str, list[str]] = {}
for _ours, _theirs in _MEANT.items():
    for _word in _theirs.split():
        _STANDS_FOR.setdefault(_word, []).append(_ours)


def synonym(word: str, candidates: Collection[str]) -> str | None:
    """Return the candidate for which other programs use this word, or None."""
    plain = plain_word(word.rpartition(".")[2])
    return next((ours for ours in _STANDS_FOR.get(plain, ()) if ours in candidates), None)


def foreign_words(ours: str) -> list[str]:
    """Return the plain words of other programs for one of ours."""
    return _MEANT.get(ours, "").split()


def foreign_names() -> dict[str, list[str]]:
    """Return the plain words of other programs for each of ours that has any."""
    return {ours: foreign_words(ours) for ours in _MEANT}


def plain_word(word: str) -> str:
    """Return a word as it is looked up."""
    return re.sub(r"[-_ ]", "", word).casefold()
