"""Normal distribution functions D(m), in 1/sr, of the half vector.

Isotropic ones are called with ``(sin^2, cos^2)`` of the angle to the normal, both accurate where they are small, so that
the same object serves a BRDF (at the half vector) and Smith's integral (at every microfacet, with cos^2 = 0 at normal
incidence, where value and slopes must be finite). Each is normalised:
the integral of D(m) (n.m) over the hemisphere is 1 (Hoffman 2013, eq. 15).
"""

from .abc import ABC as ABC
from .beckmann import Beckmann as Beckmann
from .blinn import Blinn as Blinn
from .epd import EPD as EPD
from .gaussian_angles import GaussianAngles as GaussianAngles
from .gaussian_slopes import anisotropic_gaussian as anisotropic_gaussian
from .gaussian_slopes import gaussian as gaussian
from .ggx import GGX as GGX
from .gtr import GTR as GTR
from .power_cosine import power_cosine as power_cosine
from .power_cosine import power_cosine_anisotropic as power_cosine_anisotropic
from .sgd import SGD as SGD
from .student_t import StudentT as StudentT
