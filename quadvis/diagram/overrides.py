"""Settings from outside put in the place of a diagram's own values; those that name nothing are reported."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping

from quadvis.diagram.settings import Setting, Settings
from quadvis.document import YamlNode, YamlScalar
from quadvis.errors import UNKNOWN, Faults, Unknown, quoted, suggestion
from quadvis.units import Unit, UnitError, split_quantity


class Overrides:
    """The settings of an assembly, by block path ("" for the diagram, the name of a group for its own)."""

    def __init__(self, settings: Settings, faults: Faults) -> None:
        self.settings, self.faults = settings, faults
        self._used: set[tuple[str, str]] = set()

    def of(self, path: str) -> Mapping[str, Setting]:
        """Return the settings of a block, a part or a group, by parameter."""
        return self.settings.get(path, {})

    def chosen(self, path: str, name: str, own: YamlNode | Unknown) -> YamlNode | Unknown:
        """Return the value of a parameter: the setting if there is one.

        A setting without a unit for a value with one is refused here, before others are blamed for it.
        """
        self._used.add((path, name))
        setting = self.of(path).get(name)
        value = setting.value if setting is not None else UNKNOWN
        if setting is None or value is UNKNOWN:
            return own
        if not isinstance(value, YamlScalar) or not isinstance(own, YamlScalar):
            return value
        number, unit = split_quantity(value.value)
        wanted = split_quantity(own.value)[1]
        if not number or unit or not number.strip("+-0.") or not _is_unit(wanted):
            return value
        remedy = f"did you mean {quoted(f'{number} {wanted}')}?"
        self.faults.add(setting.place, f"{quoted(name)}: {quoted(number)} has no unit", remedy)
        return UNKNOWN

    def report_unused(
        self, unknown: Callable[[str], bool], blocks: Collection[str], params: Collection[str]
    ) -> None:
        """Report the settings that name no block of ``blocks`` and no parameter of the diagram.

        Nothing is said of a path that is ``unknown``.
        """
        for path, values in self.settings.items():
            for name, setting in values.items():
                if (path, name) in self._used or unknown(path) or setting.value is UNKNOWN:
                    continue
                if path:
                    inner = [other for other in blocks if other.endswith(f"/{path}")]
                    remedy = f"did you mean '{inner[0]}'?" if inner else suggestion(path, blocks)
                    self.faults.add(setting.place, f"there is no block '{path}'", remedy)
                else:
                    remedy = suggestion(name, params)
                    remedy = remedy or "a parameter of a block is set by 'block.parameter=value'"
                    self.faults.add(setting.place, f"the diagram has no parameter '{name}'", remedy)


def _is_unit(text: str) -> bool:
    try:
        return bool(Unit.parse(text).dimension) if text else False
    except UnitError:
        return False
