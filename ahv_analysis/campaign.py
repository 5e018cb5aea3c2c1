"""Monte-Carlo campaigns: drawn flights on any executor, one row a run, resumed if stopped."""

import json
import os
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from scipy.stats import binomtest

from ahv_analysis.block import find_trims, fly_block
from ahv_analysis.case import Case, Draw, dispersion_parameters, make_case
from ahv_analysis.errors import CampaignError
from ahv_analysis.record import Array
from ahv_analysis.tally import Cause, Tally
from ahv_plant.compiled import source_hash
from ahv_plant.constants import DEGREES, STEP
from ahv_plant.dispersion import Dispersion, draw_dispersion
from ahv_plant.level_trim import LevelTrim
from ahv_plant.state import State

RUNS_PER_JOB = 64  # four blocks: half a second of work, so that little is lost and little waits
JOBS_UNDER_WAY = 64  # handed to the executor at a time, so that a campaign of any size can wait
SAVE_EVERY = 1024  # runs between two writes of the file, at least
# Random starts of section 3.5.2, around the case's own: plus and minus, in the plant's parameters.
START_SPREAD = {
    "initial.u": 100.0,  # [m/s]
    "initial.P": 5.0,  # [deg/s]
    "initial.Q": 5.0,  # [deg/s]
    "initial.R": 5.0,  # [deg/s]
    "initial.h": 500.0,  # [m]
}


DESCRIBED = {"source", "case", "level", "seed", "random_starts", "parameters"}


@dataclass(frozen=True)
class Campaign:
    """What is flown: `runs` vehicles drawn at a level [-], from one start or from random ones."""

    case: Case
    level: float
    runs: int
    seed: int
    random_starts: bool = False

    def describe(self) -> dict[str, Any]:
        """All that decides the result of a run: the code too, but not the number of runs."""
        return {
            "source": source_hash(),
            "case": self.case.name,
            "level": self.level,
            "seed": self.seed,
            "random_starts": self.random_starts,
            "parameters": self.case.parameters,
        }

    def dispersion(self, run: int) -> Dispersion:
        """Dispersion of a run."""
        return draw_dispersion(self.level, self.seed, run)

    def start(self, run: int) -> State:
        """First state of a run."""
        return self.case_of(run).plant.initial if self.random_starts else self.case.plant.initial

    def case_of(self, run: int) -> Case:
        """Return the case that flies one run alone, with the same bits, by any engine."""
        plant = self.case.parameters["plant"] | dispersion_parameters(self.dispersion(run))
        if self.random_starts:
            draws = np.random.default_rng((self.seed, run, 1)).uniform(
                -1.0, 1.0, len(START_SPREAD)
            )
            for (name, spread), draw in zip(START_SPREAD.items(), draws.tolist(), strict=True):
                plant[name] = float(plant[name]) + spread * draw
        draw = Draw(self.level, self.seed, run, self.random_starts)
        return make_case(self.case.name, self.case.parameters | {"plant": plant}, draw)


def fly_runs(campaign: Campaign, first: int, count: int) -> dict[str, Array]:
    """Fly runs `first` to `first + count - 1`: a column a quantity, as in the campaign's file."""
    runs = range(first, first + count)
    dispersions = np.array([campaign.dispersion(run) for run in runs])
    states = np.array([campaign.start(run) for run in runs])
    case = campaign.case
    control, geometric = case.control, case.plant.truth.geometric
    tallies = fly_block(states, dispersions, case.plant.truth, control, case.plant.steps)
    trims = find_trims(
        dispersions,
        control.outer.altitude,
        control.velocity.speed,
        case.plant.initial.mass,
        geometric,
    )
    trim = LevelTrim(*trims.T)
    return flight_columns(np.array(runs), dispersions, states, tallies) | {
        "trim_exists": trim.exists == 1.0,
        "trim_alpha_deg": trim.alpha * DEGREES,
    }


def flight_columns(
    runs: Array, dispersions: Array, states: Array, tallies: Array
) -> dict[str, Array]:
    """Columns of the campaign's file that a flight gives."""
    tally = Tally(*tallies.T)
    table: dict[str, Array] = {"run": runs}
    table |= {name: dispersions[:, i] for i, name in enumerate(Dispersion._fields)}
    table |= {
        f"initial_{name}": states[:, State._fields.index(name)] for name in ("u", *"PQR", "h")
    }
    return table | {
        "cause": tally.cause.astype(np.int64),
        "time_s": np.maximum(tally.steps - 1, 0) * STEP,
        "max_abs_alpha_deg": tally.max_abs_alpha * DEGREES,
        "alpha_margin_deg": 5.0 - tally.max_abs_alpha * DEGREES,
        "max_abs_beta_deg": tally.max_abs_beta * DEGREES,
        "max_abs_rate_dps": tally.max_abs_rate * DEGREES,
        "max_abs_phi_deg": tally.max_abs_phi * DEGREES,
        "min_surface_deg": tally.min_surface * DEGREES,
        "max_surface_deg": tally.max_surface * DEGREES,
        "min_throttle": tally.min_throttle,
        "max_throttle": tally.max_throttle,
        "max_altitude_error_m": tally.max_altitude_error,
        "max_observer_error_dps": tally.max_observer_error * DEGREES,
        "final_altitude_m": tally.final_altitude,
        "final_speed_mps": tally.final_speed,
    }


def fly_campaign(
    campaign: Campaign,
    folder: Path,
    executor: Executor,
    progress: Callable[[int], None] = lambda runs: None,
) -> dict[str, Array]:
    """Fly what `folder` does not hold yet, keep it there, and return all columns by run.

    Jobs go to `executor`, whatever it is; a job that fails is an error, one whose worker died is
    the executor's to repeat. Interrupted by KeyboardInterrupt, the folder keeps what was flown.
    Raises CampaignError if the folder holds another campaign.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise CampaignError(f"{folder} cannot hold a campaign: {error.strerror}") from error
    before = _kept(campaign, folder)
    done = set(before["run"].tolist()) if before else set()
    jobs = (
        (first, min(RUNS_PER_JOB, campaign.runs - first))
        for first in range(0, campaign.runs, RUNS_PER_JOB)
        if not done.issuperset(range(first, min(first + RUNS_PER_JOB, campaign.runs)))
    )
    parts = [before] if before else []
    under_way: set[Future[dict[str, Array]]] = set()
    count = saved = min(len(done), campaign.runs)
    progress(count)
    try:
        while True:
            for first, runs in islice(jobs, JOBS_UNDER_WAY - len(under_way)):
                under_way.add(executor.submit(fly_runs, campaign, first, runs))
            if not under_way:
                break
            finished, _ = wait(under_way, return_when=FIRST_COMPLETED)
            for future in finished:
                under_way.discard(future)
                parts.append(future.result())
                count += len(parts[-1]["run"])
            progress(min(count, campaign.runs))
            if count - saved >= max(SAVE_EVERY, saved):  # seldom enough to stay a small part
                parts, saved = [_write(campaign, folder, parts)], count
    finally:
        for future in under_way:  # of an interrupted campaign
            future.cancel()
        parts += [future.result() for future in under_way if _is_flown(future)]
        if parts:
            _write(campaign, folder, parts)
    return read_campaign(campaign, folder)


def _is_flown(future: Future[dict[str, Array]]) -> bool:
    return future.done() and not future.cancelled() and future.exception() is None


def campaign_file(campaign: Campaign, folder: Path) -> Path:
    """Parquet file of a campaign's level."""
    return folder / f"runs-{campaign.level:g}.parquet"


def read_campaign(campaign: Campaign, folder: Path) -> dict[str, Array]:
    """Columns flown so far, sorted by run, at most those of the campaign; {} if there are none."""
    table = _kept(campaign, folder)
    return {name: column[table["run"] < campaign.runs] for name, column in table.items()}


def _kept(campaign: Campaign, folder: Path) -> dict[str, Array]:
    """All columns that the folder holds of this campaign, of however many runs; {} if none."""
    path = campaign_file(campaign, folder)
    if not path.exists():
        return {}
    table, description = read_runs(path)
    if description != json.loads(json.dumps(campaign.describe())):
        raise CampaignError(
            f"{path} holds another campaign, or one of other code: choose another --out"
        )
    return table


def read_runs(path: Path) -> tuple[dict[str, Array], dict[str, Any]]:
    """Columns of a campaign file, and the description of the campaign."""
    try:
        table = pq.read_table(path)
        description = json.loads(table.schema.metadata[b"ahv"])
        columns = {name: table[name].to_numpy() for name in table.column_names}
        if not {"run", "cause"} <= columns.keys() or not set(description) >= DESCRIBED:
            raise ValueError("it lacks columns or the description")
    except (OSError, pa.ArrowException, KeyError, TypeError, ValueError) as error:
        reason = " ".join(str(error).split())
        raise CampaignError(f"{path} is not the file of a campaign: {reason}") from error
    return columns, description


def open_campaign(folder: Path, level: float | None = None) -> Campaign:
    """Campaign that a folder holds, of `level` if it holds several."""
    files = sorted(folder.glob("runs-*.parquet"))
    if level is not None:
        files = [path for path in files if path.stem == f"runs-{level:g}"]
    if len(files) != 1:
        names = [path.stem.removeprefix("runs-") for path in sorted(folder.glob("runs-*.parquet"))]
        raise CampaignError(
            f"{folder} holds {len(files)} campaigns to choose from by --level; "
            f"there are: {', '.join(names) or 'none'}"
        )
    table, description = read_runs(files[0])
    case = make_case(description["case"], description["parameters"])
    runs = int(table["run"].max()) + 1 if len(table["run"]) else 0
    return Campaign(
        case, description["level"], runs, description["seed"], description["random_starts"]
    )


def _write(
    campaign: Campaign, folder: Path, parts: Sequence[dict[str, Array]]
) -> dict[str, Array]:
    """Write all parts as one file, sorted by run, whole or not at all; returns its columns."""
    joined = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    _, order = np.unique(joined["run"], return_index=True)
    columns = {name: column[order] for name, column in joined.items()}
    table = pa.table(columns).replace_schema_metadata({"ahv": json.dumps(campaign.describe())})
    path = campaign_file(campaign, folder)
    draft = path.with_suffix(f".{os.getpid()}")
    pq.write_table(table, draft)
    draft.replace(path)
    return columns


def exact_interval(successes: int, runs: int) -> tuple[float, float]:
    """Clopper-Pearson 95 % interval of a success rate."""
    interval = binomtest(successes, runs).proportion_ci(method="exact")
    return float(interval.low), float(interval.high)


def summarize_campaign(campaign: Campaign, table: dict[str, Array]) -> dict[str, Any]:
    """Counts of a campaign, with the bound that no altitude-holding controller beats."""
    runs = len(table["run"])
    causes = Counter(Cause(cause).name.lower() for cause in table["cause"].tolist())
    successes = causes.pop("success", 0)
    holdable = table["trim_exists"] & (np.abs(table["trim_alpha_deg"]) <= 5.0)
    return {
        "controller": campaign.case.name,
        "level": campaign.level,
        "runs": runs,
        "successes": successes,
        "success_rate": successes / runs,
        "interval": exact_interval(successes, runs),
        "failures": dict(causes),
        "trim_within_5_deg": int(np.sum(holdable)),
        "failures_without_such_trim": int(np.sum(~holdable & (table["cause"] != 0))),
    }
