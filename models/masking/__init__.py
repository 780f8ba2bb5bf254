"""Masking-shadowing: the part G of the microfacets that light and viewer both see, as V = G / (4 (n.l)(n.v))."""

from .approximations import half_vector as half_vector
from .approximations import hammon as hammon
from .approximations import kelemen as kelemen
from .approximations import schlick_smith as schlick_smith
from .approximations import walter_correlated as walter_correlated
from .approximations import walter_separable as walter_separable
from .smith import averted_area as averted_area
from .smith import smith_correlated as smith_correlated
from .smith import smith_lambda as smith_lambda
from .smith import smith_separable as smith_separable
from .vcavity import vcavity as vcavity
