"""A goniometer's own file: angles and values of a scan become a table, a fit and a report.

    python examples/own_measurements.py [DIR]

Writes a scan of a material that is known (GGX, with 2 % noise) as DIR/scan.csv, reads it as one would read any other, keeps
it as DIR/scan.h5 for the command line, fits two models and writes DIR/report.html.
"""

import sys
from pathlib import Path

import brdfit
import numpy as np
from brdfit.angles import unit_vectors

COLUMNS = "theta_i,theta_o,phi,R,G,B"


def scan(path):
    """What a goniometer might write: degrees, and BRDF in 1/sr."""
    theta_i, theta_o, phi = np.meshgrid(np.arange(0, 76, 15), np.arange(0, 76, 3), np.arange(0, 181, 10), indexing="ij")
    angles = np.stack([theta_i, theta_o, phi], -1).reshape(-1, 3).astype(float)
    truth = brdfit.model("ggx", diffuse=[0.3, 0.2, 0.1], specular=[0.05, 0.05, 0.05], alpha=0.2)
    noise = np.random.default_rng(0).normal(1, 0.02, (len(angles), 3))
    values = np.asarray(truth(*directions(angles))) * noise
    np.savetxt(path, np.hstack([angles, values]), delimiter=",", header=COLUMNS, comments="", fmt="%.6g")


def directions(angles):
    """Unit vectors to light and viewer of angles in degrees; the azimuth is that between the two."""
    theta_i, theta_o, phi = np.radians(angles).T
    return unit_vectors(theta_i, 0.0), unit_vectors(theta_o, phi)


def read(path):
    """The file as a table."""
    rows = np.loadtxt(path, delimiter=",", skiprows=1)
    angles, values = rows[:, :3], rows[:, 3:]
    # equal steps of angle: what a sample stands for shrinks towards the normal
    theta_i, theta_o, _ = np.radians(angles).T
    measure = np.sin(theta_i + 0.01) * np.sin(theta_o + 0.01)
    return brdfit.measurements(*directions(angles), values, measure=measure, material=Path(path).stem)


def main(out="out/own-measurements"):
    """Scan, read, fit and report."""
    out = Path(out)
    out.mkdir(parents=True, exist_ok=True)
    scan(out / "scan.csv")
    table = read(out / "scan.csv")
    brdfit.save(table, out / "scan.h5")
    fits = [brdfit.fit(table, model) for model in ("ggx", "ward")]
    for fit in fits:
        print(f"{fit.model_name:5s} alpha {fit.parameters['alpha']:.4f} +- {fit.stderr['alpha']:.1g}, {fit.reason}")
    print(f"report: {brdfit.report(out, fits, table)}")


if __name__ == "__main__":
    main(*sys.argv[1:])
