"""The indexes of the results of a service: made in the background one after the other, kept in the folder."""

import threading
from collections import OrderedDict
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

from explore.base.errors import ExploreError
from explore.results.browsing.building import build_index
from explore.results.browsing.counting import Counts, Range, count_density
from explore.results.browsing.index_files import DamagedIndexError, Index, identify, open_index, remove_index
from explore.results.browsing.selections import Selection
from explore.results.ranking.conditions import Condition, parse_condition
from explore.results.store.results import Results
from explore.service.folder import Folder, State
from explore.service.jobs import append_event
from explore.service.queue import Jobs, StateError
from explore.service.results_views import open_shown

#: Largest number of indexes that stay open.
_MOST_OPEN = 8
#: Largest number of densities of all designs that are kept for each index.
_MOST_DENSITIES = 32
#: Largest number of selections that are kept for each index, a byte for each design.
_MOST_SELECTIONS = 2
#: Largest number of indexes that wait to be made.
_MOST_WAITING = 16


class _GivenUpError(Exception):
    """An index is not wanted any more."""


@dataclass(frozen=True)
class Browsed:
    """Results with their index."""

    results: Results
    index: Index
    _densities: OrderedDict[tuple[Range, Range], Counts] = field(default_factory=OrderedDict)
    _selections: OrderedDict[tuple[str, ...], Selection] = field(default_factory=OrderedDict)

    def selection(self, where: Sequence[str]) -> Selection:
        """The designs that meet conditions; the last ones are kept, for a page asks for several counts of them."""
        selection = self._selections.get(tuple(where))
        if selection is None:
            selection = Selection(self.index, self.conditions(where))
            while len(self._selections) >= _MOST_SELECTIONS:
                self._selections.pop(next(iter(self._selections), ()), None)
            self._selections[tuple(where)] = selection
        return selection

    def conditions(self, where: Sequence[str]) -> list[Condition]:
        """Conditions as they are written, in the units that are shown."""
        names, scales = list(self.index.columns), self.results.scales
        return [parse_condition(text, names, scales) for text in where]

    def density_of_all(self, x: Range, y: Range) -> Counts:
        """Counts of all designs by the bins of two columns; the last few are kept."""
        counts = self._densities.get((x, y))
        if counts is None:
            counts = count_density(self.index, Selection(self.index, []), x, y).counts
            while len(self._densities) >= _MOST_DENSITIES:
                self._densities.pop(next(iter(self._densities), (x, y)), None)
            self._densities[x, y] = counts
        return counts


class Indexes:
    """The indexes of the results of jobs, in a folder that this process holds; safe to use from several threads."""

    def __init__(self, jobs: Jobs, folder: Folder) -> None:
        self._jobs, self._folder = jobs, folder
        self._changed = threading.Condition()
        self._waiting: OrderedDict[str, None] = OrderedDict()
        self._building, self._share = "", 0.0
        self._problems: dict[str, str] = {}
        self._open: OrderedDict[str, tuple[list[int], Browsed]] = OrderedDict()
        self._is_stopping = False
        self._thread = threading.Thread(target=self._build_all, name="indexes", daemon=True)

    def start(self) -> None:
        """Remove the indexes of deleted jobs, and begin to make others."""
        self._folder.remove_indexes_but(job.name for job in self._jobs.in_order())
        self._thread.start()

    def stop(self) -> None:
        """Give up the index that is made."""
        with self._changed:
            self._is_stopping = True
            self._changed.notify_all()
        if self._thread.is_alive():
            self._thread.join()

    def state(self, name: str) -> tuple[str, float]:
        """The state "none", "building" or "ready", and the share that is done; `StateError` if it could not be made."""
        path = self._results_path(name)
        with self._changed:
            if self._is_coming(name):
                return "building", self._share if name == self._building else 0.0
            if problem := self._problems.pop(name, ""):
                raise StateError(f"the index of {name} could not be made: {problem}")
        if self._find(name, path):
            return "ready", 1.0
        return ("building" if self._is_coming(name) else "none"), 0.0

    def build(self, name: str) -> None:
        """Make an index in the background, unless it is there or under way."""
        if self.state(name)[0] != "none":
            return
        with self._changed:
            if len(self._waiting) >= _MOST_WAITING:
                raise StateError(f"{_MOST_WAITING} indexes wait to be made already; try again later")
            self._waiting[name] = None
            self._changed.notify_all()

    def get(self, name: str) -> Browsed:
        """Results with their index; `StateError` if it is not ready."""
        state, share = self.state(name)
        browsed = self._find(name, self._results_path(name)) if state == "ready" else None
        if browsed is None:
            advice = f"it is {share:.0%} done" if state == "building" else "ask for index?build=true"
            raise StateError(f"the index of {name} is not ready; {advice}")
        return browsed

    @contextmanager
    def reading(self, name: str) -> Iterator[Browsed]:
        """Results with their index, which is made anew if it proves to be damaged; `StateError` unless it is ready."""
        browsed = self.get(name)
        try:
            yield browsed
        except DamagedIndexError:
            self._renew(name)
            raise StateError(f"the index of {name} was damaged and is made anew; load the page again") from None

    def forget(self, name: str) -> None:
        """Give up the index of a job that is about to be deleted, and close it."""
        with self._changed:
            self._waiting.pop(name, None)
            self._open.pop(name, None)
            self._problems.pop(name, None)
            if name == self._building:
                self._building = ""
                self._changed.notify_all()

    def results(self, name: str) -> Results:
        """The results of a job that does not run; `StateError` if there are none."""
        path = self._results_path(name)
        browsed = self._find(name, path)
        return browsed.results if browsed else open_shown(path)

    def _results_path(self, name: str) -> Path:
        job, path = self._jobs.get(name), self._folder.results_path(name)
        if job.state in (State.queued, State.running):
            raise StateError(f"{name} is {job.state}; its results can be browsed when the sweep has ended")
        if not path.exists():
            raise StateError(f"{name} is {job.state} and has no results")
        return path

    def _find(self, name: str, path: Path) -> Browsed | None:
        """The index of the results as they are now."""
        identity = identify(path)
        with self._changed:
            if name in self._open and self._open[name][0] == identity:
                self._open.move_to_end(name)
                return self._open[name][1]
        try:
            index = open_index(self._folder.index_path(name), identity)
        except DamagedIndexError:
            self._renew(name)
            return None
        if index is None:
            return None
        browsed = Browsed(open_shown(path), index)
        with self._changed:
            self._open[name] = identity, browsed
            self._open.move_to_end(name)
            while len(self._open) > _MOST_OPEN:
                self._open.popitem(last=False)
        return browsed

    def _is_coming(self, name: str) -> bool:
        return name in self._waiting or name == self._building

    def _renew(self, name: str) -> None:
        """Make a damaged index anew, which replaces it when it is complete."""
        with self._changed:
            if self._is_coming(name):
                return
            self._open.pop(name, None)
            self._waiting[name] = None
            self._changed.notify_all()
        with suppress(OSError):  # a full disk
            append_event(self._folder.log_path(name), "index made anew", {"problem": "its files are damaged"})

    # --- the thread ---------------------------------------------------------------------------------------------------

    def _build_all(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._waiting or self._is_stopping)
                if self._is_stopping:
                    return
                name, _ = self._waiting.popitem(last=False)
                self._building, self._share = name, 0.0
            problem = self._build(name)
            with self._changed:
                if self._building == name:
                    self._building = ""
                    self._open.pop(name, None)  # a request may have opened the index before
                    if problem:
                        self._problems[name] = problem

    def _build(self, name: str) -> str:
        """Make an index; returns why it could not be made."""

        def report(share: float) -> None:
            if self._is_stopping or self._building != name:
                raise _GivenUpError
            self._share = share

        try:
            path = self._results_path(name)
            build_index(open_shown(path), self._folder.index_path(name), report)
            if not path.exists():  # deleted at the last moment
                remove_index(self._folder.index_path(name))
        except _GivenUpError:
            return ""
        except ExploreError as error:
            return str(error)
        except OSError as error:
            return error.strerror or type(error).__name__
        except Exception as error:  # the next index must be made, whatever is wrong with this file
            return f"internal error: {type(error).__name__}"
        return ""
