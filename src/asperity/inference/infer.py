"""The one call: recordings, or what they said, to what is possible of the contact."""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from pathlib import Path
from typing import Any

from asperity.case import Case
from asperity.core.errors import BadInput, require_choice
from asperity.inference.emulator import Emulator, build_emulator, extend_emulator
from asperity.inference.forecast import Forecast, Limit, forecast_observations, require_limit
from asperity.inference.forward import Forward, Law
from asperity.inference.inference import Inference
from asperity.inference.next_point import candidate_points, expected_information
from asperity.inference.observations import Observation, OperatingPoint, operating_points
from asperity.inference.posterior import (
    Draws,
    Sampler,
    emulated_share,
    new_pools,
    posterior_draws,
    posterior_shares,
    prior_draws,
    sample_models,
    with_point,
)
from asperity.inference.priors import share_of
from asperity.inference.recording_input import ObservedSeries, observe_recordings
from asperity.inference.sampling import Pool
from asperity.inference.settings import Setting, inference_setting
from asperity.inference.visits import visit_series
from asperity.simulation import WearHistory, load_wear
from asperity.study import StudyProgress

# share of CLR's variance over the posterior, from which on the emulator's own is worth reducing
MATERIAL = 0.1
LATELY = 0.1  # of a series: recordings of one state of a contact that changes
ROUND = 16  # points by which an emulator is extended before the next posterior
LEAST_DRIFT_STD = (
    0.02  # of a first drift that a wear model foretells, in shares of the range over the series
)
SAMPLERS: tuple[Sampler, ...] = ("importance", "nested")


def infer_contact(
    recordings: Sequence[str | Path | Observation],
    *,
    case: Case,
    table: str | Path | None = None,
    emulator: Emulator | str | Path | None = None,
    sampler: Sampler = "importance",
    extend: int = 0,
    seed: int = 0,
    workers: int | None = None,
    executor: Executor | None = None,
    progress: Callable[[StudyProgress], None] | None = None,
) -> Inference:
    """What recordings say of a contact, with intervals, and what cannot be told.

    Parameters
    ----------
    recordings : files and folders, or each an `Observation`; none at all gives what is known before any
    case : the contact; its [infer] says what is not known of it
    table : csv of what each file was recorded at, see `observe_recordings`
    emulator : one that is there, or the folder to keep it in; None: one in the user's cache. Building it solves
        hundreds of contacts, once
    sampler : "importance", seconds; "nested", minutes, by dynesty, to check the other
    extend : by how many points the emulator may be extended where the posterior is, see `refine_emulator`
    seed : of all that is drawn; the same seed gives the same numbers
    workers, executor, progress : see `asperity.study.run_study`, of the emulator's contacts

    Raises
    ------
    BadInput
        for a case, table, recording or operating point that cannot be used; without the extra `infer`.
    AsperityError
        where a posterior was not found, or too many of the emulator's contacts fail.
    """
    require_choice("sampler", sampler, SAMPLERS)
    setting = inference_setting(case)
    given = [one for one in recordings if isinstance(one, Observation)]
    files = [one for one in recordings if not isinstance(one, Observation)]
    if given and files:
        raise BadInput(
            "recordings must be files or observations, got both; infer one after the other"
        )
    heard = (
        observe_recordings(files, setting, table=table)
        if files
        else ObservedSeries(observations=tuple(given))
    )
    if not isinstance(emulator, Emulator):
        emulator = build_emulator(
            setting, folder=emulator, executor=executor, workers=workers, progress=progress
        )
    found = infer_series(setting, emulator, heard, sampler=sampler, seed=seed)
    return refine_emulator(
        found, extend, sampler=sampler, executor=executor, workers=workers, progress=progress
    )


def refine_emulator(
    found: Inference, most: int, *, sampler: Sampler = "importance", **how: Any
) -> Inference:
    """The same with an emulator that is extended where the posterior is, by up to `most` points; and a note of it.

    In rounds, each a posterior, as long as the emulator's own variance is more than a tenth of
    CLR's over the posterior, on its scale, at the case's own operating point. Further points are
    contacts drawn from the posterior, at this operating point and those that were heard in turn;
    they are kept with the emulator. `how` is as `build_emulator` takes it.

    Raises
    ------
    BadInput
        for an emulator that is not kept on disk, or one that would have too many points.
    """
    added, first = 0, found
    before = share = emulated_share(first.forward, first.draws)
    while most > added and share > MATERIAL and found.observations:
        count = min(most - added, ROUND)
        shares = posterior_shares(found.forward, found.draws, count, found.seed + added)
        emulator = extend_emulator(found.setting, found.emulator, shares, **how)
        found, added = (
            infer_observations(
                found.setting,
                emulator,
                found.observations,
                sampler=sampler,
                seed=found.seed,
                silent=found.silent,
                notes=first.notes,
            ),
            added + count,
        )
        share = emulated_share(found.forward, found.draws)
    if most == 0 or not found.observations:
        return found
    said = f"The emulator's own error makes {100 * share:.0f} % of the variance of CLR that is left"
    if added:
        said += f", {100 * before:.0f} % before it was extended by {added} points where the posterior is"
    else:
        said += f", and it was not extended: it is from {100 * MATERIAL:.0f} % on"
    return replace(found, notes=(*found.notes, f"{said}."))


def infer_series(
    setting: Setting,
    emulator: Emulator,
    heard: ObservedSeries,
    *,
    sampler: Sampler = "importance",
    seed: int = 0,
) -> Inference:
    """The same, of what `observe_recordings` heard."""
    return infer_observations(
        setting,
        emulator,
        heard.observations,
        sampler=sampler,
        seed=seed,
        silent=heard.silent,
        notes=heard.notes,
    )


def forecast_series(
    setting: Setting,
    emulator: Emulator,
    heard: ObservedSeries,
    limit: Limit,
    *,
    worn: str | Path | WearHistory | None = None,
    seed: int = 0,
    x_name: str = "",
) -> Forecast:
    """`forecast_observations` of what `observe_recordings` heard; `worn` is a history of `asperity wear`, whose drift is expected.

    Its hours are those of x, from the first recording on. `x_name` is what x is, that of the track
    where it has one.
    """
    x_name = heard.track.x_name if heard.track is not None else x_name
    times = [one.x for one in heard.observations]
    drift = None
    if worn is not None and times:
        require_limit(setting, limit, worn=True)
        visit_series(heard.observations)  # refuses what is no series
        history = worn if isinstance(worn, WearHistory) else load_wear(worn)
        drift = wear_drift(setting, history, max(times) - min(times))
    return forecast_observations(
        setting, emulator, heard.observations, limit=limit, drift=drift, seed=seed, x_name=x_name
    )


def wear_drift(setting: Setting, history: WearHistory, hours: float) -> tuple[float, float]:
    """First drift of Sq, in shares of its range over so many hours, as a wear history has it; and its deviation.

    Wear coefficients are known to a factor of two: the deviation is the drift itself.

    Raises
    ------
    BadInput
        where the case knows its Sq.
    """
    unknown = next((one for one in setting.contact if one.key == "sq_m"), None)
    if unknown is None:
        raise BadInput("the case knows its Sq, which cannot drift; leave --worn out")
    end = min(hours, history.hours)
    if end <= 0.0:
        raise BadInput(
            "the wear history has no hours, and says nothing of a drift; leave --worn out"
        )
    first, last = (
        float(share_of(unknown.range, unknown.from_si(history.at(time)["sq_m"])))
        for time in (0.0, end)
    )
    mean = (last - first) * hours / end
    return mean, max(abs(mean), LEAST_DRIFT_STD)


def latest_observations(heard: ObservedSeries) -> ObservedSeries:
    """The last recording at each operating point alone, of the last tenth of the series: the contact has changed."""
    times = [one.x for one in heard.observations]
    begin = max(times) - LATELY * (max(times) - min(times))
    last = {one.place: one for one in sorted(heard.observations, key=lambda one: one.x)}
    of_now = [one for one in last.values() if one.x >= begin]
    note = (
        "The contact changes over the series: the numbers are of the last recording at each operating point, in the "
        "last tenth of it."
    )
    if len(of_now) < len(last):
        note += f" Operating points that were last recorded before: {len(last) - len(of_now)}."
    return replace(heard, observations=tuple(of_now), notes=(*heard.notes, note))


def infer_observations(
    setting: Setting,
    emulator: Emulator,
    observations: Sequence[Observation],
    *,
    sampler: Sampler = "importance",
    seed: int = 0,
    silent: tuple[tuple[str, str], ...] = (),
    notes: tuple[str, ...] = (),
) -> Inference:
    """The same, of a setting and its emulator; `silent` are recordings that said nothing, and why."""
    conditions = setting.case.conditions
    own = OperatingPoint(conditions.load, conditions.entrainment_speed)
    forward = Forward(setting, emulator, (own, *operating_points(observations)))
    return _inferred(
        forward, tuple(observations), new_pools(forward, seed), sampler, seed, silent, notes
    )


def with_observation(inference: Inference, observation: Observation) -> Inference:
    """One recording more, by the draws that are there: a second where the whole takes several.

    Raises
    ------
    BadInput
        for an operating point that the emulator does not reach.
    """
    observations = (*inference.observations, observation)
    before = inference.forward
    points = (before.points[0], *operating_points(observations))
    forward, pools = replace(before, points=points), dict(inference.pools)
    if not inference.observations:
        pools = new_pools(forward, inference.seed)
    elif len(points) > len(before.points):
        pools = with_point(pools, forward, replace(before, points=points[-1:]))
    else:
        pools = {
            law: pool.with_columns(_again(forward, law), pool.shown) for law, pool in pools.items()
        }
    told = inference.silent, inference.notes
    return _inferred(
        forward, observations, pools, "importance", inference.seed, *told, prior=inference.prior
    )


def _again(forward: Forward, law: Law) -> Callable[..., object]:
    return lambda z: forward.heard.shown(z, law)


def _inferred(
    forward: Forward,
    observations: tuple[Observation, ...],
    pools: dict[Law, Pool],
    sampler: Sampler,
    seed: int,
    silent: tuple[tuple[str, str], ...],
    notes: tuple[str, ...],
    *,
    prior: Draws | None = None,
) -> Inference:
    models, sampled = sample_models(
        forward, pools, sampler=sampler, seed=seed, quickly=prior is not None
    )
    draws = posterior_draws(forward, sampled, discrepancy=True, seed=seed)
    candidates = expected_information(forward, draws, candidate_points(forward.setting), seed=seed)
    return Inference(
        forward=forward,
        observations=observations,
        silent=silent,
        models=models,
        prior=prior_draws(forward, seed, prior),
        draws=draws,
        exact=posterior_draws(forward, sampled, discrepancy=False, seed=seed),
        candidates=tuple(candidates),
        pools=pools,
        seed=seed,
        notes=notes,
    )
