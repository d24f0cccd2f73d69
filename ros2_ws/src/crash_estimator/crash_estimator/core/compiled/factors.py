"""A covariance as P = U D U', U unit upper triangular and D diagonal: rounding cannot make it negative.

P itself loses that where the samples tell one combination of the parameters far better than each of them: a variance of
1e-12 beside one of 1e5 is all rounding, once the two are entries of one matrix. The factors keep both apart; they are
multiplied by positive numbers and added to, never subtracted from.

One array (n, n) holds the two: its row j is column j of U up to the diagonal, which has D_j in the place of U's 1, and
zeros beyond. So the factors of a diagonal P are P itself.

Bierman, Factorization Methods for Discrete Sequential Estimation (1977), chapter V; Agee and Turner (1972) for a rank
of one.
"""

from numba import njit


@njit(cache=True, inline="always")
def through(factors, psi, out):
    """Fill out (n,) with  U' psi'. Most of psi is 0: an equation sees few parameters."""
    n = len(psi)
    for j in range(n):
        out[j] = psi[j]
    for i in range(n):
        if psi[i] != 0.0:
            for j in range(i + 1, n):
                out[j] += factors[j, i] * psi[i]


@njit(cache=True, inline="always")
def observe(factors, psi, r, spread):
    """P - (P psi') (P psi')' / s  in place, s = psi P psi' + r, for one equation -> s; spread (n,) becomes P psi'.

    With f = U' psi', s grows from r by D_j f_j^2 for each j, and D_j is multiplied by s before over s after (Bierman).
    """
    through(factors, psi, spread)
    s = r
    for j in range(len(psi)):
        f = spread[j]
        before, part = s, factors[j, j] * f
        spread[j] = part
        if part * f == 0.0:
            continue
        s = before + part * f
        factors[j, j] *= before / s
        share = f / before if before > 0.0 else 0.0  # at 0 all of spread is 0 so far
        for i in range(j):
            u = factors[j, i]
            factors[j, i] = u - share * spread[i]
            spread[i] += part * u
    return s


@njit(cache=True, inline="always")
def add_square(factors, c, a, last):
    """P + c a a'  in place, for c > 0 and a (n,) with zeros beyond `last`; a is used up (Agee and Turner)."""
    for j in range(last, -1, -1):
        d, part = factors[j, j], c * a[j]
        grown = d + part * a[j]
        if grown == 0.0:
            continue
        factors[j, j] = grown
        c *= d / grown
        share = part / grown
        for i in range(j):
            a[i] -= a[j] * factors[j, i]
            factors[j, i] += share * a[i]


@njit(cache=True, inline="always")
def widen(factors, variance, j, a):
    """P_jj + variance  in place, a step of a random walk; a (n,) is used up."""
    a[:] = 0.0
    a[j] = 1.0
    add_square(factors, variance, a, j)


@njit(cache=True, inline="always")
def product_of(factors, covariance):
    """Fill covariance (p, p) with the first p rows and columns of P (n, n)."""
    n, p = len(factors), len(covariance)
    covariance[:, :] = 0.0
    for k in range(n):
        d = factors[k, k]
        for i in range(min(k, p)):
            part = d * factors[k, i]
            for j in range(i + 1):
                covariance[i, j] += part * factors[k, j]
        if k < p:
            covariance[k, k] += d
            for j in range(k):
                covariance[k, j] += d * factors[k, j]
    for i in range(p):
        for j in range(i):
            covariance[j, i] = covariance[i, j]


@njit(cache=True, inline="always")
def seen_through(factors, gradient, noise, rotated, out):
    """Fill out (q, q) with  Psi P Psi' + R2  of noise (q,), Psi = gradient (q, n), and rotated (q, n) with Psi U."""
    q, n = gradient.shape
    for i in range(q):
        through(factors, gradient[i], rotated[i])
        for k in range(i + 1):
            total = noise[i] if i == k else 0.0
            for j in range(n):
                total += rotated[i, j] * factors[j, j] * rotated[k, j]
            out[i, k] = total
            out[k, i] = total
