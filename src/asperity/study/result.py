"""Result of a study: its plan, its table, and the stored maps and runs."""

from dataclasses import dataclass
from pathlib import Path

import pandas

from asperity.core.arrays import Field
from asperity.core.displayed import Displayed
from asperity.core.errors import BadInput
from asperity.core.files import versions
from asperity.core.storage import refusing_damaged_content
from asperity.results import Run
from asperity.study.evaluate import DONE
from asperity.study.plan import StudyPlan
from asperity.study.store import StudyFolder, load_study_folder, study_manifest


@dataclass(frozen=True, repr=False)
class StudyResult(Displayed):
    """A study: its plan and one row per finished case, in the order of the plan."""

    plan: StudyPlan
    table: pandas.DataFrame
    folder: Path | None = None
    path: Path | None = None  # of the merged table
    seconds: float = 0.0
    computed: int = 0  # in this call; the other rows were stored before
    remarks: tuple[str, ...] = ()  # on files that are missing

    @property
    def failures(self) -> pandas.DataFrame:
        """The rows of failed cases, each with its reason."""
        rows: pandas.DataFrame = self.table[self.table["status"] != DONE]
        return rows

    @property
    def failed(self) -> int:
        """Number of cases that failed or did not converge."""
        return len(self.failures)

    @property
    def missing(self) -> int:
        """Number of cases not yet computed."""
        return len(self.plan.cases) - len(self.table)

    @property
    def versions(self) -> dict[str, str]:
        """Versions of asperity and its dependencies at the start of the study."""
        return versions() if self.folder is None else dict(study_manifest(self.folder)["versions"])

    def maps(self, case_id: str) -> dict[str, Field]:
        """Read the stored maps of a case, each (nx, ny) in SI; see `fields` of `run_study`.

        Raises
        ------
        UnreadableFile
            if no maps are stored or they are damaged.
        BadInput
            for a case of another study, or a study in memory.
        """
        return self._store(case_id).maps(case_id)

    def run(self, case_id: str) -> Run:
        """Load the stored run of a case; `fields` and errors as for `maps`."""
        return self._store(case_id).run(case_id)

    def _store(self, case_id: str) -> StudyFolder:
        if self.folder is None:
            raise BadInput(
                "fields are stored in a study's folder, and this study has none; give out"
            )
        if case_id not in self.table["case_id"].to_numpy():
            raise BadInput(
                f"the study has no finished case {case_id!r}; take one of the column case_id"
            )
        return load_study_folder(self.folder)


def load_study(folder: str | Path) -> StudyResult:
    """Read a study's folder, finished or not.

    Raises
    ------
    UnreadableFile
        if the folder holds no study or is damaged.
    """
    with refusing_damaged_content(Path(folder), "study"):
        store = load_study_folder(Path(folder))
        return StudyResult(
            store.plan, store.table(), store.folder, store.merged, remarks=store.remarks()
        )
