"""Monte-Carlo campaigns: drawn flights on any executor, one row a run, resumed if stopped."""

import json
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, Future, as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from scipy.stats import binomtest

from ahv_analysis.block import find_trims, fly_block
from ahv_analysis.case import Case, dispersion_parameters, make_case
from ahv_analysis.record import Array
from ahv_analysis.tally import Cause, Tally
from ahv_plant.constants import DEGREES, STEP
from ahv_plant.dispersion import Dispersion, draw_dispersion
from ahv_plant.level_trim import LevelTrim
from ahv_plant.state import State

RUNS_PER_JOB = 64  # four blocks: half a second of work, so that little is lost and little waits
SAVE_EVERY = 16  # jobs between two writes of the file
# Random starts of section 3.5.2, around the case's own: plus and minus, in the plant's parameters.
START_SPREAD = {
    "initial.u": 100.0,  # [m/s]
    "initial.P": 5.0,  # [deg/s]
    "initial.Q": 5.0,  # [deg/s]
    "initial.R": 5.0,  # [deg/s]
    "initial.h": 500.0,  # [m]
}


class CampaignError(Exception):
    """A campaign that cannot be flown as asked; the message is one sentence."""


@dataclass(frozen=True)
class Campaign:
    """What is flown: `runs` vehicles drawn at a level [-], from one start or from random ones."""

    case: Case
    level: float
    runs: int
    seed: int
    random_starts: bool = False

    def describe(self) -> dict[str, Any]:
        """All that decides the result of a run; the number of runs does not."""
        return {
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
        return make_case(self.case.name, self.case.parameters | {"plant": plant})


def fly_runs(campaign: Campaign, first: int, count: int) -> dict[str, Array]:
    """Fly runs `first` to `first + count - 1`: a column a quantity, as in the campaign's file."""
    runs = range(first, first + count)
    dispersions = np.array([campaign.dispersion(run) for run in runs])
    states = np.array([campaign.start(run) for run in runs])
    case = campaign.case
    control, geometric = case.control, case.plant.truth.geometric
    tallies = fly_block(states, dispersions, control, geometric, case.plant.steps)
    trims = find_trims(
        dispersions,
        control.outer.altitude,
        control.velocity.speed,
        case.plant.initial.mass,
        geometric,
    )
    return columns(np.array(runs), dispersions, states, tallies, trims)


def columns(
    runs: Array, dispersions: Array, states: Array, tallies: Array, trims: Array
) -> dict[str, Array]:
    """Columns of the campaign's file from what the engine gives."""
    tally = Tally(*tallies.T)
    trim = LevelTrim(*trims.T)
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
        "trim_exists": trim.exists == 1.0,
        "trim_alpha_deg": trim.alpha * DEGREES,
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
    before = _kept(campaign, folder)
    done = set(before["run"].tolist()) if before else set()
    jobs = [
        (first, min(RUNS_PER_JOB, campaign.runs - first))
        for first in range(0, campaign.runs, RUNS_PER_JOB)
        if not done.issuperset(range(first, min(first + RUNS_PER_JOB, campaign.runs)))
    ]
    progress(min(len(done), campaign.runs))
    futures = [executor.submit(fly_runs, campaign, first, count) for first, count in jobs]
    count = min(len(done), campaign.runs)
    try:
        for number, future in enumerate(as_completed(futures), 1):
            count += len(future.result()["run"])
            progress(min(count, campaign.runs))
            if number % SAVE_EVERY == 0:
                _write(campaign, folder, before, futures)
    finally:
        for future in futures:
            future.cancel()
        _write(campaign, folder, before, futures)
    return read_campaign(campaign, folder)


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
        raise CampaignError(f"{path} holds another campaign: choose another --out")
    return table


def read_runs(path: Path) -> tuple[dict[str, Array], dict[str, Any]]:
    """Columns of a campaign file, and the description of the campaign."""
    try:
        table = pq.read_table(path)
        description = json.loads(table.schema.metadata[b"ahv"])
    except (OSError, pa.ArrowException, KeyError, TypeError) as error:
        raise CampaignError(f"{path} is not the file of a campaign: {error}") from error
    return {name: table[name].to_numpy() for name in table.column_names}, description


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
    campaign: Campaign, folder: Path, before: dict[str, Array], futures: Sequence[Future[Any]]
) -> None:
    """Write what was there and what has been flown, sorted by run, whole or not at all."""
    flown = [
        future.result()
        for future in futures
        if future.done() and not future.cancelled() and future.exception() is None
    ]
    parts = [before, *flown] if before else flown
    if not flown:
        return
    joined = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    _, order = np.unique(joined["run"], return_index=True)
    table = pa.table({name: column[order] for name, column in joined.items()})
    table = table.replace_schema_metadata({"ahv": json.dumps(campaign.describe())})
    folder.mkdir(parents=True, exist_ok=True)
    path = campaign_file(campaign, folder)
    draft = path.with_suffix(".part")
    pq.write_table(table, draft)
    draft.replace(path)


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
