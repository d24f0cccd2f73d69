"""Errors in the regressor: crush and rate are integrated from accelerometers that err, and the regression takes them as
true.

An accelerometer of body k, its zero known from n samples before the impact, is wrong by z_k, its body's velocity and
displacement by u_k and d_k:

    z ~ (0, s^2 / n)     u = u_0 + z t + integral of the noise     d = integral of u     u_0 ~ (0, velocity_std^2)

so that the equations have, beside the noise, the error H x of the motion, x = (z, u, d) of all bodies:

    y = Psi theta + H x + e          H = (1 where the equation is that body's, dF/dV / M, dF/dX / M), with their signs

x is the same from sample to sample, or changes slowly: it does not average out as noise does, and a recursion that
counts it as noise states too small a sigma. With the gain G that a method has used, whatever it was,

    error of theta  E <- E + G (H x - Psi E)         (and G e, which the method knows of)

so that the part S of theta's covariance that is due to x, and C = E[E x'], follow with N = E[x x'] by

    c = C H' - S Psi'       v = Psi S Psi' - Psi C H' - H C' Psi' + H N H'
    S <- S + G c' + c G' + G v G'       C <- C + G (H N - Psi C + D)   C <- C F' between samples, x <- F x + noise

D = s^2 dt for u of the body whose equation it is, because the sample's noise e is integrated as well, and else 0.
This is exact for a linear recursion (the covariance of a Schmidt filter for gains that are not its own: Bierman 1977,
chapter VIII). N is known beforehand: with q = s^2 dt, the noise's spectral density,

    var z = s^2 / n      cov(z, u) = var(z) t      cov(z, d) = var(z) t^2 / 2
    var u = var(u_0) + var(z) t^2 + q t            cov(u, d) = var(u_0) t + var(z) t^3 / 2 + q t^2 / 2
    var d = var(u_0) t^2 + var(z) t^4 / 4 + q t^3 / 3

A measured force has a zero as well, and no motion: its body is the fixed one that it acts on. The noise is taken as
white; that of a filtered channel is not, and its sigmas come out too small.

The lag: a method with a memory takes theta as constant within it. Where the model says that theta walks (`drift`), a
filter beside it that lets theta walk (`estimators/lag.py`) knows, with C its covariance and its errors of the motion,

    true theta - theta of the method ~ N(d, C)      d = theta of the filter - theta of the method

A part of the error that is known and not corrected is no noise. 95 % lie within |d| + 1.645 s, s^2 = C_jj, where d is
larger than s (all that is outside is on one side), and within 1.96 s where it is nothing; a sigma is stated so that
1.96 of it reach there (of uncorrected bias: Phillips, Eberhardt and Parry 1997, J. Res. NIST 102, 577):

    1.96 sigma_j = max(1.96 s_j, |d_j| + 1.645 s_j)     covariance = C + l l',  l_j = sign(d_j) (sigma_j^2 - s_j^2)^1/2

That is less than the root mean square, (s^2 + d^2)^1/2, where d is the larger part; it says nothing of the method's own
noise, which is in d.

What is integrated before an element is touched is error alone. A stiffness estimated from it goes to zero, and is
sure of that: while a crush is hidden in its own error (`HIDDEN`) its stiffness is held at its latest value, and what
may be wrong with that is counted as the error of the others (a parameter that is considered, Schmidt 1966).

The setting `regressor_errors` of each method switches all of it off: the motion is then taken as true, as the thesis
takes it.
"""

from typing import NamedTuple

import numpy as np

HIDDEN = 0.5
"""Standard deviations of its own error below which a crush says nothing of a stiffness: more than half of what it would
say is then the error's. From 1 on RLS learns the dummy's stiffnesses so late that its forces are worse (40 seeds)."""

SMALLEST_SHARE = 0.05
"""Of a parameter's scale: a walk is a share of the value, and a stiffness near zero must be able to walk as well."""


TWO_SIDED, ONE_SIDED = 1.96, 1.645
"""Standard deviations within which, and below which, 95 % of a normal error lie."""


class MotionErrors(NamedTuple):
    """What one sample's regression knows of the errors of the motion: q equations, b bodies."""

    gradient: np.ndarray  # (q, b, 3) H: of the prediction, by z, u and d of each body
    zero: np.ndarray  # (b,) (m/s^2)^2, or N^2 of a measured force: variance of z
    density: np.ndarray  # (b,) m^2/s^3: of the noise that is integrated
    velocity: np.ndarray  # (b,) (m/s)^2: variance of the initial velocity
    time: float  # s since the impact

    def of_crush(self, crush_of_body: np.ndarray) -> np.ndarray:
        """(e,) m: standard deviation of each element's crush; crush_of_body (e, b)."""
        return np.sqrt(crush_of_body**2 @ self.covariance()[:, 2, 2])

    def covariance(self) -> np.ndarray:
        """(b, 3, 3) N."""
        t, z, q, u = self.time, self.zero, self.density, self.velocity
        n = np.empty((len(z), 3, 3))
        n[:, 0, 0] = z
        n[:, 0, 1] = n[:, 1, 0] = z * t
        n[:, 0, 2] = n[:, 2, 0] = z * t**2 / 2.0
        n[:, 1, 1] = u + z * t**2 + q * t
        n[:, 1, 2] = n[:, 2, 1] = u * t + z * t**3 / 2.0 + q * t**2 / 2.0
        n[:, 2, 2] = u * t**2 + z * t**4 / 4.0 + q * t**3 / 3.0
        return n


class Consequence(NamedTuple):
    """What the errors of the motion have made of theta so far: w parameters, b bodies."""

    covariance: np.ndarray  # (w, w) S
    shared: np.ndarray  # (w, b, 3) C
    time: float  # s since the impact, of the last sample

    def walked(self, variance: np.ndarray) -> "Consequence":
        """With the variance (w,) of a step that theta has made without the method."""
        return self._replace(covariance=self.covariance + np.diag(variance))

    def after(self, gain: np.ndarray, gradient: np.ndarray, errors: MotionErrors | None) -> "Consequence":
        """After the step theta += gain (y - gradient theta), of rows that are measured; gain (w, q), gradient (q,
        w)."""
        if errors is None:
            h, known = np.zeros((len(gradient), *self.shared.shape[1:])), np.zeros((*self.shared.shape[1:], 3))
            shared, time = self.shared, self.time
        else:
            h, known, time = errors.gradient, errors.covariance(), errors.time
            shared = moved_on(self.shared, time - self.time)
        s = self.covariance
        seen, known_seen = np.einsum("wbk,qbk->wq", shared, h), np.einsum("qbk,bkj->qbj", h, known)
        c = seen - s @ gradient.T
        both = gradient @ seen
        v = gradient @ s @ gradient.T - both - both.T + np.einsum("qbk,rbk->qr", known_seen, h)
        s = s + gain @ c.T + c @ gain.T + gain @ v @ gain.T
        pulled = known_seen - np.einsum("qw,wbk->qbk", gradient, shared)
        if errors is not None:
            pulled[:, :, 1] += h[:, :, 0] * errors.density
        return Consequence(0.5 * (s + s.T), shared + np.einsum("wq,qbk->wbk", gain, pulled), time)


def late(behind: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """(p, p) that is stated of a theta (p,) which is `behind` d of a filter's, of covariance C (p, p)."""
    s = np.sqrt(np.maximum(np.diagonal(covariance), 0.0))
    reach = np.maximum(s, (np.abs(behind) + ONE_SIDED * s) / TWO_SIDED)
    more = np.copysign(np.sqrt(np.maximum(reach**2 - s**2, 0.0)), behind)
    return covariance + np.outer(more, more)


def none_yet(parameters: int, bodies: int) -> Consequence:
    return Consequence(np.zeros((parameters, parameters)), np.zeros((parameters, bodies, 3)), 0.0)


def moved_on(shared: np.ndarray, dt: float) -> np.ndarray:
    """C (w, b, 3) after dt s, in which the zero has gone on to move the body: u += z dt, d += u dt + z dt^2 / 2."""
    z, u, d = np.moveaxis(shared, -1, 0)
    return np.stack([z, u + z * dt, d + u * dt + z * (0.5 * dt * dt)], axis=-1)
