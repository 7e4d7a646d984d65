"""Watch of a tree of folders: each subfolder with recordings is a measuring point."""

import os
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from time import monotonic

from asperity.core.errors import AsperityError
from asperity.core.troubles import Troubles, failure_reason
from asperity.monitoring.files import is_utf8, may_be_recording, natural_order
from asperity.monitoring.settings import WatchSettings
from asperity.monitoring.store.database import Store
from asperity.monitoring.watching.folder_watch import FolderWatch
from asperity.monitoring.watching.watch_state import Update

RESULTS = "asperity-watch"  # folder of results, by default
SEARCH_S = 60.0  # interval between searches for new folders [s]
CACHE_BYTES = 512 << 20  # memory for spectra of places; others are read from the store again
POINT = "point"  # name of a point without a folder of its own


def folders_with_recordings(root: Path, out: Path | None = None) -> Iterator[Path]:
    """Yield the folders of a tree that contain recordings; results and hidden ones are left out."""
    for name, inside, files in os.walk(root):
        folder = Path(name)
        inside[:] = sorted(
            (
                child
                for child in inside
                if not child.startswith(".")
                and child != RESULTS
                and is_utf8(child)
                and (out is None or folder / child != out)
            ),
            key=natural_order,
        )
        if any(is_utf8(file) and may_be_recording(folder / file) for file in files):
            yield folder


def is_tree(root: Path, out: Path | None = None) -> bool:
    """Tell whether only subfolders of a folder contain recordings."""
    root = root.resolve()
    first = next(folders_with_recordings(root, None if out is None else out.resolve()), None)
    return first is not None and first != root


class TreeWatch:
    """Watches of all folders of a tree, with one store.

    Parameters
    ----------
    root, out, watching : as `watch_tree`
    store : of all folders
    open_place : returns the watch of a folder, with the store and its own settings
    """

    def __init__(
        self,
        root: Path,
        out: Path,
        store: Store,
        watching: WatchSettings,
        open_place: Callable[..., FolderWatch],
    ) -> None:
        self.root, self.out, self.watching = root, out.resolve(), watching
        self.open_place = open_place
        self.store = store
        self.troubles = Troubles()
        self.watches: dict[Path, FolderWatch] = {}
        self._recent: dict[Path, int] = {}  # memory for spectra [bytes], the latest use last
        self._searched_s: float | None = None

    def check(self) -> Iterator[Update]:
        """Check every place in turn, and yield its update if it has one."""
        self._search()
        for folder, watch in [*self.watches.items()]:
            machine, point = self._names(folder)
            place = f"{machine}/{point}"
            update = None
            try:
                update = watch.check()
            except Exception as error:  # noqa: BLE001 (the others continue)
                self._begin(place, error)
            else:
                self.troubles.end(place, f"{place} is checked again")
            sentences = self.troubles.take()
            if update is not None:
                self._limit_memory(folder, watch)
                yield replace(update, place=place, failed=(*update.failed, *sentences))
            elif sentences:
                yield Update(new=(), track=None, failed=sentences, notice=True, place=place)

    def require_complete(self) -> None:
        """Raise AsperityError if a place could not be checked."""
        failed = self.troubles.active
        if failed:
            raise AsperityError(
                f"{len(failed)} of {len(self.watches)} places could not be evaluated; "
                f"the first: {next(iter(failed.values()))}"
            )

    def close(self) -> None:
        """Merge what is in memory only, and close the store.

        Raises
        ------
        AsperityError
            if the store cannot be written.
        """
        failures = []
        for watch in self.watches.values():
            try:
                watch.finish()
            except AsperityError as error:
                failures.append(error)
        self.store.close()
        if failures:
            raise failures[0]

    def _search(self) -> None:
        """Open watches of folders with recordings that are new."""
        now_s = monotonic()
        if self._searched_s is not None and now_s - self._searched_s < SEARCH_S:
            return
        self._searched_s = now_s
        for folder in folders_with_recordings(self.root, self.out):
            if folder in self.watches:
                continue
            machine, point = self._names(folder)
            own = replace(self.watching, machine=machine, point=point)
            try:
                watch = self.open_place(folder, self.store, watching=own)
            except Exception as error:  # noqa: BLE001 (the others continue)
                self._begin(f"{machine}/{point}", error)
            else:
                watch.state.troubles = watch.troubles = self.troubles
                self.watches[folder] = watch

    def _begin(self, place: str, error: Exception) -> None:
        """State that a place has failed."""
        ending = "" if self.watching.once else "; the watch continues and retries"
        self.troubles.begin(place, f"{place} failed ({failure_reason(error)}){ending}")

    def _names(self, folder: Path) -> tuple[str, str]:
        """Return the names of machine and point of a folder."""
        parts = folder.relative_to(self.root).parts
        return (parts[0] if parts else self.root.name), "/".join(parts[1:]) or POINT

    def _limit_memory(self, folder: Path, watch: FolderWatch) -> None:
        """Release the spectra of the places that have been without recordings for longest."""
        self._recent.pop(folder, None)
        self._recent[folder] = watch.state.cached_bytes
        while len(self._recent) > 1 and sum(self._recent.values()) > CACHE_BYTES:
            longest = next(iter(self._recent))
            del self._recent[longest]
            self.watches[longest].state.release()
