"""Measurements of a watch for time-series databases, and its heartbeat."""

import http.server
import re
import signal
import subprocess
import sys
import threading
import time
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from asperity.core.errors import AsperityError
from asperity.monitoring import Telemetry, TrackSettings, WatchSettings, watch_folder
from asperity.monitoring.fleet import line_protocol, telemetry
from asperity.monitoring.fleet.line_protocol import line_of
from asperity.monitoring.fleet.measurements import Measurement

ONCE = ("--once", "--settle", "0", "--quiet")


def snapshots(folder, levels, first=0, channels=("acc",)):
    """Write noise without a contact resonance, in recordings of 0.1 s that state their start."""
    Path(folder).mkdir(exist_ok=True, parents=True)
    for number, level in enumerate(levels, first):
        rng = np.random.default_rng(number)
        signals = {name: level * rng.standard_normal(2000) for name in channels}
        path = Path(folder) / f"s-{number:03}.npz"
        np.savez(path, **signals, fs=20e3, unit="m/s^2")
        Path(f"{path}.toml").write_text(f'started = "2025-03-{number + 1:02}T12:00:00+00:00"\n')


def parse(line):
    """Parse a line by an implementation of its grammar: tags, fields and time."""
    head, fields, stamp = re.split(r"(?<!\\) ", line)
    tags = dict(re.split(r"(?<!\\)=", part) for part in re.split(r"(?<!\\),", head)[1:])
    values = dict(part.split("=") for part in fields.split(","))
    numbers = {
        name: int(value[:-1]) if value.endswith("i") else float(value)
        for name, value in values.items()
    }
    unescaped = {name: re.sub(r"\\(.)", r"\1", value) for name, value in tags.items()}
    return unescaped, numbers, int(stamp)


def failing():
    return np.concatenate([np.ones(8), np.exp(np.log(20.0) * np.arange(20) / 19)])


def test_lines_state_the_values_of_new_recordings_and_a_heartbeat(asp):
    snapshots("plant/Fan, 1=x/DE", failing())
    assert asp("watch", "plant", *ONCE, "--line-protocol", "lines.txt")[0] == 3
    lines = [parse(line) for line in Path("lines.txt").read_text().splitlines()]
    assert {tuple(tags.items()) for tags, _, _ in lines} == {
        (("machine", "Fan, 1=x"), ("point", "DE"), ("sensor", "sensor"))
    }
    beats = [fields for _, fields, _ in lines if "heartbeat" in fields]
    assert {tuple(fields.items()) for fields in beats} == {(("state", 4), ("heartbeat", 1))}
    recorded = [(fields, stamp) for _, fields, stamp in lines if "heartbeat" not in fields]
    assert len(recorded) == 28
    assert recorded[0][1] == 1740830400 * 10**9  # 2025-03-01T12:00Z
    assert [fields["rms"] for fields, _ in recorded] == pytest.approx(failing(), rel=0.1)
    assert recorded[-1][0]["state"] == 4
    assert "crf" not in recorded[0][0]  # it was not found
    before = len(lines)
    assert asp("watch", "plant", *ONCE, "--line-protocol", "lines.txt")[0] == 3
    assert len(Path("lines.txt").read_text().splitlines()) <= before + 2  # heartbeats only


def test_lines_on_stdout_come_alone(asp):
    snapshots("in", np.ones(2), channels=("a", "b"))
    code, out, _ = asp("watch", "in", *ONCE, "--channel", "a,b", "--line-protocol", "-")
    assert code == 4
    parsed = [parse(line) for line in out.splitlines()]
    assert [tags["sensor"] for tags, fields, _ in parsed if "rms" in fields] == [*"abab"]


@pytest.mark.parametrize("name", ["a b", "a,b", "a=b", "a\\", "a\\ b", "a\nb", "größe", "\\"])
def test_names_of_tags_are_escaped(name):
    tags, fields, stamp = parse(line_of(Measurement(name, "p", "s", 5, {"rms": 1e-9})))
    assert tags["machine"] == name.replace("\\", "/").replace("\n", " ")
    assert (fields, stamp) == ({"rms": 1e-9}, 5)


class Influx(http.server.BaseHTTPRequestHandler):
    """Database that stores what it accepts."""

    works = True
    lines = ()
    headers_seen = ()

    def do_POST(self):
        content = self.rfile.read(int(self.headers["Content-Length"])).decode()
        if Influx.works:
            Influx.lines = (*Influx.lines, *content.splitlines())
        Influx.headers_seen = (self.path, self.headers["Authorization"])
        self.send_response(204 if Influx.works else 503)
        self.end_headers()

    def log_message(self, *_):
        pass


@pytest.fixture
def influx():
    server = http.server.HTTPServer(("127.0.0.1", 0), Influx)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    Influx.works, Influx.lines = True, ()
    yield f"http://127.0.0.1:{server.server_port}/write?db=plant"
    server.shutdown()
    thread.join()
    server.server_close()


def test_lines_wait_while_the_database_cannot_be_reached(tmp_path, influx, monkeypatch):
    monkeypatch.setattr(telemetry, "RETRY_S", 0.0)
    monkeypatch.setenv(line_protocol.TOKEN, "secret")
    outputs = Telemetry(influx)
    snapshots(tmp_path / "in", np.ones(3))
    settings = WatchSettings(poll_interval_s=0.0, settle_time_s=0.0)
    with closing(
        watch_folder(tmp_path / "in", tmp_path / "out", TrackSettings(), settings)
    ) as updates:
        outputs.add(next(updates))
        Influx.works = False
        outputs.check()
        (sentence,) = outputs.troubles.take()
        assert "could not be written: it answered 503" in sentence
        assert "secret" not in sentence
        outputs.check()
        assert outputs.troubles.take() == ()
        with pytest.raises(AsperityError, match="lines wait"):
            outputs.finish()
        Influx.works = True
        outputs.check()
        assert "is written again" in outputs.troubles.take()[0]
    assert sum("rms=" in line for line in Influx.lines) == 3
    assert Influx.headers_seen == ("/write?db=plant", "Token secret")


def test_a_heartbeat_is_written_regularly(tmp_path, monkeypatch):
    monkeypatch.setattr(telemetry, "HEARTBEAT_S", 0.0)
    snapshots(tmp_path / "in", np.ones(3))
    settings = WatchSettings(once=True, settle_time_s=0.0)
    (update,) = watch_folder(tmp_path / "in", tmp_path / "out", TrackSettings(), settings)
    outputs = Telemetry(str(tmp_path / "lines"), tmp_path / "plant.prom")
    outputs.add(update)
    outputs.check()
    before = len((tmp_path / "lines").read_text().splitlines())
    outputs.check()
    lines = (tmp_path / "lines").read_text().splitlines()
    assert len(lines) == before + 1
    tags, fields, stamp = parse(lines[-1])
    assert fields == {"state": 2, "heartbeat": 1}
    assert abs(stamp / 1e9 - time.time()) < 5.0
    assert tags["point"] == "in"


def test_the_prometheus_file_has_one_value_per_metric_and_sensor(asp):
    snapshots('plant/Fan "1"/DE', failing())
    snapshots("plant/Pump/DE", np.ones(3))
    assert asp("watch", "plant", *ONCE, "--prometheus", "plant.prom")[0] == 3
    text = Path("plant.prom").read_text()
    assert 'asperity_state{machine="Fan \\"1\\"",point="DE",sensor="sensor"} 4' in text
    assert 'asperity_state{machine="Pump",point="DE",sensor="sensor"} 2' in text
    samples = [line for line in text.splitlines() if not line.startswith("#")]
    assert len(samples) == len({line.rpartition(" ")[0] for line in samples})
    assert all(re.fullmatch(r'[a-z_]+\{.*"\} [-+.\de]+', line) for line in samples)
    assert text.count("# TYPE asperity_rms gauge") == 1
    assert "asperity_crf_hertz" not in text
    code, _, err = asp("watch", "plant", *ONCE, "--prometheus", "plant.txt")
    assert code == 2
    assert "ends in .prom" in err
    assert asp("watch", "plant", *ONCE, "--line-protocol", "nowhere/lines")[0] == 2
    assert asp("watch", "plant", *ONCE, "--line-protocol", "ftp://x/y")[0] == 2


def test_an_mqtt_broker_knows_whether_the_watch_is_online(tmp_path):
    pytest.importorskip("amqtt", reason="the small broker is a development package")
    from paho.mqtt import subscribe

    from end_to_end.test_calls import broker

    def status(port):
        return subscribe.simple("plant/status", hostname="127.0.0.1", port=port).payload.decode()

    snapshots(tmp_path / "in", np.ones(3))
    command = [sys.executable, "-m", "asperity", "watch", "in", "--quiet", "--every", "0.1"]
    for end, expected in ((signal.SIGTERM, "offline"), (signal.SIGKILL, "offline")):
        with broker() as port:
            target = ["--mqtt", f"mqtt://127.0.0.1:{port}/plant"]
            process = subprocess.Popen(
                [*command, *target], cwd=tmp_path, stdout=subprocess.PIPE, text=True
            )
            assert process.stdout.readline()
            assert status(port) == "online"
            process.send_signal(end)
            process.wait(30)
            process.stdout.close()
            time.sleep(1.0)
            assert status(port) == expected
