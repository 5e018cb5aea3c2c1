# Copyright 2026 ahv developers, Apache-2.0
"""Monte-Carlo campaigns: drawn flights on any executor, one row a run, resumed if stopped."""

import os
import platform
import sys
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, CancelledError, Executor, Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from ahv_analysis.bag.rows import Array
from ahv_analysis.campaign.batch import (
    find_trims,
    fly_alone,
    fly_batch,
    fly_batch_on_hardware,
)
from ahv_analysis.campaign.draws import checked_draws
from ahv_analysis.campaign.nose_down import nose_down, nose_down_alphas
from ahv_analysis.campaign.store import (
    PART_RUNS,
    Columns,
    differences,
    level_folder,
    level_name,
    part_file,
    part_files,
    read_part,
    read_parts,
    write_part,
)
from ahv_analysis.errors import CampaignError, CampaignStopped
from ahv_analysis.flight.case import (
    OWN_LAW,
    Case,
    Draw,
    dispersion_parameters,
    make_case,
)
from ahv_analysis.flight.outcome import Corridor, Outcome
from ahv_analysis.versions import what_computes
from ahv_control.law_file import compiling, law_identity
from ahv_control.own_law import is_compiled
from ahv_plant.dispersion import Dispersion, draw_dispersion, in_calm
from ahv_plant.draws import Distributions, draw_values
from ahv_plant.hardware.noise import NO_DRAWS
from ahv_plant.hardware.wind import is_turbulent
from ahv_plant.level_trim import LevelTrim, level_trim
from ahv_plant.model.constants import DEGREES, STEP, UNSTART_ALPHA
from ahv_plant.model.vectors import State
from ahv_plant.numerics.identity import Definition
from ahv_plant.plant import noise_stream, rig

RUNS_PER_JOB = 64  # four batches: half a second of work, so that little is lost and little waits
RUNS_IN_PLAIN_PYTHON = 4  # the same for laws that are not compiled: some seconds of work
LOOK = 0.2  # [s] between looks for an interruption
JOBS_UNDER_WAY = 64  # handed to the executor at a time, so that a campaign of any size can wait
# Random starts of section 3.5.2, around the case's own: plus and minus, in the plant's parameters.
START_SPREAD = {
    "initial.u": 100.0,  # [m/s]
    "initial.P": 5.0,  # [deg/s]
    "initial.Q": 5.0,  # [deg/s]
    "initial.R": 5.0,  # [deg/s]
    "initial.h": 500.0,  # [m]
}
COMPUTED_BY = what_computes(Definition(Path(__file__).resolve(), "fly_runs"))


@dataclass(frozen=True)
class Campaign:
    """What is flown: `runs` vehicles drawn at a level [-], from one start or from random ones."""

    case: Case
    level: float
    runs: int
    seed: int
    random_starts: bool = False
    draws: dict[str, Any] | None = None  # what else is drawn, as a file of `load_draws` holds it
    corridor: Corridor | None = None  # which a run must keep to as well

    def describe(self) -> dict[str, Any]:
        """All that decides a run: what computes it too, but not the number of runs."""
        law = self.case.law
        return {
            **COMPUTED_BY,
            **({} if law is None else {"law": law.identity}),
            "case": self.case.name,
            "level": self.level,
            "seed": self.seed,
            "random_starts": self.random_starts,
            "draws": self.draws,
            **({} if self.corridor is None else {"corridor": self.corridor._asdict()}),
            "parameters": self.case.parameters,
        }

    def dispersion(self, run: int) -> Dispersion:
        """Dispersion of a run."""
        return draw_dispersion(self.level, self.seed, run)

    def start(self, run: int) -> State:
        """First state of a run."""
        return self.case_of(run).plant.initial if self.random_starts else self.case.plant.initial

    def controls(self, run: int) -> tuple[float, ...]:
        """Where the actuators rest before the run, on hardware, in the order of `Controls`."""
        case = self.case_of(run) if self.random_starts else self.case
        assert case.plant.hardware is not None
        start = case.plant.hardware.start
        return *start.surfaces, start.throttle

    @cached_property
    def _distributions(self) -> Distributions | None:
        return None if self.draws is None else checked_draws(self.draws)

    def case_of(self, run: int) -> Case:
        """Return the case that flies one run alone, with the same bits, by any engine."""
        plant = self.case.parameters["plant"] | dispersion_parameters(self.dispersion(run))
        if self.random_starts:
            draws = np.random.default_rng((self.seed, run, 1)).uniform(
                -1.0, 1.0, len(START_SPREAD)
            )
            for (name, spread), draw in zip(START_SPREAD.items(), draws.tolist(), strict=True):
                plant[name] = float(plant[name]) + spread * draw
        if self._distributions is not None:
            plant |= draw_values(self._distributions, self.seed, run)
        plant |= {"noise.seed": self.seed, "noise.run": run}
        draw = Draw(self.level, self.seed, run, self.random_starts)
        return make_case(self.case.name, self.case.parameters | {"plant": plant}, draw)


def fly_runs(campaign: Campaign, first: int, count: int) -> Columns:
    """Fly runs `first` to `first + count - 1`: a column a quantity, as in the campaign's file.

    Runs that differ in more than lanes can differ in are flown one by one.
    """
    runs = range(first, first + count)
    drawn_filters = campaign.random_starts and is_turbulent(campaign.case.plant.truth.wind)
    alone = drawn_filters or not is_compiled(campaign.case.control)
    if campaign.draws is not None or alone:  # filters of turbulence go by the first speed
        rows = [fly_again(campaign, run) for run in runs]
        return {name: np.concatenate([row[name] for row in rows]) for name in rows[0]}
    dispersions = np.array([campaign.dispersion(run) for run in runs])
    states = np.array([campaign.start(run) for run in runs])
    case = campaign.case
    control, (initial, steps, truth, hardware, _) = case.control, case.plant
    starts = None
    if hardware is None:
        outcomes = fly_batch(states, dispersions, truth, control, steps, campaign.corridor)
    else:
        noise = [noise_stream(hardware, truth.wind, campaign.seed, run) for run in runs]
        starts = np.array([campaign.controls(run) for run in runs])
        outcomes = fly_batch_on_hardware(
            states,
            dispersions,
            starts,
            noise,
            truth,
            control,
            hardware,
            steps,
            campaign.corridor,
        )
    trims = find_trims(
        dispersions,
        control.altitude,
        control.speed,
        initial.mass,
        in_calm(truth),
    )
    bounds = nose_down_alphas(states, dispersions, starts, truth, hardware)
    return _columns(np.array(runs), dispersions, states, outcomes, bounds, trims)


def fly_again(campaign: Campaign, run: int) -> Columns:
    """Fly one run by scalar code: the columns of its row, with the same bits."""
    case = campaign.case_of(run)
    control, initial, truth = case.control, case.plant.initial, case.plant.truth
    outcome = fly_alone(case, campaign.corridor)
    altitude, speed = control.altitude, control.speed
    trim = level_trim(altitude, speed, initial.mass, in_calm(truth))
    draws = None if case.plant.hardware is None else NO_DRAWS
    bound = nose_down(initial, truth, draws, rig(case.plant.hardware))
    rows = [run], [truth.dispersion], [initial], [outcome], [[bound]], [trim]
    return _columns(*map(np.array, rows))


def fly_job(described: dict[str, Any], first: int, count: int) -> Columns | str:
    """Fly runs of the campaign that is `described`, in any process; or why this one must not.

    A refusal is a result and no error, for executors try again elsewhere what is one.
    """
    differing = differences(described | COMPUTED_BY | _law_here(described), described)
    if differing:
        return (
            f"{_this_worker()} would compute other numbers ({differing}): "
            "give it the code and the packages of this machine, and start it anew"
        )
    campaign = _campaign_of(described, first + count)
    with compiling(campaign.case.law):
        return fly_runs(campaign, first, count)


def _law_here(described: Mapping[str, Any]) -> dict[str, str]:
    """Identity of the law of a campaign in this process, as `describe` has it; read, not run."""
    if "law" not in described:
        return {}
    return {"law": law_identity(str(described["parameters"][OWN_LAW]["law"]))}


def _this_worker() -> str:
    """Name this process, by its address if dask runs it."""
    if "distributed" in sys.modules:
        with suppress(ValueError):  # there is no worker in this process
            return f"worker {sys.modules['distributed'].get_worker().address}"
    return f"process {os.getpid()} on {platform.node()}"


def _columns(
    runs: Array,
    dispersions: Array,
    states: Array,
    outcomes: Array,
    bounds: Array,
    trims: Array,
) -> Columns:
    """Columns of the campaign's file."""
    outcome, trim = Outcome(*outcomes.T), LevelTrim(*trims.T)
    table: Columns = {"run": runs}
    counted = np.maximum(outcome.steps, 1)
    table |= {name: dispersions[:, i] for i, name in enumerate(Dispersion._fields)}
    table |= {
        f"initial_{name}": states[:, State._fields.index(name)] for name in ("u", *"PQR", "h")
    }
    return table | {
        "cause": outcome.cause.astype(np.int64),
        "time_s": np.maximum(outcome.steps - 1, 0) * STEP,
        "max_abs_alpha_deg": outcome.max_abs_alpha * DEGREES,
        "alpha_margin_deg": UNSTART_ALPHA * DEGREES - outcome.max_abs_alpha * DEGREES,
        "max_abs_beta_deg": outcome.max_abs_beta * DEGREES,
        "max_abs_rate_dps": outcome.max_abs_rate * DEGREES,
        "max_abs_phi_deg": outcome.max_abs_phi * DEGREES,
        "min_surface_deg": outcome.min_surface * DEGREES,
        "max_surface_deg": outcome.max_surface * DEGREES,
        "min_throttle": outcome.min_throttle,
        "max_throttle": outcome.max_throttle,
        "max_altitude_error_m": outcome.max_altitude_error,
        "max_observer_error_dps": outcome.max_observer_error * DEGREES,
        "final_altitude_m": outcome.final_altitude,
        "final_speed_mps": outcome.final_speed,
        "rms_altitude_error_m": np.sqrt(outcome.squared_altitude_error / counted),
        "final_altitude_error_m": outcome.final_altitude_error,
        "rms_speed_error_mps": np.sqrt(outcome.squared_speed_error / counted),
        "max_speed_error_mps": outcome.max_speed_error,
        "max_heading_error_deg": outcome.max_heading_error * DEGREES,
        "fuel_kg": np.where(
            outcome.final_mass > 0.0,
            states[:, State._fields.index("mass")] - outcome.final_mass,
            0.0,
        ),
        "least_mach": outcome.least_mach,
        "outside_corridor_s": outcome.outside * STEP,
        "nose_down_alpha_deg": bounds[:, 0] * DEGREES,
        "trim_exists": trim.exists == 1.0,
        "trim_alpha_deg": trim.alpha * DEGREES,
    }


def fly_campaign(
    campaign: Campaign,
    folder: Path,
    executor: Executor,
    progress: Callable[[int], None] = lambda runs: None,
    interrupted: Callable[[], bool] = lambda: False,
) -> None:
    """Fly what `folder` does not hold yet of `campaign`, and keep it there.

    Jobs go to `executor`, whatever it is; a job that fails is an error, one whose worker died is
    the executor's to repeat. A part is written when all of it is flown. Once
    `interrupted()`, or by an error, it ends and the folder keeps what was flown. `progress(runs)`
    is called now and then. Raises CampaignError if the folder holds another campaign or cannot
    hold any, or if a worker would compute other numbers, CampaignStopped if the executor gives up.
    """
    kept = level_folder(folder, campaign.level)
    try:
        kept.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise CampaignError(f"{folder} cannot hold a campaign: {error.strerror}") from error
    described = campaign.describe()
    count = sum(
        int(np.sum(part["run"] < campaign.runs)) for part in read_parts(kept, ["run"], described)
    )
    progress(count)
    parts: dict[int, _Part] = {}
    jobs = _jobs(campaign, kept, parts)
    under_way: dict[Future[Columns | str], int] = {}
    try:
        while not interrupted():
            for start, first, runs in islice(jobs, JOBS_UNDER_WAY - len(under_way)):
                under_way[executor.submit(fly_job, described, first, runs)] = start
            if not under_way:
                break
            finished, _ = wait(under_way, LOOK, FIRST_COMPLETED)
            for future in finished:
                start = under_way.pop(future)
                part = parts[start]
                part.flown.append(_flown(future))
                count += len(part.flown[-1]["run"])
                part.jobs_left -= 1
                if part.jobs_left == 0:
                    write_part(part_file(kept, start), [*part.filed, *part.flown], described)
                    del parts[start]
            progress(min(count, campaign.runs))
    finally:
        for future, start in under_way.items():  # of an interrupted campaign
            future.cancel()
            if future.done() and not future.cancelled() and future.exception() is None:
                result = future.result()
                if not isinstance(result, str):
                    parts[start].flown.append(result)
        for start, part in parts.items():
            if part.flown:
                write_part(part_file(kept, start), [*part.filed, *part.flown], described)


def _flown(job: Future[Columns | str]) -> Columns:
    """Result of a job; CampaignError if it was refused, CampaignStopped if it was given up."""
    try:
        result = job.result()
    except BrokenProcessPool as error:
        raise CampaignStopped(
            "a process that flew ended without a word, as one does whose law crashes or takes all "
            "memory: what was flown is kept"
        ) from error
    except CancelledError as error:
        raise CampaignStopped(
            "the jobs were given up, as when a scheduler dies: "
            "what was flown is kept, and the same command resumes"
        ) from error
    if isinstance(result, str):
        raise CampaignError(result)
    return result


@dataclass
class _Part:
    """A part of which not everything is flown."""

    filed: list[Columns]  # by the folder
    flown: list[Columns]
    jobs_left: int


def _jobs(
    campaign: Campaign, kept: Path, parts: dict[int, _Part]
) -> Iterator[tuple[int, int, int]]:
    """Jobs that are left to fly: first run of its part, first run, number of runs.

    A part enters `parts` with its first job, so that only those under way are in memory.
    """
    compiled = is_compiled(campaign.case.control)
    at_once = RUNS_PER_JOB if compiled else RUNS_IN_PLAIN_PYTHON
    for start in range(0, campaign.runs, PART_RUNS):
        end = min(start + PART_RUNS, campaign.runs)
        path = part_file(kept, start)
        filed = [read_part(path)[0]] if path.exists() else []
        done = set(filed[0]["run"].tolist()) if filed else set()
        jobs = [
            (start, first, min(at_once, end - first))
            for first in range(start, end, at_once)
            if not done.issuperset(range(first, min(first + at_once, end)))
        ]
        if jobs:
            parts[start] = _Part(filed, [], len(jobs))
        yield from jobs


def open_campaign(folder: Path, level: float | None = None) -> Campaign:
    """Campaign that a folder holds, of `level` if it holds several."""
    found = {path.name.removeprefix("runs-"): path for path in sorted(folder.glob("runs-*"))}
    chosen = [name for name in found if level is None or name == level_name(level)]
    there = f"there are: {', '.join(found)}"
    if not found:
        raise CampaignError(f"{folder} holds no campaign")
    if not chosen:
        raise CampaignError(f"{folder} holds no campaign of level {level}; {there}")
    if len(chosen) > 1:
        raise CampaignError(f"{folder} holds several campaigns; choose one by --level; {there}")
    files = part_files(found[chosen[0]])
    if not files:
        raise CampaignError(f"{found[chosen[0]]} holds no runs of a campaign")
    last, described = read_part(files[-1], ["run"])
    if level_name(described["level"]) != chosen[0]:
        raise CampaignError(
            f"{found[chosen[0]]} holds runs of level {described['level']}: "
            f"its name was runs-{level_name(described['level'])}"
        )
    differing = differences(described | _law_here(described), described)
    if differing:
        raise CampaignError(
            f"{found[chosen[0]]} was flown by another source of its law ({differing}): "
            "its runs cannot be flown again"
        )
    return _campaign_of(described, int(last["run"][-1]) + 1)


def _campaign_of(described: dict[str, Any], runs: int) -> Campaign:
    return Campaign(
        make_case(described["case"], described["parameters"]),
        described["level"],
        runs,
        described["seed"],
        described["random_starts"],
        described.get("draws"),  # which older campaigns do not speak of
        Corridor(**described["corridor"]) if described.get("corridor") else None,
    )


def find_run(campaign: Campaign, folder: Path, run: int) -> dict[str, Any] | None:
    """Row of a run, None if it has not been flown."""
    path = part_file(level_folder(folder, campaign.level), run - run % PART_RUNS)
    if not path.exists():
        return None
    columns, _ = read_part(path)
    index = np.flatnonzero(columns["run"] == run)
    return {name: column[index[0]] for name, column in columns.items()} if len(index) else None


def first_causes(campaign: Campaign, folder: Path, runs: int) -> dict[int, int]:
    """Causes of failure of the first `runs` runs that were flown, zero for success."""
    causes: dict[int, int] = {}
    for part in read_parts(level_folder(folder, campaign.level), ["run", "cause"]):
        causes |= zip(part["run"].tolist(), part["cause"].tolist(), strict=True)
        if len(causes) >= runs:
            break
    return dict(islice(causes.items(), runs))
