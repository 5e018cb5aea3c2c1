# Copyright 2026 ahv developers, Apache-2.0
"""Flights of vehicles that a search asks for, each flown once and kept in a file.

A search that is started again asks for the same vehicles in the same order, and finds those that
were flown: so it resumes.
"""

import json
import os
import time
from collections.abc import Callable
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from ahv_analysis.bag.rows import Array
from ahv_analysis.campaign.batch import fly_alone, fly_batch, fly_batch_on_hardware
from ahv_analysis.campaign.campaign import LOOK
from ahv_analysis.errors import CampaignError
from ahv_analysis.flight.case import Case, dispersion_parameters, make_case
from ahv_analysis.flight.outcome import Outcome
from ahv_analysis.versions import what_computes
from ahv_control.law_file import compiling
from ahv_control.own_law import is_compiled
from ahv_plant.dispersion import Dispersion
from ahv_plant.model.constants import DEGREES, UNSTART_ALPHA
from ahv_plant.numerics.identity import Definition
from ahv_plant.plant import noise_stream

VEHICLES_PER_JOB = 32  # two batches: a search asks for few at a time, and all cores shall fly
SAVED_EVERY = 5.0  # [s] of flying
FACTORS = len(Dispersion._fields)
LOSS = UNSTART_ALPHA * DEGREES  # severity beyond which a vehicle is lost
NAMES = (*Dispersion._fields, "severity")
COMPUTED_BY = what_computes(Definition(Path(__file__).resolve(), "fly_vehicles"))


def fly_vehicles(case: Case, dispersions: Array) -> Array:
    """Severity (N,) of the flights of a case on vehicles with `dispersions` (N, 9).

    Of a vehicle that is kept the largest |alpha| [deg], which is at most 5; of a lost one 5 and
    the share [-] of the flight that it did not live to fly: it goes on rising where vehicles are
    lost sooner. Start, noise and all else are those of the case.
    """
    control, (initial, steps, truth, hardware, noise) = case.control, case.plant
    count = len(dispersions)
    if not is_compiled(control):
        rows = [fly_alone(vehicle_case(case, one)) for one in dispersions]
        return severity(np.array(rows), steps)
    states = np.array([initial] * count)
    if hardware is None:
        return severity(fly_batch(states, dispersions, truth, control, steps), steps)
    rest = np.array([(*hardware.start.surfaces, hardware.start.throttle)] * count)
    streams = [noise_stream(hardware, truth.wind, *noise) for _ in range(count)]
    outcomes = fly_batch_on_hardware(
        states, dispersions, rest, streams, truth, control, hardware, steps
    )
    return severity(outcomes, steps)


def severity(outcomes: Array, steps: int) -> Array:
    """Severity (N,), as `fly_vehicles` has it, of outcomes (N, 14) of flights of `steps`."""
    outcome = Outcome(*outcomes.T)
    kept = np.minimum(outcome.max_abs_alpha * DEGREES, LOSS)
    unflown: Array = LOSS + (steps + 1.0 - outcome.steps) / (steps + 1.0)
    return np.where(outcome.cause == 0.0, kept, unflown)


def vehicle_case(case: Case, dispersion: Array) -> Case:
    """The case on a vehicle with `dispersion` (9,), to be flown alone."""
    multipliers = Dispersion(*(float(value) for value in dispersion))
    plant = case.parameters["plant"] | dispersion_parameters(multipliers)
    return make_case(case.name, case.parameters | {"plant": plant})


class Vehicles:
    """Flies vehicles of a case on an executor, and remembers them in a file.

    Raises CampaignError for a file that is of another case or code, or damaged.
    """

    def __init__(
        self,
        case: Case,
        file: Path,
        executor: Executor,
        progress: Callable[[int], None] = lambda flown: None,
        interrupted: Callable[[], bool] = lambda: False,
    ):
        """`progress(flown)` is told of all flights asked for; once `interrupted()` it ends."""
        self.case, self.asked = case, 0
        self._file, self._executor = file, executor
        self._progress, self._interrupted = progress, interrupted
        law = {} if case.law is None else {"law": case.law.identity}
        self._described: dict[str, Any] = {
            **COMPUTED_BY,
            **law,
            "case": case.name,
            "parameters": case.parameters,
        }
        self._known: dict[bytes, float] = self._read() if file.exists() else {}
        self._kept, self._saved_at = len(self._known), time.monotonic()

    def fly(self, dispersions: Array) -> Array:
        """Severity (N,) of vehicles with `dispersions` (N, 9).

        Raises KeyboardInterrupt where it was interrupted; what was flown is kept.
        """
        rows = np.ascontiguousarray(dispersions, dtype=float)
        keys = [row.tobytes() for row in rows]
        new = [place for place, key in enumerate(dict.fromkeys(keys)) if key not in self._known]
        unique = list(dict.fromkeys(keys))
        missing = [unique[place] for place in new]
        for first in range(0, len(missing), VEHICLES_PER_JOB * 32):
            self._fly_new(missing[first : first + VEHICLES_PER_JOB * 32])
        self.asked += len(rows)
        self._progress(self.asked)
        return np.array([self._known[key] for key in keys])

    def _fly_new(self, keys: list[bytes]) -> None:
        jobs = []
        for first in range(0, len(keys), VEHICLES_PER_JOB):
            some = keys[first : first + VEHICLES_PER_JOB]
            vehicles = np.frombuffer(b"".join(some)).reshape(-1, FACTORS)
            jobs.append((some, self._executor.submit(fly_vehicles, self.case, vehicles)))
        try:
            with compiling(self.case.law):
                for some, job in jobs:
                    while not job.done() and not self._interrupted():
                        time.sleep(min(LOOK, 0.01))
                    if self._interrupted():
                        raise KeyboardInterrupt
                    self._known |= zip(some, job.result().tolist(), strict=True)
        finally:
            for _, job in jobs:
                job.cancel()
            if time.monotonic() - self._saved_at > SAVED_EVERY or self._interrupted():
                self.save()

    def save(self) -> None:
        """Write all that was flown, whole or not at all."""
        self._saved_at = time.monotonic()
        if len(self._known) == self._kept:
            return
        vehicles = np.frombuffer(b"".join(self._known)).reshape(-1, FACTORS)
        columns = [*vehicles.T, np.array([*self._known.values()])]
        table = pa.table(dict(zip(NAMES, columns, strict=True)))
        table = table.replace_schema_metadata({b"ahv": json.dumps(self._described).encode()})
        draft = self._file.with_name(f".{self._file.name}.{os.getpid()}")
        self._file.parent.mkdir(parents=True, exist_ok=True)
        pq.write_table(table, draft, write_page_checksum=True)
        draft.replace(self._file)
        self._kept = len(self._known)

    def _read(self) -> dict[bytes, float]:
        try:
            with pq.ParquetFile(self._file, page_checksum_verification=True) as file:
                table = file.read()
            found = json.loads((table.schema.metadata or {}).get(b"ahv", b"{}"))
            columns = np.column_stack([table[name].to_numpy() for name in NAMES]).astype(float)
        except (OSError, pa.ArrowException, ValueError, KeyError, TypeError) as error:
            reason = " ".join(str(error).split())[:200]
            raise CampaignError(
                f"{self._file} holds no flights of a search, or is damaged ({reason}): "
                "delete it, and they are flown anew"
            ) from error
        if found != json.loads(json.dumps(self._described)):
            raise CampaignError(
                f"{self._file} holds flights of another case, or of other code: "
                "choose another --out"
            )
        if not np.all(np.isfinite(columns)):
            raise CampaignError(f"{self._file} holds what is no number: delete it")
        vehicles = np.ascontiguousarray(columns[:, :FACTORS])
        return {
            row.tobytes(): float(value)
            for row, value in zip(vehicles, columns[:, FACTORS], strict=True)
        }
