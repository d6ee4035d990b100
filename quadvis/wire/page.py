"""The page of the wire: all that a program in C, MATLAB or LabVIEW must know to talk to a target."""

from __future__ import annotations

from collections.abc import Iterator

from quadvis.wire import limits
from quadvis.wire.argument import REQUIRED
from quadvis.wire.levels import LEVELS
from quadvis.wire.refusals import KINDS
from quadvis.wire.verbs import STREAM, TOPICS, VERBS, Verb

V = limits.VERSION

_TEXT = f"""\
# The wire between host and target

Version {limits.VERSION}. Generated from the declarations by `quadvis wire`.

## Transport

A host has two ZeroMQ sockets of type DEALER, connected to two sockets of type ROUTER of the target:
*control* for requests, *stream* for subscriptions and their data. A message to the target has one frame.
A host sets no identity (`ZMQ_ROUTING_ID`): messages of a connection that has chosen one are dropped.

| | control | stream |
|---|---|---|
| TCP | port P, by default {limits.PORT} | port P + 2 |
| on the target's own computer | `ipc://$XDG_RUNTIME_DIR/quadvis/NAME` | the same with `.stream` behind it |

`hello` says where the stream socket is. Over TCP both are encrypted with CURVE. A host needs its own key
pair and the target's public key, 32 bytes each; `quadvis keys` writes them as 64 hexadecimal digits. The
target must have the host's public key on its list (`quadvis keys allow`); else the handshake ends with
status 400, and with 500 if there is no room. Port P + 1 sends one line of ASCII to whoever connects, and
closes: `quadvis {limits.VERSION} NAME PUBLIC`, with a line feed at its end. It says which key the target
has and proves nothing; a host keeps the key and refuses another one.

An `ipc` socket has no keys: only the user of the target can open its folder, and has level 0.

## Messages

Messages are [msgpack](https://msgpack.org) maps with texts as keys. No extension types, no timestamps;
texts are UTF-8.

| message | frames |
|---|---|
| request | `{{"v": {V}, "id": number, "cmd": verb, "args": map, "deadline": seconds}}` |
| reply on the control socket | `{{"v": {V}, "id": number, "ok": true, "result": ..., "tick": number}}` |
| an error | `{{"v": {V}, "id": number, "ok": false, "error": {{"kind": ..., "sentence": ...}}}}` |
| reply on the stream socket | three frames: an empty one, the reply, an empty one |
| stream data | three frames: the topic, a map, the array |

`id` is a whole number from 0 to 2^53 that the host chooses; the reply has the same. `deadline` may be
left out; a request that takes longer is answered with the kind *busy* and goes on. `tick` is there if the
command took effect at a tick. Replies come in the order in which they are ready.

The map of stream data has `v`, `number`, and what the target says about the data. `number` grows by one
with each message of a topic, so a jump is a gap: data for a slow host is dropped, the oldest first. If
there is an array, `type` is `<f8` or another number type of numpy in little-endian order and `shape` the
list of its sizes; the array is then stored row by row. Topics:

"""

_KINDS = {
    "refused": "the level of the key forbids it",
    "unknown": "there is no such verb, signal, parameter, scope, file or set",
    "bad": "an argument, or the message, is wrong",
    "busy": "not now: another operator, too many requests, not yet finished",
    "gone": "what was asked for is no more, such as a lease that was lost",
    "failed": "the target has a fault",
}

_LEASE = f"""\
## The operator's lease

One host at a time changes what the target does. `lease` gives it a token, and `renew` with this token
keeps it: send one every {limits.RENEWAL * 1000:g} ms. After {limits.LEASE:g} s without one the lease is
lost, and what the diagram says of this happens. A lease belongs to a connection; on a new one, `renew`
with the same key and token takes it along."""


def page() -> str:
    """Return the page as Markdown."""
    return "\n".join(_lines()) + "\n"


def _lines() -> Iterator[str]:
    yield _TEXT.rstrip("\n")
    yield ""
    yield "| topic | level | data |"
    yield "|---|---|---|"
    for topic in TOPICS:
        name = f"{topic.name}N" if topic.name.endswith("/") else topic.name
        yield f"| `{name}` | {topic.level} | {topic.doc} |"
    yield "\n## Kinds of errors\n\n| kind | meaning |\n|---|---|"
    for kind in KINDS:
        yield f"| *{kind}* | {_KINDS[kind]} |"
    yield "\n## Limits\n\nWhat exceeds them is refused or dropped, and counted.\n\n| limit | |\n|---|---|"
    yield from (f"| {words} | {value} |" for words, value in _limits())
    yield "\n## Levels\n\nA key has one of five levels; a verb names the highest one that may use it.\n"
    yield "| level | |\n|---|---|"
    yield from (f"| {level} | {words} |" for level, words in enumerate(LEVELS))
    yield f"\n{_LEASE}\n## Verbs\n"
    for verb in VERBS.values():
        yield from _verb(verb)


def _limits() -> list[tuple[str, str]]:
    return [
        ("bytes of a message to a target; who sends more is cut off", f"{limits.REQUEST}"),
        ("bytes of a message to a host", f"{limits.MESSAGE}"),
        ("values in a request, those in lists and maps included", f"{limits.ITEMS}"),
        ("lists and maps inside one another", f"{limits.DEPTH}"),
        ("bytes of a text in a request", f"{limits.TEXT}"),
        ("bytes of a piece of a file", f"{limits.PIECE}"),
        ("connections to each socket", f"{limits.CONNECTIONS}"),
        ("time for the handshake", f"{limits.HANDSHAKE:g} s"),
        (
            "requests of one key",
            f"{limits.RATE} a second, {limits.BURST} at once; one of many values counts more",
        ),
        ("requests of one key under way", f"{limits.PENDING}"),
        ("deadline", f"{limits.LONGEST_DEADLINE:g} s"),
        ("topics of one connection", f"{limits.SUBSCRIPTIONS}"),
        ("data that waits for one slow host", f"{limits.QUEUED} messages and {limits.LAG} bytes"),
        ("a connection without a sign of life", f"{limits.DEAD_AFTER:g} s (ZMTP heartbeats)"),
    ]


def _verb(verb: Verb) -> Iterator[str]:
    yield f"### `{verb.name}`\n"
    marks = [f"level {verb.level}"]
    marks += ["needs the lease"] * verb.leased + ["audited"] * verb.changes
    marks += ["stream socket"] * (verb.socket == STREAM)
    yield f"{verb.doc[:1].upper()}{verb.doc[1:]}. ({', '.join(marks)})\n"
    for each in verb.arguments:
        default = "" if each.default is REQUIRED else f"; default {_shown(each.default)}"
        yield f"- `{each.name}`: {each.type.words}: {each.doc}{default}"
    if verb.arguments:
        yield ""
    yield f"Result: {verb.reply}.\n"


def _shown(value: object) -> str:
    return "nil" if value is None else f"`{value}`"
