"""The memory that the engine owns: one flat run of 8-byte slots, and blocks bound to their place in it.

Every scalar takes one slot (float64, int64, or a bool in its first byte, the others zero). One layout serves
the Python tier (blocks bound as C structures), numpy (views), the log (rows are slices) and compiled code
(``self`` as a record).
"""

from __future__ import annotations

import ctypes
import functools
import math
import types
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadvis.block import NO_FRAME, Block, Shape, Sizes
from quadvis.block.returned import CALL
from quadvis.block.signals import SCALARS
from quadvis.engine.frames import Frames

SLOT = 8
C_TYPES = {"float64": ctypes.c_double, "int64": ctypes.c_int64, "bool": ctypes.c_bool}
VIEWS = {"float64": "d", "int64": "q", "bool": "?"}


class Slot(NamedTuple):
    """Where a signal or field lives: kind, shape, first slot; for ``frame`` its place in a list of frames.

    A state that holds several frames has the shape (n,) and n neighbouring places.
    """

    scalar: str
    shape: Shape
    position: int

    @property
    def size(self) -> int:
        """How many elements it has."""
        return math.prod(self.shape)

    @property
    def strides(self) -> Shape:
        """Bytes between neighbours along each axis."""
        return tuple(SLOT * math.prod(self.shape[axis + 1 :]) for axis in range(len(self.shape)))


def packed(scalar: str, shape: Shape) -> np.dtype[Any]:
    """Return the element type that fills whole slots: arrays of bool become int64."""
    return np.dtype("int64" if shape and scalar == "bool" else scalar)


class Field(NamedTuple):
    """One field of a block's record: its offset in slots counts from the start of the record."""

    name: str
    scalar: str
    shape: Shape
    offset: int


@dataclass(frozen=True)
class Record:
    """The layout of a block's ``self``: the period, parameters, what is derived from them, states, Work.

    ``kept`` slots come before the Work, which is scratch of one tick and no part of a snapshot.
    """

    fields: tuple[Field, ...]
    size: int
    kept: int

    @staticmethod
    def of(block: Block, sizes: Sizes) -> Record:
        """Lay out a block whose symbolic sizes are known; texts and frames stay outside."""
        interface = block.interface
        fields, offset, kept = [Field("period", "float64", (), 0)], 1, 1
        for group in (interface.params, interface.derived, interface.states, interface.work):
            kept = offset
            for name, declared in group.items():
                if declared.signal.scalar in ("str", "frame"):
                    continue
                # A parameter may be a scalar where other blocks of its class have an array.
                given = group is interface.params
                shape = np.shape(getattr(block, name)) if given else declared.signal.resolve(sizes)
                fields.append(Field(name, declared.signal.scalar, shape, offset))
                offset += math.prod(shape)
        return Record(tuple(fields), offset, kept)

    @property
    def dtype(self) -> np.dtype[Any]:
        """The same layout as a numpy record, which is what compiled methods take as ``self``.

        An array of bools is one of int64 here, since numpy cannot say that each takes a slot.
        """
        return np.dtype({
            "names": [field.name for field in self.fields],
            "formats": [(packed(field.scalar, field.shape), field.shape) for field in self.fields],
            "offsets": [field.offset * SLOT for field in self.fields],
            "itemsize": self.size * SLOT,
        })  # fmt: skip

    def __getitem__(self, name: str) -> Field:
        """Return the field of that name."""
        return next(field for field in self.fields if field.name == name)


class Memory:
    """A run's signals, states and parameters: slots in one buffer, and a list of frames.

    ``size`` slots start at zero, or hold what a program's ``image`` has. ``buffer``, if given, is where they
    live, such as memory that processes share; it must be writable and have room for them.
    """

    def __init__(self, size: int, frames: Sequence[Any] = (), image: bytes = b"", buffer: Any = None) -> None:
        self.buffer = bytearray(size * SLOT) if buffer is None else buffer
        self.raw = memoryview(self.buffer).cast("B")[: size * SLOT]
        self.raw[:] = image or bytes(size * SLOT)
        self.floats: NDArray[np.float64] = np.frombuffer(self.raw, np.float64)
        self.frames = list(frames)
        self._work: list[slice] = []  # the bytes of all blocks' Work
        self._scalars = {scalar: self.raw.cast(code) for scalar, code in VIEWS.items()}  # type: ignore[call-overload]

    def view(self, slot: Slot) -> NDArray[Any]:
        """Return an array over a slot's bytes; writing to it writes to memory."""
        return np.ndarray(slot.shape, slot.scalar, self.raw, slot.position * SLOT, slot.strides)

    def read(self, slot: Slot) -> Any:
        """Return the present value of a slot: a Python scalar, a copy of an array, a frame or a list."""
        if slot.scalar == "frame":
            found = Frames(self.frames, slot.position, slot.size)
            return list(found) if slot.shape else found[0]
        value = self.view(slot)
        return value.copy() if slot.shape else value.item()

    def write(self, slot: Slot, value: Any) -> None:
        """Store a value that fits the slot's shape."""
        if slot.scalar == "frame":
            Frames(self.frames, slot.position, slot.size).fill(value if slot.shape else [value])
        elif slot.shape:
            self.view(slot)[...] = value
        else:
            self._scalars[slot.scalar][self._place(slot)] = SCALARS[slot.scalar](value)

    def content(self) -> bytes:
        """Return the bytes for a snapshot, with zeros for Work, which no tick hands to the next."""
        found = bytearray(self.raw)
        for scratch in self._work:
            found[scratch] = bytes(scratch.stop - scratch.start)
        return bytes(found)

    def call(
        self, method: Callable[..., Any], arguments: Sequence[Slot], targets: Sequence[Slot]
    ) -> Callable[[], None]:
        """Return a call of ``method`` from slots to slots, specialised to their types.

        A general loop over arguments would cost more than most blocks do. Array arguments are read-only.
        """
        make = _caller(tuple(map(_kind, arguments)), tuple(map(_kind, targets)))
        places = [self._place(slot) for slot in (*arguments, *targets)]
        for place, slot in zip(places, arguments, strict=False):
            if slot.shape:
                place.flags.writeable = False
        return make(method, places, self.frames, *self._scalars.values())

    def _place(self, slot: Slot) -> Any:
        """Return the index of the slot in its view: arrays have one of their own, bools count bytes."""
        if slot.shape:
            return self.view(slot)
        return slot.position * SLOT if slot.scalar == "bool" else slot.position

    def copy(self, source: Slot, target: Slot) -> Callable[[], None]:
        """Return a call that copies one slot to another of the same kind."""
        if source.scalar == "frame":
            return self.call(lambda frame: frame, [source], [target])
        size = source.size * SLOT
        start, end = source.position * SLOT, target.position * SLOT

        def copy(raw: memoryview = self.raw) -> None:
            raw[end : end + size] = raw[start : start + size]

        return copy

    def gated(self, call: Callable[[], None], gate: Slot, idle: Sequence[Slot]) -> Callable[[], None]:
        """Return a call that is made while a slot is true; while it is false, some slots become zero."""
        at, raw = gate.position * SLOT, self.raw
        zeros = [(self._bytes(slot), bytes(slot.size * SLOT)) for slot in idle]

        def run() -> None:
            if raw[at]:
                call()
            else:
                for place, nothing in zeros:
                    raw[place] = nothing

        return run

    def reset(
        self, flag: Slot, slots: Sequence[Slot], image: bytes, blocks: Sequence[Block]
    ) -> Callable[[], None]:
        """Return a call that, if ``flag`` is true, gives slots their values in ``image``, starts blocks."""
        at, raw, frames = flag.position * SLOT, self.raw, self.frames
        parts = [self._bytes(slot) for slot in slots if slot.scalar != "frame"]
        initial = [(part, image[part]) for part in parts]
        pictures = [Frames(frames, slot.position, slot.size) for slot in slots if slot.scalar == "frame"]
        starts = [block.start for block in blocks if "start" in block.interface.arguments]  # type: ignore[attr-defined]

        def run() -> None:
            if raw[at]:
                for place, value in initial:
                    raw[place] = value
                for picture in pictures:
                    picture.fill([NO_FRAME] * len(picture))
                for start in starts:
                    start()

        return run

    @staticmethod
    def _bytes(slot: Slot) -> slice:
        return slice(slot.position * SLOT, (slot.position + slot.size) * SLOT)

    def fill(self, block: Block, record: Record, position: int, period: float) -> None:
        """Write a block's period, parameters and the initial values of its states from ``position`` on."""
        interface = block.interface
        for item in record.fields:
            if item.name in interface.params or item.name in interface.derived:
                value = getattr(block, item.name)
            elif item.name in interface.states:
                value = interface.states[item.name].init
            else:
                value = 0 if item.name in interface.work else period
            self.write(Slot(item.scalar, item.shape, position + item.offset), value)

    def bind(self, block: Block, record: Record, position: int, frames: Mapping[str, Slot]) -> Block:
        """Return the block as its methods see it: its fields are the bytes from ``position`` on.

        ``frames`` are the places of those of its states that hold frames.
        """
        if record.kept < record.size:
            self._work.append(slice((position + record.kept) * SLOT, (position + record.size) * SLOT))
        kind: Any = _bound_class(type(block), record)  # type: ignore[arg-type]  # mypy: a class has no hash
        bound: Block = kind.from_buffer(self.raw, position * SLOT)
        for item in record.fields:
            if item.shape:
                view = self.view(Slot(item.scalar, item.shape, position + item.offset))
                bound.__dict__[_array_key(item.name)] = view
        bound.__dict__.update(_kept=block._kept, _digests=block._digests)
        for name, param in block.interface.params.items():
            if param.is_text:
                bound.__dict__[name] = getattr(block, name)
        for name, slot in frames.items():
            bound.__dict__[_array_key(name)] = Frames(self.frames, slot.position, slot.size)
        return bound


def _kind(slot: Slot) -> str:
    return slot.scalar if slot.scalar == "frame" or not slot.shape else "array"


@functools.cache
def _caller(arguments: tuple[str, ...], targets: tuple[str, ...]) -> Callable[..., Callable[[], None]]:
    """Make the maker of calls for one signature; its text is made of the kinds alone."""
    patterns = {"frame": "frames[p{}]", "array": "p{}", **{scalar: f"{scalar}[p{{}}]" for scalar in VIEWS}}
    sources = [patterns[kind].format(index) for index, kind in enumerate(arguments)]
    sinks = [
        (patterns[kind] + ("[...]" if kind == "array" else "")).format(index + len(arguments))
        for index, kind in enumerate(targets)
    ]
    places = "".join(f"p{index}, " for index in range(len(arguments) + len(targets)))
    text = (
        f"def make(method, places, frames, {', '.join(VIEWS)}):\n"
        f"    {f'({places}) = places' if places else 'pass'}\n"
        f"    def call():\n"
        f"        {', '.join(sinks)}{' = ' if sinks else ''}method({', '.join(sources)})\n"
        f"    return call\n"
    )
    namespace: dict[str, Any] = {}
    exec(compile(text, CALL, "exec"), namespace)
    made: Callable[..., Callable[[], None]] = namespace["make"]
    return made


@functools.cache
def _bound_class(block: type[Block], record: Record) -> type[Block]:
    """Make the block's class again as a C structure over its record; array fields become views."""
    fields: list[tuple[str, Any]] = []
    attributes: dict[str, Any] = {
        "__init__": object.__init__,
        "__module__": block.__module__,
        "_fields_": fields,
    }
    for item in record.fields:
        if item.shape:
            fields.append((f"{item.name}.slots", ctypes.c_double * math.prod(item.shape)))
            attributes[item.name] = _array_property(_array_key(item.name))
        else:
            fields.append((item.name, C_TYPES[item.scalar]))
            if item.scalar == "bool":
                fields.append((f"{item.name}.rest", ctypes.c_uint8 * (SLOT - 1)))
    for state in block.interface.states.values():
        if state.signal.scalar == "frame":
            made = _frames_property if state.signal.shape else _frame_property
            attributes[state.name] = made(_array_key(state.name))
    return types.new_class(
        block.__name__, (block, ctypes.Structure), {"bound": True}, lambda body: body.update(attributes)
    )


def _array_key(name: str) -> str:
    """Return where a bound block keeps an array's view, a name that no attribute of an author can have."""
    return f"{name}[]"


def _array_property(key: str) -> property:
    def write(block: Any, value: Any) -> None:
        block.__dict__[key][...] = value

    return property(lambda block: block.__dict__[key], write)


def _frame_property(key: str) -> property:
    def write(block: Any, frame: Any) -> None:
        block.__dict__[key][0] = frame

    return property(lambda block: block.__dict__[key][0], write)


def _frames_property(key: str) -> property:
    def write(block: Any, frames: Any) -> None:
        block.__dict__[key].fill(frames)

    return property(lambda block: block.__dict__[key], write)
