"""Output of the latest measurements as a text file that a node exporter of Prometheus collects."""

from collections.abc import Iterator
from pathlib import Path

from asperity.core.errors import BadInput
from asperity.core.files import require_writable, write_text
from asperity.monitoring.fleet.measurements import HEARTBEAT, STATE, STATE_CODES, Measurement

CODES = ", ".join(f"{code} {state}" for state, code in STATE_CODES.items())
METRICS = {  # field: name of the metric, and its description
    STATE: ("asperity_state", f"State of the alarm: {CODES}."),
    "rms": ("asperity_rms", "Rms of the latest recording, in its unit."),
    "velocity": ("asperity_velocity_rms_meters_per_second", "Rms velocity from 10 to 1000 Hz."),
    "crest": ("asperity_crest_factor", "Crest factor."),
    "kurtosis": ("asperity_kurtosis", "Kurtosis."),
    "crf": ("asperity_crf_hertz", "Contact resonance frequency."),
    "crfa": ("asperity_crfa", "Amplitude of the contact resonance."),
    "damping": ("asperity_damping_ratio", "Damping ratio of the contact resonance."),
    "clr": ("asperity_contact_load_ratio", "Contact load ratio by the model of the case."),
    "severe_probability": ("asperity_severe_probability", "Probability of the severe stage."),
}
RECORDED = "asperity_last_recording_timestamp_seconds"
CHECKED = "asperity_heartbeat_timestamp_seconds"


class PrometheusFile:
    """Text file with the latest values of every sensor, written atomically.

    Raises
    ------
    BadInput
        if the file cannot be written, or does not end in .prom, which collectors require.
    """

    def __init__(self, path: Path) -> None:
        if path.suffix != ".prom":
            raise BadInput(f"a file for Prometheus ends in .prom, got {path}; change its suffix")
        require_writable(path)
        self.path = path
        self._values: dict[tuple[str, str, str], dict[str, float | int]] = {}
        self._changed = False

    @property
    def name(self) -> str:
        """Name of the file."""
        return str(self.path)

    def add(self, measurement: Measurement) -> None:
        """Replace the values of a sensor."""
        labels = (measurement.machine, measurement.point, measurement.sensor)
        heartbeat = HEARTBEAT in measurement.fields
        values = self._values.setdefault(labels, {})
        if not heartbeat:  # a value that is not determined must not remain
            for field in METRICS:
                values.pop(field, None)
        values |= measurement.fields
        values[CHECKED if heartbeat else RECORDED] = measurement.time_ns / 1e9
        self._changed = True

    def write(self) -> None:
        """Write the file if values have changed; raises AsperityError if it cannot be written."""
        if self._changed:
            write_text(self.path, "".join(f"{line}\n" for line in self._lines()))
            self._changed = False

    def _lines(self) -> Iterator[str]:
        times = {
            RECORDED: (RECORDED, "Start of the latest recording."),
            CHECKED: (CHECKED, "Latest check by a running watch."),
        }
        for field, (name, description) in (METRICS | times).items():
            values = {
                labels: fields[field] for labels, fields in self._values.items() if field in fields
            }
            if values:
                yield f"# HELP {name} {description}"
                yield f"# TYPE {name} gauge"
            for (machine, point, sensor), value in values.items():
                labels = ",".join(
                    f'{label}="{_escape(text)}"'
                    for label, text in (("machine", machine), ("point", point), ("sensor", sensor))
                )
                yield f"{name}{{{labels}}} {value!r}"


def _escape(label: str) -> str:
    """Escape the value of a label."""
    return label.replace("\\", "\\\\").replace("\n", "\\n").replace('"', '\\"')
