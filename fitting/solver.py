"""Levenberg-Marquardt in a box, assembled from Optimistix' parts.

Optimistix has no bounds for least squares, damps every parameter alike and spends its last steps at round-off. Here a
descent of our own damps by the column norms of the Jacobian (Marquardt 1963) and projects onto the box with an active
set; the trust region is the library's; and the solver stops when an accepted step no longer pays.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import optimistix as optx
from jaxtyping import Array, Bool, Float

Vector = Float[Array, " n"]

ROUNDING = 1e-14
"""Residual, relative to what the coordinates do to it, that is rounding: 45 units in the last place. Below it the cost
goes up and down at random, and a search for less goes on as long as it may."""


class Box(eqx.Module):
    """Bounds of a vector, and which of its elements may move at all."""

    lower: Float[Any, " n"]
    upper: Float[Any, " n"]
    free: Bool[Any, " n"]


class _State(eqx.Module):
    y: Vector
    cost: Array
    gradient: Vector
    matrix: Float[Array, "n n"]
    """J^T J."""
    second: Float[Array, "n n"]
    """Estimate of sum r grad^2 r, what Gauss-Newton leaves out of the Hessian."""
    augmented: Array
    """Whether the Hessian with ``second`` foretold the last step better than J^T J alone."""


class BoxDescent(optx.AbstractDescent[Any, Any, Any]):
    """Damped Newton step in a box.

    Elements at a bound that the gradient pushes outwards are held, and elements that the step would carry out of the box
    stop at its wall while the others are solved for again.

    Where a model cannot reproduce a table the residuals stay large, and Gauss-Newton creeps (a factor of 0.9 a step is
    common). As in NL2SOL (Dennis, Gay & Welsch 1981) the missing part of the Hessian is estimated from the change of the
    gradient, here by symmetric rank-one updates, sized down when it is stale, and used while it foretells better.
    """

    box: Box
    damping: Array | float = 1.0
    """Damping of the first step, relative to the unit diagonal: 1 far from an optimum, little close to one."""

    def init(self, y: Vector, f_info_struct: Any) -> _State:
        """State before the first step."""
        n = y.size
        zero = jnp.zeros((n, n))
        return _State(y, jnp.zeros(()), jnp.zeros(n), zero, zero, jnp.zeros((), bool))

    def query(self, y: Vector, f_info: Any, state: _State) -> _State:
        """Gradient and Hessian at a newly accepted y."""
        jac = f_info.jac.as_matrix()
        gradient, matrix, cost = jac.T @ f_info.residual, jac.T @ jac, 0.5 * jnp.sum(f_info.residual**2)
        s = y - state.y
        gained = cost - state.cost
        plain = state.gradient @ s + 0.5 * s @ state.matrix @ s
        bent = plain + 0.5 * s @ state.second @ s
        sharp = gradient - state.gradient - matrix @ s
        curvature = s @ state.second @ s
        # Guards: before the first step there is nothing to learn from, and a rank-one update divides by v.s
        # (tests/test_solver.py::test_large_residuals).
        size = jnp.where(curvature == 0, 1.0, jnp.abs(s @ sharp) / jnp.where(curvature == 0, 1.0, jnp.abs(curvature)))
        second = state.second * jnp.minimum(size, 1.0)
        v = sharp - second @ s
        vs = v @ s
        learn = (state.cost > 0) & (jnp.abs(vs) > 1e-8 * jnp.linalg.norm(v) * jnp.linalg.norm(s))
        second = jnp.where(learn, second + jnp.outer(v, v) / jnp.where(learn, vs, 1.0), second)
        return _State(y, cost, gradient, matrix, second, learn & (jnp.abs(bent - gained) <= jnp.abs(plain - gained)))

    def step(self, step_size: Array, state: _State) -> tuple[Vector, Any]:
        """Step for damping ``damping``/step_size."""
        diagonal = jnp.diag(state.matrix)
        # Guard: a parameter without any effect has a zero column; it gets scale 1 and stays where it is
        # (tests/test_solver.py::test_a_parameter_without_effect_stays).
        scale = jnp.sqrt(jnp.where(diagonal > 0, diagonal, 1.0))
        damping = jnp.maximum(self.damping / step_size, 1e-13)
        gradient = state.gradient / scale
        gauss_newton = state.matrix / scale[:, None] / scale
        hessian = gauss_newton + state.second / scale[:, None] / scale
        lower, upper = (self.box.lower - state.y) * scale, (self.box.upper - state.y) * scale
        boxed: Any = jax.vmap(lambda matrix: self._boxed(matrix, gradient, damping, lower, upper))
        d, newton = boxed(jnp.stack([gauss_newton, hessian]))
        convex = (newton @ hessian @ newton > 0) & (gradient @ newton < 0)
        d = jnp.where(state.augmented & convex, newton, d)
        y = jnp.clip(state.y + d / scale, self.box.lower, self.box.upper)  # lands on the bound itself, to the bit
        return jnp.where(self.box.free, y - state.y, 0.0), optx.RESULTS.successful

    def _boxed(self, matrix: Array, gradient: Vector, damping: Array, lower: Vector, upper: Vector) -> Vector:
        """Minimiser of the damped quadratic in a box, by a few rounds of an active set; NaN where it is not convex."""
        outward = ((lower >= 0) & (gradient > 0)) | ((upper <= 0) & (gradient < 0))
        held = ~self.box.free | outward

        def one_round(_: int, carry: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
            held, at, _last = carry
            moving = ~held
            a = jnp.where(moving[:, None] & moving, matrix, 0.0) + jnp.diag(jnp.where(moving, damping, 1.0))
            rhs = jnp.where(moving, -(gradient + matrix @ jnp.where(held, at, 0.0)), at)
            d = jax.scipy.linalg.cho_solve((jnp.linalg.cholesky(a), True), rhs)
            clipped = jnp.clip(d, lower, upper)
            return held | (clipped != d), jnp.where(moving & (clipped != d), clipped, at), d

        nothing = jnp.zeros_like(gradient)
        _, _, d = jax.lax.fori_loop(0, 3, one_round, (held, nothing, nothing))
        return jnp.where(self.box.free, jnp.clip(d, lower, upper), 0.0)


class BoxLevenbergMarquardt(optx.AbstractGaussNewton[Any, Any, Any]):
    """Levenberg-Marquardt that stops on what matters: ``rtol`` is the relative decrease of the cost that still counts.

    Successful when an accepted, hardly damped step lowers the cost by less than ``rtol`` relative or by no more than
    rounding, when ``patience`` steps in a row were rejected (the cost is flat to rounding), or when the residual itself is
    rounding. It stops after ``max_steps``, too: an argument of the program, where the library's own limit is a part of it.
    """

    rtol: Any
    atol: float
    norm: Callable[[Any], Array]
    descent: BoxDescent
    search: optx.LinearTrustRegion[Any]
    verbose: Callable[..., None]
    patience: int
    max_steps: Array | float

    def __init__(
        self,
        box: Box,
        rtol: Array | float,
        damping: Array | float = 1.0,
        patience: int = 10,
        max_steps: Array | float = jnp.inf,
    ) -> None:
        self.rtol = rtol
        self.max_steps = max_steps
        self.atol = 0.0
        self.norm = optx.max_norm
        self.descent = BoxDescent(box, damping)
        # A quadratic model that is right gains half of what its slope promises: the cut-offs are half the usual ones.
        self.search = optx.LinearTrustRegion(high_cutoff=0.3, low_cutoff=0.005, high_constant=10.0, low_constant=0.1)
        self.verbose = lambda **_: None
        self.patience = patience

    def step(self, fn: Any, y: Vector, args: Any, options: Any, state: Any, tags: Any) -> Any:
        """One step of Gauss-Newton, then the test whether to stop."""
        result: Any = optx.AbstractGaussNewton.step(self, fn, y, args, options, state, tags)
        new_y, new, aux = result
        before, after = jnp.sum(state.f_info.residual**2), jnp.sum(new.f_info.residual**2)
        accepted = new.num_steps_since_acceptance == 0
        damped = self.descent.damping > 1e-2 * new.search_state.step_size
        # A column times its coordinate is what 100 % of it does to the residual, and sets the size of rounding
        # (tests/test_solver.py::test_exact_problems_stop_at_rounding).
        rounding = ROUNDING * _scale(new.f_info.jac.as_matrix(), new_y)
        little = self.rtol * before + 2 * rounding * jnp.sqrt(before)
        stalled = accepted & ~state.first_step & ~damped & (before - after <= little)
        # A step damped down to nothing counts as accepted, and would be for ever (tests/test_solver.py::test_stops_at_once).
        still = accepted & ~state.first_step & jnp.all(new_y == y)
        hopeless = new.num_steps_since_acceptance >= self.patience
        done = stalled | still | hopeless | (after <= rounding**2) | (new.num_steps >= self.max_steps)
        return new_y, eqx.tree_at(lambda s: s.terminate, new, done), aux


class Minimum(eqx.Module):
    """Where a solver stopped."""

    x: Vector
    cost: Array
    """|residual|^2."""
    optimality: Array
    """Distance from a first-order optimum of the boxed problem: the largest cosine between the residual and a column of
    the Jacobian that may still move, in [0, 1]; 0 for an exact fit."""
    steps: Array
    stopped: Array
    """Whether it stopped by itself, not by the limit of steps."""
    scale: Array
    """What 100 % of the coordinate that matters most does to the residual: the size that an error is small against."""


def minimise(
    residual: Callable[[Vector], Array], x: Vector, box: Box, rtol: Array, damping: Array, max_steps: Array | int
) -> Minimum:
    """Minimise |residual(x)|^2 over a box, from an x inside it."""
    solver = BoxLevenbergMarquardt(box, rtol, damping, max_steps=max_steps)
    solution: Any = optx.least_squares(lambda y, _: residual(y), solver, x, max_steps=None, throw=False)
    end = solution.state.f_info
    columns = end.jac.as_matrix()
    gradient, cost = columns.T @ end.residual, jnp.sum(end.residual**2)
    x = jnp.where(box.free, _on_bound(solution.value, box), solution.value)
    outward = ((x <= box.lower) & (gradient > 0)) | ((x >= box.upper) & (gradient < 0))
    size = jnp.sum(columns**2, 0) * cost
    moves = box.free & ~outward & (size > 0)
    cosine = jnp.where(moves, jnp.abs(gradient) / jnp.sqrt(jnp.where(moves, size, 1.0)), 0.0)
    steps = solution.stats["num_steps"]
    stopped = (solution.result == optx.RESULTS.successful) & (steps < max_steps)
    return Minimum(x, cost, jnp.max(cosine, initial=0.0), steps, stopped, _scale(columns, x))


def _on_bound(x: Vector, box: Box) -> Vector:
    """A step to a bound, added to where it began, may end a rounding before or beyond it: there x is the bound
    (tests/test_solver.py::test_ends_in_its_box).
    """
    for bound in (box.lower, box.upper):
        x = jnp.where(jnp.isfinite(bound) & (jnp.abs(x - bound) <= 1e-15 * jnp.abs(bound)), bound, x)
    return x


def _scale(columns: Array, x: Vector) -> Array:
    """Largest norm of a column of the Jacobian times its coordinate."""
    return jnp.sqrt(jnp.max(jnp.sum(columns**2, 0) * x**2, initial=0.0))


__all__ = ["Box", "BoxDescent", "BoxLevenbergMarquardt", "Minimum", "minimise"]
