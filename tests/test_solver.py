"""The solver on problems whose minimum is known, free and in boxes, and against scipy's."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
import pytest
from brdfit.fitting.solver import Box, BoxDescent, BoxLevenbergMarquardt, Minimum, minimise
from scipy.optimize import least_squares

INF = np.inf


@pytest.fixture(autouse=True)
def _float64():
    with jax.enable_x64(True):
        yield


def box(lower, upper, free=None) -> Box:
    lower, upper = np.asarray(lower, float), np.asarray(upper, float)
    return Box(jnp.asarray(lower), jnp.asarray(upper), jnp.ones(lower.size, bool) if free is None else jnp.asarray(free))


@eqx.filter_jit
def solve(residual, x, within: Box, rtol: float = 1e-14, damping: float = 1.0, max_steps: int = 2000) -> Minimum:
    return minimise(residual, x, within, jnp.asarray(rtol), jnp.asarray(damping), max_steps)


# --- problems -----------------------------------------------------------------------------------------------------
# More, Garbow & Hillstrom 1981 (by number) and the NIST reference datasets for nonlinear regression (certified values).


def rosenbrock(x):
    """No. 1."""
    return jnp.stack([10 * (x[1] - x[0] ** 2), 1 - x[0]])


def powell_singular(x):
    """No. 13: the Jacobian is singular at the minimum."""
    return jnp.stack([x[0] + 10 * x[1], 5**0.5 * (x[2] - x[3]), (x[1] - 2 * x[2]) ** 2, 10**0.5 * (x[0] - x[3]) ** 2])


def box_3d(x):
    """No. 12."""
    t = jnp.arange(1, 11) / 10
    return jnp.exp(-t * x[0]) - jnp.exp(-t * x[1]) - x[2] * (jnp.exp(-t) - jnp.exp(-10 * t))


def helical_valley(x):
    """No. 7, from x1 > 0."""
    theta = jnp.arctan2(x[1], x[0]) / (2 * jnp.pi)
    return jnp.stack([10 * (x[2] - 10 * theta), 10 * (jnp.hypot(x[0], x[1]) - 1), x[2]])


def brown_dennis(x):
    """No. 16: large residuals."""
    t = jnp.arange(1, 21) / 5
    return (x[0] + t * x[1] - jnp.exp(t)) ** 2 + (x[2] + x[3] * jnp.sin(t) - jnp.cos(t)) ** 2


KOWALIK_Y = np.array([0.1957, 0.1947, 0.1735, 0.16, 0.0844, 0.0627, 0.0456, 0.0342, 0.0323, 0.0235, 0.0246])
KOWALIK_U = np.array([4, 2, 1, 0.5, 0.25, 0.167, 0.125, 0.1, 0.0833, 0.0714, 0.0625])


def kowalik_osborne(x):
    """No. 15; NIST MGH09."""
    u = KOWALIK_U
    return x[0] * (u**2 + u * x[1]) / (u**2 + u * x[2] + x[3]) - KOWALIK_Y


MEYER_Y = np.array(
    [34780, 28610, 23650, 19630, 16370, 13720, 11540, 9744, 8261, 7030, 6005, 5147, 4427, 3820, 3307, 2872], float
)


def meyer(x):
    """No. 10; NIST MGH10."""
    t = 45 + 5 * jnp.arange(1, 17)
    return x[0] * jnp.exp(x[1] / (t + x[2])) - MEYER_Y


MISRA_X = np.array([77.6, 114.9, 141.1, 190.8, 239.9, 289.0, 332.8, 378.4, 434.8, 477.3, 536.8, 593.1, 689.1, 760.0])
MISRA_Y = np.array([10.07, 14.73, 17.94, 23.93, 29.61, 35.18, 40.02, 44.82, 50.76, 55.05, 61.01, 66.40, 75.47, 81.78])


def misra1a(x):
    """NIST Misra1a."""
    return x[0] * (1 - jnp.exp(-x[1] * MISRA_X)) - MISRA_Y


THURBER_DATA = """
80.574 -3.067  84.248 -2.981  87.264 -2.921  87.195 -2.912  89.076 -2.840  89.608 -2.797  89.868 -2.702
90.101 -2.699  92.405 -2.633  95.854 -2.481  100.696 -2.363  101.060 -2.322  401.672 -1.501  390.724 -1.460
567.534 -1.274  635.316 -1.212  733.054 -1.100  759.087 -1.046  894.206 -0.915  990.785 -0.714  1090.109 -0.566
1080.914 -0.545  1122.643 -0.400  1178.351 -0.309  1260.531 -0.109  1273.514 -0.103  1288.339 0.010  1327.543 0.119
1353.863 0.377  1414.509 0.790  1425.208 0.963  1421.384 1.006  1442.962 1.115  1464.350 1.572  1468.705 1.841
1447.894 2.047  1457.628 2.200"""
THURBER = np.array(THURBER_DATA.split(), float).reshape(-1, 2)


def thurber(b):
    """NIST Thurber."""
    x = THURBER[:, 1]
    return (b[0] + b[1] * x + b[2] * x**2 + b[3] * x**3) / (1 + b[4] * x + b[5] * x**2 + b[6] * x**3) - THURBER[:, 0]


@dataclass(frozen=True)
class Known:
    """A problem, where to start, and its minimum: sum of squares and, where it is a point, where it lies."""

    residual: Callable
    start: tuple[float, ...]
    cost: float
    at: tuple[float, ...] | None = None
    lower: tuple[float, ...] | None = None
    upper: tuple[float, ...] | None = None
    damping: float = 1.0
    """Of the first step. Box 3D has a second minimum at x1 -> infinity, where careful steps from its start lead."""


FREE = {
    "rosenbrock": Known(rosenbrock, (-1.2, 1), 0, (1, 1)),
    "powell singular": Known(powell_singular, (3, -1, 0, 1), 0),
    "box 3d": Known(box_3d, (0, 10, 20), 0, damping=1e-2),
    "helical valley": Known(helical_valley, (0.5, 1, 0), 0, (1, 0, 0)),
    "kowalik-osborne": Known(
        kowalik_osborne,
        (0.25, 0.39, 0.415, 0.39),
        3.0750560385e-04,
        (1.9280693458e-01, 1.9128232873e-01, 1.2305650693e-01, 1.3606233068e-01),
    ),
    "meyer": Known(meyer, (0.02, 4000, 250), 8.7945855171e01, (5.6096364710e-03, 6.1813463463e03, 3.4522363462e02)),
    "misra1a": Known(misra1a, (500, 0.0001), 1.2455138894e-01, (2.3894212918e02, 5.5015643181e-04)),
    "thurber": Known(
        thurber,
        (1000, 1000, 400, 40, 0.7, 0.3, 0.03),
        5.6427082397e03,
        (
            *(1.2881396800e03, 1.4910792535e03, 5.8323836877e02, 7.5416644291e01),
            *(9.6629502864e-01, 3.9797285797e-01, 4.9727297349e-02),
        ),
    ),
    "brown-dennis": Known(brown_dennis, (25, 5, -5, -1), 85822.20162635628),
}

BOXED = {
    # x0 held at a wall leaves a linear problem in x1: x1 = x0^2
    "rosenbrock, right of 1": Known(rosenbrock, (2, 1), 0.25, (1.5, 2.25), (1.5, -INF), (INF, INF)),
    "rosenbrock, left of 1": Known(rosenbrock, (-1.2, 1), 0.25, (0.5, 0.25), (-2, -INF), (0.5, INF)),
    "rosenbrock in a corner": Known(rosenbrock, (3, -2.5), 100 * (4 + 2) ** 2 + 1, (2, -2), (2, -3), (4, -2)),
    # no closed form: against scipy
    "misra with a ceiling": Known(misra1a, (100, 0.0001), -1, None, (0, 0), (200, 1)),
    "powell, x0 >= 1": Known(powell_singular, (3, -1, 0, 1), -1, None, (1, -INF, -INF, -INF), (INF,) * 4),
    "kowalik, all at most 0.15": Known(kowalik_osborne, (0.1, 0.1, 0.1, 0.1), -1, None, (0,) * 4, (0.15,) * 4),
}


@pytest.mark.parametrize("name", FREE)
def test_known_minimum(name):
    p = FREE[name]
    n = len(p.start)
    end = solve(p.residual, jnp.asarray(p.start, float), box([-INF] * n, [INF] * n), damping=p.damping)
    # Powell's Jacobian is singular at the minimum: at x = 1e-8 the valley is rounding in J^T J, and the rest is creeping
    assert bool(end.stopped) or name == "powell singular"
    if p.cost:
        assert float(end.cost) == pytest.approx(p.cost, rel=1e-9)  # certified to 11 digits
    else:
        assert float(end.cost) < 1e-15
    if p.at:
        # the cost is flat to the square of this
        np.testing.assert_allclose(end.x, p.at, rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("name", BOXED)
def test_known_minimum_in_a_box(name):
    p = BOXED[name]
    end = solve(p.residual, jnp.asarray(p.start, float), box(p.lower, p.upper))
    x = np.asarray(end.x)
    assert bool(end.stopped)
    assert ((x >= p.lower) & (x <= p.upper)).all()
    active = (x == p.lower) | (x == p.upper)
    assert active.any(), "the bound is met to the bit"
    want, at = p.cost, p.at
    if at is None:
        jac = jax.jit(jax.jacfwd(p.residual))
        best = least_squares(
            lambda y: np.asarray(p.residual(jnp.asarray(y))),
            np.clip(p.start, np.add(p.lower, 1e-3), np.subtract(p.upper, 1e-3)),
            lambda y: np.asarray(jac(jnp.asarray(y))),
            (p.lower, p.upper),
            x_scale="jac",
            xtol=1e-15,
            ftol=1e-15,
            gtol=1e-15,
            max_nfev=2000,
        )
        want = 2 * best.cost
        # scipy stays inside the box and ends a little above
        assert float(end.cost) <= want * (1 + 1e-9)
        assert float(end.cost) == pytest.approx(want, rel=1e-5)
    else:
        np.testing.assert_allclose(x, at, rtol=1e-7)
        assert float(end.cost) == pytest.approx(want, rel=1e-12)
    kkt(p.residual, x, p.lower, p.upper)
    assert float(end.optimality) < 1e-5


def kkt(residual, x, lower, upper):
    """The gradient vanishes, or pushes outwards at a wall."""
    r, jac = np.asarray(residual(jnp.asarray(x))), np.asarray(jax.jacfwd(residual)(jnp.asarray(x)))
    gradient = jac.T @ r
    cosine = gradient / np.maximum(np.linalg.norm(jac, axis=0) * np.linalg.norm(r), 1e-300)
    for g, a, b, v in zip(cosine, lower, upper, x, strict=True):
        assert abs(g) < 1e-5 or (v == a and g > 0) or (v == b and g < 0), (g, v, a, b)


def random_problem(p, x):
    a, b, target = p
    return a @ x + 0.3 * jnp.tanh(b @ x) - target


@pytest.mark.parametrize("seed", range(20))
def test_against_scipy(seed):
    """Random overdetermined problems, gently bent so that there is one minimum, with about half of the bounds active."""
    rng = np.random.default_rng(seed)
    n, m = 5, 20
    p = (rng.standard_normal((m, n)), rng.standard_normal((m, n)), 3 * rng.standard_normal(m))
    lower = rng.uniform(-1, 0.3, n)
    upper = lower + rng.uniform(0.1, 1, n)
    start = rng.uniform(lower, upper)
    end = RANDOM(p, jnp.asarray(start), box(lower, upper))
    jac = JACOBIAN
    best = least_squares(
        lambda y: np.asarray(random_problem(p, y)),
        start,
        lambda y: np.asarray(jac(p, y)),
        (lower, upper),
        xtol=1e-15,
        ftol=1e-15,
        gtol=1e-12,
    )
    assert bool(end.stopped)
    assert float(end.cost) <= 2 * best.cost * (1 + 1e-10)
    np.testing.assert_allclose(end.x, best.x, atol=1e-4)  # scipy stays off the walls by about that
    assert float(end.optimality) < 1e-6


@eqx.filter_jit
def RANDOM(p, x, within):
    return minimise(lambda y: random_problem(p, y), x, within, jnp.asarray(1e-14), jnp.asarray(1.0), 500)


JACOBIAN = jax.jit(jax.jacfwd(random_problem, argnums=1))


def test_what_is_not_free_does_not_move():
    end = solve(rosenbrock, jnp.array([0.3, 4.0]), box([-INF] * 2, [INF] * 2, [False, True]))
    assert float(end.x[0]) == 0.3
    assert float(end.x[1]) == pytest.approx(0.09, rel=1e-7)  # the cost is flat to its square
    assert float(end.optimality) < 1e-8


def test_ends_in_its_box():
    """On the bound itself, to the bit, though the last step is added to where it began: what lies beyond is no parameter."""
    rng = np.random.default_rng(0)
    upper = jnp.asarray(rng.uniform(0.1, 2, (300, 1)))
    begin = upper * rng.uniform(-1, 1, (300, 1))
    ends = jax.vmap(lambda u, x: solve(lambda y: y - 10, x, Box(-u, u, jnp.ones(1, bool))).x)(upper, begin)
    np.testing.assert_array_equal(ends, upper)


def test_a_parameter_without_effect_stays():
    end = solve(lambda x: rosenbrock(x[:2]) + 0 * x[2], jnp.array([-1.2, 1.0, 7.0]), box([-INF] * 3, [INF] * 3))
    np.testing.assert_allclose(end.x, [1, 1, 7], rtol=1e-9)


class Plain(BoxDescent):
    """Gauss-Newton: what is learnt of the missing curvature is not used."""

    def query(self, y, f_info, state):
        new = BoxDescent.query(self, y, f_info, state)
        return eqx.tree_at(lambda s: s.augmented, new, jnp.zeros((), bool))


def steps(residual, x, descent: type[BoxDescent], rtol: float = 1e-13) -> tuple[int, float]:
    n = x.size
    within = box([-INF] * n, [INF] * n)
    solver = BoxLevenbergMarquardt(within, rtol)
    solver = eqx.tree_at(lambda s: s.descent, solver, descent(within))

    @eqx.filter_jit
    def run(x):
        return optx.least_squares(lambda y, _: residual(y), solver, x, max_steps=5000, throw=False)

    end = run(x)
    return int(end.stats["num_steps"]), float(jnp.sum(residual(end.value) ** 2))


def test_large_residuals():
    """Where residuals stay large and bend, Gauss-Newton creeps; with the secant Hessian the same minimum is near."""
    plain, cost = steps(brown_dennis, jnp.array([25.0, 5, -5, -1]), Plain)
    bent, same = steps(brown_dennis, jnp.array([25.0, 5, -5, -1]), BoxDescent)
    assert cost >= same * (1 - 1e-9)  # still on its way after 5000 steps
    assert same == pytest.approx(85822.20162635628, rel=1e-9)
    assert plain > 3 * bent, (plain, bent)


def test_exact_problems_stop_at_rounding():
    """A residual that can be made zero but for rounding is not searched for less for ever, whatever its unit."""
    t = jnp.linspace(0, 3, 50)
    truth = jnp.array([0.7, 1.3, 0.2])

    def model(x):
        return x[0] * jnp.exp(-x[1] * t) + x[2] * jnp.sqrt(1 + t)

    for unit in (1.0, 1e-9, 1e9):
        data = model(truth) * unit
        end = solve(lambda x, u=unit, d=data: model(x) * u - d, jnp.array([0.4, 0.8, 0.3]), box([-INF] * 3, [INF] * 3))
        assert bool(end.stopped)
        assert int(end.steps) < 40
        np.testing.assert_allclose(end.x, truth, rtol=1e-12)
        assert float(jnp.sqrt(end.cost)) < 1e-13 * float(end.scale)


def test_stops_at_once():
    """Started at a minimum, with whatever damping, the search ends within the patience for rejected steps."""
    rng = np.random.default_rng(0)
    a, b = jnp.asarray(rng.standard_normal((30, 4))), jnp.asarray(rng.standard_normal(30))

    def residual(x):
        return a @ x - b

    best = jnp.linalg.lstsq(a, b)[0]
    for damping in (1e-12, 1e-6, 1.0, 1e3):
        for k in range(5):
            start = best * (1 + k * 2.0**-52)
            end = solve(residual, start, box([-INF] * 4, [INF] * 4), 1e-9, damping)
            assert bool(end.stopped)
            assert int(end.steps) <= 15, (damping, k)
            assert float(end.optimality) < 1e-12
