"""Who is called when a state changes, as a user meets it: a command, a web address, an MQTT broker;
all on loopback.
"""

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
with open(sys.argv[1], "a") as heard:
    heard.write(json.dumps(json.load(sys.stdin)) + "\\n")
"""


def snapshots(levels, first=0):
    """Noise of a machine without a contact resonance: a tenth of a second each."""
    Path("in").mkdir(exist_ok=True)
    for number, level in enumerate(levels, first):
        values = level * np.random.default_rng(number).standard_normal(2000)
        np.savez(Path("in") / f"s-{number:03}.npz", acc=values, fs=20e3, unit="m/s^2")


def watched(asp, *more):
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


def kept(query):
    with closing(sqlite3.connect(STORE)) as connection:
        return connection.execute(query).fetchall()


@pytest.fixture
def listener(tmp_path):
    """A program that appends what it hears to a file whose name holds what a shell would take
    apart.
    """
    Path(tmp_path / "listen.py").write_text(LISTENER)
    heard = tmp_path / "heard; $(touch never).jsonl"
    command = f"'{sys.executable}' '{tmp_path / 'listen.py'}' '{heard}'"
    return (
        command,
        lambda: (
            [json.loads(line) for line in heard.read_text().splitlines()] if heard.exists() else []
        ),
    )


def test_a_command_is_called_once_a_change_of_state(asp, listener):
    command, heard = listener
    send = ("--on-alarm", command)
    snapshots(np.ones(12))
    for _ in range(2):
        assert watched(asp, *send)[0] == 4  # no resonance in snapshots
    assert [(said["state"], said["before"]) for said in heard()] == [("cannot-tell", None)]
    snapshots(np.exp(np.log(20.0) * np.arange(24) / 23), first=12)
    for _ in range(2):
        assert watched(asp, *send)[0] == 3
    assert [(said["state"], said["before"]) for said in heard()[1:]] == [("alarm", "cannot-tell")]
    said = heard()[1]
    assert (said["machine"], said["point"], said["sensor"]) == ("Pump 3", "DE", "sensor")
    assert said["raised_by"] == "the level (rms)"
    assert said["verdict"].startswith("ALARM since s-")
    assert said["recording"].endswith("s-035.npz")
    assert said["since"] < said["recording"]
    assert watched(asp, *send, "--acknowledge", "last")[0] == 0
    assert [said["state"] for said in heard()] == ["cannot-tell", "alarm", "none"]
    assert len({said["id"] for said in heard()}) == 3
    assert not Path("never").exists()  # no shell took the name apart


def test_a_call_that_fails_is_noted_and_made_again(asp, listener, tmp_path):
    command, heard = listener
    snapshots(np.ones(3))
    script = (tmp_path / "listen.py").read_text()
    (tmp_path / "listen.py").write_text("import sys\nsys.exit('nobody is at home')")
    code, out, err = watched(asp, "--on-alarm", command)
    assert (code, heard()) == (4, [])
    assert (
        "could not be notified (exit code 1: nobody is at home); the notification will be sent"
        " again" in err
    )
    assert kept("SELECT attempts, answered, failure FROM call") == [
        (1, None, "exit code 1: nobody is at home")
    ]
    (tmp_path / "listen.py").write_text(script)
    code, again, err = watched(
        asp, "--on-alarm", command
    )  # nothing is new, but somebody still has to be told
    assert (code, again, err) == (4, out, "")
    assert [said["state"] for said in heard()] == ["cannot-tell"]
    assert kept("SELECT attempts, failure FROM call WHERE answered IS NOT NULL") == [(2, None)]


def test_a_command_that_does_not_end_is_stopped_with_all_it_started(monkeypatch, tmp_path):
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
    """A web address that answers with these codes, one after another; and what was posted to it."""
    heard = []

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self):
            heard.append(
                (
                    self.path,
                    self.headers["Content-Type"],
                    self.rfile.read(int(self.headers["Content-Length"])),
                )
            )
            code = codes[min(len(heard), len(codes)) - 1]
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
        yield f"http://127.0.0.1:{server.server_port}/hook", heard
    finally:
        server.shutdown()
        server.server_close()


def test_a_web_address_is_posted_to_until_it_answers(asp):
    snapshots(np.ones(3))
    with served([503, 302, 204]) as (url, heard):
        assert "it answered 503 Service Unavailable" in watched(asp, "--webhook", url)[2]
        assert "it answered 302 Found" in watched(asp, "--webhook", url)[2]
        assert watched(asp, "--webhook", url)[2] == ""
        assert watched(asp, "--webhook", url)[2] == ""
    assert [path for path, _, _ in heard] == ["/hook"] * 3
    bodies = [json.loads(body) for _, _, body in heard]
    assert {kind for _, kind, _ in heard} == {"application/json"}
    assert len({body["id"] for body in bodies}) == 1  # by which a receiver knows it again
    assert bodies[-1]["state"] == "cannot-tell"
    assert kept("SELECT attempts FROM call") == [(3,)]


def test_passwords_and_tokens_are_used_and_not_kept(asp):
    snapshots(np.ones(3))
    with served([500]) as (url, heard):
        secret = url.replace("http://", "http://bob:hunter2@") + "?token=S3CRET"
        err = watched(asp, "--webhook", secret)[2]
    path, _, _ = heard[0]
    assert path == "/hook?token=S3CRET"
    assert "it answered 500" in err
    kept_there = Path(STORE).read_bytes() + err.encode()
    assert not any(word in kept_there for word in (b"hunter2", b"S3CRET"))


def test_an_answer_that_drips_is_not_waited_for():
    began = time.monotonic()
    with pytest.raises(calls.NotificationFailed, match=r"no complete answer within 0\.2 s"):
        calls._within(0.2, partial(time.sleep, 5.0))
    assert time.monotonic() - began < 3.0


def test_what_waits_is_told_in_its_order(asp):
    snapshots(np.ones(3))
    with served([500, 500, 204]) as (url, heard):
        watched(asp, "--webhook", url)
        sensor = Sensors(Store(STORE), SensorAddress("Pump 3", "DE", "sensor"), {})
        last = sensor.last_judgement()
        sensor.queue_notifications(
            [calls.Webhook(url).name], last | {"alarm": last["alarm"] | {"state": "alarm"}}
        )
        assert len(calls.deliver(sensor, [calls.Webhook(url)], now=True)) == 1
        assert calls.deliver(sensor, [calls.Webhook(url)], now=True) == ()
    states = [json.loads(body)["state"] for _, _, body in heard]
    assert states == ["cannot-tell", "cannot-tell", "cannot-tell", "alarm"]


def test_a_call_that_keeps_failing_is_made_ever_more_seldom(asp):
    snapshots(np.ones(3))
    with served([500]) as (url, heard):
        watched(asp, "--webhook", url)
        sensor = Sensors(Store(STORE), SensorAddress("Pump 3", "DE", "sensor"), {})
        assert calls.deliver(sensor, [calls.Webhook(url)]) == ()  # not due yet
        assert len(heard) == 1
        with sensor.store.transaction() as run:
            run("UPDATE call SET attempts = 5000")  # a month at every start of cron's
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
    """A small MQTT broker on loopback, in a process of its own; its port."""
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
    """What a broker holds for who asks later."""
    from paho.mqtt import subscribe

    return json.loads(
        subscribe.simple(topic, hostname="127.0.0.1", port=port, keepalive=20).payload
    )


def test_an_mqtt_broker_holds_the_last_state(asp):
    pytest.importorskip("amqtt", reason="the small broker is a development package")
    snapshots(np.ones(3))
    with broker() as port:
        assert watched(asp, "--mqtt", f"mqtt://127.0.0.1:{port}/plant/alarms")[2] == ""
        assert retained(port, "plant/alarms")["state"] == "cannot-tell"
        assert watched(asp, "--mqtt", f"mqtt://127.0.0.1:{port}")[2] == ""
        assert retained(port, "asperity/Pump 3/DE/sensor")["machine"] == "Pump 3"
    snapshots([1.0], first=3)
    watched(
        asp, "--mqtt", f"mqtt://127.0.0.1:{port}/plant/alarms"
    )  # the state is the same: nobody is called
    assert kept("SELECT count(*) FROM call WHERE answered IS NULL") == [(0,)]
    code, _, err = watched(asp, "--mqtt", f"mqtt://somebody:secret@127.0.0.1:{port}/other")
    assert code == 4
    assert f"mqtt mqtt://127.0.0.1:{port}/other could not be notified" in err
    assert "secret" not in Path(STORE).read_bytes().decode("latin-1")


@pytest.mark.parametrize(
    ("option", "value", "said"),
    [
        ("--on-alarm", "no-such-program --now", "there is no program 'no-such-program' to run"),
        ("--on-alarm", "", "there is no program '' to run"),
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
def test_who_cannot_be_called_is_refused_before_anything_is_read(asp, option, value, said):
    snapshots(np.ones(3))
    code, out, err = watched(asp, option, value)
    assert (code, out) == (2, "")
    assert said in err
    assert not Path(STORE).exists()


def test_mqtt_without_its_library_says_what_to_install(asp, monkeypatch):
    snapshots(np.ones(3))
    monkeypatch.setitem(sys.modules, "paho.mqtt.client", None)
    code, _, err = watched(asp, "--mqtt", "mqtt://127.0.0.1/x")
    assert code == 2
    assert "pip install 'asperity[monitor]'" in err
