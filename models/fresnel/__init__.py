"""Fresnel reflectance as a function of cos(theta_d), by the ways models parametrise it."""

from .conductor import conductor as conductor
from .conductor import lazanyi as lazanyi
from .conductor import schlick_ior as schlick_ior
from .dielectric import dielectric as dielectric
from .dielectric import dielectric_at as dielectric_at
from .dielectric import dielectric_f0 as dielectric_f0
from .schlick import schlick as schlick
from .schlick import sgd_fresnel as sgd_fresnel
