"""Published fits as models: where a user can start from, and what a new fit is compared with."""

from __future__ import annotations

from typing import TypeVar, cast

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike

from ..models import BRDF, build, ndf
from ..models.abc import ABC
from ..models.sgd import SGD
from .published import raw
from .published_sgd import PublishedSGD

Model = TypeVar("Model", bound=BRDF)


def published_abc(material: str) -> ABC:
    """The fit of Low et al. (2012) to a MERL material, as an ``abc`` model of three channels; the form is exact.

    They write A/pi where the normalised lobe has specular k/4, hence specular = 4 A/(pi k(b, c)).
    Raises InputError for a material that was not fitted.
    """
    fit = raw("abc", material)
    with jax.enable_x64(True):
        k = float(_abc_normaliser(fit["B"], fit["C"]))
    scale = 4 * fit["A"] / (np.pi * k)
    return _built(ABC, diffuse=fit["kD"], specular=scale, b=fit["B"], c=fit["C"], ior=fit["ior"])


def published_sgd(material: str) -> PublishedSGD:
    """The fit of Bagher et al. (2012) to a MERL material in its exact form, approximate masking included.

    Raises InputError for a material that was not fitted.
    """
    fit = raw("sgd", material)
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


def _built(cls: type[Model], **parameters: ArrayLike) -> Model:
    return cast(Model, build(cls, parameters))


@jax.jit
def _abc_normaliser(b: Array, c: Array) -> Array:
    return ndf.ABC(b, c).normalisation()


@jax.jit
def _sgd_peaks(alpha: Array, p: Array) -> Array:
    """D at the pole, of each channel."""
    return jax.vmap(lambda a, q: ndf.SGD(a, q)(jnp.zeros(()), jnp.ones(())))(alpha, p)


__all__ = ["published_abc", "published_sgd", "published_sgd_smith"]
