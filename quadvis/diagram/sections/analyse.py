"""`analyse`: the questions of `quadvis analyse`: where to open the loop, and how far parameters can go."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from quadvis.diagram.sections.context import Context, RunSection
from quadvis.diagram.sections.cuts import Cut, read_cut
from quadvis.diagram.sections.forms import QUANTITY, TEXT, Schema, closed, labelled, list_of, ref
from quadvis.diagram.sections.transfers import Transfer, read_transfer, transfer_schema
from quadvis.diagram.times import read_duration
from quadvis.diagram.variable import Variable, find_variable
from quadvis.diagram.wiring import Wiring
from quadvis.document import YamlList, YamlMap, YamlNode, YamlScalar
from quadvis.errors import UNKNOWN, Faults, Place, Unknown, known
from quadvis.errors.caller import as_given
from quadvis.units import Unit, split_quantity

ANALYSE_KEYS = ("at", "cuts", "transfer", "limits")
LIMIT_KEYS = ("vary", "from", "to")
LISTS = ANALYSE_KEYS[1:]
NOTHING: Mapping[str, tuple[str, ...] | Unknown] = {key: () for key in LISTS}
AT = 3.0  # s; where something waits for longer in the loop, the steady state is sought later


class Limit(NamedTuple):
    """A question: how far a parameter can go from ``start`` toward ``end`` (SI) before the loop is unstable.

    ``shown`` is the unit that people read it in.
    """

    label: str
    variable: Variable
    start: float
    end: float
    shown: Unit

    def shows(self, value: float) -> str:
        """Return a value of the parameter as text."""
        number = f"{value / self.shown.scale:.4g}"
        return f"{number} {self.shown}" if self.shown.symbols else number


class Questions(NamedTuple):
    """All that is asked: time (s) of the operating point, cuts, transfers, limits.

    ``context`` is for more of them. ``named`` are the names that are written under `cuts`, `transfer` and
    `limits`, also of those with a fault.
    """

    context: Context
    at: float = AT
    cuts: tuple[Cut, ...] = ()
    transfers: tuple[Transfer, ...] = ()
    limits: tuple[Limit, ...] = ()
    named: Mapping[str, tuple[str, ...] | Unknown] = NOTHING

    def more(
        self, cuts: Mapping[str, Any], limits: Mapping[str, tuple[str, str, str]]
    ) -> tuple[tuple[Cut, ...], tuple[Limit, ...]]:
        """Return the cuts and limits with others added; DiagramError reports their faults."""
        added, sought = self.others(cuts, limits, as_given("--vary", "limits"))
        return self.cuts + added, self.limits + sought

    def others(
        self, cuts: Mapping[str, Any], limits: Mapping[str, tuple[str, str, str]], place: str
    ) -> tuple[tuple[Cut, ...], tuple[Limit, ...]]:
        """Return other cuts and limits alone; ``place`` names in faults where the limits were given."""
        context = self._fresh()
        faults = context.faults
        _refuse_twice("cut", cuts, self.cuts, as_given("--cut", "cuts"), faults)
        found = [
            read_cut(
                label, _list([signals] if isinstance(signals, str) else signals, "--cut", "cuts"), context
            )
            for label, signals in cuts.items()
        ]
        sought = [_limit(label, _map(limit, place), context) for label, limit in limits.items()]
        faults.check()
        return tuple(cut for cut in found if known(cut)), tuple(limit for limit in sought if known(limit))

    def more_transfers(self, transfers: Mapping[str, Any]) -> tuple[Transfer, ...]:
        """Return the transfers with others added, ``[from, to]`` each; DiagramError reports their faults."""
        context = self._fresh()
        place = ("--transfer", "transfers")
        _refuse_twice("transfer", transfers, self.transfers, as_given(*place), context.faults)
        found = [read_transfer(label, _list(ends, *place), context) for label, ends in transfers.items()]
        context.faults.check()
        return self.transfers + tuple(transfer for transfer in found if known(transfer))

    def _fresh(self) -> Context:
        """Return the context with no faults yet."""
        faults = Faults()
        return replace(self.context, wiring=Wiring(self.context.wiring.expansion, faults), faults=faults)


class Analyse(RunSection[Questions]):
    """The questions that a diagram asks of its loop."""

    key = "analyse"
    words = "cut points, transfers and limits for `quadvis analyse`, see below"

    def read(self, node: YamlNode | None, context: Context) -> Questions:
        """Return the questions."""
        faults = context.faults
        if node is None:
            return Questions(context)
        fields = faults.collect(node.fields, (), ANALYSE_KEYS, faults)
        if fields is None:
            return Questions(context, named=dict.fromkeys(LISTS, UNKNOWN))
        at = faults.collect(read_duration, fields["at"]) if "at" in fields else None
        maps = {key: faults.collect(fields[key].mapping) for key in LISTS if key in fields}

        def found(key: str, read: Callable[[str, YamlNode, Context], Any]) -> tuple[Any, ...]:
            pairs = (maps.get(key) or YamlMap({}, {}, "", 0, 0)).pairs()
            read_all = [read(label.value, value, context) for label, value in pairs]
            return tuple(each for each in read_all if known(each))

        return Questions(
            context,
            AT if at is None else float(at),
            found("cuts", read_cut),
            found("transfer", read_transfer),
            found("limits", _limit),
            {key: _labels(fields.get(key)) for key in LISTS},
        )

    def schema(self) -> Schema:
        """Return the schema: a time, cuts, transfers and limits."""
        cut = {"anyOf": [ref("signal"), list_of(ref("signal"), "opened at once")]}
        return closed(ANALYSE_KEYS, {
            "at": {**QUANTITY, "description": "run so long before the operating point is sought"},
            "cuts": labelled(cut, "where `quadvis analyse` opens the loop, by name"),
            "transfer": labelled(ref("transfer"), "how one signal answers to another one, by name"),
            "limits": labelled(
                ref("limit"), "how far a parameter can go before the loop is unstable, by name"
            ),
        })  # fmt: skip

    def definitions(self, blocks: object) -> dict[str, Schema]:
        """Return the forms of a limit and of a transfer."""
        limit: dict[str, Schema] = {
            "vary": {**TEXT, "description": "block.parameter, a parameter of the diagram, or an element"},
            "from": {**QUANTITY, "description": "where the search begins; the loop is stable there"},
            "to": {**QUANTITY, "description": "where it ends"},
        }
        return {"limit": closed(LIMIT_KEYS, limit, LIMIT_KEYS), "transfer": transfer_schema()}


def _labels(node: YamlNode | None) -> tuple[str, ...] | Unknown:
    if isinstance(node, YamlMap):
        return tuple(node.values)
    return UNKNOWN if node is not None else ()


def _text(text: str, place: str, key: str = "") -> YamlScalar:
    return YamlScalar(text, False, place, 0, 0, key)


def _refuse_twice(
    word: str, added: Iterable[str], there: Sequence[Cut | Transfer], place: str, faults: Faults
) -> None:
    for label in added:
        if any(label == each.label for each in there):
            problem = f"the diagram has a {word} '{label}' already"
            faults.add(Place(place), problem, "choose another name")


def _list(signals: Sequence[str], option: str, argument: str) -> YamlNode:
    place = as_given(option, argument)
    return YamlList([_text(text, place) for text in signals], place, 0, 0)


def _map(limit: tuple[str, str, str], place: str) -> YamlMap:
    values: dict[str, YamlNode] = {
        key: _text(text, place, key) for key, text in zip(LIMIT_KEYS, limit, strict=True)
    }
    return YamlMap({}, values, place, 0, 0)


def _limit(label: str, node: YamlNode, context: Context) -> Limit | Unknown:
    """Read ``{vary: eyes/camera.latency, from: 50 ms, to: 2 s}``."""
    faults = context.faults
    fields = faults.collect(node.fields, LIMIT_KEYS, (), faults)
    if fields is None or any(key not in fields for key in LIMIT_KEYS):
        return UNKNOWN
    variable = faults.collect(find_variable, context.wiring, context.graph, fields["vary"])
    if variable is None:
        return UNKNOWN
    start, end = (faults.collect(fields[key].quantity, variable.unit, bare=False) for key in LIMIT_KEYS[1:])
    if start is None or end is None:
        return UNKNOWN
    if start == end:
        faults.add(fields["to"].place, "'from' and 'to' are the same", "give the end of a range")
        return UNKNOWN
    unit = split_quantity(fields["to"].text())[1]
    return Limit(label, variable, start, end, Unit.parse(unit) if unit else variable.unit)


ANALYSE = Analyse()
