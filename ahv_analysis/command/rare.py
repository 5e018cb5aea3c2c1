# Copyright 2026 ahv developers, Apache-2.0
"""The command `ahv rare`: the probability of losses too rare to be counted."""

from pathlib import Path
from typing import Annotated, Any

import typer

from ahv_analysis.command.campaign import CORES, Workers
from ahv_analysis.command.console import (
    HardwareChoice,
    Json,
    LawChoice,
    ProfileChoice,
    UsageError,
    integer_option,
    print_json,
    show_table,
    words_of,
)
from ahv_analysis.command.results import results_in, write_numbers
from ahv_analysis.command.worst import Search, vehicles_of


def rare(
    case: Annotated[str, typer.Argument(help="Name of a case, or a YAML file.")],
    level: Annotated[float, typer.Option(help="Dispersion of the vehicles.")] = 0.28,
    hardware: HardwareChoice = None,
    profile: ProfileChoice = None,
    law: LawChoice = None,
    repetitions: Annotated[int, integer_option("Independent simulations.", 2)] = 8,
    seed: Annotated[int, integer_option("Seed of the simulations.")] = 0,
    workers: Workers = CORES,
    out: Annotated[
        Path | None, typer.Option(help="Folder of the search; one that is there is resumed.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Estimate how probable a loss is that is too rare to count.

    Subset simulation over the nine multipliers, each uniform from 1 - LEVEL to 1 + LEVEL; all else
    is as in the case, the noise of hardware too. The interval comes from the repetitions.
    """
    import numpy as np
    from scipy.special import ndtr

    from ahv_analysis.campaign.rare import combine, subset_simulation
    from ahv_analysis.campaign.vehicles import FACTORS, LOSS
    from ahv_analysis.flight.case import load_case
    from ahv_analysis.report.picture import save_picture
    from ahv_analysis.report.worst_figure import draw_rare
    from ahv_plant.dispersion import HIGHEST_LEVEL, Dispersion

    if not 0.0 < level <= HIGHEST_LEVEL:
        raise UsageError(f"level {level:g} must be above 0, and {HIGHEST_LEVEL:g} at most")
    flown = load_case(case, hardware=hardware, profile=profile, law=law)
    words = [flown.name, *words_of(hardware, profile, law)]
    folder = out or Path("rare") / "-".join(words)
    search = Search(flown, words, [], seed, workers, folder, as_json)

    def multipliers(numbers: Any) -> Any:
        return 1.0 + level * (2.0 * ndtr(numbers) - 1.0)

    with vehicles_of(search, flown, folder) as flights:
        done = [
            subset_simulation(
                lambda numbers: flights.fly(multipliers(numbers)),
                LOSS,
                FACTORS,
                np.random.default_rng((seed, number)),
            )
            for number in range(repetitions)
        ]
        asked = flights.asked
    found = combine(done)
    flown_words = f"{', '.join(words)} at level {level:g}, {asked} flights"
    if found.found:
        said = f"{found.probability:.2e} ({found.low:.2e} to {found.high:.2e})"
        brute = f"{round(100.0 / found.probability):,} flights to see 100 of them"
    else:
        said, brute = "no loss was found", "no number"
    title = f"{flown_words}: probability of a loss {said}"
    likely = [one.most_likely for one in done if one.most_likely is not None]
    nearest = min(likely, key=lambda one: float(np.sum(one**2)), default=None)
    vehicle = (
        None
        if nearest is None
        else dict(zip(Dispersion._fields, multipliers(nearest).tolist(), strict=True))
    )
    content = {
        "case": flown.name,
        "hardware_and_profile": words[1:],
        "level": level,
        "seed": seed,
        "flights": asked,
        "probability": found.probability if found.found else None,  # none found is not zero
        "interval": [found.low, found.high] if found.found else None,
        "repetitions": [
            {"probability": one.probability, "thresholds": one.thresholds, "shares": one.shares}
            for one in done
        ],
        "most_central_loss": vehicle,
        "out": str(folder),
    }
    figure = draw_rare(found, title.replace(": ", ":\n"))
    with results_in(folder):
        save_picture(figure, folder / "rare.png")
        write_numbers(folder / "rare.json", content)
    if as_json:
        print_json(content)
        return
    rows = [
        ("probability of a loss, 95 %", said),
        ("of each repetition", ", ".join(f"{one.probability:.1e}" for one in done)),
        ("by drawing", brute),
    ]
    if vehicle is not None:
        named = ", ".join(f"{name} {value:.3f}" for name, value in vehicle.items())
        rows.append(("a lost vehicle, most central", named))
    show_table(flown_words, [*rows, ("kept in", str(folder))])
