"""Notifications on a change of state by command, web address and MQTT broker, all on loopback."""

import json
import socket
import sqlite3
import subprocess
import sys
import threading
import time
from contextlib import closing, contextmanager
from functools import partial
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

import numpy as np
import pytest

from asperity.monitoring import notify as calls
from asperity.monitoring.store.database import SensorAddress, Store
from asperity.monitoring.store.sensors import Sensors

STORE = "in/asperity-watch/asperity.db"
LISTENER = """
import json, sys
with open(sys.argv[1], "a") as file:
    file.write(json.dumps(json.load(sys.stdin)) + "\\n")
"""


def snapshots(levels, first=0):
    """Write noise without a contact resonance, in recordings of 0.1 s."""
    Path("in").mkdir(exist_ok=True)
    for number, level in enumerate(levels, first):
        values = level * np.random.default_rng(number).standard_normal(2000)
        np.savez(Path("in") / f"s-{number:03}.npz", acc=values, fs=20e3, unit="m/s^2")


def watch(asp, *more):
    return asp(
        "watch",
        "in",
        "--once",
        "--settle",
        "0",
        "--quiet",
        "--machine",
        "Pump 3",
        "--point",
        "DE",
        *more,
    )


def query_store(query):
    with closing(sqlite3.connect(STORE)) as connection:
        return connection.execute(query).fetchall()


@pytest.fixture
def listener(tmp_path):
    """Return a program that appends its input to a file; its name contains shell characters."""
    Path(tmp_path / "listen.py").write_text(LISTENER)
    log = tmp_path / "log; $(touch never).jsonl"
    command = f"'{sys.executable}' '{tmp_path / 'listen.py'}' '{log}'"
    return (
        command,
        lambda: [json.loads(line) for line in log.read_text().splitlines()] if log.exists() else [],
    )


def test_a_command_is_called_once_per_change_of_state(asp, listener):
    command, events = listener
    send = ("--on-alarm", command)
    snapshots(np.ones(12))
    for _ in range(2):
        assert watch(asp, *send)[0] == 0
    assert [(event["state"], event["before"]) for event in events()] == [("none", None)]
    snapshots(np.exp(np.log(20.0) * np.arange(24) / 23), first=12)
    for _ in range(2):
        assert watch(asp, *send)[0] == 3
    assert [(event["state"], event["before"]) for event in events()[1:]] == [("alarm", "none")]
    event = events()[1]
    assert (event["machine"], event["point"], event["sensor"]) == ("Pump 3", "DE", "sensor")
    assert event["raised_by"] == "the level (rms)"
    assert event["verdict"].startswith("ALARM since s-")
    assert event["recording"].endswith("s-035.npz")
    assert event["since"] < event["recording"]
    assert watch(asp, *send, "--acknowledge", "last")[0] == 0
    assert [event["state"] for event in events()] == ["none", "alarm", "none"]
    assert len({event["id"] for event in events()}) == 3
    assert not Path("never").exists()  # no shell split the name


def test_a_failed_call_is_recorded_and_repeated(asp, listener, tmp_path):
    command, events = listener
    snapshots(np.ones(3))
    script = (tmp_path / "listen.py").read_text()
    (tmp_path / "listen.py").write_text("import sys\nsys.exit('no receiver')")
    code, out, err = watch(asp, "--on-alarm", command)
    assert (code, events()) == (4, [])
    assert (
        "could not be notified (exit code 1: no receiver); the notification will be sent"
        " again" in err
    )
    assert query_store("SELECT attempts, answered, failure FROM call") == [
        (1, None, "exit code 1: no receiver")
    ]
    (tmp_path / "listen.py").write_text(script)
    code, again, err = watch(
        asp, "--on-alarm", command
    )  # nothing is new, but a notification is pending
    assert (code, again, err) == (4, out, "")
    assert [event["state"] for event in events()] == ["cannot-tell"]
    assert query_store("SELECT attempts, failure FROM call WHERE answered IS NOT NULL") == [
        (2, None)
    ]


def test_a_command_that_does_not_end_is_stopped_with_its_children(monkeypatch, tmp_path):
    monkeypatch.setattr(calls, "COMMAND_S", 1.0)
    late = tmp_path / "late"
    child = f"import time; time.sleep(3); open({str(late)!r}, 'w')"
    parent = (
        f"import subprocess, sys, time; subprocess.Popen([sys.executable, '-c', {child!r}]);"
        " time.sleep(60)"
    )
    began = time.monotonic()
    with pytest.raises(calls.NotificationFailed, match="did not end within 1 s"):
        calls.Command((sys.executable, "-c", parent)).send({"state": "alarm"})
    assert time.monotonic() - began < 20.0
    time.sleep(3.5)
    assert not late.exists()


@contextmanager
def served(codes):
    """Serve a web address that answers with these codes in turn; yield it and the posts."""
    posts = []

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self):
            posts.append(
                (
                    self.path,
                    self.headers["Content-Type"],
                    self.rfile.read(int(self.headers["Content-Length"])),
                )
            )
            code = codes[min(len(posts), len(codes)) - 1]
            self.send_response(code)
            self.send_header("Location", "/elsewhere")
            self.send_header("Content-Length", "0")
            self.end_headers()

        def log_message(self, *_):
            pass

    server = HTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}/hook", posts
    finally:
        server.shutdown()
        server.server_close()


def test_a_web_address_is_posted_to_until_it_answers(asp):
    snapshots(np.ones(3))
    with served([503, 302, 204]) as (url, posts):
        assert "it answered 503 Service Unavailable" in watch(asp, "--webhook", url)[2]
        assert "it answered 302 Found" in watch(asp, "--webhook", url)[2]
        assert watch(asp, "--webhook", url)[2] == ""
        assert watch(asp, "--webhook", url)[2] == ""
    assert [path for path, _, _ in posts] == ["/hook"] * 3
    bodies = [json.loads(body) for _, _, body in posts]
    assert {kind for _, kind, _ in posts} == {"application/json"}
    assert len({body["id"] for body in bodies}) == 1  # identifies the event to the receiver
    assert bodies[-1]["state"] == "cannot-tell"
    assert query_store("SELECT attempts FROM call") == [(3,)]


def test_passwords_and_tokens_are_used_and_not_stored(asp):
    snapshots(np.ones(3))
    with served([500]) as (url, posts):
        secret = url.replace("http://", "http://bob:hunter2@") + "?token=S3CRET"
        err = watch(asp, "--webhook", secret)[2]
    path, _, _ = posts[0]
    assert path == "/hook?token=S3CRET"
    assert "it answered 500" in err
    kept_there = Path(STORE).read_bytes() + err.encode()
    assert not any(word in kept_there for word in (b"hunter2", b"S3CRET"))


def test_a_slow_answer_is_abandoned():
    began = time.monotonic()
    with pytest.raises(calls.NotificationFailed, match=r"no complete answer within 0\.2 s"):
        calls.within(0.2, partial(time.sleep, 5.0))
    assert time.monotonic() - began < 3.0


def test_pending_notifications_are_delivered_in_order(asp):
    snapshots(np.ones(3))
    with served([500, 500, 204]) as (url, posts):
        watch(asp, "--webhook", url)
        sensor = Sensors(Store(STORE), SensorAddress("Pump 3", "DE", "sensor"), {})
        last = sensor.last_judgement()
        sensor.queue_notifications(
            [calls.Webhook(url).name], last | {"alarm": last["alarm"] | {"state": "alarm"}}
        )
        assert len(calls.deliver(sensor, [calls.Webhook(url)], now=True)) == 1
        assert calls.deliver(sensor, [calls.Webhook(url)], now=True) == ()
    states = [json.loads(body)["state"] for _, _, body in posts]
    assert states == ["cannot-tell", "cannot-tell", "cannot-tell", "alarm"]


def test_a_call_that_keeps_failing_is_repeated_ever_less_often(asp):
    snapshots(np.ones(3))
    with served([500]) as (url, posts):
        watch(asp, "--webhook", url)
        sensor = Sensors(Store(STORE), SensorAddress("Pump 3", "DE", "sensor"), {})
        assert calls.deliver(sensor, [calls.Webhook(url)]) == ()  # not due yet
        assert len(posts) == 1
        with sensor.store.transaction() as run:
            run("UPDATE call SET attempts = 5000")  # a month of runs started by cron
        calls.deliver(sensor, [calls.Webhook(url)], now=True)
        ((_, attempts, due, _),) = sensor.pending_notifications(calls.Webhook(url).name)
    assert attempts == 5001
    assert 0.9 * calls.MAX_RETRY_S < due - time.time() <= calls.MAX_RETRY_S


BROKER = """
import asyncio, sys
from amqtt.broker import Broker

async def serve():
    plugins = {"amqtt.plugins.authentication.AnonymousAuthPlugin": {"allow_anonymous": True}}
    listeners = {"default": {"type": "tcp", "bind": sys.argv[1]}}
    await Broker({"listeners": listeners, "plugins": plugins}).start()
    print("ready", flush=True)
    await asyncio.sleep(120)

asyncio.run(serve())
"""


@contextmanager
def broker():
    """Start a small MQTT broker on loopback in its own process; return its port."""
    with closing(socket.socket()) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [sys.executable, "-c", BROKER, f"127.0.0.1:{port}"]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ) as process:
        try:
            assert process.stdout.readline() == "ready\n"
            yield port
        finally:
            process.kill()


def retained(port, topic):
    """Return the messages that a broker retains for later subscribers."""
    from paho.mqtt import subscribe

    return json.loads(
        subscribe.simple(topic, hostname="127.0.0.1", port=port, keepalive=20).payload
    )


def test_an_mqtt_broker_holds_the_last_state(asp):
    pytest.importorskip("amqtt", reason="the small broker is a development package")
    snapshots(np.ones(3))
    with broker() as port:
        assert watch(asp, "--mqtt", f"mqtt://127.0.0.1:{port}/plant/alarms")[2] == ""
        assert retained(port, "plant/alarms")["state"] == "cannot-tell"
        assert watch(asp, "--mqtt", f"mqtt://127.0.0.1:{port}")[2] == ""
        assert retained(port, "asperity/Pump 3/DE/sensor")["machine"] == "Pump 3"
    snapshots([1.0], first=3)
    watch(
        asp, "--mqtt", f"mqtt://127.0.0.1:{port}/plant/alarms"
    )  # the state is unchanged: no notification
    assert query_store("SELECT count(*) FROM call WHERE answered IS NULL") == [(0,)]
    code, _, err = watch(asp, "--mqtt", f"mqtt://user:secret@127.0.0.1:{port}/other")
    assert code == 4
    assert f"mqtt mqtt://127.0.0.1:{port}/other could not be notified" in err
    assert "secret" not in Path(STORE).read_bytes().decode("latin-1")


@pytest.mark.parametrize(
    ("option", "value", "message"),
    [
        ("--on-alarm", "no-such-program --now", "program 'no-such-program' not found"),
        ("--on-alarm", "", "program '' not found"),
        ("--on-alarm", "echo 'open", "cannot be parsed"),
        ("--webhook", "ftp://there/x", "it begins with http or https"),
        (
            "--webhook",
            "http://:80",
            "an address such as https://alarms.example/hook is needed, got 'http://:80'",
        ),
        ("--mqtt", "broker:1883", "it begins with mqtt or mqtts"),
        ("--mqtt", "mqtt://broker:port/x", "it begins with mqtt or mqtts"),
        ("--mqtt", "mqtt://broker/plant/+/alarms", "has neither + nor #"),
        ("--mqtt", "mqtt://broker/plant#1", "has neither + nor #"),
    ],
)
def test_invalid_notification_targets_are_refused_before_reading(asp, option, value, message):
    snapshots(np.ones(3))
    code, out, err = watch(asp, option, value)
    assert (code, out) == (2, "")
    assert message in err
    assert not Path(STORE).exists()


@pytest.mark.parametrize(
    "address",
    [
        "https://user:s3#q7@host/hook",
        "https://user:80#q7@host/hook",
        "https://user:s3q7\n@host/hook",
        "https://user:s3q7@host/a hook",
        "ftp://user:s3q7@host",
        "https://user:s3q7@host:port/hook",
    ],
)
def test_a_refused_address_does_not_print_its_password(asp, address):
    snapshots(np.ones(3))
    code, _, err = watch(asp, "--webhook", address)
    assert code == 2
    assert "special characters of a password are written as %23" in err
    for part in ("s3", "q7", "user"):
        assert part not in err


def test_mqtt_without_its_library_names_the_package_to_install(asp, monkeypatch):
    snapshots(np.ones(3))
    monkeypatch.setitem(sys.modules, "paho.mqtt.client", None)
    code, _, err = watch(asp, "--mqtt", "mqtt://127.0.0.1/x")
    assert code == 2
    assert "pip install 'asperity[monitor]'" in err
