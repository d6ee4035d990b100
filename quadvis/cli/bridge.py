"""The command `quadvis bridge`."""

from __future__ import annotations

import argparse
from typing import Any

from quadvis.cli.arguments import Parser
from quadvis.errors import QuadvisError

FOXGLOVE, PLOTJUGGLER = ENDS = ("foxglove", "plotjuggler")
HERE = "127.0.0.1"
FOXGLOVE_PORT, PLOTJUGGLER_PORT = 8765, 9870  # what the two programs suggest
DEFAULTS: dict[str, dict[str, Any]] = {
    FOXGLOVE: {"listen": HERE, "port": FOXGLOVE_PORT, "tune": False},
    PLOTJUGGLER: {"to": f"{HERE}:{PLOTJUGGLER_PORT}", "encoding": "json"},
}

BRIDGE_HELP = f"""\
examples:
  quadvis bridge foxglove                      # then 'Open connection' there: ws://localhost:{FOXGLOVE_PORT}
  quadvis bridge foxglove --target lab1 --signals 'craft.*,eyes.centres'
  quadvis bridge plotjuggler                   # 'UDP Server' there listens at port {PLOTJUGGLER_PORT}

The bridge goes on until Ctrl-C, whatever is loaded, started or stopped meanwhile. It needs level 2 of the
target, with --tune level 0. A stamp is the instant at which the run began, by the clock of the target, and
the time of the tick since then.
Foxglove: channels as in a log, one for each block, of which only those come that somebody looks at; a pose
for each block with a position and angles, as PoseInFrame and on /tf, with X along x, Y to the left, Z up;
pictures; the parameters that can be tuned.
PlotJuggler: datagrams of at most 1400 bytes with the key timestamp (s)."""


def add_bridge(add: Any) -> Parser:
    """Add the command; return its parser."""
    parser: Parser = add("bridge", bridge, "show what a target flies in Foxglove or PlotJuggler", BRIDGE_HELP)
    parser.add_argument("end", choices=ENDS)
    words = "these signals, divided by commas, or patterns such as 'craft.*'; may be repeated; default: all"
    parser.add_argument("--signals", metavar="A,B", action="append", default=[], help=words)
    words = "foxglove: the address at which it is served; default: this machine alone, without any key"
    parser.add_argument("--listen", metavar="ADDRESS", help=words)
    words = f"foxglove: the port; default {FOXGLOVE_PORT}, 0 for any free one"
    parser.add_argument("--port", type=int, metavar="N", help=words)
    words = "foxglove: let its users change parameters"
    parser.add_argument("--tune", action="store_true", default=None, help=words)
    words = f"plotjuggler: where datagrams go; default {DEFAULTS[PLOTJUGGLER]['to']}"
    parser.add_argument("--to", metavar="ADDRESS:PORT", help=words)
    words = "plotjuggler: how they are written; default json"
    parser.add_argument("--encoding", choices=("json", "messagepack"), help=words)
    return parser


def bridge(options: argparse.Namespace) -> int:
    """Be a bridge until Ctrl-C."""
    from quadvis.bridge.serving import send_to_plotjuggler, serve_foxglove
    from quadvis.graph.names import split_names
    from quadvis.host.target import Target
    from quadvis.wire.address import read_address

    chosen = _chosen(options)
    names = [name for text in options.signals for name in split_names(text) if name]
    with Target(options.target) as tg:
        if options.end == FOXGLOVE:
            serve_foxglove(tg, names, chosen["listen"], chosen["port"], chosen["tune"], _say)
        else:
            send_to_plotjuggler(tg, names, read_address(chosen["to"]), chosen["encoding"], _say)
    return 0


def _chosen(options: argparse.Namespace) -> dict[str, Any]:
    """Return the options of an end, or their defaults; QuadvisError for one of the other end."""
    for end, defaults in DEFAULTS.items():
        for name in defaults:
            if end != options.end and getattr(options, name) is not None:
                raise QuadvisError(f"'{options.end}' takes no --{name}; leave it out")
    given = {name: getattr(options, name) for name in DEFAULTS[options.end]}
    return DEFAULTS[options.end] | {name: value for name, value in given.items() if value is not None}


def _say(words: str) -> None:
    print(words, flush=True)
