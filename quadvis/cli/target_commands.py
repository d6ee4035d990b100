"""The commands that talk to a target: xPC's verbs, as in `quadvis.Target`. Each returns the exit code."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from quadvis.cli.given import FAILED
from quadvis.cli.shown import print_json
from quadvis.errors import QuadvisError, closest, quoted

if TYPE_CHECKING:
    from quadvis.host.profiler import ProfilerData
    from quadvis.host.target import Target


def target(options: argparse.Namespace) -> int:
    """Be a target until SIGTERM or Ctrl-C; or write the systemd unit of one."""
    if options.action == "install":
        return _install(options)
    from quadvis.target.daemon import serve

    serve(options.name, listen=options.listen, folder=options.folder, startup=options.startup,
          idle=options.until_idle, say=lambda words: print(words, file=sys.stderr, flush=True),
          screen=sys.stdout)  # fmt: skip
    return 0


def _install(options: argparse.Namespace) -> int:
    from quadvis.target.unit import unit_text, write_unit

    if options.until_idle is not None:
        raise QuadvisError("--until-idle is for a target that is started by hand; with install, leave it out")
    text = unit_text(
        options.name, listen=options.listen, folder=options.folder, startup=options.startup, cpu=options.cpu
    )
    if options.output == "-":
        print(text, end="")
    else:
        print(write_unit(text, options.name, options.output))
    return 0


def load(options: argparse.Namespace) -> int:
    """Load a diagram, or an application that the target keeps."""
    with _target(options) as tg:
        what = options.what
        if what.endswith((".yaml", ".yml")):
            from quadvis.cli.given import own_blocks
            from quadvis.diagram.load import load as load_diagram

            diagram = load_diagram(
                what, variant=options.variant, settings=options.set, params=options.params,
                stop_time=options.stop_time, own_blocks=own_blocks(options),
            )  # fmt: skip
            tg.load(diagram, engine=options.engine, name=options.name, computers=options.computer)
        else:
            tg.load(
                what, variant=options.variant, settings=options.set, params=options.params,
                stop_time=options.stop_time, name=options.name, computers=options.computer,
            )  # fmt: skip
        print(f"{tg.name}: {tg.Application} is loaded, {tg.Status}")
    return 0


def start(options: argparse.Namespace) -> int:
    """Start the application."""
    with _target(options) as tg:
        tg.start()
        print(f"{tg.name}: {tg.Application} runs")
    return 0


def stop(options: argparse.Namespace) -> int:
    """Stop the application; 1 if its run had come to an early end."""
    with _target(options) as tg:
        tg.stop()
        found = tg.status()
        print(f"{tg.name}: {found['Application']} is stopped at {found['ExecTime']:.9g} s")
        return _outcome(found)


def unload(options: argparse.Namespace) -> int:
    """Remove the application that is loaded."""
    with _target(options) as tg:
        tg.unload()
    return 0


def status(options: argparse.Namespace) -> int:
    """Print the properties of a target."""
    with _target(options) as tg:
        if options.json:
            print_json(_finite(tg.status()))
        else:
            print(tg)
    return 0


def get(options: argparse.Namespace) -> int:
    """Print values of parameters and signals."""
    with _target(options) as tg:
        if not options.names:
            found = tg.getparam()
        else:
            parameters = {each["name"] for each in tg.parameters()}
            found = {name: _value(tg, name, parameters) for name in options.names}
        if options.json:
            print_json(found)
        else:
            for name, value in found.items():
                print(f"{name}: {_text(value)}")
    return 0


def set_parameters(options: argparse.Namespace) -> int:
    """Give parameters values, all at one tick."""
    values = {}
    for text in options.values:
        name, equals, value = text.partition("=")
        if not equals:
            raise QuadvisError(f"{quoted(text)} gives no value; write NAME=VALUE")
        name = name.strip()
        if not name or not value.strip():
            lacking = "value" if name else "name"
            raise QuadvisError(f"{quoted(text)} gives no {lacking}; write NAME=VALUE")
        if name in values:
            raise QuadvisError(f"{quoted(name)} is given twice; give it one value")
        values[name] = value.strip()
    with _target(options) as tg:
        _print_changes(tg, tg.tune(values))
    return 0


def scope(options: argparse.Namespace) -> int:
    """Acquire samples of signals, and print them as a picture, or write them."""
    from quadvis.cli.scope_view import acquire, check_place, live, written

    if options.output:
        check_place(Path(options.output))
    with _target(options) as tg:
        settings = _scope_settings(options)
        if options.live:
            live(tg, options.signals, settings)
            return 0
        samples = acquire(tg, options.signals, settings, options.timeout)
        if options.output:
            print(written(samples, Path(options.output)))
        else:
            from quadvis.cli.scope_view import shown

            print(shown(samples))
    return 0


def log(options: argparse.Namespace) -> int:
    """List the logs of a target, or copy one."""
    with _target(options) as tg:
        if options.list:
            for each in tg.logs():
                print(f"{each['name']}  {each['size'] / 1e6:.3g} MB")
            return 0
        name = options.name or next((each["name"] for each in reversed(tg.logs())), None)
        print(tg.fetchlog(name, options.output or f"{name}.mcap"))
    return 0


def sets(options: argparse.Namespace) -> int:
    """Keep, show, compare and use parameter sets of the application."""
    with _target(options) as tg:
        _SETS[options.action](tg, options.names)
    return 0


def profile(options: argparse.Namespace) -> int:
    """Start or stop the profiler, or print what it has found, and write it as a trace."""
    if options.output:
        from quadvis.machine.files import check_output
        from quadvis.run.trace import TRACE

        check_output(options.output, TRACE)
    with _target(options) as tg:
        if options.seconds is not None:
            _show_profile(tg.profile(options.seconds), options.output)
        elif options.action == "start":
            tg.startProfiler()
            print(f"{tg.name}: the profiler is on")
        elif options.action == "stop":
            tg.stopProfiler()
            print(f"{tg.name}: the profiler is off")
        else:
            _show_profile(tg.getProfilerData(), options.output)
    return 0


def _show_profile(found: ProfilerData, output: str | None) -> None:
    print(found)
    if output:
        print(f"trace: {found.write(output)}")


def console(options: argparse.Namespace) -> int:
    """Read commands line by line, and do them on one target."""
    from quadvis.cli.console import run_console

    with _target(options) as tg:
        return run_console(tg)


def web(options: argparse.Namespace) -> int:
    """Serve the live page of a target until Ctrl-C."""
    from quadvis.web.serving import serve

    with _target(options) as tg:
        serve(tg, options.port, not options.no_browser, lambda words: print(words, flush=True))
    return 0


def _target(options: argparse.Namespace) -> Target:
    """Return the target that is named; a console has one that stays."""
    from quadvis.host.target import Target

    kept: Target | None = getattr(options, "connected", None)
    return kept or Target(options.target)


def _outcome(found: Mapping[str, Any]) -> int:
    if found.get("Problem"):
        print(found["Problem"], file=sys.stderr)
        return FAILED
    return 0


def _value(tg: Target, name: str, parameters: Collection[str]) -> Any:
    """Return the value of a parameter, of a block or of more, or of a signal."""
    if name in parameters:
        return tg.getparam(name)
    try:
        return tg.getsignal(name)
    except QuadvisError as error:
        try:
            return tg.getparam(name)  # of a part, or of the diagram
        except QuadvisError as other:
            raise (other if closest(name, parameters) else error) from None


def _print_changes(tg: Target, found: Mapping[str, Any]) -> None:
    when = f"at tick {found['tick']} ({found['time']:.9g} s)"
    if not found["tick"] and tg.status()["Status"] != "running":
        when = "from the next start on"
    for change in found["changes"]:
        print(f"{change['name']}: {_text(change['old'])} -> {_text(change['new'])} {when}")


def _text(value: Any) -> str:
    if isinstance(value, dict) and set(value) == {"value", "unit"}:
        return f"{value['value']} {value['unit']}"
    return str(value)


def _finite(value: Any) -> Any:
    """Return plain data with None in place of what is infinite, which JSON does not know."""
    if isinstance(value, dict):
        return {name: _finite(each) for name, each in value.items()}
    if isinstance(value, list):
        return [_finite(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _scope_settings(options: argparse.Namespace) -> dict[str, Any]:
    """Return a scope's settings from the options: `--trigger 'rising eyes.lost'`."""
    found: dict[str, Any] = {
        "NumSamples": options.samples, "Decimation": options.decimation, "NumPrePostSamples": -options.pre,
    }  # fmt: skip
    if options.trigger:
        slope, _, signal = options.trigger.rpartition(" ")
        found |= {"TriggerMode": "Signal", "TriggerSignal": signal, "TriggerLevel": options.level}
        found["TriggerSlope"] = (slope or "either").capitalize()
    return found


def _list_sets(tg: Target, names: Sequence[str]) -> None:
    print("\n".join(tg.listparamsets()) or "no sets")


def _save_set(tg: Target, names: Sequence[str]) -> None:
    tg.saveparamset(*_exactly(names, 1, "save NAME"))


def _load_set(tg: Target, names: Sequence[str]) -> None:
    (name,) = _exactly(names, 1, "load NAME")
    print(f"{name} holds from tick {tg.loadparamset(name)} on")


def _show_set(tg: Target, names: Sequence[str]) -> None:
    for name, value in tg.getparamset(*_exactly(names, 1, "show NAME")).items():
        print(f"{name}: {_text(value)}")


def _compare_sets(tg: Target, names: Sequence[str]) -> None:
    for name, old, new in tg.compare(*_exactly(names, 2 if len(names) == 2 else 1, "compare NAME [NAME]")):
        print(f"{name}: {_text(old)} -> {_text(new)}")


def _delete_set(tg: Target, names: Sequence[str]) -> None:
    tg.deleteparamset(*_exactly(names, 1, "delete NAME"))


def _export_set(tg: Target, names: Sequence[str]) -> None:
    print(tg.exportparamset(*_exactly(names, 2, "export NAME FILE")))


def _import_set(tg: Target, names: Sequence[str]) -> None:
    print(tg.importparamset(*_exactly(names, 2 if len(names) == 2 else 1, "import FILE [NAME]")))


def _default_set(tg: Target, names: Sequence[str]) -> None:
    if names:
        tg.setdefaultparamset(*_exactly(names, 2 if len(names) == 2 else 1, "default [NAME [APPLICATION]]"))
    else:
        print(tg.DefaultParamSet or "no set")


def _exactly(names: Sequence[str], count: int, right: str) -> Sequence[str]:
    if len(names) != count:
        raise QuadvisError(f"write quadvis sets {right}")
    return names


_SETS: Mapping[str, Callable[[Target, Sequence[str]], None]] = {
    "list": _list_sets, "save": _save_set, "load": _load_set, "show": _show_set, "compare": _compare_sets,
    "delete": _delete_set, "default": _default_set, "export": _export_set, "import": _import_set,
}  # fmt: skip
