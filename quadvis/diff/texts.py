"""Values of a resolved diagram as texts for people: short ones whole, long lists by what differs in them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

LONGEST = 72  # characters of a value that is shown whole


def value_text(value: Any) -> str:
    """Return a value as a diagram writes it, on one line, with its unit; a long list by its shape."""
    text = _whole(value)
    if len(text) <= LONGEST:
        return text
    numbers = _numbers(value)
    return f"{len(numbers)} values" if isinstance(numbers, list) else f"{text[: LONGEST - 3]}..."


def changed_texts(old: Any, new: Any) -> tuple[str, str]:
    """Return two different values as texts that differ; of long lists the first element that differs."""
    texts = _whole(old), _whole(new)
    if max(map(len, texts)) <= LONGEST:
        return texts
    lists = [dict(_elements(_numbers(each))) for each in (old, new)]
    if lists[0].keys() != lists[1].keys() or not lists[0]:
        shown = value_text(old), value_text(new)
        return shown if shown[0] != shown[1] else texts
    different = [place for place, value in lists[0].items() if value != lists[1][place]]
    if not different:
        return texts
    first = different[0]
    place = f"[{','.join(map(str, first))}]"
    more = f" and {len(different) - 1} more" if len(different) > 1 else ""
    units = (_unit_text(each) for each in (old, new))
    before, after = (
        f"{place} {_whole(each[first])}{f' {unit}' if unit else ''}"
        for each, unit in zip(lists, units, strict=True)
    )
    return before, f"{after}{more}"


def entry_text(value: Any) -> str:
    """Return an entry of a list, such as an expectation, on one line."""
    if isinstance(value, dict):
        return ", ".join(f"{key} {_whole(inner)}" for key, inner in value.items())
    return _whole(value)


def wire_text(source: Any) -> Any:
    """Return the source of an input: a wire with its crossing as one text, a constant as it is."""
    if isinstance(source, dict) and "from" in source:
        more = [f"{key} {_whole(value)}" if key != "across" else str(value) for key, value in source.items()
                if key != "from"]  # fmt: skip
        return f"{source['from']} ({', '.join(more)})" if more else source["from"]
    return source


def is_quantity(value: Any) -> bool:
    """Whether a value is one with its unit: ``{value: [1, 2], unit: m}``."""
    return isinstance(value, dict) and "value" in value and value.keys() <= {"value", "unit"}


def _whole(value: Any) -> str:
    if is_quantity(value):
        numbers, units = value["value"], _unit_text(value).split(" ")
        if isinstance(numbers, list) and len(units) == len(numbers) > 1:
            texts = (
                f"{number} {'' if unit == '1' else unit}".rstrip()
                for number, unit in zip(numbers, units, strict=True)
            )
            return f"[{', '.join(texts)}]"
        return f"{_whole(numbers)} {' '.join(units)}".rstrip()
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{key}: {_whole(inner)}' for key, inner in value.items())}}}"
    if isinstance(value, list):
        return f"[{', '.join(map(_whole, value))}]"
    return str(value).lower() if isinstance(value, bool) else str(value)


def _unit_text(value: Any) -> str:
    return str(value.get("unit", "")) if is_quantity(value) else ""


def _numbers(value: Any) -> Any:
    return value["value"] if is_quantity(value) else value


def _elements(value: Any, place: tuple[int, ...] = ()) -> Iterator[tuple[tuple[int, ...], Any]]:
    """Yield the elements of nested lists with their places; nothing for a value that is no list."""
    if isinstance(value, list):
        for index, inner in enumerate(value):
            yield from _elements(inner, (*place, index))
    elif place:
        yield place, value
