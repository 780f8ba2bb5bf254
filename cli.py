"""The command line. A verb parses, makes one library call, writes; heavy modules are imported when a verb needs them."""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from .errors import InputError
from .files import folder

if TYPE_CHECKING:
    from .fitting import Fit
    from .reports.evidence import Evidence

OK, SOME_FAILED, WRONG_USE = 0, 1, 2
DEFAULT_MODELS = "gtr,abc,sgd,ward,ashikhmin_shirley"


def run(arguments: Sequence[str] | None = None) -> int:
    """Run a command line and return its exit code; wrong use is one line on standard error."""
    try:
        code = commands.main(args=None if arguments is None else list(arguments), prog_name="brdfit", standalone_mode=False)
        return int(code or OK)
    except click.ClickException as fault:
        where = fault.ctx.command_path if isinstance(fault, click.UsageError) and fault.ctx else "brdfit"
        click.echo(f"{where}: {' '.join(fault.format_message().split())} (see {where} --help)", err=True)
        return WRONG_USE
    except InputError as fault:
        click.echo(f"brdfit: {fault}", err=True)
        return WRONG_USE
    except (click.Abort, KeyboardInterrupt):
        click.echo("brdfit: interrupted; what was finished is kept", err=True)
        return SOME_FAILED


def _finite(context: click.Context, option: click.Parameter, value: float) -> float:
    if not math.isfinite(value):
        raise click.BadParameter(f"{value} is not a number to use.", context, option)
    return value


class Measure(click.ParamType[float]):
    """A number with a unit of its own: ``1%`` or ``50ms``."""

    def __init__(self, name: str, units: dict[str, float], below: float, example: str) -> None:
        self.name = name
        self.units = units
        self.below = below
        self.example = example

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """The number in terms of the bare unit."""
        if isinstance(value, float):
            return value
        text = str(value).strip()
        unit = next((u for u in sorted(self.units, key=len, reverse=True) if text.endswith(u)), "")
        try:
            number = float(text.removesuffix(unit)) * self.units[unit]
        except ValueError:
            number = math.nan
        if not 0 < number < self.below:
            self.fail(f"{value!r} is not a {self.name}: write {self.example}", param, ctx)
        return number


SHARE = Measure("share", {"": 1.0, "%": 0.01}, 1.0, "1% or 0.01")
DURATION = Measure("time", {"": 1.0, "s": 1.0, "ms": 1e-3}, math.inf, "500ms or 0.5s")

_angles = click.option(
    "--angles",
    default="edge",
    show_default=True,
    type=click.Choice(["edge", "centre"]),
    help="Where in a cell of a MERL file its value holds.",
)
_max_angle = click.option(
    "--max-angle",
    default=80.0,
    show_default=True,
    type=click.FloatRange(0, 90, min_open=True, max_open=True),
    callback=_finite,
    help="Largest polar angle fitted, degrees.",
)


@click.group(no_args_is_help=False, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(package_name="brdfit")
def commands() -> None:
    """Fit analytic reflectance models to measured BRDF tables.

    Exit codes: 0 all fitted; 1 some fit failed or did not converge; 2 wrong use or unreadable input.
    """


@commands.command("fit", short_help="Fit models to tables; writes fits.json and a report.")
@click.argument("files", nargs=-1, required=True, metavar="FILE...")
@click.option("--model", "models", default=DEFAULT_MODELS, show_default=True, help="Models, separated by commas.")
@click.option("--out", "out_dir", required=True, metavar="DIR", help="Where fits.json and report.html go.")
@click.option("--loss", default="log", show_default=True, help="What is minimised; `brdfit models` lists the names.")
@click.option(
    "--measure",
    default="solid_angle",
    show_default=True,
    type=click.Choice(["solid_angle", "cells"]),
    help="What a cell counts by.",
)
@click.option("--scene", "scene_file", metavar="SCENE.toml", help="Weight cells by what this scene shows of them.")
@_angles
@_max_angle
@click.option("--seed", default=0, show_default=True, type=click.IntRange(0), help="Seed of random starts.")
@click.option(
    "--start",
    default="data",
    show_default=True,
    type=click.Choice(["data", "published"]),
    help="Start from the data, or also from the published fit of the model to the material.",
)
@click.option("--json", "as_json", is_flag=True, help="Print fits.json on standard output, and no progress.")
@click.option("--tolerance", type=SHARE, help="Cheapest settings that keep the error within this share of the best: 1%.")
@click.option("--time-budget", type=DURATION, help="Best settings that prepare and fit a table in this time: 500ms.")
@click.option("--report/--no-report", default=True, show_default=True, help="Write report.html.")
@click.option("--quiet", is_flag=True, help="Print nothing.")
def fit_command(
    files: tuple[str, ...],
    models: str,
    out_dir: str,
    loss: str,
    measure: str,
    scene_file: str | None,
    angles: Any,
    max_angle: float,
    seed: int,
    start: str,
    as_json: bool,
    tolerance: float | None,
    time_budget: float | None,
    report: bool,
    quiet: bool,
) -> int:
    """Fit every model to every FILE; writes DIR/fits.json and DIR/report.html."""
    from .progress import Progress
    from .tables import load

    files = tuple(dict.fromkeys(files))
    isotropic = []
    for path in files:  # nothing is fitted or written if one of them cannot be used
        kept = {path: load(path, angles=angles)}
        isotropic += [path] if kept[path].isotropic else []
    _keep_programs()
    names = _checked_names(models, loss, isotropic)
    scene = None
    if scene_file is not None:
        from .scenes import load_scene, weighted

        if measure != "solid_angle":
            raise click.UsageError("--scene is a measure itself: leave --measure out", click.get_current_context())
        scene = load_scene(scene_file)
    out = folder(out_dir)

    from .environment import environment
    from .fitting import fit_many
    from .reports import Views, preload, rebuild_report, save_evidence, write_fits
    from .reports.words import planned

    fits: list[Fit] = []
    evidence: list[Evidence] = []
    where = environment()
    options: dict[str, Any] = {
        "loss": loss,
        "measure": measure,
        "max_angle": max_angle,
        "seed": seed,
        "start": None if start == "data" else start,
        "tolerance": tolerance,
        "time_budget": time_budget,
    }
    interrupted = False
    with Progress(len(files) * len(names), silent=quiet or as_json) as progress:
        try:
            for path in files:
                table = kept.pop(path) if path in kept else load(path, angles=angles)
                progress.say(f"{table.material}: fitting")
                first, views = len(fits), None
                if scene is not None:
                    table = weighted(table, scene)
                for f in fit_many([table], names, **options):
                    if scene is not None:
                        f = replace(f, measure=f"scene {scene.name}")
                    fits[first:] = sorted([*fits[first:], f], key=lambda f: names.index(f.model_name))
                    write_fits(out, fits, where)
                    said = (_line(f), planned(f), *(f"WARNING: {w}" for w in f.warnings))
                    progress.advance("\n  ".join(filter(None, said)))
                    if report:  # meanwhile the next fits go on
                        preload()
                        views = views or Views(table, max_angle)
                        views(f)
                if views:
                    progress.say(f"{table.material}: drawing")
                    evidence.append(views.evidence(fits[first:]))
        except KeyboardInterrupt:
            interrupted = True
        if report and fits:
            save_evidence(out, evidence)
            rebuild_report(out)
    if interrupted:
        raise KeyboardInterrupt
    if as_json:
        click.echo((out / "fits.json").read_text(encoding="utf-8"), nl=False)
    elif not quiet:
        click.echo(f"report: {out / 'report.html'}" if report else f"fits: {out / 'fits.json'}")
    return OK if all(f.converged for f in fits) else SOME_FAILED


@commands.command("synth", short_help="Write synthetic tables whose parameters are known.")
@click.argument("names", nargs=-1, metavar="[NAME]...")
@click.option("--out", "out_dir", metavar="DIR", help="Where the tables go.")
@click.option("--seed", default=0, show_default=True, type=click.IntRange(0), help="Seed of the noise.")
@click.option(
    "--noise",
    default=0.0,
    show_default=True,
    type=click.FloatRange(0),
    callback=_finite,
    help="Relative noise, standard deviation.",
)
@click.option("--list", "list_names", is_flag=True, help="List the materials and stop.")
@click.option("--quiet", is_flag=True, help="Print nothing.")
def synth_command(
    names: tuple[str, ...], out_dir: str | None, seed: int, noise: float, list_names: bool, quiet: bool
) -> int:
    """Write synthetic ground-truth tables: NAME.binary (MERL), NAME.h5 and their true parameters as NAME.json.

    Without a NAME, a few of each sort.
    """
    _keep_programs()
    from .data import synthetic

    if list_names:
        click.echo("\n".join(synthetic.names()))
        return OK
    if out_dir is None:
        raise click.UsageError("Missing option '--out'.", click.get_current_context())
    for name in names:  # nothing is written if one of them is unknown
        synthetic.material(name)
    parts = [synthetic.Relative(noise)] if noise else []
    for path in synthetic.write(names, folder(out_dir), noise=parts, seed=seed):
        if not quiet:
            click.echo(str(path))
    return OK


@commands.command("report", short_help="Rebuild a report from its fits.json.")
@click.argument("directory", metavar="DIR")
def report_command(directory: str) -> int:
    """Rebuild DIR/report.html from DIR/fits.json."""
    from .reports import rebuild_report

    click.echo(f"report: {rebuild_report(directory)}")
    return OK


@commands.command("models", short_help="List models with their parameters, and losses.")
@click.argument("names", nargs=-1, metavar="[NAME]...")
@click.option("--json", "as_json", is_flag=True, help="Print as JSON.")
def models_command(names: tuple[str, ...], as_json: bool) -> int:
    """List every model, or those named, with parameters, ranges, units and source; and every loss."""
    from .catalogue import catalogue, text

    try:
        click.echo(json.dumps(catalogue(names), indent=1) if as_json else text(names))
    except ValueError as fault:
        raise click.UsageError(str(fault), click.get_current_context()) from None
    return OK


@commands.command("stability", short_help="Measure how many digits every model keeps.")
@click.option("--out", "out_dir", required=True, metavar="DIR", help="Where stability.md, .html and .json go.")
@click.option("--draws", type=click.IntRange(1), help="Random draws of each part that must be finite.  [default: some]")
@click.option("--quiet", is_flag=True, help="Print nothing.")
def stability_command(out_dir: str, draws: int | None, quiet: bool) -> int:
    """Measure how many digits every model and part keeps over its whole domain; takes three minutes."""
    try:
        import mpmath  # noqa: F401
    except ImportError:
        raise InputError("stability needs mpmath for its 40-digit reference: pip install 'brdfit[stability]'") from None
    _keep_programs()
    out = folder(out_dir)
    from .stability.page import write_atlas

    page = write_atlas(out, draws, (lambda text: None) if quiet else (lambda text: click.echo(text, err=True)))
    if not quiet:
        click.echo(f"atlas: {page}")
    return OK


@commands.command("tradeoff", short_help="Measure what accuracy costs in time.")
@click.argument("file", metavar="FILE")
@click.option("--out", "out_dir", required=True, metavar="DIR", help="Where tradeoff.html and tradeoff.json go.")
@click.option(
    "--model", help="Whose fitting settings are measured; compared with the usual models.  [default: the best of these]"
)
@click.option("--loss", default="log", show_default=True, help="What fits minimise.")
@_angles
@_max_angle
@click.option("--quiet", is_flag=True, help="Print nothing.")
def tradeoff_command(
    file: str, out_dir: str, model: str | None, loss: str, angles: Any, max_angle: float, quiet: bool
) -> int:
    """Measure what accuracy costs in time, for the material of FILE on this machine; takes a minute and a half or two."""
    from .progress import Progress
    from .tables import load

    table = load(file, angles=angles)
    _keep_programs()
    names = _checked_names(DEFAULT_MODELS if model is None else model, loss, [file] if table.isotropic else [])
    if model is not None and len(names) > 1:
        raise click.UsageError("--model takes one model here", click.get_current_context())
    model = model and names[0]
    out = folder(out_dir)
    from .tradeoff import pieces, tradeoff, write_tradeoff

    with Progress(pieces(model), silent=quiet) as progress:
        result = tradeoff(table, model, loss=loss, max_angle=max_angle, progress=progress)
    page = write_tradeoff(out, result)
    if not quiet:
        click.echo(f"tradeoff: {page}")
    return OK if all(f.converged for f in result.fits) else SOME_FAILED


@commands.command("scene", short_help="Find the effects that a scene calls for.")
@click.argument("scene_file", metavar="SCENE.toml")
@click.argument("file", metavar="FILE")
@click.option("--out", "out_dir", required=True, metavar="DIR", help="Where scene.html and scene.json go.")
@click.option("--exr", is_flag=True, help="Write the pictures as DIR/scene.exr, too.")
@_angles
@click.option("--quiet", is_flag=True, help="Print nothing.")
def scene_command(scene_file: str, file: str, out_dir: str, exr: bool, angles: Any, quiet: bool) -> int:
    """Find which effects of the material in FILE the scene shows, and the cheapest model that does."""
    from .progress import Progress
    from .tables import load

    _keep_programs()
    from .scenes import PIECES, load_scene, study, write_scene

    scene = load_scene(scene_file)
    table = load(file, angles=angles)
    out = folder(out_dir)
    with Progress(PIECES, silent=quiet) as progress:
        found = study(table, scene, progress)
    page = write_scene(out, found, exr)
    if not quiet:
        click.echo(f"scene: {page}")
    return OK if found.choice.met else SOME_FAILED


def _checked_names(models: str, loss: str, isotropic: Sequence[str]) -> list[str]:
    """The models of a list with commas, once each.

    Raises UsageError for an unknown name of a model or loss, InputError for a model without an isotropic form if there are
    ``isotropic`` files.
    """
    from .fitting.given import check_azimuth
    from .fitting.losses import LOSSES
    from .models import variants

    names = list(dict.fromkeys(m.strip() for m in re.split(r",(?![^(]*\))", models) if m.strip()))
    if not names:
        raise click.UsageError("--model names no model", click.get_current_context())
    try:
        names = list(dict.fromkeys(variants(name)[0].name for name in names))
    except ValueError as fault:
        raise click.UsageError(str(fault), click.get_current_context()) from None
    if loss not in LOSSES:
        raise click.UsageError(f"unknown loss {loss!r}: choose from {', '.join(LOSSES)}", click.get_current_context())
    for path in isotropic:
        for name in names:
            check_azimuth(variants(name)[0], path)
    return names


def _keep_programs() -> None:
    """Keep compiled programs from run to run in the user's cache directory, and have JAX do so (it looks when imported)."""
    from platformdirs import user_cache_path

    directory = os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(user_cache_path("brdfit") / "programs"))
    os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0")
    os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_ENTRY_SIZE_BYTES", "-1")
    from .stored_programs import store_in

    store_in(directory)


def _line(f: Fit) -> str:
    if f.model is None:
        return f"{f.material}  {f.model_name}  FAILED: {f.reason}"
    took = f"{f.seconds['prepare'] + f.seconds['solve']:.2f} s + {f.seconds['compile']:.2f} s compiling"
    verdict = "" if f.converged else f"  NOT CONVERGED: {f.reason}"
    errors = "  ".join(f"{name} {f.errors[name]:.5f}" for name in dict.fromkeys(("perceptual", f.loss)))
    return f"{f.material}  {f.model_name:18s} {errors}  {took}{verdict}"


__all__ = ["run"]
