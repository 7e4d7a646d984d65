"""Lookup of sensors in a store: by folder and names, or by address."""

from dataclasses import asdict, replace
from pathlib import Path

from asperity.core.documents import JsonObject
from asperity.monitoring.reading import channels_in
from asperity.monitoring.store.database import SensorAddress, Store
from asperity.monitoring.store.sensor import FOLDER, TOGETHER
from asperity.monitoring.store.sensors import Sensors
from asperity.monitoring.target import Target
from asperity.recording import ReadOptions


def settings_of(target: Target, options: ReadOptions) -> JsonObject:
    """Return the settings of reading, equal for all recordings of a sensor."""
    machine = {"rates_per_turn": dict(target.rates_per_turn)} if target.rates_per_turn else {}
    return {"band_hz": [round(end, 6) for end in target.band_hz]} | asdict(options) | machine


def open_sensors(
    store: str | Path | Store,
    folder: Path,
    names: tuple[str | None, str | None, str | None],
    target: Target,
    options: ReadOptions,
) -> Sensors:
    """Open the sensors of the store whose recordings are in a folder.

    Parameters
    ----------
    store : its file, or an open store
    names : of machine, point and sensor; without machine and point, recordings of other folders
        are refused
    target, options : with which recordings are read
    """
    machine, point, sensor = names
    channels = [channel for channel in channels_in(options.channel) if channel is not None]
    channel = ",".join(channels) or None
    address = SensorAddress(
        machine or folder.parent.name or "machine",
        point or folder.name or "point",
        sensor or channel or "sensor",
    )
    settings = settings_of(target, replace(options, channel=channel))
    settings |= {} if machine and point else {FOLDER: str(folder)}
    opened = store if isinstance(store, Store) else Store(store)
    return Sensors(
        opened, address, settings, channels=max(len(channels), 1), named=sensor is not None
    )


def sensors_judged_with(store: Store, address: SensorAddress) -> Sensors:
    """Return a sensor of the store and those that are judged with it."""
    stored = dict(store.sensors_at(address.machine, address.point))[address.sensor]
    return Sensors(store, address._replace(sensor=str(stored.get(TOGETHER, address.sensor))), {})
