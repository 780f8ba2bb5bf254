"""Angles and half vectors lose no digit: against 40-digit arithmetic on the very same numbers.

The oracle starts from the definitions, h = (l + v)/|l + v| and 2 theta_d = the angle between l and v, and takes the exact
value of every float it is given. What remains is the rounding of our own operations.
"""

import brdfit
import jax
import jax.numpy as jnp
import mpmath as mp
import numpy as np
import pytest
from brdfit.angles import directions, half_difference, polar_cosines
from brdfit.geometry import from_directions

mp.mp.dps = 40

DEG = np.pi / 180
# (theta_h, theta_d, phi_d, phi_h)
CASES = {
    "normal incidence": (0.0, 0.0, 0.0, 0.0),
    "mirror": (0.0, 0.8, 0.3, 0.0),
    **{f"mirror + {offset:g} rad": (offset, 0.8, 0.3, 1.1) for offset in (1e-8, 1e-7, 1e-5, 1e-3)},
    **{f"mirror + {offset:g} rad at grazing": (offset, 89.9 * DEG, 2.0, -2.0) for offset in (1e-8, 1e-5)},
    "mirror at 89.995 deg": (0.0, 89.995 * DEG, 0.3, 0.0),
    "retro": (0.9, 0.0, 0.0, 0.7),
    "retro + 1e-8 rad": (0.9, 1e-8, 1.0, 0.7),
    "retro at 89.995 deg": (89.995 * DEG, 0.0, 0.0, -1.0),
    "light at 89.995 deg": (60 * DEG, 29.995 * DEG, 0.0, 0.2),
    "viewer at 89.995 deg": (30 * DEG, 59.995 * DEG, np.pi, 0.2),
    "both at 89.995 deg, far apart": (1e-3, 89.99 * DEG, np.pi / 2, 0.0),
    "light at the normal": (40 * DEG, 40 * DEG, np.pi, 0.5),
    "near the normal": (1e-8, 1e-8, 1.0, 2.0),
    "general": (0.4, 0.7, 2.5, -2.9),
}
RANDOM = np.random.default_rng(3).random((40, 4)) * [np.pi / 2, np.pi / 2, np.pi, 2 * np.pi] - [0, 0, 0, np.pi]
ANGLES = np.concatenate([list(CASES.values()), RANDOM])


def pairs(dtype=np.float64):
    """Unit vectors to rounding of all cases, [n, 3] each."""
    return tuple(v.astype(dtype) for v in directions(*ANGLES.T))


def exact_directions(th, td, pd, ph):
    """Rusinkiewicz 1998: l in the frame of h, turned by theta_h about y and by phi_h about z."""
    th, td, pd, ph = map(mp.mpf, (th, td, pd, ph))
    tilt = mp.matrix([[mp.cos(th), 0, mp.sin(th)], [0, 1, 0], [-mp.sin(th), 0, mp.cos(th)]])
    turn = mp.matrix([[mp.cos(ph), -mp.sin(ph), 0], [mp.sin(ph), mp.cos(ph), 0], [0, 0, 1]])
    across = mp.sin(td) * mp.cos(pd), mp.sin(td) * mp.sin(pd)
    return [turn * tilt * mp.matrix([s * across[0], s * across[1], mp.cos(td)]) for s in (1, -1)]


def exact_geometry(wi, wo):
    """What every field of a geometry should be, and the four angles."""
    l, v = ([mp.mpf(float(x)) for x in w] for w in (wi, wo))  # noqa: E741
    h = [a + b for a, b in zip(l, v, strict=True)]
    length = mp.sqrt(mp.fdot(h, h))
    x, y, z = (c / length for c in h)
    # the angle between l and v; 40 digits leave 24 to an arccos near 1
    angle = mp.acos(min(mp.fdot(l, v) / mp.sqrt(mp.fdot(l, l) * mp.fdot(v, v)), mp.mpf(1))) if l != v else mp.mpf(0)
    td, th, ph = angle / 2, mp.atan2(mp.hypot(x, y), z), mp.atan2(y, x) if x or y else mp.mpf(0)
    u = mp.cos(ph) * l[0] + mp.sin(ph) * l[1]
    pd = mp.atan2(-mp.sin(ph) * l[0] + mp.cos(ph) * l[1], mp.cos(th) * u - mp.sin(th) * l[2])
    fields = {
        "cos_i": l[2],
        "cos_o": v[2],
        "cos_h": z,
        "sin2_h": mp.sin(th) ** 2,
        "vers_h": 1 - mp.cos(th),
        "tan2_h": mp.tan(th) ** 2,
        "theta_h": th,
        "cos_d": mp.cos(td),
        "sin2_d": mp.sin(td) ** 2,
        "vers_d": 1 - mp.cos(td),
        "theta_d": td,
        "h_x2": x * x,
        "h_y2": y * y,
    }
    return fields, (th, td, pd, ph)


def turn_between(a, b):
    """Difference of two azimuths, in [0, pi]."""
    return abs(float(mp.fmod(mp.mpf(a) - b + 3 * mp.pi, 2 * mp.pi) - mp.pi))


def test_directions():
    wi, wo = directions(*ANGLES.T)
    for angles, found_i, found_o in zip(ANGLES, wi, wo, strict=True):
        for found, exact in zip((found_i, found_o), exact_directions(*angles), strict=True):
            # a dozen operations on numbers of at most 1, half an ulp (1.1e-16) each
            assert max(abs(float(mp.mpf(float(a)) - e)) for a, e in zip(found, exact, strict=True)) < 12 * 1.1e-16


def test_polar_cosines():
    found = polar_cosines(*ANGLES.T[:3])
    for n, angles in enumerate(ANGLES):
        for cosine, exact in zip(found, exact_directions(*angles), strict=True):
            # pi/2, two differences, a sine, a product of five factors and a sum, half an ulp (1.1e-16) of at most 2 each
            assert abs(float(mp.mpf(float(cosine[n])) - exact[2])) < 10 * 1.1e-16


FIELDS = [*exact_geometry([0, 0, 1], [0, 0, 1])[0]]


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("field", FIELDS)
def test_from_directions(field, dtype):
    wi, wo = pairs(dtype)
    with jax.enable_x64(dtype is np.float64):
        found = np.asarray(getattr(from_directions(wi, wo), field))
    assert found.dtype == dtype
    for name, l, v, value in zip([*CASES, *range(len(RANDOM))], wi, wo, found, strict=True):  # noqa: E741
        exact = exact_geometry(l, v)[0][field]
        # Relative, whatever the size of the value: a sum of three squares of sums, twice, a quotient, a root and a quotient
        # are at most ten roundings, half an ulp each. The vectors are of unit length to an ulp: as |l| and |v| differ, the
        # squared ratio |l - v|^2/|l + v|^2 has an absolute error of its square, 1e-32, in double.
        unit = np.finfo(dtype).eps ** 2
        assert abs(float(mp.mpf(float(value)) - exact)) <= 5 * np.finfo(dtype).eps * abs(float(exact)) + unit, name


def test_half_difference():
    wi, wo = pairs()
    found = np.stack(half_difference(wi, wo), -1)
    for name, l, v, angles in zip([*CASES, *range(len(RANDOM))], wi, wo, found, strict=True):  # noqa: E741
        _, exact = exact_geometry(l, v)
        for n in (0, 1):  # theta_h, theta_d: relative, ten roundings of half an ulp as above
            assert abs(float(mp.mpf(float(angles[n])) - exact[n])) <= 10 * 1.1e-16 * float(exact[n]) + 1e-32, name
        if exact[0] > 0:  # phi_h: a few ulps of pi (4.4e-16)
            assert turn_between(angles[3], exact[3]) < 2 * 4.4e-16, name
        if exact[0] > 0 and exact[1] > 0:  # phi_d: two rotations with rounded angles before it
            assert turn_between(angles[2], exact[2]) < 6 * 4.4e-16, name


def round_trip():
    """Error that there and back may make in each case, radians.

    Two dozen operations of half an ulp (1.1e-16), seen from h: rounding of l and v turns l + v, whose length is
    2 cos(theta_d), by that over its length.
    """
    return 24 * 1.1e-16 / np.cos(ANGLES[:, 1])


def test_round_trip_of_directions():
    wi, wo = pairs()
    back_i, back_o = directions(*half_difference(wi, wo))
    assert (np.abs(back_i - wi).max(-1) < round_trip()).all()
    assert (np.abs(back_o - wo).max(-1) < round_trip()).all()


def test_round_trip_of_angles():
    found = half_difference(*pairs())
    error = round_trip()
    assert (np.abs(found[0] - ANGLES[:, 0]) < error).all()
    assert (np.abs(found[1] - ANGLES[:, 1]) < error).all()
    # an azimuth has that error over the sine of its polar angle, and phi_d counts from phi_h
    for n in range(len(ANGLES)):
        at_h, at_d = np.sin(ANGLES[n, 0]), np.sin(ANGLES[n, 1])
        if at_h:
            assert turn_between(found[3][n], ANGLES[n, 3]) * at_h < error[n]
        if at_h and at_d:
            assert turn_between(found[2][n], ANGLES[n, 2]) * min(at_h, at_d) < error[n]


def test_normal_incidence_and_retro_are_exact():
    up = np.array([0.0, 0.0, 1.0])
    g = from_directions(up, up)
    assert [float(x) for x in (g.cos_i, g.cos_o, g.cos_h, g.cos_d, g.sin2_h, g.sin2_d)] == [1, 1, 1, 1, 0, 0]
    slanted = np.array([0.6, 0.0, 0.8])
    assert float(from_directions(slanted, slanted).sin2_d) == 0
    assert float(from_directions(slanted, slanted * [-1, -1, 1]).sin2_h) == 0
    assert half_difference(slanted, slanted)[1] == 0
    assert half_difference(slanted, slanted * [-1, -1, 1])[0] == 0


def test_half_vector_on_the_horizon():
    """l + v without a component along the normal: theta_h is 90 degrees, with finite derivatives."""
    with jax.enable_x64(True):
        l, v = jnp.array([1.0, 0.0, 0.0]), jnp.array([0.0, 1.0, 0.0])  # noqa: E741
        for field, value in (("cos_h", 0), ("sin2_h", 1)):
            f = lambda l, v: getattr(from_directions(l, v), field)  # noqa: B023, E731, E741
            assert f(l, v) == value
            assert all(np.isfinite(s).all() for s in jax.grad(f, (0, 1))(l, v))


def test_angles_that_come_from_cosines():
    """theta_i, theta_o and phi_d are taken from cosines: half of the digits near 0 and pi, no NaN anywhere."""
    with jax.enable_x64(True):
        g = from_directions(*pairs())
        theta_i, theta_o, phi_d = np.asarray(g.theta_i), np.asarray(g.theta_o), np.asarray(g.phi_d)
        rounded = from_directions(*np.array([[0, 0, 1 + 2.3e-16]] * 2))  # normalised to rounding
        assert rounded.theta_i == rounded.theta_o == 0
    assert np.isfinite([theta_i, theta_o, phi_d]).all()
    wi, wo = pairs()
    half = np.sqrt(2.2e-16)
    np.testing.assert_allclose(theta_i, np.arctan2(np.hypot(wi[:, 0], wi[:, 1]), wi[:, 2]), rtol=0, atol=2 * half)
    np.testing.assert_allclose(theta_o, np.arctan2(np.hypot(wo[:, 0], wo[:, 1]), wo[:, 2]), rtol=0, atol=2 * half)
    general = slice(len(CASES), None)
    # the difference of cosines over 2 sin(theta_h) sin(theta_d), which is above 1e-2 in the random cases
    np.testing.assert_allclose(phi_d[general], RANDOM[:, 2], rtol=0, atol=4 * half)


def test_broadcast_and_flat():
    wi, wo = pairs()
    g = from_directions(wi[:4, None], wo[None, :3])
    assert g.shape == (4, 3)
    flat = g.flat()
    assert flat.shape == (12,)
    np.testing.assert_array_equal(flat.sin2_h.reshape(4, 3), g.sin2_h)
    np.testing.assert_array_equal(flat.tangential()[0].reshape(4, 3), g.h_x2)


def test_isotropic_geometry_has_no_azimuth():
    g = from_directions(*pairs())
    isotropic = type(g)(g.cos_i, g.cos_o, g.cos_h, g.sin2_h, g.cos_d, g.sin2_d)
    with pytest.raises(ValueError, match="an anisotropic model needs the azimuth of the half vector, and this table is iso"):
        isotropic.tangential()
    assert isotropic.flat().h_x2 is None


def test_one_loop():
    """Sums over components that the compiler hands to a library break the loop of a model: kCustom in its program."""
    numbers = {"scatter": 0.1, "b": 100.0, "c": 1.0, "retro": 0.1, "alpha_retro": 0.2}
    model = brdfit.model("diffraction+retro", **numbers)
    wi, wo = jnp.full((8192, 3), 3**-0.5), jnp.full((8192, 3), 3**-0.5)
    program = jax.jit(lambda m, i, o: m(i, o)).lower(model, wi, wo).compile()
    assert "kind=kLoop" in program.as_text()
    assert "kind=kCustom" not in program.as_text()
