"""All mechanisms by name, each loaded when it is first asked for."""

import copyreg
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any
from weakref import WeakValueDictionary

from explore.base.errors import RequestError
from explore.mechanisms.entry_points import registered_entries, source_of
from explore.mechanisms.linkages.table import PREFIX, LinkageTable
from explore.model.mechanism import Mechanism
from explore.model.quantities import GivenMetric
from explore.model.targets import Target

#: Time after which a package whose module is still being imported is named, s.
_PATIENCE = 5.0


class Registry(Mapping[str, Mechanism]):
    """The mechanisms of this package and of installed packages, by name.

    A mechanism that cannot be loaded raises `RequestError` with the reason in one line.
    """

    def __init__(self) -> None:
        self._loaded: dict[str, Mechanism] = {}
        # Those that something holds, of which the last ones are kept: `linkages.declaration.linkage_mechanism`.
        self._of_tables: WeakValueDictionary[str, Mechanism] = WeakValueDictionary()

    def __getitem__(self, name: str) -> Mechanism:
        if (of_table := self._of_tables.get(name)) is not None:
            return of_table
        if name not in self._loaded:
            self._loaded[name] = _load(name)
        return self._loaded[name]

    def __iter__(self) -> Iterator[str]:
        return iter({**registered_entries(), **self._loaded})

    def __len__(self) -> int:
        return len({*registered_entries(), *self._loaded})

    def __contains__(self, name: object) -> bool:
        return name in self._of_tables or name in self._loaded or name in registered_entries()

    def of_table(self, table: LinkageTable) -> Mechanism:
        """The mechanism of a table, which has its name in this process while it is in use; lists leave it out."""
        from explore.mechanisms.linkages.declaration import linkage_mechanism  # imports Numba, needed only here

        mechanism = linkage_mechanism(table)
        self._of_tables[mechanism.name] = mechanism
        return mechanism

    def load_all(self) -> tuple[dict[str, Mechanism], list[str]]:
        """All mechanisms that can be loaded, and a line for each other one."""
        mechanisms, problems = {}, []
        for name in self:
            try:
                mechanisms[name] = self[name]
            except RequestError as error:
                problems.append(str(error))
        return mechanisms, problems

    @contextmanager
    def including(self, mechanism: Mechanism) -> Iterator[None]:
        """Hold a mechanism for a while, in place of any other of its name, in this process."""
        before = dict(self._loaded)
        self._loaded[mechanism.name] = mechanism
        try:
            yield
        finally:
            self._loaded = before


def _load(name: str) -> Mechanism:
    entry, *others = registered_entries()[name]
    if others:
        sources = " and by ".join(source_of(each) for each in (entry, *others))
        raise RequestError(f"the mechanism '{name}' is registered by {sources}; uninstall all but one of them")
    source = source_of(entry)
    line = f"loading the mechanism '{name}' of {source} takes long; uninstall {source} if it never ends"
    warning = threading.Timer(_PATIENCE, sys.stderr.write, [f"warning: {line}\n"])
    warning.daemon = True
    try:
        if entry.dist:
            warning.start()
        mechanism = entry.load()
    except (Exception, SystemExit) as error:  # anything may happen in another package's module
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        raise RequestError(f"the mechanism '{name}' of {source} cannot be loaded: {reason}") from error
    finally:
        warning.cancel()
    if not isinstance(mechanism, Mechanism) or mechanism.name != name:
        found = f"the mechanism '{mechanism.name}'" if isinstance(mechanism, Mechanism) else "no mechanism"
        raise RequestError(f"the mechanism '{name}' of {source} cannot be loaded: {entry.value} is {found}")
    return mechanism


MECHANISMS = Registry()


def mechanism_by_name(
    name: str,
    points: tuple[str, ...] = (),
    target: Target | None = None,
    given: tuple[GivenMetric, ...] = (),
    names: frozenset[str] = frozenset(),
) -> Mechanism:
    """The mechanism of that name with points, a target and given metrics, for a worker that unpickles it.

    Of points it has the kernel for signals of these `names`, if there are any.
    """
    if name not in MECHANISMS:
        raise RequestError(f"the mechanism '{name}' is not installed here")
    mechanism = MECHANISMS[name].with_points(points)
    return (mechanism.for_signals(names) if names else mechanism).with_target(target).with_given(given)


def _of_table(
    table: LinkageTable,
    specialised: tuple[frozenset[str], bool] | None,
    target: Target | None,
    given: tuple[GivenMetric, ...],
) -> Mechanism:
    """The mechanism of a table with the same kernel, for a worker that unpickles it."""
    mechanism = MECHANISMS.of_table(table)
    if specialised:
        names, needs_stroke = specialised
        mechanism = mechanism.for_signals(names, needs_stroke=needs_stroke)
    return mechanism.with_target(target).with_given(given)


def _extended(find: Callable[..., Mechanism], *arguments: Any) -> Mechanism:
    """The extended mechanism of what is found, or this where one kernel fills all signals."""
    mechanism = find(*arguments)
    return mechanism.extended or mechanism


def _reduce(mechanism: Mechanism) -> tuple[Callable[..., Mechanism], tuple[Any, ...]]:
    """How a mechanism is pickled: as its name or its table, so that a worker loads its own compiled functions."""
    find: Callable[..., Mechanism] = _of_table
    arguments: tuple[Any, ...] = (mechanism.table, mechanism.specialised, mechanism.target, mechanism.given)
    if not mechanism.name.startswith(PREFIX):
        kernel = mechanism.extended or mechanism
        names = frozenset(signal.name for signal in kernel.signals if mechanism.specialise and kernel.fills(signal))
        find = mechanism_by_name
        arguments = (mechanism.name, mechanism.points, mechanism.target, mechanism.given, names)
    # An extended mechanism has none of its own.
    return (find, arguments) if mechanism.extended else (_extended, (find, *arguments))


copyreg.pickle(Mechanism, _reduce)
