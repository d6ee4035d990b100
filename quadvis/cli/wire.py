"""The commands `quadvis keys` and `quadvis wire`."""

from __future__ import annotations

import argparse
import sys

from quadvis.errors import QuadvisError, sentence

ACTIONS = ("new", "show", "allow", "revoke", "forget")


def keys(options: argparse.Namespace) -> int:
    """Make, show, allow and revoke keys."""
    if options.action != "show" and options.name is None:
        raise QuadvisError(f"NAME is missing; write 'quadvis keys {options.action} NAME'")
    if options.public is not None and options.action != "allow":
        raise QuadvisError(f"'{options.action}' takes no public key; leave it out")
    if options.action != "allow" and (options.level is not None or options.network):
        raise QuadvisError(f"'{options.action}' takes no level and no network; they are for 'allow'")
    {"new": _new, "show": _show, "allow": _allow, "revoke": _revoke, "forget": _forget}[options.action](
        options
    )
    return 0


def _new(options: argparse.Namespace) -> None:
    from quadvis.wire.keys import fingerprint, new_key

    pair, path = new_key(options.name)
    print(f"{path}: public key {pair.public.hex()}, fingerprint {fingerprint(pair.public)}")
    print(f"on a target: quadvis keys allow {pair.name} {pair.public.hex()} --level 3", file=sys.stderr)


def _show(options: argparse.Namespace) -> None:
    from quadvis.wire.hosts import FILE, AuthorizedHosts, described
    from quadvis.wire.keys import fingerprint, own_key, own_names
    from quadvis.wire.known import KnownTargets

    pairs = [own_key(name) for name in ([options.name] if options.name else own_names())]
    print(
        "keys of this computer's user:"
        if pairs
        else "there are no keys; make one with 'quadvis keys new NAME'"
    )
    for pair in pairs:
        print(f"  {pair.name}: {pair.public.hex()}, fingerprint {fingerprint(pair.public)}")
    if options.name:
        return
    hosts = AuthorizedHosts()
    if lines := [described(host) for host in hosts]:
        print("hosts that a target here lets in:\n  " + "\n  ".join(lines))
    if known := KnownTargets().all():
        print("targets that are known here:")
        for target in known.values():
            print(f"  {target.name}: {target.address}, fingerprint {fingerprint(target.public)}")
    if hosts.faults:
        faults = "\n".join(map(str, hosts.faults))
        raise QuadvisError(
            sentence(f"{FILE} has faults, and lets in the hosts above alone", "") + f":\n{faults}"
        )


def _allow(options: argparse.Namespace) -> None:
    from quadvis.wire.hosts import allow, described

    if options.public is None or options.level is None:
        lacks = "PUBLIC" if options.public is None else "--level"
        raise QuadvisError(f"{lacks} is missing; write 'quadvis keys allow NAME PUBLIC --level 0..4'")
    print(described(allow(options.name, options.public, options.level, options.network)))


def _revoke(options: argparse.Namespace) -> None:
    from quadvis.wire.hosts import revoke

    print(f"{revoke(options.name).name} is let in no more")


def _forget(options: argparse.Namespace) -> None:
    from quadvis.wire.known import KnownTargets

    print(f"{KnownTargets().forget(options.name).name} is forgotten; its next key is pinned anew")


def wire(options: argparse.Namespace) -> int:
    """Print the page of the wire."""
    from quadvis.wire.page import page

    sys.stdout.write(page())
    return 0
