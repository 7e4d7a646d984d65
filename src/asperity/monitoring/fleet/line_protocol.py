"""Output of measurements by the line protocol of InfluxDB, to a file, a stream or an address."""

import os
import sys
from collections import deque
from functools import partial
from pathlib import Path
from urllib.parse import urlsplit

from asperity.core.errors import AsperityError
from asperity.core.files import require_writable
from asperity.monitoring.fleet.measurements import Measurement
from asperity.monitoring.notify import NETWORK_S, post, require_address, within

MEASUREMENT = "asperity"
TOKEN = "ASPERITY_LINE_PROTOCOL_TOKEN"  # variable with the token of an InfluxDB 2
MAX_LINES = 100_000  # waiting lines, beyond which the oldest are lost
MAX_POST = 5000  # lines per post


def line_of(measurement: Measurement) -> str:
    """Return a measurement as a line: asperity,machine=Pump,point=DE,sensor=acc rms=0.5 1000."""
    tags = "".join(
        f",{name}={_escape_tag(value)}"
        for name, value in (
            ("machine", measurement.machine),
            ("point", measurement.point),
            ("sensor", measurement.sensor),
        )
        if value
    )
    fields = ",".join(
        f"{name}={value}i" if isinstance(value, int) else f"{name}={value!r}"
        for name, value in measurement.fields.items()
    )
    return f"{MEASUREMENT}{tags} {fields} {measurement.time_ns}"


def _escape_tag(value: str) -> str:
    """Escape the value of a tag; backslashes and line breaks, which cannot be, are replaced."""
    plain = " ".join(value.splitlines()).replace("\\", "/")
    for sign in (",", "=", " "):
        plain = plain.replace(sign, f"\\{sign}")
    return plain or "_"


class LineProtocol:
    """Output of lines to a file, to stdout ("-"), or to a web address.

    Lines wait until they have been written.

    Raises
    ------
    BadInput
        if the file cannot be written, or the address is invalid.
    """

    def __init__(self, target: str) -> None:
        self.target = target
        self._lines: deque[str] = deque(maxlen=MAX_LINES)
        if "://" in target:
            require_address(target, ("http", "https"), "http://influx.example:8086/write?db=plant")
        elif target != "-":
            require_writable(Path(target))

    @property
    def name(self) -> str:
        """Name of the target, without passwords and tokens."""
        if "://" not in self.target:
            return self.target
        parts = urlsplit(self.target)
        return f"{parts.scheme}://{parts.netloc.rpartition('@')[2]}{parts.path}"

    def add(self, measurement: Measurement) -> None:
        """Append a measurement to the waiting lines."""
        self._lines.append(line_of(measurement))

    def write(self) -> None:
        """Write the waiting lines; those that cannot be written wait.

        Raises
        ------
        AsperityError
            if they could not be written.
        """
        while self._lines:
            block = [*self._lines][:MAX_POST]
            content = "".join(f"{line}\n" for line in block)
            try:
                self._write(content)
            except BrokenPipeError:
                raise
            except Exception as error:
                raise AsperityError(
                    f"{self.name} could not be written: {error}; {len(self._lines)} lines wait"
                ) from error
            for _ in block:
                self._lines.popleft()

    def _write(self, content: str) -> None:
        if "://" in self.target:
            token = os.environ.get(TOKEN)
            headers = {"Content-Type": "text/plain; charset=utf-8"}
            if token:
                headers["Authorization"] = f"Token {token}"
            within(2.0 * NETWORK_S, partial(post, self.target, content.encode(), headers))
        elif self.target == "-":
            sys.stdout.write(content)
            sys.stdout.flush()
        else:
            _append(Path(self.target), content.encode())


def _append(path: Path, content: bytes) -> None:
    """Append to a file; on a full disk nothing is appended."""
    with path.open("ab", buffering=0) as file:
        size = file.seek(0, os.SEEK_END)
        written = file.write(content)
        if written < len(content):
            file.truncate(size)
            raise OSError("no space left")
