"""Body reflection: light that entered the material and came out again."""

from .ashikhmin_shirley import ashikhmin_shirley_albedo as ashikhmin_shirley_albedo
from .ashikhmin_shirley import ashikhmin_shirley_body as ashikhmin_shirley_body
from .lambert import lambert as lambert
from .oren_nayar import oren_nayar as oren_nayar
from .oren_nayar import oren_nayar_full as oren_nayar_full
