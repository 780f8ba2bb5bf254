"""What scenes call for: of synthetic truths what is visible and nothing else, of real materials what it saves.

    python benchmarks/scenes.py TABLES --keep scenes.jsonl --out docs/scenes_measured.md [--every 2]

Twelve materials made of known effects, and every N-th of the MERL .binary files of TABLES, are studied in the example
scenes. Finished studies are kept as lines of JSON; an interrupted run goes on from them.

An effect of a truth is visible in a scene if the best fit of the truth's other effects makes a picture beyond the tolerance;
any other effect is invisible. It is called for if every set that is as cheap as the truth, or cheaper, and makes a picture
within the tolerance holds it. For the latter, and to see whether the search missed a cheaper set, all sets of up to four
effects are fitted to each truth in each scene.
"""

from __future__ import annotations

import json
import os
import platform
import sys
from collections.abc import Callable
from datetime import date
from pathlib import Path
from typing import Any

import brdfit
import kept
import numpy as np
from brdfit.data import synthetic
from brdfit.models.effects import EFFECTS
from brdfit.scenes import load_scene, study
from brdfit.scenes.choose import Tried, estimate, every, possible, without
from brdfit.scenes.scene import Tolerance
from brdfit.scenes.survey import SceneBench, left_out
from brdfit.tables import Table
from brdfit.tables import table as brdfit_table

SCENES = ("frontal", "grazing", "environment")
LARGEST = 4
"""Effects of the sets that are all fitted to the truths."""
FOLDER = Path(__file__).resolve().parents[1] / "examples" / "scenes"
GREEN, GOLD, GREY = [0.08, 0.25, 0.1], [0.9, 0.6, 0.25], [0.3, 0.3, 0.3]
TRUTHS: tuple[dict[str, Any], ...] = (
    {"name": "body", "diffuse": GREEN},
    {"name": "body+rough_body", "diffuse": GREY, "sigma": 0.8},
    {"name": "lobe", "specular": GOLD, "alpha": 0.25},
    {"name": "body+lobe", "diffuse": GREEN, "specular": 0.1, "alpha": 0.15},
    {"name": "lobe+masking", "specular": GOLD, "alpha": 0.4},
    {"name": "body+lobe+fresnel", "diffuse": GREEN, "specular": 0.04, "alpha": 0.1},
    {"name": "body+lobe+fresnel+masking", "diffuse": GREY, "specular": 0.05, "alpha": 0.3},
    {"name": "body+lobe+tail+masking", "diffuse": GREEN, "specular": 0.2, "alpha": 0.05, "gamma": 1.3},
    {"name": "body+retro", "diffuse": GREEN, "retro": 0.1, "alpha_retro": 0.3},
    {"name": "lobe+dispersion+masking", "specular": 0.7, "alpha": [0.15, 0.25, 0.4]},
    {"name": "body+lobe+second_lobe", "diffuse": GREEN, "specular": 0.2, "alpha": 0.05, "share": 0.6, "alpha_2": 0.4},
    {"name": "body+diffraction", "diffuse": GREEN, "scatter": 3.0, "b": 200.0, "c": 1.2},
)

Row = dict[str, Any]


def made(truth: dict[str, Any]) -> Table:
    """The table of a truth on the grid of the MERL database."""
    numbers = dict(truth)
    name = numbers.pop("name")
    layout = synthetic.grid(synthetic.GRID, "edge")
    return brdfit_table(synthetic.evaluate(brdfit.model(name, **numbers), layout)[1], layout, name)


def studied(table: Table, scene_name: str, truth: str | None = None) -> Row:
    """One material in one scene."""
    scene = load_scene(FOLDER / f"{scene_name}.toml")
    found = study(table, scene)
    choice, limit = found.choice, found.scene.tolerance
    row: Row = {
        "material": table.material,
        "scene": scene_name,
        "synthetic": truth is not None,
        "met": choice.met,
        "chosen": list(choice.chosen.effects),
        "everything": list(choice.everything.effects),
        "error": choice.chosen.error,
        "least": choice.everything.error,
        "nanoseconds": choice.chosen.nanoseconds * found.lights,
        "all": choice.everything.nanoseconds * found.lights,
        "fits": len(choice.tried),
        "seconds": found.seconds,
        "estimate": estimate(choice.chosen.effects),
        "without": {v.effect: v.other.error for v in choice.verdicts if v.called and v.other},
    }
    if truth is not None:
        bench = SceneBench(found, [n for n in EFFECTS if n not in left_out(table)])
        whole = frozenset(truth.split("+"))
        at = bench.fit(whole, [choice.everything.fitted])
        fits = {n: bench.fit(rest, [at]) for n in whole if (rest := without(whole, n))}
        errors = {n: bench.finished(f) for n, f in fits.items()}
        row["visible"] = sorted(n for n in whole if n not in errors or not limit.met(errors[n]))
        row["lacking"] = errors
        seen = frozenset(row["visible"])
        own = Tried(bench.fit(seen, [at]) if possible(seen) else at, bench)
        own = own if limit.met(own.finished) else Tried(at, bench)
        (mine, _), (chosen, _) = bench.costs([own, Tried(choice.chosen.fitted, bench)])
        row["missed"], row["called"] = exhausted(bench, choice.chosen, own, limit)
        row["own"] = {"error": own.finished, "nanoseconds": mine * found.lights, "chosen": chosen * found.lights}
    return row


def exhausted(bench: SceneBench, chosen: Tried, own: Tried, limit: Tolerance) -> tuple[list[str], list[str]]:
    """Of all sets of up to :data:`LARGEST` effects those that meet the tolerance for less than the chosen one, and the
    effects of the truth that all hold that meet it for no more than the truth.

    Sets are fitted one by one, each from the best two of its subsets: nothing that costs no more is left out.
    """
    fits: dict[frozenset[str], Tried] = {}
    dearest = max(estimate(chosen.effects), estimate(own.effects))
    sets = [s for s in every(bench.screen.among) if len(s) <= LARGEST and estimate(s) <= dearest]
    for s in sorted(sets, key=len):
        near = sorted((t for o, t in fits.items() if o < s), key=lambda t: t.fit_error)[:2]
        fits[s] = Tried(bench.fit(s, [t.fitted for t in near]), bench)
    good = [s for s, t in fits.items() if limit.met(t.seen)]
    cheaper = [s for s in good if estimate(s) < estimate(chosen.effects) and limit.met(fits[s].finished)]
    rivals = [s for s in [*good, frozenset(chosen.effects)] if estimate(s) <= estimate(own.effects)]
    return ["+".join(n for n in EFFECTS if n in s) for s in cheaper], [n for n in own.effects if all(n in s for s in rivals)]


def judged(row: Row) -> tuple[int, int, int, int]:
    """Visible effects chosen, and visible; invisible effects not chosen, and invisible."""
    visible, chosen = set(row["visible"]), set(row["chosen"])
    tried = set(EFFECTS) - {"anisotropy", "interreflection"}
    return len(visible & chosen), len(visible), len(tried - visible - chosen), len(tried - visible)


def explained(row: Row) -> str:
    """What stands in for what, where the choice is not that of the truth."""
    missing, extra = sorted(set(row["visible"]) - set(row["chosen"])), sorted(set(row["chosen"]) - set(row["visible"]))
    if not missing and not extra:
        return "right"
    said = f"{plain(extra) or 'nothing'} for {plain(missing) or 'nothing'}"
    if not row["met"]:
        return f"{said}: no set meets the tolerance"
    if missing:
        own = row["own"]
        if own["error"] > 3:
            return f"{said}: the visible ones alone miss the tolerance, {own['error']:.2f}"
        word = "faster" if own["chosen"] <= own["nanoseconds"] else "slower"
        miss = f"; missed {plain(row['missed'])}" if row["missed"] else ""
        return f"{said}: within the tolerance, too, and {word}, {own['chosen']:.0f} for {own['nanoseconds']:.0f} ns{miss}"
    hidden = plain(sorted(set(row["material"].split("+")) - set(row["visible"])))
    return f"{said}: of {hidden} each alone can be left out, not all" if hidden else said


def plain(names: list[str]) -> str:
    return ", ".join(names).replace("_", " ")


def materials(rows: list[Row]) -> int:
    return len({r["material"] for r in rows})


def share(part: int, whole: int) -> str:
    return f"{part} of {whole} ({100 * part / whole:.1f} %)"


def ranked(rows: list[Row], cost: Callable[[list[str]], float] = estimate) -> float:
    """Rank correlation of what chosen sets are taken to cost with their times, each as its study measured it."""
    from scipy.stats import spearmanr

    return float(spearmanr([cost(r["chosen"]) for r in rows], [r["nanoseconds"] for r in rows])[0])


def page(rows: list[Row], command: str) -> str:
    """The page as Markdown."""
    known, real = ([r for r in rows if r["synthetic"] is kind] for kind in (True, False))
    lines = [
        "# What scenes call for, measured",
        "",
        f"Made on {date.today().isoformat()} by",
        f"`{command}`",
        f"({os.cpu_count()} cores, {platform.machine()}).",
        "Scenes: the [examples](../examples/scenes), tolerance RMS ΔE ITP 3.",
        f"Rank correlation of the estimated and the measured time of the {len(rows)} chosen sets: {ranked(rows):.2f}",
        f"(of the number of their effects: {ranked(rows, len):.2f}).",
        "",
    ]
    if known:
        lines += synthetic_part(known)
    if real:
        lines += real_part(real)
    return "\n".join(lines) + "\n"


def synthetic_part(rows: list[Row]) -> list[str]:
    found, visible, left, invisible = np.sum([judged(r) for r in rows], 0)
    met = sum(r["met"] for r in rows)
    cheaper = sum(len(set(r["visible"]) - set(r["chosen"])) for r in rows if r["own"]["chosen"] <= r["own"]["nanoseconds"])
    held, called = (sum(len(set(r["called"]) & set(s)) for r in rows for s in [r[k]]) for k in ("chosen", "called"))
    lines = [
        "## Truths that are known",
        "",
        f"{materials(rows)} materials made of known effects, {len(rows)} studies. Two ways to say which effects to choose:",
        "",
        "- *visible*: the best fit of the truth's other effects makes a picture beyond the tolerance. Whether effects that",
        "  the truth does not have make one within it is not asked.",
        "- *called for*: every set that makes a picture within the tolerance and is estimated to cost no more than the",
        f"  visible effects together holds it. All sets of up to {LARGEST} effects at that cost were fitted to find out.",
        "",
        "What is found:",
        "",
        f"- visible effects that are chosen: {share(found, visible)}",
        f"- visible effects that are chosen, or whose substitutes take less time: {share(found + cheaper, visible)}",
        f"- effects called for that are chosen: {share(held, called)}",
        f"- invisible effects that are not chosen: {share(left, invisible)}",
        f"- chosen sets whose picture meets the tolerance: {met} of {len(rows)}",
        f"- studies that missed a set of up to {LARGEST} effects that is estimated to cost less and meets the tolerance: "
        f"{sum(bool(r['missed']) for r in rows)} of {len(rows)}",
        "",
        "The last column says what a choice that is not that of the visible effects has in their place, and how fast it is.",
        "",
        "| truth | scene | visible | called for | chosen | error | ns a pixel | |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for r in rows:
        cells = (r["material"], r["scene"], *(plain(r[k]) for k in ("visible", "called", "chosen")))
        lines.append(f"| {' | '.join(cells)} | {r['error']:.2f} | {r['nanoseconds']:.0f} | {explained(r)} |")
    return [*lines, ""]


def real_part(rows: list[Row]) -> list[str]:
    saving = np.array([r["all"] / r["nanoseconds"] for r in rows])
    low, middle, high = np.percentile(saving, [25, 50, 75])
    lines = [
        "## Real materials",
        "",
        f"{materials(rows)} materials. *ns a pixel*: that of the chosen effects and of everything, for each directional",
        "or point light, at least one, in float32. *Saving*: the one over the other.",
        "",
        f"- median saving: {middle:.1f} (quartiles {low:.1f} and {high:.1f})",
        f"- chosen sets within the tolerance: {sum(r['met'] for r in rows)} of {len(rows)}; everything within it: "
        f"{sum(r['least'] <= 3 for r in rows)}",
        f"- everything worse than the chosen set: {sum(r['least'] > r['error'] * (1 + 1e-6) for r in rows)}",
        f"- medians of a study: {np.median([r['fits'] for r in rows]):.0f} sets of effects fitted, "
        f"{np.median([r['seconds'] for r in rows]):.0f} s while other work shared the cores",
        "",
        "| scene | within the tolerance | medians: effects chosen | error | of everything | saving |",
        "|---|---|---|---|---|---|",
    ]
    for scene in SCENES:
        mine = [r for r in rows if r["scene"] == scene]
        if mine:
            count, error, least, ratio = (
                float(np.median([f(r) for r in mine]))
                for f in (
                    lambda r: len(r["chosen"]),
                    lambda r: r["error"],
                    lambda r: r["least"],
                    lambda r: r["all"] / r["nanoseconds"],
                )
            )
            met = f"{sum(r['met'] for r in mine)} of {len(mine)}"
            lines.append(f"| {scene} | {met} | {count:.0f} | {error:.2f} | {least:.2f} | {ratio:.1f} |")
    lines += [
        "",
        "How often each effect is chosen:",
        "",
        "| effect | " + " | ".join(SCENES) + " |",
        "|---|" + "---|" * len(SCENES),
    ]
    for name in EFFECTS:
        counts = [sum(name in r["chosen"] for r in rows if r["scene"] == scene) for scene in SCENES]
        if any(counts):
            lines.append(f"| {plain([name])} | " + " | ".join(str(c) for c in counts) + " |")
    lines += [
        "",
        "| material | scene | chosen | error | everything | ns a pixel | everything | saving |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for r in rows:
        mark = "" if r["met"] else " (not met)"
        lines.append(
            f"| {r['material']} | {r['scene']} | {plain(r['chosen'])} | {r['error']:.2f}{mark} | {r['least']:.2f} | "
            f"{r['nanoseconds']:.0f} | {r['all']:.0f} | {r['all'] / r['nanoseconds']:.1f} |"
        )
    return [*lines, ""]


def main() -> None:
    """Parse, study what is missing, write."""
    args = kept.arguments(__doc__)
    rows = kept.rows(args.keep)
    sources: list[tuple[str, Any]] = [(t["name"], t) for t in TRUTHS]
    sources += [(path.stem, path) for path in args.tables]
    for k, (name, source) in enumerate(sources):
        done = {r["scene"] for r in rows if r["material"] == name}
        missing = [scene for scene in SCENES if scene not in done]
        if missing:
            table = made(source) if isinstance(source, dict) else brdfit.load(source)
        for scene in missing:
            rows.append(studied(table, scene, name if isinstance(source, dict) else None))
            with args.keep.open("a") as file:
                file.write(json.dumps(rows[-1]) + "\n")
        print(f"{k + 1}/{len(sources)} {name}", file=sys.stderr, flush=True)
    command = kept.command("scenes", "scenes_measured", args.every)
    args.out.write_text(page([r for r in rows if r["material"] in dict(sources)], command), encoding="utf-8")
    print(args.out)


if __name__ == "__main__":
    main()
