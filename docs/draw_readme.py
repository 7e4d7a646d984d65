"""Draw the pictures of the README: `python docs/draw_readme.py`."""

from pathlib import Path
from tempfile import TemporaryDirectory

import asperity as asp
from asperity.case import case_template, load_machine
from asperity.machines import machine_conditions
from asperity.paper import RigSettings, simulate_rig, write_rig
from asperity.report.style import write_figure

DOCS = Path(__file__).parent
IMAGES = DOCS / "images"


def main() -> None:
    """Draw the bearing of the template, and the trend of the simulated wear test."""
    with TemporaryDirectory() as folder:
        template = Path(folder, "bearing.toml")
        template.write_text(case_template("bearing"), "utf-8")
        bearing = machine_conditions(load_machine(template))
        write_figure(bearing.plot().figure, IMAGES / "bearing.png")
        rig = Path(folder, "rig")
        recordings = write_rig(simulate_rig(RigSettings()), rig)
        case = asp.load_case(rig / "rig.toml")
        track = asp.track_recordings(recordings, case=case, table=rig / "table.csv")
    write_figure(track.plot("trend").figure, IMAGES / "trend.png")


if __name__ == "__main__":
    main()
