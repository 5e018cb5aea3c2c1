# Copyright 2026 ahv developers, Apache-2.0
"""The command `ahv linearise`."""

from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ahv_analysis.command.at_trim import Altitude, Dispersed, Mach, Mass, Speed, case_at
from ahv_analysis.command.console import (
    HardwareChoice,
    Json,
    UsageError,
    integer_option,
    print_json,
    show_columns,
)
from ahv_plant.model.constants import DEGREES

if TYPE_CHECKING:  # these take long to load
    from ahv_analysis.gnc.linear_model import LinearModel
    from ahv_analysis.gnc.modes import Mode

LEAST = 0.02  # [-] participation that it names
TOLD = 3  # states of a mode that the table names


def linearise(
    case: Annotated[
        str, typer.Argument(help="Case whose vehicle and hardware it is: a name, or a YAML file.")
    ] = "nominal_di",
    altitude: Altitude = None,
    speed: Speed = None,
    mach: Mach = None,
    mass: Mass = None,
    dispersion: Dispersed = None,
    seed: Annotated[int, integer_option("Seed of the campaign of a draw.")] = 0,
    run: Annotated[int, integer_option("Number of the run of a draw.")] = 0,
    hardware: HardwareChoice = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder for vehicle.npz, on_hardware.npz and modes.png.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Linearise the vehicle at a trim: A, B, C, D and the modes.

    In continuous time, and sampled at 100 Hz on the hardware of the case, with servos, delay and
    sensors.
    """
    from ahv_analysis.gnc.linear_model import (
        trim_to_linearise,
        vehicle_model,
        without_idle,
        write_model,
    )
    from ahv_analysis.gnc.modes import modes, sampled_modes
    from ahv_analysis.gnc.sampled import plant_at, plant_model
    from ahv_plant.dispersion import in_calm

    flown = case_at(
        case,
        altitude,
        speed,
        mach,
        mass,
        hardware=hardware,
        dispersion=dispersion,
        seed=seed,
        run=run,
    )
    truth = in_calm(flown.plant.truth)
    at = trim_to_linearise(
        flown.control.altitude, flown.control.speed, flown.plant.initial.mass, truth
    )
    vehicle = vehicle_model(at, truth)
    found = modes(vehicle)
    equipped = None
    if flown.plant.hardware is not None:
        start = plant_at(at, truth, flown.plant.hardware)
        equipped = without_idle(plant_model(start, at))
    files = []
    if out is not None:
        from ahv_analysis.gnc.mode_figure import draw_modes
        from ahv_analysis.report.picture import save_picture

        try:
            out.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise UsageError(f"{out} cannot hold a model: {error.strerror}") from error
        write_model(vehicle, out / "vehicle.npz")
        save_picture(draw_modes(found, _where(vehicle)), out / "modes.png")
        files = ["vehicle.npz", "modes.png"]
        if equipped is not None:
            write_model(equipped, out / "on_hardware.npz")
            files.insert(1, "on_hardware.npz")
    if as_json:
        print_json(
            {
                "case": flown.name,
                "trim": {
                    "altitude_m": at.state.h,
                    "u_mps": at.state.u,
                    "mass_kg": at.state.mass,
                    "alpha_deg": at.alpha * DEGREES,
                    "elevon_deg": at.surfaces.right_elevon * DEGREES,
                    "throttle": at.throttle,
                },
                "vehicle": _matrices(vehicle),
                "modes": [_numbers(mode) for mode in found],
                "on_hardware": None if equipped is None else _matrices(equipped),
                "modes_on_hardware": []
                if equipped is None
                else [_numbers(mode) for mode in sampled_modes(equipped, found)],
                "files": [str(out / name) for name in files] if out else [],
            }
        )
        return
    show_columns(f"Modes of the vehicle, open loop, {_where(vehicle)}\n", HEAD, *map(_row, found))
    if equipped is not None:
        on_hardware = map(_row, sampled_modes(equipped, found))
        show_columns("\nSampled at 100 Hz, on its hardware\n", HEAD, *on_hardware)
    if files:
        print(f"{', '.join(files)} in {out}")


HEAD = ("mode", "eigenvalue [rad/s]", "damping", "doubles, halves", "participation")


def _where(model: "LinearModel") -> str:
    at = model.at
    return (
        f"{at.state.h:g} m, u = {at.state.u:.1f} m/s, {at.state.mass:g} kg, "
        f"alpha {at.alpha * DEGREES:.3f} deg"
    )


def _row(mode: "Mode") -> tuple[str, ...]:
    value = mode.eigenvalue
    written = f"{value.real:.4g}" + (f" +- {value.imag:.4g} i" if value.imag else "")
    doubles = mode.doubles
    time = "" if not isfinite(doubles) else f"{abs(doubles):.3g} s"
    share = [
        f"{name} {part:.0%}"
        for name, part in list(mode.participation.items())[:TOLD]
        if part >= LEAST
    ]
    return (
        mode.name,
        written,
        f"{mode.damping:.3f}",
        f"halves in {time}" if doubles < 0.0 else time or "neutral",
        ", ".join(share),
    )


def _numbers(mode: "Mode") -> dict[str, Any]:
    doubles, period = mode.doubles, mode.period
    return {
        "name": mode.name,
        "real": mode.eigenvalue.real,
        "imag": mode.eigenvalue.imag,
        "frequency_radps": mode.frequency,
        "damping": mode.damping,
        "doubles_s": doubles if isfinite(doubles) else None,
        "period_s": period if isfinite(period) else None,
        "participation": mode.participation,
    }


def _matrices(model: "LinearModel") -> dict[str, Any]:
    return {
        "step_s": model.step,
        "states": model.states,
        "inputs": model.inputs,
        "outputs": model.outputs,
        **{name: getattr(model, name).tolist() for name in "ABCD"},
    }
