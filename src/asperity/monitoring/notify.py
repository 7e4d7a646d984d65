"""Notification of changes of state: by a command (such as e-mail), web address or MQTT topic.

A notification is stored before it is sent, and stays until it has been delivered (at least once);
a failed one is sent again.
"""

import json
import os
import re
import shlex
import shutil
import signal
import subprocess
from base64 import b64encode
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from hashlib import sha256
from tempfile import TemporaryFile
from threading import Thread
from time import time
from typing import TYPE_CHECKING
from urllib.parse import SplitResult, unquote, urlsplit

from asperity.core.documents import JsonObject
from asperity.core.errors import BadInput, install_text
from asperity.core.third_party import first_line
from asperity.monitoring.settings import Notifier
from asperity.monitoring.store.sensors import Sensors

if TYPE_CHECKING:
    from paho.mqtt.client import MQTTMessageInfo

COMMAND_S, NETWORK_S = 30.0, 10.0  # time limits [s]
RETRY_S, MAX_RETRY_S = 5.0, 3600.0  # first interval between attempts, doubled up to the second [s]
MQTT_PORTS = {"mqtt": 1883, "mqtts": 8883}


class NotificationFailed(Exception):
    """A notification was not delivered; the message states why."""


@dataclass(frozen=True, slots=True)
class Command:
    """Program with arguments that gets the JSON on its standard input; run without a shell."""

    arguments: tuple[str, ...]

    @property
    def name(self) -> str:
        """Name of the recipient."""
        return f"command {self.arguments[0]} ({_fingerprint(*self.arguments)})"

    def send(self, notification: JsonObject) -> None:
        """Run the program; raise NotificationFailed unless it ends with 0 in time."""
        with TemporaryFile() as content, TemporaryFile() as errors:
            content.write(json.dumps(notification).encode())
            content.seek(0)
            process = subprocess.Popen(
                self.arguments,
                stdin=content,
                stdout=subprocess.DEVNULL,
                stderr=errors,
                start_new_session=True,
            )
            try:
                code = process.wait(COMMAND_S)
            except subprocess.TimeoutExpired:
                raise NotificationFailed(
                    f"it did not end within {COMMAND_S:g} s and was stopped"
                ) from None
            finally:
                if process.poll() is None:
                    _stop(process)
            if code:
                errors.seek(0)
                lines = errors.read(500).decode(errors="replace").strip().splitlines()
                raise NotificationFailed(f"exit code {code}{f': {lines[-1]}' if lines else ''}")


def _stop(process: subprocess.Popen[bytes]) -> None:
    """Stop a process, with its children where the system allows it."""
    if hasattr(os, "killpg"):
        os.killpg(process.pid, signal.SIGKILL)
    else:
        process.kill()
    process.wait()


@dataclass(frozen=True, slots=True)
class Webhook:
    """Web address to which the JSON is posted; a status of 200 to 299 confirms delivery."""

    url: str

    @property
    def name(self) -> str:
        """Name of the recipient."""
        parts = urlsplit(self.url)
        return (
            f"webhook {parts.scheme}://{parts.netloc.rpartition('@')[2]} ({_fingerprint(self.url)})"
        )

    def send(self, notification: JsonObject) -> None:
        """Post the JSON; raise NotificationFailed for another status, OSError without an answer."""
        content = json.dumps(notification).encode()
        post(self.url, content, {"Content-Type": "application/json"})


def post(url: str, content: bytes, headers: Mapping[str, str]) -> None:
    """Post content to a web address, with its user and password if it has them.

    Raises NotificationFailed for a status other than 200 to 299, OSError without an answer.
    """
    from urllib.request import HTTPError, HTTPRedirectHandler, Request, build_opener

    class NoRedirect(HTTPRedirectHandler):
        def redirect_request(self, *_: object) -> None:
            return None  # a redirected post becomes a get without content

    parts = urlsplit(url)
    authorization = {}
    if parts.username:
        credentials = f"{unquote(parts.username)}:{unquote(parts.password or '')}".encode()
        authorization = {"Authorization": f"Basic {b64encode(credentials).decode()}"}
    request = Request(
        _without_credentials(parts), content, {**headers, **authorization}, method="POST"
    )
    try:
        build_opener(NoRedirect).open(request, timeout=NETWORK_S).close()
    except HTTPError as error:
        error.close()
        raise NotificationFailed(f"it answered {error.code} {error.reason}") from None


@dataclass(frozen=True, slots=True)
class Topic:
    """Topic of an MQTT broker that retains the JSON; delivered at least once."""

    url: str

    @property
    def name(self) -> str:
        """Name of the recipient."""
        return f"mqtt {_without_credentials(urlsplit(self.url))}"

    def send(self, notification: JsonObject) -> None:
        """Publish the JSON; raise NotificationFailed unless confirmed, OSError without a broker."""
        from paho.mqtt import client as mqtt
        from paho.mqtt.enums import CallbackAPIVersion

        parts = urlsplit(self.url)
        address = [str(notification[name]) for name in ("machine", "point", "sensor")]
        topic = unquote(parts.path).strip("/") or "/".join(["asperity", *map(_level, address)])
        replies: list[str] = []
        client = mqtt.Client(CallbackAPIVersion.VERSION2)
        client.on_connect = lambda _client, _data, _flags, reason, _more: replies.append(
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
            sent = client.publish(topic, json.dumps(notification), qos=1, retain=True)
            sent.wait_for_publish(NETWORK_S)
            if not sent.is_published():
                reply = (
                    f"; it answered: {replies[-1]}" if replies and replies[-1] != "Success" else ""
                )
                raise NotificationFailed(
                    f"no confirmation by the broker within {NETWORK_S:g} s{reply}"
                )
        finally:
            client.disconnect()
            client.loop_stop()


class Presence:
    """Retained status of a watch at an MQTT broker: online, or offline as its last will.

    The topic is that of notifications with `/status`. A broken connection is made again.
    """

    def __init__(self, url: str) -> None:
        from paho.mqtt import client as mqtt
        from paho.mqtt.enums import CallbackAPIVersion

        parts = urlsplit(url)
        self.topic = f"{unquote(parts.path).strip('/') or 'asperity'}/status"
        self._client = mqtt.Client(CallbackAPIVersion.VERSION2)
        if parts.username:
            self._client.username_pw_set(unquote(parts.username), unquote(parts.password or ""))
        if parts.scheme == "mqtts":
            self._client.tls_set()
        self._client.will_set(self.topic, "offline", qos=1, retain=True)
        self._client.on_connect = self._announce
        self._client.connect_async(parts.hostname or "", parts.port or MQTT_PORTS[parts.scheme])
        self._client.loop_start()

    def _announce(self, *_: object) -> None:
        self._publish("online")

    def _publish(self, status: str) -> "MQTTMessageInfo":
        return self._client.publish(self.topic, status, qos=1, retain=True)

    def close(self) -> None:
        """Publish offline, as far as the broker can be reached, and end the connection."""
        if self._client.is_connected():
            with suppress(ValueError, RuntimeError):
                self._publish("offline").wait_for_publish(NETWORK_S)
        self._client.disconnect()
        self._client.loop_stop()


def _fingerprint(*words: str) -> str:
    """Return a digest that identifies a recipient without its passwords and tokens."""
    return sha256("\0".join(words).encode(errors="replace")).hexdigest()[:8]


def _level(name: str) -> str:
    """Return a name as one level of a topic."""
    return "".join("_" if letter in "/+#\0" else letter for letter in name)


def _without_credentials(parts: SplitResult) -> str:
    """Return an address without user and password."""
    return parts._replace(netloc=parts.netloc.rpartition("@")[2]).geturl()


def notifiers(
    *, command: str | None = None, webhook: str | None = None, mqtt: str | None = None
) -> tuple[Notifier, ...]:
    """Build notifiers: a command line, run without a shell; an http(s) and an mqtt(s) address.

    Raises
    ------
    BadInput
        if a program does not exist, an address is invalid, or the MQTT library is missing.
    """
    recipients: list[Notifier] = []
    if command is not None:
        try:
            arguments = shlex.split(command)
        except ValueError as error:
            raise BadInput(
                f"the command {command!r} cannot be parsed ({first_line(error)}); close its quotes"
            ) from None
        if not arguments or shutil.which(arguments[0]) is None:
            raise BadInput(
                f"program {arguments[0] if arguments else ''!r} not found; "
                "check its name, or give its path"
            )
        recipients.append(Command(tuple(arguments)))
    if webhook is not None:
        require_address(webhook, ("http", "https"), "https://alarms.example/hook")
        recipients.append(Webhook(webhook))
    if mqtt is not None:
        require_address(mqtt, tuple(MQTT_PORTS), "mqtt://broker.example/plant/alarms")
        try:
            import paho.mqtt.client  # noqa: F401
        except ImportError:
            raise BadInput(f"MQTT needs paho-mqtt; {install_text('monitor')}") from None
        if "+" in urlsplit(mqtt).path or "#" in mqtt:
            raise BadInput(
                "a topic to publish to has neither + nor #, "
                f"got {_without_credentials(urlsplit(mqtt))}; name one topic"
            )
        recipients.append(Topic(mqtt))
    return tuple(recipients)


def within(seconds: float, delivery: Callable[[], None]) -> None:
    """Run a delivery with a time limit: an answer may trickle in without end."""
    outcome: list[Exception | None] = []

    def run() -> None:
        try:
            delivery()
        except Exception as error:  # noqa: BLE001 (raised below)
            outcome.append(error)
        else:
            outcome.append(None)

    thread = Thread(target=run, daemon=True)
    thread.start()
    thread.join(seconds)
    if not outcome:
        raise NotificationFailed(f"no complete answer within {seconds:g} s")
    if outcome[0] is not None:
        raise outcome[0]


def require_address(url: str, schemes: Sequence[str], example: str) -> None:
    """Raise BadInput unless an address has a host and one of the schemes."""
    try:
        parts = urlsplit(url)
        fits = (
            parts.scheme in schemes
            and bool(parts.hostname)
            and (parts.port is None or parts.port > 0)
            and "@" not in parts.fragment  # the rest of a password with "#"
            and not re.search(r"[\s\x00-\x1f]", url)
        )
    except ValueError:
        fits = False
    if not fits:
        shown = re.sub(r"//.*@", "//...@", url, flags=re.DOTALL)
        raise BadInput(
            f"an address such as {example} is needed, got {shown[:80]!r}; it begins with "
            f"{' or '.join(schemes)}, and special characters of a password are written as %23"
        )


def deliver(
    sensors: Sensors, recipients: Sequence[Notifier], *, now: bool = False
) -> tuple[str, ...]:
    """Send the pending notifications that are due, in order; return a sentence per failure.

    `now` also sends those that are due later.
    """
    failed = []
    for notifier in recipients:
        for pending in sensors.pending_notifications(notifier.name):
            # one due after the longest interval was stored before the clock was set back
            if not now and 0.0 < pending.due_s - time() <= MAX_RETRY_S:
                break
            try:
                within(COMMAND_S + NETWORK_S, partial(notifier.send, json.loads(pending.text)))
            except Exception as error:  # noqa: BLE001 (program or network of the user)
                wait_s = min(RETRY_S * 2.0 ** min(pending.attempts, 20), MAX_RETRY_S)
                sensors.notifications.record_attempt(
                    pending.number, failure=first_line(error), due_s=time() + wait_s
                )
                failed.append(
                    f"{notifier.name} could not be notified ({first_line(error)}); "
                    "the notification will be sent again"
                )
                break  # later ones wait, to keep the order
            sensors.notifications.record_attempt(pending.number)
    return tuple(failed)
