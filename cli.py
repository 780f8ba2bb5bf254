"""The command line. A verb parses, makes one library call, writes; heavy modules are imported when a verb needs them."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .errors import InputError

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
    except click.exceptions.NoArgsIsHelpError as fault:
        click.echo(fault.format_message())
        return WRONG_USE
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


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(package_name="brdfit")
def commands() -> None:
    """Fit analytic reflectance models to measured BRDF tables.

    Exit codes: 0 all fitted; 1 some fit failed or did not converge; 2 wrong use or unreadable input.
    """


@commands.command("fit")
@click.argument("files", nargs=-1, required=True, metavar="FILE...")
@click.option("--model", "models", default=DEFAULT_MODELS, show_default=True, help="Models, separated by commas.")
@click.option("--out", "out_dir", required=True, metavar="DIR", help="Where fits.json and report.html go.")
@click.option("--loss", default="log", show_default=True, help="What is minimised; `brdfit models` lists the names.")
@click.option("--measure", default="solid_angle", show_default=True, type=click.Choice(["solid_angle", "cells"]), help="What a cell counts by.")
@click.option("--angles", default="edge", show_default=True, type=click.Choice(["edge", "centre"]), help="Where in a cell of a MERL file its value holds.")
@click.option("--max-angle", default=80.0, show_default=True, type=click.FloatRange(0, 90, min_open=True, max_open=True), help="Largest polar angle fitted, degrees.")
@click.option("--seed", default=0, show_default=True, help="Seed of random starts.")
@click.option("--json", "as_json", is_flag=True, help="Print the records of fits.json on standard output.")
@click.option("--report/--no-report", default=True, show_default=True, help="Write report.html.")
@click.option("--quiet", is_flag=True, help="No progress and no table.")
def fit_command(
    files: tuple[str, ...],
    models: str,
    out_dir: str,
    loss: str,
    measure: str,
    angles: str,
    max_angle: float,
    seed: int,
    as_json: bool,
    report: bool,
    quiet: bool,
) -> int:
    """Fit every model to every FILE; writes DIR/fits.json and DIR/report.html."""
    from .progress import Progress

    names = [m.strip() for m in models.split(",") if m.strip()]
    _check_names(names, loss)
    tables = _checked(files, angles)
    out = _writable(out_dir)
    _cache_programs()

    from .environment import environment
    from .fitting import fit_many
    from .reports import gather, save_evidence, write_fits, write_report

    fits: list[Fit] = []
    evidence: list[Evidence] = []
    where = environment()
    with Progress(len(files) * len(names), silent=quiet or as_json) as progress:
        for path in tables:
            table = _load(path, angles)
            progress.say(f"{table.material}: fitting {', '.join(names)}")
            mine: list[Fit] = []
            for f in fit_many([table], names, loss=loss, measure=measure, max_angle=max_angle, seed=seed):
                mine.append(f)
                progress.advance(_line(f))
            mine.sort(key=lambda f: names.index(f.model_name))
            fits += mine
            write_fits(out, fits, where)
            if report:
                progress.say(f"{table.material}: drawing")
                evidence.append(gather(table, mine))
        if report:
            save_evidence(out, evidence)
            write_report(out, fits, evidence, where)
    if as_json:
        click.echo(json.dumps([f.record() for f in fits], indent=1))
    elif not quiet:
        click.echo(f"report: {out / 'report.html'}" if report else f"fits: {out / 'fits.json'}")
    return OK if all(f.converged for f in fits) else SOME_FAILED


@commands.command("synth")
@click.argument("names", nargs=-1, metavar="[NAME]...")
@click.option("--out", "out_dir", metavar="DIR", help="Where the tables go.")
@click.option("--seed", default=0, show_default=True, help="Seed of the noise.")
@click.option("--noise", default=0.0, show_default=True, type=click.FloatRange(0), help="Relative noise, standard deviation.")
@click.option("--list", "list_names", is_flag=True, help="List the materials and stop.")
@click.option("--quiet", is_flag=True, help="Print nothing.")
def synth_command(names: tuple[str, ...], out_dir: str | None, seed: int, noise: float, list_names: bool, quiet: bool) -> int:
    """Write synthetic ground-truth tables: NAME.binary (MERL), NAME.h5 and their true parameters as NAME.json."""
    from .data import synthetic

    if list_names:
        click.echo("\n".join(synthetic.names()))
        return OK
    if out_dir is None:
        raise click.UsageError("Missing option '--out'.", click.get_current_context())
    _cache_programs()
    parts = [synthetic.Relative(noise)] if noise else []
    for path in synthetic.write(names, _writable(out_dir), noise=parts, seed=seed):
        if not quiet:
            click.echo(str(path))
    return OK


@commands.command("report")
@click.argument("directory", metavar="DIR")
def report_command(directory: str) -> int:
    """Rebuild DIR/report.html from DIR/fits.json."""
    from .reports import rebuild_report

    click.echo(f"report: {rebuild_report(directory)}")
    return OK


@commands.command("models")
@click.option("--json", "as_json", is_flag=True, help="Print as JSON.")
def models_command(as_json: bool) -> int:
    """List every model with its parameters, ranges, units and source, and every loss."""
    from .catalogue import catalogue, text

    click.echo(json.dumps(catalogue(), indent=1) if as_json else text())
    return OK


def _check_names(models: list[str], loss: str) -> None:
    from .fitting.losses import LOSSES
    from .models import MODELS

    for name in models:
        if name not in MODELS:
            raise click.UsageError(f"unknown model {name!r}: choose from {', '.join(MODELS)}", click.get_current_context())
    if not models:
        raise click.UsageError("--model names no model", click.get_current_context())
    if loss not in LOSSES:
        raise click.UsageError(f"unknown loss {loss!r}: choose from {', '.join(LOSSES)}", click.get_current_context())


def _load(path: str, angles: Any) -> Any:
    from .tables import load

    return load(path, angles=angles)


def _checked(files: tuple[str, ...], angles: str) -> tuple[str, ...]:
    """The files, each read once: nothing is fitted or written if one of them cannot be used."""
    for path in files:
        _load(path, angles)
    return files


def _writable(out_dir: str) -> Path:
    """The directory, made if need be. Raises InputError if nothing can be written there."""
    from .files import replacing

    out = Path(out_dir)
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as fault:
        raise InputError(f"{out_dir}: cannot be made a directory ({fault.strerror or fault}); choose another --out") from None
    probe = out / ".brdfit-can-write"
    with contextlib.suppress(FileNotFoundError), replacing(probe) as temporary:
        temporary.touch()
    probe.unlink(missing_ok=True)
    return out


def _cache_programs() -> None:
    """Keep compiled programs from run to run in the user's cache directory (this process only: a library must not)."""
    import jax
    from platformdirs import user_cache_dir

    if jax.config.jax_compilation_cache_dir is None:
        jax.config.update("jax_compilation_cache_dir", str(Path(user_cache_dir("brdfit")) / "programs"))
        jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
        jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)


def _line(f: Fit) -> str:
    verdict = "" if f.converged else f"  NOT CONVERGED: {f.reason}"
    took = f.seconds["prepare"] + f.seconds["solve"]
    return (
        f"{f.material}  {f.model_name:18s} perceptual {f.errors['perceptual']:.4f}  {f.loss} {f.errors[f.loss]:.5f}"
        f"  {took:.2f} s + {f.seconds['compile']:.2f} s compiling{verdict}"
    )

