"""The contract of a block: ports, parameters and state declared once, behaviour in plain methods.

The inputs that ``output`` asks for by name are the block's direct feedthrough. Parameters and states live in
memory that the engine owns (see ``quadvis.engine.memory``), so snapshot, replay, tuning and scopes need no
code of the author.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Collection, Hashable, Mapping
from types import MappingProxyType
from typing import Any, ClassVar, Self, TypeVar

import numpy as np

from quadvis.block.declare import ParameterError, entry_name
from quadvis.block.interface import PORTS, Interface, arguments_of_ports, interface_of
from quadvis.block.unlike import unlike_sizes
from quadvis.errors import QuadvisError, sentence, suggestion
from quadvis.machine.inputs import file_digest, read_once
from quadvis.machine.source_line import file_of, source_line

OWN_MODULES = "quadvis_own_blocks."  # prefix of the names of modules that come with a diagram
NONE: Mapping[str, int] = MappingProxyType({})
_Read = TypeVar("_Read")


class Block:
    """One reusable unit of computation or input/output; see the module's docstring for the contract.

    ``Gain(factor=2.0)`` makes a block from its parameters, and from ``period`` (s) where that is known;
    ParameterError if a parameter is unknown, missing or out of range. The block can run after the engine has
    bound it to memory.
    """

    interface: ClassVar[Interface]
    numeric: ClassVar[bool] = True
    stepwise: bool = False  # whether outputs change at ticks only, though they use the time; or `check` says
    # Whether outputs jump between two ticks and no ``crossing`` says where; or the block that has one.
    jumps: ClassVar[bool | str] = False
    functions: ClassVar[tuple[Any, ...]] = ()  # plain functions with machine code that its methods call
    not_replayable: ClassVar[str] = ""  # why a second run may differ from the first: "it reads a camera"
    not_restorable: ClassVar[str] = ""  # why it cannot return to a snapshot: "the model has no way back"
    brings_code: ClassVar[str] = ""  # the parameter whose file a run executes
    harmless: ClassVar[str] = ""  # why its writes need no safe values: "a file moves nothing"
    example: ClassVar[str] = (
        ""  # entries under `blocks` that show its use: rates fast, slow, inner, continuous
    )
    example_needs: ClassVar[str] = ""  # what its example needs that not every computer has: "an FMU"
    symbol: ClassVar[str] = ""  # by which pictures show it: one of `quadvis.block.symbol.SYMBOLS`
    free_names: ClassVar[str] = ""  # what diagrams name by themselves: "outputs, by formulas"; see `named`
    # The parameters and the numbers of inputs from which the ports were made; these numbers alone.
    made_for: ClassVar[Mapping[str, Any] | None] = None
    entry_counts: ClassVar[Mapping[str, int]] = NONE
    period: float = math.nan
    until: float = math.inf  # time of the run's last tick (s), where it is known; not for compiled methods
    _kinds: ClassVar[dict[Hashable, type[Block]]]

    def __init_subclass__(cls, *, numeric: bool | None = None, bound: bool = False) -> None:
        if bound:
            return
        if numeric is not None:
            cls.numeric = numeric
        cls._kinds = {}
        cls.interface = interface_of(cls)

    @classmethod
    def ports_from(cls) -> tuple[str, ...]:
        """Return the names of the parameters on which the ports depend, of the arguments of ``ports``."""
        return tuple(name for name in arguments_of_ports(cls) if name in cls.interface.params)

    @classmethod
    def named(cls, given: Mapping[str, Any], inputs: Collection[str]) -> type[Block]:
        """Return the class with the names that a diagram gives, for a class with ``free_names``.

        ``given`` are the parameters as plain values, texts as they are written; ``inputs`` are the wired
        inputs. ParameterError says what is wrong.
        """
        return cls

    @classmethod
    def with_ports(cls, parameters: Mapping[str, Any], entries: Mapping[str, int] = NONE) -> type[Block]:
        """Return the class with its ports for these parameters; ParameterError if a parameter is wrong.

        ``entries`` has the number of signals of each input of any number; a class for which it is open stays
        as it is. The ports of a class may depend on parameters, for example on the file of a model. Such a
        class has a class method ``ports``, which asks for parameters, and for the number of signals of
        inputs, by name, and returns the ports by name, a list of ports for an input of any number, and what
        else of the class depends on the file: parameters, states, methods, tags. ``*inputs`` of a method then
        stands for all inputs, in the order of ``ports``; of ``output``, for those that are ``direct``.
        """
        if cls.made_for is None and not hasattr(cls, PORTS) and not cls.interface.many:
            return cls
        base = cls._before_ports()
        asked, many = base.ports_from(), base.interface.many
        counts = {name: entries.get(name, cls.entry_counts.get(name)) for name in many}
        if None in counts.values():
            return cls
        declared = base.interface.params
        given = {name: declared[name].given(parameters.get(name)) for name in asked} | counts
        if cls.made_for is not None and all(
            np.array_equal(given[name], cls.made_for[name]) for name in given
        ):
            return cls
        return base._made(given)

    @classmethod
    def _before_ports(cls) -> type[Block]:
        """Return the class from which this one was made when its ports were known."""
        kinds: tuple[type[Any], ...] = cls.__mro__
        return kinds[0 if cls.made_for is None else 1]

    @classmethod
    def _made(cls, given: Mapping[str, Any]) -> type[Block]:
        """Return the class with its ports; one class for equal values, unless these are files or arrays."""
        files = any(cls.interface.params[name].is_file for name in cls.ports_from())
        key = tuple(given.items())
        if files or any(isinstance(value, np.ndarray) for value in given.values()):
            return _kind(cls, given)
        if key not in cls._kinds:
            cls._kinds[key] = _kind(cls, given)
        return cls._kinds[key]

    def with_entries(self, **entries: int) -> Self:
        """Return the block itself, whose inputs of any number now take so many signals.

        A block that is made without a diagram does not know their number: ``Sum()`` becomes
        ``Sum().with_entries(u=3)``. ParameterError if a parameter asks for another number.
        """
        kind = self._before_ports()
        given = {name: getattr(self, name) for name in kind.ports_from()}
        made: Any = kind._made(given | {name: entries[name] for name in kind.interface.many})
        self.__class__ = made
        self.check()
        return self

    def __init__(self, *, period: float = math.nan, **parameters: Any) -> None:
        kind = type(self).with_ports(parameters)
        if kind is not type(self):
            self.__class__ = kind
        self.period = period
        declared = self.interface.params
        for name in parameters:
            if name not in declared:
                problem = f"{type(self).__name__} has no parameter '{name}'"
                raise ParameterError(name, sentence(problem, suggestion(name, declared)))
        for name, param in declared.items():
            self.__dict__[name] = param.given(parameters.get(name))
        self._kept: dict[str, Any] = {}  # results of `read_file`, by parameter
        self._check()
        self._digests = {
            param.name: file_digest(getattr(self, param.name))
            for param in self.interface.files_read
            if param.name not in self._kept and os.path.isfile(getattr(self, param.name))
        }

    def _check(self) -> None:
        """Check the values; one that fails on values that do not fit together has this as its sentence."""
        try:
            self.check()
        except QuadvisError:
            raise
        except Exception as error:
            if (unlike := unlike_sizes(self)) is not None:
                raise unlike from error
            raise

    def check(self) -> None:
        """Raise ParameterError for values that make a run impossible, so that `quadvis check` finds them.

        Such values are parameters that contradict each other or ``self.period`` (s), and unusable files.
        This method is called when the block is made, and before a run if the period has changed since then.
        The period is NaN where it is not known: write comparisons such that NaN refuses nothing.
        """

    def check_written(self) -> None:
        """Raise ParameterError for an existing file that must not be overwritten.

        This method is called when all inputs of the diagram are known and no block writes over one of them;
        ``open`` checks the file again.
        """

    def reads(self) -> list[str]:
        """Return the files that a run reads: the files that parameters name, and all files of a folder."""
        paths = (getattr(self, param.name) for param in self.interface.files_read)
        return [path for path in paths if path]

    def picture_lines(self) -> tuple[str, ...]:
        """Return lines for its box in a picture of the diagram, such as the transitions of a machine."""
        return ()

    def picture_formula(self) -> tuple[str, ...]:
        """Return what a picture shows in the place of its type: a text, or numerator and denominator."""
        return ()

    def picture_signs(self) -> Mapping[str, str]:
        """Return signs that a picture shows at inputs in the place of their names: + and - of a sum."""
        return {}

    def doubts(self) -> list[ParameterError]:
        """Return the warnings: values that can run, but are surely a mistake at ``self.period`` (s)."""
        return []

    def read_file(self, name: str, read: Callable[[str], _Read]) -> _Read:
        """Return ``read(path)`` of the file that a parameter names; ParameterError reports a fault in it.

        The file is read at the first call, and the result is kept. So ``open`` gets the same result as
        ``check``, even if the file has changed in between. Blocks of one diagram that give the same ``read``
        and path share the result: do not modify it.
        """
        if name not in self._kept:
            try:
                self._kept[name] = read_once(read, getattr(self, name))
            except ParameterError:
                raise
            except QuadvisError as error:
                reasons = "; ".join(str(error).splitlines())
                raise ParameterError(name, f"{name} is not usable: {reasons}") from None
        found: _Read = self._kept[name]
        return found

    def verify_files(self) -> None:
        """Refuse, before ``open``, a file that has changed since the block was made.

        Results that `read_file` keeps stay valid, so their files may change.
        """
        for name, digest in self._digests.items():
            path = getattr(self, name)
            if not os.path.isfile(path) or file_digest(path) != digest:
                problem = f"file '{path}' is not what it was when the diagram was loaded"
                raise ParameterError(name, sentence(problem, "load it again"))

    def open(self) -> None:
        """Acquire what the block needs outside the engine: a file, a port, a device."""

    def write_safe(self, time: float) -> None:
        """Write the safe values: at every end of a run, before ``close``, if ``open`` succeeded."""
        write: Callable[..., None] | None = getattr(self, "write", None)
        if write is None or self.harmless:
            return
        safe, names = self.interface.safe, self.interface.arguments["write"]
        write(*(time if name == "time" else getattr(self, safe[name].name) for name in names))

    def close(self) -> None:
        """Release what ``open`` has acquired. This method is called even if ``open`` failed halfway."""

    def keep(self) -> Any:
        """Return, for a snapshot between two ticks, what is outside of memory and later outputs depend on.

        Most blocks have all that in states, and return None.
        """

    def put_back(self, kept: Any) -> None:
        """Go back to what `keep` has returned; None is the state before the first tick.

        The states in memory are back by then. QuadvisError, in a sentence, if the block has no way back.
        """


def _kind(cls: type[Block], given: Mapping[str, Any]) -> type[Block]:
    """Return a class with its ports for the values on which they depend."""
    arguments = arguments_of_ports(cls)
    many = {name: given[name] for name in cls.interface.many}
    try:
        made = getattr(cls, PORTS)(**{name: given[name] for name in arguments}) if arguments else {}
    except QuadvisError:
        raise
    except Exception as error:
        place = source_line(error, file_of(cls))
        reason = f"{type(error).__name__}: {error}{f' in {place}' if place else ''}"
        problem = f"the ports cannot be made from {arguments[0]}: {reason}"
        raise ParameterError(arguments[0], problem) from error
    ports = {name: port for name, port in made.items() if name not in many}
    for name, count in many.items():
        entries = made.get(name) or cls.interface.inputs[name].entries(count)
        ports |= {entry_name(name, number): entry for number, entry in enumerate(entries)}
    members = {"__doc__": cls.__doc__, "__module__": cls.__module__, "made_for": given, "entry_counts": many}
    return type(cls.__name__, (cls,), ports | members)
