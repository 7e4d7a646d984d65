"""Who is called when the state of a sensor changes: a command, a web address, an MQTT topic.

What is to be said stands in the store before anybody is called, and until somebody has answered: a
call that fails is made again. What changes, and when, is left to `watch`.
"""

import json
import os
import shlex
import shutil
import signal
import subprocess
from base64 import b64encode
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from hashlib import sha256
from tempfile import TemporaryFile
from threading import Thread
from time import time
from typing import Any, Protocol
from urllib.parse import SplitResult, unquote, urlsplit

from asperity.core.errors import BadInput
from asperity.core.third_party import first_line
from asperity.monitoring.sensors import Sensors

COMMAND_S, NETWORK_S = 30.0, 10.0  # for which an answer is waited for
RETRY_S, SELDOM_S = 5.0, 3600.0  # between the first two tries; twice as long each time, up to this
MQTT_PORTS = {"mqtt": 1883, "mqtts": 8883}


class Caller(Protocol):
    """Somebody to call; `name` says who, without any password."""

    @property
    def name(self) -> str:
        """Who is called."""

    def call(self, said: dict[str, Any]) -> None:
        """Say it; raises Exception, with the reason, where that has not worked."""


class Refused(Exception):
    """Why a call has not worked."""


@dataclass(frozen=True, slots=True)
class Command:
    """A program with its arguments, which gets the JSON on its standard input; no shell."""

    arguments: tuple[str, ...]

    @property
    def name(self) -> str:
        """Who is called."""
        return f"command {self.arguments[0]} ({_mark(*self.arguments)})"

    def call(self, said: dict[str, Any]) -> None:
        """Run it; Refused for another exit code than 0, or none in time."""
        with TemporaryFile() as told, TemporaryFile() as complaint:
            told.write(json.dumps(said).encode())
            told.seek(0)
            process = subprocess.Popen(
                self.arguments,
                stdin=told,
                stdout=subprocess.DEVNULL,
                stderr=complaint,
                start_new_session=True,
            )
            try:
                code = process.wait(COMMAND_S)
            except subprocess.TimeoutExpired:
                raise Refused(f"it did not end within {COMMAND_S:g} s and was stopped") from None
            finally:
                if process.poll() is None:
                    _stop(process)
            if code:
                complaint.seek(0)
                words = complaint.read(500).decode(errors="replace").strip().splitlines()
                raise Refused(f"exit code {code}{f': {words[-1]}' if words else ''}")


def _stop(process: subprocess.Popen[bytes]) -> None:
    """With all that it has started, where the system can tell."""
    if hasattr(os, "killpg"):
        os.killpg(process.pid, signal.SIGKILL)
    else:
        process.kill()
    process.wait()


@dataclass(frozen=True, slots=True)
class Webhook:
    """A web address to which the JSON is posted; an answer of 200 to 299 counts."""

    url: str

    @property
    def name(self) -> str:
        """Who is called."""
        parts = urlsplit(self.url)
        return f"webhook {parts.scheme}://{parts.netloc.rpartition('@')[2]} ({_mark(self.url)})"

    def call(self, said: dict[str, Any]) -> None:
        """Post it; Refused for another answer, OSError for none."""
        from urllib.error import HTTPError
        from urllib.request import HTTPRedirectHandler, Request, build_opener

        class Stay(HTTPRedirectHandler):
            def redirect_request(self, *_: Any) -> None:
                return None  # a post that is redirected becomes a get, and says nothing

        parts, headers = urlsplit(self.url), {"Content-Type": "application/json"}
        if parts.username:
            told = f"{unquote(parts.username)}:{unquote(parts.password or '')}".encode()
            headers["Authorization"] = f"Basic {b64encode(told).decode()}"
        request = Request(_bare(parts), json.dumps(said).encode(), headers, method="POST")
        try:
            build_opener(Stay).open(request, timeout=NETWORK_S).close()
        except HTTPError as error:
            error.close()
            raise Refused(f"it answered {error.code} {error.reason}") from None


@dataclass(frozen=True, slots=True)
class Topic:
    """A topic of an MQTT broker, at which the JSON is kept for who asks later: delivered at least once."""

    url: str

    @property
    def name(self) -> str:
        """Who is called."""
        return f"mqtt {_bare(urlsplit(self.url))}"

    def call(self, said: dict[str, Any]) -> None:
        """Publish it; Refused where the broker has not taken it in time, OSError where there is none."""
        from paho.mqtt import client as mqtt
        from paho.mqtt.enums import CallbackAPIVersion

        parts = urlsplit(self.url)
        topic = unquote(parts.path).strip("/") or "/".join(
            ["asperity", *(_level(said[name]) for name in ("machine", "point", "sensor"))]
        )
        answers: list[str] = []
        client = mqtt.Client(CallbackAPIVersion.VERSION2)
        client.on_connect = lambda _client, _data, _flags, reason, _more: answers.append(
            str(reason)
        )
        client.connect_timeout = NETWORK_S
        if parts.username:
            client.username_pw_set(unquote(parts.username), unquote(parts.password or ""))
        if parts.scheme == "mqtts":
            client.tls_set()
        client.connect(parts.hostname or "", parts.port or MQTT_PORTS[parts.scheme])
        client.loop_start()
        try:
            sent = client.publish(topic, json.dumps(said), qos=1, retain=True)
            sent.wait_for_publish(NETWORK_S)
            if not sent.is_published():
                said_so = (
                    f"; it said: {answers[-1]}" if answers and answers[-1] != "Success" else ""
                )
                raise Refused(f"the broker has not taken it within {NETWORK_S:g} s{said_so}")
        finally:
            client.disconnect()
            client.loop_stop()


def _mark(*words: str) -> str:
    """By which a caller is known again without its words, which may hold a password or a token."""
    return sha256("\0".join(words).encode(errors="replace")).hexdigest()[:8]


def _level(name: str) -> str:
    """A name as one level of a topic."""
    return "".join("_" if letter in "/+#\0" else letter for letter in name)


def _bare(parts: SplitResult) -> str:
    """An address without user and password."""
    return parts._replace(netloc=parts.netloc.rpartition("@")[2]).geturl()


def callers(
    *, command: str | None = None, webhook: str | None = None, mqtt: str | None = None
) -> tuple[Caller, ...]:
    """Who is to be called: a command line, split as a shell would but run without one; addresses http(s), mqtt(s).

    Raises
    ------
    BadInput
        for a program that is not there, an address that is none, or MQTT without its library.
    """
    called: list[Caller] = []
    if command is not None:
        try:
            arguments = shlex.split(command)
        except ValueError as error:
            raise BadInput(
                f"the command {command!r} cannot be split ({first_line(error)}); close its quotes"
            ) from None
        if not arguments or shutil.which(arguments[0]) is None:
            raise BadInput(
                f"there is no program {arguments[0] if arguments else ''!r} to call; check its name, or give its path"
            )
        called.append(Command(tuple(arguments)))
    if webhook is not None:
        _require_address(webhook, ("http", "https"), "https://alarms.example/hook")
        called.append(Webhook(webhook))
    if mqtt is not None:
        _require_address(mqtt, tuple(MQTT_PORTS), "mqtt://broker.example/plant/alarms")
        try:
            import paho.mqtt.client  # noqa: F401
        except ImportError:
            raise BadInput("MQTT needs paho-mqtt; pip install 'asperity[monitor]'") from None
        if "+" in urlsplit(mqtt).path or "#" in mqtt:
            raise BadInput(
                f"a topic to publish at has neither + nor #, got {_bare(urlsplit(mqtt))}; name one topic"
            )
        called.append(Topic(mqtt))
    return tuple(called)


def _within(seconds: float, call: Callable[[], None]) -> None:
    """A call that has to be done in time, whatever the other side does: an answer may drip for ever."""
    outcome: list[Exception | None] = []

    def made() -> None:
        try:
            call()
        except Exception as error:  # noqa: BLE001 (handed on)
            outcome.append(error)
        else:
            outcome.append(None)

    thread = Thread(target=made, daemon=True)
    thread.start()
    thread.join(seconds)
    if not outcome:
        raise Refused(f"no whole answer within {seconds:g} s")
    if outcome[0] is not None:
        raise outcome[0]


def _require_address(url: str, schemes: Sequence[str], example: str) -> None:
    try:
        parts = urlsplit(url)
        fits = (
            parts.scheme in schemes
            and bool(parts.hostname)
            and (parts.port is None or parts.port > 0)
        )
    except ValueError:
        fits = False
    if not fits:
        raise BadInput(
            f"an address such as {example} is needed, got {url!r}; it begins with {' or '.join(schemes)}"
        )


def deliver(sensors: Sensors, called: Sequence[Caller], *, now: bool = False) -> tuple[str, ...]:
    """Make the calls that are due, in their order; which have not worked, a sentence each.

    `now` makes those too that would be tried later.
    """
    failed = []
    for caller in called:
        for number, attempts, due, text in sensors.waiting(caller.name):
            if not now and due > time():
                break
            try:
                _within(COMMAND_S + NETWORK_S, partial(caller.call, json.loads(text)))
            except Exception as error:  # noqa: BLE001 (somebody else's program or network)
                wait = min(RETRY_S * 2.0 ** min(attempts, 20), SELDOM_S)
                sensors.called(number, failure=first_line(error), due=time() + wait)
                failed.append(
                    f"{caller.name} could not be called ({first_line(error)}); it is tried again"
                )
                break  # later ones wait, so that they are told in order
            sensors.called(number)
    return tuple(failed)
