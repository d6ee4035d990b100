"""The verbs, each declared once: the server checks them, the client offers them, the page describes them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from quadvis.errors import quoted, sentence, suggestion
from quadvis.wire import argument
from quadvis.wire.argument import REQUIRED, Argument
from quadvis.wire.levels import may
from quadvis.wire.limits import PIECE, SUBSCRIPTIONS
from quadvis.wire.refusals import BadError, RefusedError, UnknownError

CONTROL, STREAM = "control", "stream"
LEASED = CHANGES = True


@dataclass(frozen=True)
class Verb:
    """What a host can ask for; ``level`` is the highest one of a key that may.

    ``leased`` says that it needs the operator's lease, ``changes`` that it is written to the audit file.
    """

    name: str
    level: int
    doc: str
    reply: str
    arguments: tuple[Argument, ...] = ()
    leased: bool = False
    changes: bool = False
    socket: str = CONTROL


@dataclass(frozen=True)
class Topic:
    """A kind of stream data; a name that ends in '/' stands for one topic a number."""

    name: str
    level: int
    doc: str


_NAME = argument.text()
_SET_NAME = argument.text(
    64, "[A-Za-z0-9][A-Za-z0-9_.-]*", "a name of at most 64 letters, digits, '_', '.' and '-'"
)
_TOPIC = argument.text(40, "[a-z]+(/[0-9]{1,4})?", "a topic such as 'state' or 'scope/1'")
_ID = argument.whole(1, 9999)
_COUNT = argument.whole(0, 2**53)
_TIME = argument.number(0, math.inf, "a time of at least 0 s, which may be infinite")
_SAMPLES = argument.number(1, math.inf, "a number of at least 1, which may be infinite")
_INSTANT = argument.whole(0, 2**62)
_SHIFT = argument.whole(-(10**10), 10**10)
_PERIOD = argument.number(1e-6, 1e6, "a time from 1e-6 to 1e6 s")

_TOKEN = Argument("token", argument.text(32, "[0-9a-f]{32}", "the token of the lease"), "what 'lease' gave")
_FIRST = Argument("first", _COUNT, "the first of them, from 0", 0)
_SET = Argument("name", _SET_NAME, "the name of the set")
_VALUES = Argument("values", argument.map_of(argument.SETTING, 1000), "new values by name")
_NAMES = Argument("names", argument.list_of(_NAME, 1000, 0), "their names; all if there are none")
_IDS = Argument("ids", argument.list_of(_ID, 100), "numbers of scopes")
_ID_OF_SCOPE = Argument("id", _ID, "the number of the scope")
_TOPICS = Argument("topics", argument.list_of(_TOPIC, SUBSCRIPTIONS), "the topics")
_KIND_OF_SCOPE = argument.text(16, "host|target|file", "'host', 'target' or 'file'")
_FILE = Argument("file", argument.DIGEST, "the SHA-256 of the whole file")


def _some(most: int) -> Argument:
    return Argument("count", argument.whole(1, most), "how many at most", most)


# Who may do what, seen from above: level 0 all; 1 start, stop and logs; 2 parameters seen, scopes added;
# 3 signals and scopes; 4 the status.
_DECLARED = (
    Verb("hello", 4, "say who is there",
         "a map: target, version, key, level, stream (the port or the path of the second socket)"),
    Verb("status", 4, "the state of the target",
         "a map; 'operator' is the name of who has the lease, or nil; 'wire' has the counts of the wire"),
    Verb("lease", 1, "become the operator, if there is none",
         "a map: token, renew_s, lost_s", changes=True),
    Verb("renew", 1, "stay the operator", "a map: lost_s", (_TOKEN,)),
    Verb("release", 1, "be the operator no more", "nil", (_TOKEN,), changes=True),
    Verb("applications", 3, "what can be loaded", "a list of maps"),
    Verb("load", 0, "load an application, stopped", "a map of facts about it",
         (Argument("application", _NAME, "its name, or the SHA-256 of its bundle"),), LEASED, CHANGES),
    Verb("unload", 0, "remove the application", "nil", (), LEASED, CHANGES),
    Verb("start", 1, "start the application", "the name of the log",
         (Argument("at", argument.or_none(_INSTANT), "when, on the target's monotonic clock (ns)", None),),
         LEASED, CHANGES),
    Verb("clock", 3, "read the target's monotonic clock", "nanoseconds"),
    Verb("align", 0, "move the ticks of the run, slowly, to where they are due by the host's clock", "nil",
         (Argument("shift", _SHIFT, "by how much in all since the start (ns)"),), LEASED),
    Verb("stop", 1, "stop the application, which stays loaded", "nil", (), LEASED, CHANGES),
    Verb("startprofiler", 1, "take the times of tasks and blocks from now on", "nil", (), LEASED, CHANGES),
    Verb("stopprofiler", 1, "take no more times; what was found stays", "nil", (), LEASED, CHANGES),
    Verb("getprofilerdata", 3, "what the profiler has found in the newest run",
         "a map: on, tick (s), tasks, blocks; of a task a list of tick, lateness, execution time (ns), "
         "overruns; of a computer a list of a method's place, begin, time taken (ns)",
         (Argument("task", argument.or_none(_COUNT), "the place of the task whose steps are wanted", None),
          Argument("computer", argument.or_none(_COUNT), "that of the computer whose calls are wanted", None),
          _FIRST, _some(10_000))),
    Verb("signals", 3, "the signals of the application", "a list of maps", (_FIRST, _some(4000))),
    Verb("getsignal", 3, "present values of signals", "a map of name to value", (_NAMES,)),
    Verb("watch", 3, "have the newest numbers of signals published as they come, for whoever subscribes",
         "a map: topic, set (its mark, which comes with the numbers), sizes (how many of each signal)",
         (Argument("names", argument.list_of(_NAME, 1000), "their names"),)),
    Verb("parameters", 2, "the parameters of the application", "a list of maps", (_FIRST, _some(4000))),
    Verb("getparam", 2, "present values of parameters", "a map of name to value", (_NAMES,)),
    Verb("setparam", 0, "tune parameters, all between the same two ticks, or none", "nil, with the tick",
         (_VALUES,), LEASED, CHANGES),
    Verb("settime", 0, "replace the stop time or the sample time of the application", "nil",
         (Argument("StopTime", argument.or_none(_TIME), "the stop time (s)", None),
          Argument("SampleTime", argument.or_none(_PERIOD), "the period of the base rate (s)", None)),
         LEASED, CHANGES),
    Verb("setlog", 0, "bound the log of a run", "nil",
         (Argument("MaxLogSamples", _SAMPLES,
                   "how many samples of the fastest task it has at least, of a long run the newest"),),
         LEASED, CHANGES),
    Verb("addscope", 2, "add a scope", "its number",
         (Argument("id", argument.or_none(_ID), "its number; else the first free one", None),
          Argument("type", _KIND_OF_SCOPE, "where its data goes", "host")), changes=True),
    Verb("remscope", 2, "remove scopes", "nil", (_IDS,), changes=True),
    Verb("setscope", 3, "set signals and properties of a scope", "a map of all properties",
         (_ID_OF_SCOPE, _VALUES), changes=True),
    Verb("startscope", 3, "let scopes acquire", "nil", (_IDS,), changes=True),
    Verb("stopscope", 3, "interrupt scopes", "nil", (_IDS,), changes=True),
    Verb("trigger", 3, "trigger scopes by software", "nil", (_IDS,), changes=True),
    Verb("setview", 3, "show one target scope alone on the target's own terminal", "nil",
         (Argument("id", argument.or_none(_ID), "its number; nil for all of them"),), changes=True),
    Verb("scopes", 3, "all scopes with their properties", "a list of maps"),
    Verb("getscope", 3, "the newest whole acquisition of a scope", "a map with the samples",
         (_ID_OF_SCOPE, _FIRST, _some(10_000))),
    Verb("saveparamset", 0, "keep the present parameters as a set", "nil", (_SET,), LEASED, CHANGES),
    Verb("loadparamset", 0, "tune all parameters of a set", "nil, with the tick", (_SET,), LEASED, CHANGES),
    Verb("putparamset", 0, "keep values as a set", "the name of the set", (_SET, _VALUES), LEASED, CHANGES),
    Verb("listparamsets", 2, "the sets of this application", "a list of names"),
    Verb("getparamset", 2, "the values of a set", "a map of name to value", (_SET,)),
    Verb("deleteparamset", 0, "remove a set", "nil", (_SET,), LEASED, CHANGES),
    Verb("setdefaultparamset", 0, "let an application have a set whenever it is loaded", "nil",
         (Argument("name", argument.or_none(_SET_NAME), "the name of the set; nil for none"),
          Argument("application", argument.or_none(_NAME), "its name; nil for the one that is loaded", None)),
         LEASED, CHANGES),
    Verb("logs", 1, "the logs on the target", "a list of maps: name, size, changed (when, s since 1970)"),
    Verb("getlog", 1, "a piece of a log", "a map: data, size (of the whole log)",
         (Argument("name", _NAME, "the name of the log"),
          Argument("offset", _COUNT, "where the piece begins, from 0", 0), _some(PIECE))),
    Verb("have", 0, "which of these files are missing on the target", "a list of SHA-256",
         (Argument("files", argument.list_of(argument.DIGEST, 1000), "SHA-256 of files"),)),
    Verb("put", 0, "give a piece of a file, which is kept when it is whole and its SHA-256 right",
         "how many bytes of it are there",
         (_FILE, Argument("size", _COUNT, "bytes of the whole file"),
          Argument("offset", _COUNT, "where the piece begins, from 0"),
          Argument("data", argument.BYTES, "the piece")), changes=True),
    Verb("drawing", 3, "the diagram of the application as SVG", "a text"),
    Verb("pictures", 3, "the signals that are pictures", "a list of names"),
    Verb("picture", 3, "the newest picture of a signal that is one",
         "a map: format, data, width, height, sequence, time (of its tick, s), stamp (of its exposure, s), "
         "began (the instant of tick 0, ns since 1970)",
         (Argument("signal", _NAME, "its name"),)),
    Verb("subscribe", 4, "receive the data of topics", "a list of all topics subscribed to",
         (_TOPICS,), socket=STREAM),
    Verb("unsubscribe", 4, "receive the data of topics no more", "a list of all topics subscribed to",
         (_TOPICS,), socket=STREAM),
)  # fmt: skip

VERBS: Mapping[str, Verb] = {verb.name: verb for verb in _DECLARED}

TOPICS = (
    Topic("state", 4, "the status, when it changes and at least once a second"),
    Topic("event", 4, "what happened: started, stopped, overloaded, lease lost"),
    Topic(
        "values/",
        3,
        "the newest numbers of the signals of a 'watch' as an array, when there are new ones; `set` is its "
        "mark, `without` has the places of signals that have no numbers yet",
    ),
    Topic(
        "scope/",
        3,
        "packages of samples of a scope, by its number: rows of a time (s) and the values of `names`; "
        "`began` is the instant of tick 0 (ns since 1970)",
    ),
)


def find_verb(name: str, socket: str) -> Verb:
    """Return a verb of a socket; UnknownError if there is none."""
    verb = VERBS.get(name)
    if verb is None:
        raise UnknownError(sentence(f"there is no verb {quoted(name)}", suggestion(name, VERBS)))
    if verb.socket != socket:
        raise UnknownError(
            f"the verb '{name}' belongs to the {verb.socket} socket, not to the {socket} socket"
        )
    return verb


def check_level(verb: Verb, level: int) -> None:
    """Raise RefusedError if a key of this level may not use a verb."""
    if level > verb.level:
        raise RefusedError(f"this key {may(level)}; '{verb.name}' needs {_at_most(verb.level)}")


def _at_most(level: int) -> str:
    return f"level {level} or lower" if level else "level 0"


def check_topic(name: str, level: int) -> None:
    """Raise UnknownError if there is no such topic, RefusedError if a key of this level may not see it."""
    head, slash, _ = name.partition("/")
    topic = next((topic for topic in TOPICS if topic.name == head + slash), None)
    if topic is None:
        raise UnknownError(f"there is no topic {quoted(name)}")
    if level > topic.level:
        raise RefusedError(f"this key {may(level)}; the stream '{name}' needs {_at_most(topic.level)}")


def checked(verb: Verb, given: Mapping[str, Any]) -> dict[str, Any]:
    """Return all arguments of a verb, defaults included; BadError says which one is wrong."""
    known = {each.name: each for each in verb.arguments}
    for name in given:
        if name not in known:
            remedy = suggestion(name, known)
            raise BadError(sentence(f"'{verb.name}' has no argument {quoted(name)}", remedy))
    found = {}
    for name, each in known.items():
        if name in given:
            each.check(given[name])
        elif each.default is REQUIRED:
            raise BadError(f"'{verb.name}' lacks its argument '{name}': {each.doc}")
        found[name] = given.get(name, each.default)
    return found
