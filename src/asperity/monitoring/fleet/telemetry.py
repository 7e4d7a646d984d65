"""Telemetry of a watch: measurements of its updates and a heartbeat, to all requested outputs."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from time import monotonic, time_ns

from asperity.core.troubles import RetryDelay, Troubles, failure_reason
from asperity.monitoring.fleet.line_protocol import LineProtocol
from asperity.monitoring.fleet.measurements import Measurement, heartbeat_of, measurements_of
from asperity.monitoring.fleet.prometheus import PrometheusFile
from asperity.monitoring.watching.watch_state import Update

HEARTBEAT_S = 60.0  # interval between heartbeats [s]
RETRY_S = 5.0  # first delay before a failed output is written again [s]


class Telemetry:
    """Outputs of a watch; a failure is stated once and retried.

    Parameters
    ----------
    line_protocol : file, "-" for stdout, or web address; None: none
    prometheus : text file; None: none

    Raises
    ------
    BadInput
        if a file cannot be written, or an address is invalid.
    """

    def __init__(self, line_protocol: str | None = None, prometheus: Path | None = None) -> None:
        outputs: list[LineProtocol | PrometheusFile] = []
        if line_protocol is not None:
            outputs.append(LineProtocol(line_protocol))
        if prometheus is not None:
            outputs.append(PrometheusFile(prometheus))
        self.outputs: Sequence[LineProtocol | PrometheusFile] = outputs
        self.troubles = Troubles()
        self._delays = [RetryDelay(RETRY_S) for _ in outputs]
        self._heartbeats: dict[tuple[str, str, str], Measurement] = {}
        self._next_s = 0.0

    def add(self, update: Update) -> None:
        """Add the measurements of an update."""
        if not self.outputs:
            return
        heartbeat = heartbeat_of(update)
        if heartbeat is not None:
            self._heartbeats[update.address] = heartbeat
            self._add(heartbeat)
        for measurement in measurements_of(update):
            self._add(measurement)

    def check(self) -> None:
        """Add heartbeats that are due, and write what waits."""
        if not self.outputs:
            return
        if monotonic() >= self._next_s:
            self._next_s = monotonic() + HEARTBEAT_S
            for heartbeat in self._heartbeats.values():
                self._add(replace(heartbeat, time_ns=time_ns()))
        for output, delay in zip(self.outputs, self._delays, strict=True):
            if delay.waiting:
                continue
            try:
                output.write()
            except BrokenPipeError:
                raise
            except Exception as error:  # noqa: BLE001 (a watch continues)
                delay.record(failed=True)
                self.troubles.begin(
                    output.name, f"{failure_reason(error)}; the watch continues and retries"
                )
            else:
                delay.record(failed=False)
                self.troubles.end(output.name, f"{output.name} is written again")

    def finish(self) -> None:
        """Write what waits; raises AsperityError if an output cannot be written."""
        for output in self.outputs:
            output.write()

    def _add(self, measurement: Measurement) -> None:
        for output in self.outputs:
            output.add(measurement)
