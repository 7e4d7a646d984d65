"""Draw the pictures of the README: `python docs/draw_readme.py`."""

from pathlib import Path
from tempfile import TemporaryDirectory

import asperity as asp
from asperity.case import load_machine
from asperity.machines import machine_conditions
from asperity.paper import RigSettings, simulate_rig, write_rig
from asperity.report.style import write_figure

DOCS = Path(__file__).parent
IMAGES = DOCS / "images"


def main() -> None:
    """Draw the bearing of an example, and the trend of the simulated wear test."""
    bearing = machine_conditions(load_machine(DOCS.parent / "examples" / "6206.toml"))
    write_figure(bearing.plot().figure, IMAGES / "bearing.png")
    with TemporaryDirectory() as folder:
        rig = Path(folder, "rig")
        recordings = write_rig(simulate_rig(RigSettings()), rig)
        case = asp.load_case(rig / "rig.toml")
        track = asp.track_recordings(recordings, case=case, table=rig / "table.csv")
    write_figure(track.plot("trend").figure, IMAGES / "trend.png")


if __name__ == "__main__":
    main()
