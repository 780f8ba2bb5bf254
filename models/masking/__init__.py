"""Masking-shadowing: the part of the microfacets that light and viewer both see."""

from .smith import smith_correlated as smith_correlated
from .smith import smith_lambda as smith_lambda
from .smith import smith_separable as smith_separable
from .vcavity import vcavity as vcavity
