"""What a measurement does to true values: small parts that are applied one after the other.

Each part takes values ``[C, *shape]`` in 1/sr, the smaller of cos(theta_i) and cos(theta_o) of each cell ``[*shape]``
and a generator, and returns new values. NaN is a cell that was not measured and stays so. What falls below zero stays
negative, and is masked as a reader of a real table would mask it: strong noise on dark cells biases what is left.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

Reals = NDArray[np.float64]


@runtime_checkable
class Noise(Protocol):
    """One part. Implementations are frozen dataclasses, so that the truth of a table can name them with their values."""

    def apply(self, values: Reals, cosine: Reals, rng: np.random.Generator) -> Reals:
        """Values ``[C, *shape]`` after this part; ``cosine`` ``[*shape]`` is that of the lower of both directions."""
        ...


@dataclass(frozen=True)
class Relative:
    """Independent Gaussian noise with a standard deviation of ``sigma`` times the value."""

    sigma: float

    def __post_init__(self) -> None:
        _at_least_zero("sigma", self.sigma)

    def apply(self, values: Reals, cosine: Reals, rng: np.random.Generator) -> Reals:
        """v (1 + sigma n)."""
        return values * (1 + self.sigma * rng.standard_normal(values.shape))


@dataclass(frozen=True)
class Floor:
    """Independent Gaussian noise with a standard deviation of ``sigma`` in 1/sr, as of a sensor in the dark."""

    sigma: float

    def __post_init__(self) -> None:
        _at_least_zero("sigma", self.sigma)

    def apply(self, values: Reals, cosine: Reals, rng: np.random.Generator) -> Reals:
        """v + sigma n."""
        return values + self.sigma * rng.standard_normal(values.shape)


@dataclass(frozen=True)
class Grazing:
    """Relative noise that grows towards grazing: ``sigma``/cos of the lower direction times the value."""

    sigma: float

    def __post_init__(self) -> None:
        _at_least_zero("sigma", self.sigma)

    def apply(self, values: Reals, cosine: Reals, rng: np.random.Generator) -> Reals:
        """v (1 + sigma n / min(cos_i, cos_o))."""
        return values * (1 + self.sigma * rng.standard_normal(values.shape) / cosine)


@dataclass(frozen=True)
class Outliers:
    """A ``fraction`` of the cells, in all channels together, is off by a ``factor`` (a glint, a shadow, dust)."""

    fraction: float
    factor: float = 10.0

    def __post_init__(self) -> None:
        _share("fraction", self.fraction)
        _at_least_zero("factor", self.factor)

    def apply(self, values: Reals, cosine: Reals, rng: np.random.Generator) -> Reals:
        """Factor times v where a cell is hit."""
        return values * np.where(rng.random(cosine.shape) < self.fraction, self.factor, 1.0)


@dataclass(frozen=True)
class Missing:
    """A ``fraction`` of the cells was not measured."""

    fraction: float

    def __post_init__(self) -> None:
        _share("fraction", self.fraction)

    def apply(self, values: Reals, cosine: Reals, rng: np.random.Generator) -> Reals:
        """NaN where a cell is hit."""
        return np.where(rng.random(cosine.shape) < self.fraction, np.nan, values)


def describe(noise: Noise) -> dict[str, object]:
    """The part as data: its kind and its numbers."""
    return {"kind": type(noise).__name__.lower(), **asdict(noise)}  # type: ignore[call-overload]


def _at_least_zero(name: str, value: float) -> None:
    if not (np.isfinite(value) and value >= 0):
        raise ValueError(f"{name} of the noise must be finite and at least 0, not {value:g}")


def _share(name: str, value: float) -> None:
    if not 0 <= value <= 1:
        raise ValueError(f"{name} of the noise must lie in [0, 1], not {value:g}")


__all__ = ["Floor", "Grazing", "Missing", "Noise", "Outliers", "Relative", "describe"]
