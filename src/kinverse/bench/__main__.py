"""``python -m kinverse.bench``: run sections, print their lines, write JSON."""

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

from rich.console import Console

from kinverse import kernels
from kinverse.bench import report
from kinverse.bench.report import Line
from kinverse.bench.sections import (
    accuracy_points,
    calibration,
    closed_form,
    fitting,
    general,
    general_speed,
    importing,
    known_minima,
    networks_anfis,
    networks_fusion,
    networks_learned,
    networks_swarm,
    networks_training,
    pairs,
    planar_paths,
    reach,
    seven,
    simulation,
    speed,
    spline_5r,
    swarm,
    swarm_answers,
    tracking,
)
from kinverse.errors import MissingExtra

SECTIONS: dict[str, Callable[[bool], list[Line]]] = {
    "closed_form": closed_form.complete,
    "singular": closed_form.singular,
    "unreachable": closed_form.unreachable,
    "general": general.complete,
    "branch_sets": general.branch_sets,
    "around": reach.around,
    "rank_deficient": reach.rank_deficient,
    "quaternion_pairs": pairs.quaternion_pairs,
    "seven": seven.at_values,
    "sweeps": seven.sweeps,
    "fit_time": fitting.fit_time,
    "general_speed": general_speed.compare,
    "closed_form_speed": speed.closed_form,
    "numerical": speed.numerical,
    "follow": speed.follow,
    "fk_lanes": speed.fk_lanes,
    "swarm": swarm.against_peers,
    "swarm_polished": swarm_answers.polished,
    "swarm_branches": swarm_answers.eight,
    "known_minima": known_minima.known_minima,
    "hybrid_mlps": networks_swarm.hybrid_mlps,
    "trainers": networks_training.trainers,
    "predicting": networks_training.predicting,
    "fusion": networks_fusion.fusion,
    "anfis": networks_anfis.anfis,
    "learned": networks_learned.branches,
    "learned_starts": networks_learned.starts,
    "calibration": calibration.calibration,
    "simulation": simulation.simulation,
    "tracking": tracking.tracking,
    "accuracy_points": accuracy_points.accuracy_points,
    "planar_paths": planar_paths.planar_paths,
    "spline_5r": spline_5r.spline_5r,
    "import_time": importing.import_time,
}


def main(argv: list[str] | None = None) -> int:
    """Run the chosen sections; exit status 1 if a target was missed or a section broke down."""
    parser = argparse.ArgumentParser(prog="python -m kinverse.bench", description=__doc__)
    parser.add_argument("--section", action="append", choices=list(SECTIONS), help="all if none")
    parser.add_argument("--quick", action="store_true", help="few cases, few rounds")
    parser.add_argument("--json", type=Path, help="write all figures to this file")
    chosen = parser.parse_args(argv)
    console = Console(highlight=False, width=100)
    kernels.set_threads(1)
    facts = report.machine()
    console.print(", ".join(f"{key} {value}" for key, value in facts.items()), markup=False)
    lines: list[Line] = []
    broken = []
    for name in chosen.section or SECTIONS:
        try:
            made = SECTIONS[name](chosen.quick)
        except (ModuleNotFoundError, MissingExtra) as error:
            console.print(f"{name}: left out, {error}: make bench installs the peers")
            broken.append(name)
            continue
        for title in dict.fromkeys(line.section for line in made):
            report.show([line for line in made if line.section == title], console)
        lines += made
    missed = sum(line.verdict == "MISS" for line in lines)
    met = sum(line.verdict == "PASS" for line in lines)
    console.print(f"{met} targets reached, {missed} missed, {len(broken)} sections left out")
    if chosen.json:
        settings: dict[str, object] = {"quick": chosen.quick, "left_out": broken}
        chosen.json.write_text(report.to_json(lines, settings) + "\n", encoding="utf-8")
    return 1 if missed or broken else 0


if __name__ == "__main__":
    sys.exit(main())
