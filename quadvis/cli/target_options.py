"""The options of the commands that talk to a target."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any

from quadvis.cli import target_commands as commands
from quadvis.cli.arguments import Parser
from quadvis.cli.bridge import add_bridge
from quadvis.cli.tool import waiting_time

Add = Callable[..., Parser]


def add_target_commands(add: Add, diagram_settings: Callable[[Parser], None], engine: Any) -> None:
    """Add the commands; the other arguments add what they share with those that run a diagram."""
    _target_options(add("target", commands.target, "be a target: hold applications, fly them, answer hosts"))
    load = add("load", commands.load, "load a diagram into a target, or an application that it keeps")
    load.add_argument("what", metavar="FILE|NAME", help="a diagram, or the name of an application")
    load.add_argument("--variant", metavar="V", help="one of the diagram's variants")
    load.add_argument("--stop-time", metavar="T", help="such as '20 s'; replaces the diagram's")
    load.add_argument("--name", metavar="NAME", help="of the application; default: that of the diagram")
    words = "one that the target is; may be repeated; default: all of them"
    load.add_argument("--computer", action="append", default=[], metavar="NAME", help=words)
    diagram_settings(load)
    engine(load)
    start = add("start", commands.start, "start the application of a target")
    stop = add("stop", commands.stop, "stop it: safe values, log closed; it stays loaded")
    unload = add("unload", commands.unload, "remove the application from a target's memory")
    status = add("status", commands.status, "print the properties of a target")
    status.add_argument("--json", action="store_true", help="print one JSON object")
    get = add("get", commands.get, "print parameters and signals of a target")
    get.add_argument("names", nargs="*", metavar="NAME", help="default: all parameters that can be tuned")
    get.add_argument("--json", action="store_true", help="print one JSON object")
    given = add("set", commands.set_parameters, "give parameters new values, all at one tick")
    given.add_argument(
        "values", nargs="+", metavar="NAME=VALUE", help="such as control.bandwidth='2.5 rad/s'"
    )
    scope = add("scope", commands.scope, "show signals of a target over time")
    _scope_options(scope)
    log = add("log", commands.log, "copy a log of a target to here")
    log.add_argument("name", nargs="?", metavar="NAME", help="default: the newest")
    log.add_argument("--list", action="store_true", help="list the logs instead")
    log.add_argument("--output", "-o", metavar="PATH", help="default: NAME.mcap")
    sets = add("sets", commands.sets, "keep, show, compare and use parameter sets of the application")
    actions = ("list", "save", "load", "show", "compare", "delete", "default", "export", "import")
    sets.add_argument("action", choices=actions, nargs="?", default="list")
    sets.add_argument("names", nargs="*", metavar="NAME", help="names of sets")
    profile = add("profile", commands.profile, "time the tasks and blocks of a target's application")
    profile.add_argument("action", choices=("start", "stop", "show"), nargs="?", default="show")
    words = "start it, stop it after so many seconds, and show what it has found"
    profile.add_argument("--seconds", type=float, metavar="S", help=words)
    words = "with show or --seconds: write a trace for Perfetto or chrome://tracing there"
    profile.add_argument("--output", "-o", metavar="PATH.json", help=words)
    web = add("web", commands.web, "serve the live page of a target to browsers on this machine")
    words = "where; default 22280, 0 for any free one"
    web.add_argument("--port", type=int, default=22280, metavar="N", help=words)
    web.add_argument("--no-browser", action="store_true", help="print the address, and open no browser")
    bridge = add_bridge(add)
    console = add("console", commands.console, "read such commands line by line")
    talking = (load, start, stop, unload, status, get, given, scope, log, sets, profile, web, bridge, console)
    for each in talking:
        words = "a target by its name or address; default: one on this machine, which is started if needed"
        each.add_argument("--target", metavar="NAME", help=words)


def _target_options(parser: Parser) -> None:
    parser.add_argument("--name", metavar="NAME", default="local", help="of the target; default: local")
    words = "address, or address:port, at which hosts with keys may come; default: this machine's user alone"
    parser.add_argument("--listen", metavar="ADDRESS", help=words)
    words = "where applications, sets and logs are kept; default: in the user's data folder"
    parser.add_argument("--folder", metavar="FOLDER", help=words)
    parser.add_argument("--startup", metavar="APP", help="load and start this application at once")
    words = "end when nothing is loaded and nobody has asked for anything for so long (s)"
    parser.add_argument("--until-idle", metavar="S", type=waiting_time, help=words)
    words = "write a systemd unit that starts the target at boot, with these options"
    parser.add_argument("action", nargs="?", choices=("install",), metavar="install", help=words)
    words = "with install: the processors that the target may use"
    parser.add_argument("--cpu", metavar="N[,N]", help=words)
    words = "with install: where to write the unit; default: the system's folder; '-' prints it"
    parser.add_argument("--output", "-o", metavar="PATH", help=words)


def _scope_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("signals", nargs="+", metavar="SIGNAL", help="such as craft.position, or craft.x[2]")
    parser.add_argument("--live", action="store_true", help="go on until Ctrl-C")
    parser.add_argument("--samples", type=int, default=500, metavar="N", help="default 500")
    parser.add_argument("--decimation", type=int, default=1, metavar="N", help="take one sample of N")
    words = "begin there, such as 'rising eyes.lost'; falling and either are the other words"
    parser.add_argument("--trigger", metavar="'SLOPE SIGNAL'", help=words)
    parser.add_argument("--level", type=float, default=0.5, metavar="X", help="of the trigger; default 0.5")
    parser.add_argument("--pre", type=int, default=0, metavar="N", help="samples before the trigger")
    parser.add_argument("--timeout", type=waiting_time, default=60.0, metavar="S", help="default 60 s")
    parser.add_argument("--output", "-o", metavar="PATH", help="write a table, .csv, or a picture, .png")
