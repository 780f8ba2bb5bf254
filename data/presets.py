"""Published fits as models: where a user can start from, and what a new fit is compared with."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeVar, cast

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike
from numpy.typing import NDArray

from ..models import BRDF, build, model, ndf, parameter_values
from ..models.abc import ABC
from ..models.factory import microfacet
from ..models.sgd import SGD
from .published import NGAN_SCALE, published_materials, raw
from .published_sgd import PublishedSGD

Model = TypeVar("Model", bound=BRDF)
Row = Mapping[str, NDArray[np.float64]]


def preset(form: str, material: str) -> BRDF:
    """A published fit to a MERL material as a model of three channels, in 1/sr, in the exact form that was fitted.

    ``form`` is a name of :func:`brdfit.data.forms`, a table of published fits. Where a model of the package has that form,
    the preset is one of it; else it is made of named blocks (:func:`brdfit.microfacet`).

    Raises InputError for an unknown form, and for a material that it was not fitted to, naming close ones.
    """
    row = raw(form, material)
    return _PRESETS[form](row)


def published_start(name: str, material: str) -> dict[str, NDArray[np.float64]] | None:
    """Parameters of the published fit of the named model to a material; None if there is none."""
    form = STARTS.get(name)
    if form is None or material not in published_materials(form):
        return None
    start = published_sgd_smith(material) if form == "sgd" else preset(form, material)
    return parameter_values(start)


def published_abc(material: str) -> ABC:
    """The fit of Low et al. (2012) to a MERL material, as an ``abc`` model of three channels; the form is exact.

    They write A/pi where the normalised lobe has specular k/4, hence specular = 4 A/(pi k(b, c)).
    Raises InputError for a material that was not fitted.
    """
    return _abc(raw("abc", material))


def _abc(fit: Row) -> ABC:
    with jax.enable_x64(True):
        k = float(_abc_normaliser(fit["B"], fit["C"]))
    scale = 4 * fit["A"] / (np.pi * k)
    return _built(ABC, diffuse=fit["kD"], specular=scale, b=fit["B"], c=fit["C"], ior=fit["ior"])


def published_sgd(material: str) -> PublishedSGD:
    """The fit of Bagher et al. (2012) to a MERL material in its exact form, approximate masking included.

    Raises InputError for a material that was not fitted.
    """
    return _sgd(raw("sgd", material))


def _sgd(fit: Row) -> PublishedSGD:
    return _built(
        PublishedSGD,
        diffuse=fit["rhoD"],
        specular=fit["rhoS"],
        alpha=fit["alpha"],
        p=fit["p"],
        f0=fit["F0"],
        f1=fit["F1"],
        normaliser=fit["K"],
        lam=fit["Lambda"],
        log_c=np.log(fit["c"]),
        k=fit["k"],
        theta0=fit["theta0"],
    )


def published_sgd_smith(material: str) -> SGD:
    """The same lobe as an ``sgd`` model of three channels: as :func:`published_sgd` but for the masking, exact Smith here.

    specular = 4/pi rhoS K alpha Gamma(1 - p, alpha), the last three the ratio of their D to the normalised one.
    Raises InputError for a material that was not fitted.
    """
    fit = raw("sgd", material)
    alpha, p = fit["alpha"], fit["p"]
    with jax.enable_x64(True):
        ratio = fit["K"] * np.exp(-alpha - p * np.log(alpha)) / (np.pi * np.asarray(_sgd_peaks(alpha, p)))
    scale = 4 / np.pi * fit["rhoS"] * ratio
    return _built(SGD, diffuse=fit["rhoD"], specular=scale, alpha=alpha, p=p, f0=fit["F0"], f1=fit["F1"])


def _of_table(row: Row) -> Row:
    """A row of the ``ngan_*`` forms in the units of the tables."""
    scale = np.asarray(NGAN_SCALE)
    return {**row, "kd": row["kd"] * scale, "albedo": row["albedo"] * scale}


def _low_smooth(row: Row) -> BRDF:
    return model("abc_smooth", diffuse=row["kd"], scale=row["A"], b=row["B"], c=row["C"], ior=row["eta"])


def _ashikhmin_shirley(row: Row, fresnel: str, **reflectance: ArrayLike) -> BRDF:
    """Their lobe over 8 pi c_d max(n.l, n.v); D of the block has s + 2 where it has s + 1."""
    s = row["sharpness"]
    cls = microfacet("blinn", "half_vector", fresnel, "lambert")
    specular = row["albedo"] * (s + 1) / (s + 2)
    return _built(cls, diffuse=row["kd"], specular=specular, exponent=s, **reflectance)


def _cook_torrance(row: Row, fresnel: str, scale: float, **reflectance: ArrayLike) -> BRDF:
    cls = microfacet("beckmann", "vcavity", fresnel, "lambert")
    specular = scale * row["albedo"]
    return _built(cls, diffuse=row["kd"], specular=specular, alpha=row["roughness"], **reflectance)


def _lafortune(row: Row) -> BRDF:
    tilt = np.arctan2(-row["Cxy"], row["Cz"])
    return model("lafortune", diffuse=row["kd"], specular=row["albedo"], tilt=tilt, exponent=row["sharpness"])


def _ward(name: str) -> Callable[[Row], BRDF]:
    return lambda row: model(name, diffuse=row["kd"], specular=row["albedo"], alpha=row["roughness"])


def _he(row: Row) -> BRDF:
    lobe = {"ior": row["eta"], "sigma": row["roughness"], "tau": row["autocorrelation"]}
    return model("htsg", diffuse=row["kd"], specular=row["albedo"], **lobe)


def _built(cls: type[Model], **parameters: ArrayLike) -> Model:
    return cast(Model, build(cls, parameters))


def _ngan(make: Callable[[Row], BRDF]) -> Callable[[Row], BRDF]:
    return lambda row: make(_of_table(row))


_LOW_AS: Any = lambda row: _ashikhmin_shirley(row, "dielectric", ior=row["fresnelReflectance"])  # noqa: E731
_LOW_CT: Any = lambda row: _cook_torrance(row, "dielectric", 4.0, ior=row["eta"])  # noqa: E731

_PRESETS: dict[str, Callable[[Row], BRDF]] = {
    "abc": _abc,
    "sgd": _sgd,
    "low_lowsmooth_E2": _low_smooth,
    "low_ashikhminshirley_E1": _LOW_AS,
    "low_ashikhminshirley_E2": _LOW_AS,
    "low_cooktorrance_E1": _LOW_CT,  # pi of their pi D over the pi that they divide by, and 4 of the microfacet term
    "low_cooktorrance_E2": _LOW_CT,
    "ngan_ashikhminshirley": _ngan(lambda row: _ashikhmin_shirley(row, "schlick_scaled", f0=row["fresnelReflectance"])),
    "ngan_blinnphong": _ngan(
        lambda row: model("blinn_phong", diffuse=row["kd"], specular=row["albedo"], exponent=row["sharpness"])
    ),
    "ngan_cooktorrance": _ngan(lambda row: _cook_torrance(row, "schlick_scaled", 4 / np.pi, f0=row["eta"])),
    "ngan_he": _ngan(_he),
    "ngan_lafortune": _ngan(_lafortune),
    "ngan_ward": _ngan(_ward("ward")),
    "ngan_wardduer": _ngan(_ward("ward_duer")),
}

STARTS = {
    "abc": "abc",
    "sgd": "sgd",
    "abc_smooth": "low_lowsmooth_E2",
    "blinn_phong": "ngan_blinnphong",
    "htsg": "ngan_he",
    "lafortune": "ngan_lafortune",
    "ward": "ngan_ward",
    "ward_duer": "ngan_wardduer",
    "microfacet(blinn,half_vector,dielectric,lambert)": "low_ashikhminshirley_E2",
    "microfacet(beckmann,vcavity,dielectric,lambert)": "low_cooktorrance_E2",
    "microfacet(blinn,half_vector,schlick_scaled,lambert)": "ngan_ashikhminshirley",
    "microfacet(beckmann,vcavity,schlick_scaled,lambert)": "ngan_cooktorrance",
}
"""The form that was fitted with the named model."""


@jax.jit
def _abc_normaliser(b: Array, c: Array) -> Array:
    return ndf.ABC(b, c).normalisation()


@jax.jit
def _sgd_peaks(alpha: Array, p: Array) -> Array:
    """D at the pole, of each channel."""
    return jax.vmap(lambda a, q: ndf.SGD(a, q)(jnp.zeros(()), jnp.ones(())))(alpha, p)


__all__ = ["preset", "published_abc", "published_sgd", "published_sgd_smith", "published_start"]
