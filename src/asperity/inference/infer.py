"""Inference of a contact from recordings or observations, and forecasts of a series."""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from pathlib import Path

from threadpoolctl import threadpool_limits

from asperity.case import Case
from asperity.core.arrays import Field, usual_float_errors
from asperity.core.errors import BadInput, require_choice
from asperity.inference.emulator import Emulator, build_emulator, extend_emulator
from asperity.inference.forecast import Forecast, Limit, forecast_observations, require_limit
from asperity.inference.forward import ChannelPrediction, ForwardModel, Law
from asperity.inference.inference import Inference
from asperity.inference.next_point import candidate_points, expected_information
from asperity.inference.observations import Observation, ObservationPoint, operating_points
from asperity.inference.posterior import (
    ContactPool,
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
from asperity.inference.recording_input import ObservedSeries, RecordingInput, observe_recordings
from asperity.inference.settings import Setting, inference_setting
from asperity.inference.structure_input import on_single_mass
from asperity.inference.visits import visit_series
from asperity.simulation import WearHistory, load_wear
from asperity.study import StudyProgress

EMULATOR_SHARE = 0.1  # of CLR's posterior variance from which on the emulator is extended
RECENT = 0.1  # fraction of a series regarded as one state of a changing contact
EXTENSION_STEP = 16  # points added to the emulator before the next posterior
MIN_DRIFT_STD = 0.02  # of a drift from a wear model, in shares of the range over the series
SAMPLERS: tuple[Sampler, ...] = ("importance", "nested")


@dataclass(frozen=True, slots=True, kw_only=True)
class InferenceSettings:
    """Numerical settings of an inference.

    Parameters
    ----------
    sampler : "importance", takes seconds; "nested", takes minutes, an independent check (dynesty)
    extend : maximum number of points to add to the emulator, see `refine_emulator`
    seed : random seed
    """

    sampler: Sampler = "importance"
    extend: int = 0
    seed: int = 0


@usual_float_errors
def infer_contact(
    recordings: Sequence[str | Path | Observation],
    *,
    case: Case,
    table: str | Path | None = None,
    emulator: Emulator | str | Path | None = None,
    settings: InferenceSettings | None = None,
    workers: int | None = None,
    executor: Executor | None = None,
    progress: Callable[[StudyProgress], None] | None = None,
) -> Inference:
    """Infer a contact's state from recordings: posterior intervals and their information gain.

    Parameters
    ----------
    recordings : files and folders, or `Observation` objects; without any, the prior is returned
    case : the contact; its [infer] defines the unknowns
    table : csv of operating points by file, see `RecordingInput`
    emulator : an emulator, or its folder; None: one in the user's cache. Building it once solves
        hundreds of contacts
    settings : sampler, extension of the emulator, random seed; None: the defaults
    workers, executor, progress : see `asperity.study.run_study`, for the emulator's contacts

    Raises
    ------
    BadInput
        for a case, table, recording or operating point that cannot be used; without the extra
        `infer`.
    AsperityError
        if a posterior was not found, or too many of the emulator's contacts fail.
    """
    settings = settings or InferenceSettings()
    require_choice("sampler", settings.sampler, SAMPLERS)
    setting = inference_setting(case)
    observed = [entry for entry in recordings if isinstance(entry, Observation)]
    files = [entry for entry in recordings if not isinstance(entry, Observation)]
    if observed and files:
        raise BadInput("recordings must be files or observations, not both")
    if files:
        series = observe_recordings(files, setting, source=RecordingInput(table=table))
    else:
        series = ObservedSeries(observations=tuple(observed))
    if not isinstance(emulator, Emulator):
        emulator = build_emulator(
            setting, folder=emulator, executor=executor, workers=workers, progress=progress
        )
    inference = infer_series(
        setting, emulator, series, sampler=settings.sampler, seed=settings.seed
    )
    return refine_emulator(
        inference,
        settings.extend,
        sampler=settings.sampler,
        executor=executor,
        workers=workers,
        progress=progress,
    )


def refine_emulator(
    inference: Inference,
    max_points: int,
    *,
    sampler: Sampler = "importance",
    executor: Executor | None = None,
    workers: int | None = None,
    progress: Callable[[StudyProgress], None] | None = None,
) -> Inference:
    """Extend the emulator in the region of the posterior by up to `max_points` points; add a note.

    Points are added in rounds, each with a new posterior, while the emulator's variance exceeds a
    tenth of the posterior variance of CLR (on its scale, at the case's operating point). They are
    posterior draws at the measured operating points in turn, and are stored with the emulator.
    `executor`, `workers` and `progress` are those of `build_emulator`.

    Raises
    ------
    BadInput
        for an emulator that is not on disk, or too many points.
    """
    added, first = 0, inference
    before = share = emulated_share(first.forward, first.draws)
    while max_points > added and share > EMULATOR_SHARE and inference.observations:
        count = min(max_points - added, EXTENSION_STEP)
        shares = posterior_shares(inference.forward, inference.draws, count, inference.seed + added)
        emulator = extend_emulator(
            inference.setting,
            inference.emulator,
            shares,
            executor=executor,
            workers=workers,
            progress=progress,
        )
        inference, added = (
            infer_observations(
                inference.setting,
                emulator,
                inference.observations,
                sampler=sampler,
                seed=inference.seed,
                excluded=inference.excluded,
                notes=first.notes,
            ),
            added + count,
        )
        share = emulated_share(inference.forward, inference.draws)
    if max_points == 0 or not inference.observations:
        return inference
    note = f"The emulator's error makes up {100 * share:.0f} % of the posterior variance of CLR"
    if added:
        note += f", {100 * before:.0f} % before {added} points were added"
    else:
        note += f"; it was not extended (threshold {100 * EMULATOR_SHARE:.0f} %)"
    return replace(inference, notes=(*inference.notes, f"{note}."))


def infer_series(
    setting: Setting,
    emulator: Emulator,
    series: ObservedSeries,
    *,
    sampler: Sampler = "importance",
    seed: int = 0,
) -> Inference:
    """Infer a contact from the result of `observe_recordings`, through its structure if any."""
    series = on_single_mass(setting, series)
    return infer_observations(
        setting,
        emulator,
        series.observations,
        sampler=sampler,
        seed=seed,
        excluded=series.excluded,
        notes=series.notes,
    )


def forecast_series(
    setting: Setting,
    emulator: Emulator,
    series: ObservedSeries,
    limit: Limit,
    *,
    worn: str | Path | WearHistory | None = None,
    seed: int = 0,
    x_name: str = "",
) -> Forecast:
    """Forecast the result of `observe_recordings`, see `forecast_observations`.

    Parameters
    ----------
    setting, emulator, limit, seed : see `forecast_observations`
    series : the observations
    worn : history of `asperity wear` as prior for the drift of Sq; its hours are those of x, from
        the first recording
    x_name : label of x; that of the track if there is one
    """
    series = on_single_mass(setting, series)
    x_name = series.track.x_name if series.track is not None else x_name
    times = [observation.x for observation in series.observations]
    drift = None
    if worn is not None and times:
        require_limit(setting, limit, worn=True)
        visit_series(series.observations)  # raises BadInput for an unusable series
        history = worn if isinstance(worn, WearHistory) else load_wear(worn)
        drift = wear_drift(setting, history, max(times) - min(times))
    forecast = forecast_observations(
        setting, emulator, series.observations, limit=limit, drift=drift, seed=seed
    )
    return replace(forecast, x_name=x_name)


def wear_drift(setting: Setting, history: WearHistory, hours: float) -> tuple[float, float]:
    """Return mean and deviation of the drift of Sq from a wear history, in shares over `hours`.

    Wear coefficients are uncertain by a factor of two: the deviation equals the drift.

    Raises
    ------
    BadInput
        if Sq is known in the case.
    """
    unknown = next((entry for entry in setting.contact if entry.key == "sq_m"), None)
    if unknown is None:
        raise BadInput("Sq is known in the case and cannot drift; leave --worn out")
    end = min(hours, history.hours)
    if end <= 0.0:
        raise BadInput("the wear history has no hours and gives no drift; leave --worn out")
    first, last = (
        float(share_of(unknown.range, unknown.from_si(history.values_at(time)["sq_m"])))
        for time in (0.0, end)
    )
    mean = (last - first) * hours / end
    return mean, max(abs(mean), MIN_DRIFT_STD)


def latest_observations(series: ObservedSeries) -> ObservedSeries:
    """Return only the last recording at each operating point, from the last tenth of the series."""
    times = [observation.x for observation in series.observations]
    start = max(times) - RECENT * (max(times) - min(times))
    last = {
        observation.conditions: observation
        for observation in sorted(series.observations, key=lambda entry: entry.x)
    }
    recent = [observation for observation in last.values() if observation.x >= start]
    note = (
        "The contact changes over the series: the numbers are those of the last recording at each "
        "operating point, within the last tenth of the series."
    )
    if len(recent) < len(last):
        note += f" Operating points recorded only before: {len(last) - len(recent)}."
    return replace(series, observations=tuple(recent), notes=(*series.notes, note))


def infer_observations(
    setting: Setting,
    emulator: Emulator,
    observations: Sequence[Observation],
    *,
    sampler: Sampler = "importance",
    seed: int = 0,
    excluded: tuple[tuple[str, str], ...] = (),
    notes: tuple[str, ...] = (),
) -> Inference:
    """Infer a contact from observations.

    Parameters
    ----------
    setting, emulator : from `inference_setting` and `build_emulator`
    observations : resonances with their operating points
    sampler, seed : see `InferenceSettings`
    excluded : recordings without a usable resonance, with reasons
    notes : notes to add to the result
    """
    conditions = setting.case.conditions
    case_point = ObservationPoint(conditions.load, conditions.entrainment_speed)
    forward = ForwardModel(setting, emulator, (case_point, *operating_points(observations)))
    source = _Source(tuple(observations), excluded, notes)
    with threadpool_limits(1, "blas"):  # the matrices are too small for several threads
        return _infer(forward, source, new_pools(forward, seed), sampler, seed)


def with_observation(inference: Inference, observation: Observation) -> Inference:
    """Update an inference with one more observation, reusing its draws: about a second.

    Raises
    ------
    BadInput
        for an operating point outside the emulator's ranges.
    """
    observations = (*inference.observations, observation)
    previous = inference.forward
    points = (previous.points[0], *operating_points(observations))
    forward = replace(previous, points=points)
    source = _Source(observations, inference.excluded, inference.notes)
    with threadpool_limits(1, "blas"):
        pools = _updated_pools(inference, forward)
        return _infer(forward, source, pools, "importance", inference.seed, prior=inference.prior)


def _updated_pools(inference: Inference, forward: ForwardModel) -> dict[Law, ContactPool]:
    """Return the draws of an inference with the outputs of `forward`, one observation further."""
    previous = inference.forward
    if not inference.observations:
        return new_pools(forward, inference.seed)
    pools = dict(inference.pools)
    if len(forward.points) > len(previous.points):
        return with_point(pools, forward, replace(previous, points=forward.points[-1:]))
    return {
        law: pool.with_columns(_predictor(forward, law), pool.outputs)
        for law, pool in pools.items()
    }


def _predictor(forward: ForwardModel, law: Law) -> Callable[[Field], ChannelPrediction]:
    return lambda z: forward.observed.predict(z, law)


@dataclass(frozen=True, slots=True)
class _Source:
    """The data of an inference: observations, excluded recordings and notes."""

    observations: tuple[Observation, ...]
    excluded: tuple[tuple[str, str], ...]
    notes: tuple[str, ...]


def _infer(
    forward: ForwardModel,
    source: _Source,
    pools: dict[Law, ContactPool],
    sampler: Sampler,
    seed: int,
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
        observations=source.observations,
        excluded=source.excluded,
        models=models,
        prior=prior_draws(forward, seed, prior),
        draws=draws,
        exact=posterior_draws(forward, sampled, discrepancy=False, seed=seed),
        candidates=tuple(candidates),
        pools=pools,
        seed=seed,
        notes=source.notes,
    )
