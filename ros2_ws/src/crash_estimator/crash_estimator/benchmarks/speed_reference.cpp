// The same recursions as straight loops: what a compiler makes of them is the limit to compare with.
//
// n samples, p parameters, q equations; psi (n, q, p), y (n, q), walk (n, p), active (n, p); theta (p) and F or S (p, p)
// are changed in place. Every function returns a checksum, so that nothing is optimised away.

#include <algorithm>
#include <cmath>
#include <cstring>

const int P = 64;

// P = U D U', row j of F being column j of U up to D_j on the diagonal; P + c a a' where a is zero beyond `last`.
static void add_square(int p, double* F, double c, double* a, int last) {
    for (int j = last; j >= 0; j--) {
        double d = F[j * p + j], part = c * a[j], grown = d + part * a[j];
        if (grown == 0.0) continue;
        F[j * p + j] = grown;
        c *= d / grown;
        double share = part / grown;
        for (int i = 0; i < j; i++) {
            a[i] -= a[j] * F[j * p + i];
            F[j * p + i] += share * a[i];
        }
    }
}

// P - (P h')(P h')' / s -> s; b becomes P h'.
static double observe(int p, double* F, const double* h, double r, double* b) {
    double s = r;
    for (int j = 0; j < p; j++) {
        double f = h[j];
        for (int i = 0; i < j; i++) f += F[j * p + i] * h[i];
        double before = s, part = F[j * p + j] * f;
        b[j] = part;
        if (part * f == 0.0) continue;
        s = before + part * f;
        F[j * p + j] *= before / s;
        double share = before > 0.0 ? f / before : 0.0;
        for (int i = 0; i < j; i++) {
            double u = F[j * p + i];
            F[j * p + i] = u - share * b[i];
            b[i] += part * u;
        }
    }
    return s;
}

extern "C" double constrained_kalman(int n, int p, int q, const double* psi, const double* y, const double* walk,
                                     const double* active, const double* noise, const double* lower,
                                     const double* scale, double* theta, double* F) {
    double start[P], prior[P * P], free_[P], seen[P], b[P], sum = 0.0;
    for (int t = 0; t < n; t++) {
        const double *H = psi + t * q * p, *z = y + t * q;
        for (int j = 0; j < p; j++) {
            if (walk[t * p + j] == 0.0) continue;
            double size = std::max(std::fabs(theta[j]), 0.05 * scale[j]);
            std::fill(b, b + p, 0.0);
            b[j] = 1.0;
            add_square(p, F, walk[t * p + j] * size * size, b, j);
        }
        std::memcpy(start, theta, p * sizeof(double));
        std::memcpy(prior, F, p * p * sizeof(double));
        std::memcpy(free_, active + t * p, p * sizeof(double));
        for (bool again = true; again;) {
            std::memcpy(theta, start, p * sizeof(double));
            std::memcpy(F, prior, p * p * sizeof(double));
            for (int i = 0; i < q; i++) {
                const double* h = H + i * p;
                double error = z[i];
                int last = -1;
                for (int j = 0; j < p; j++) {
                    error -= h[j] * theta[j];
                    seen[j] = h[j] * free_[j];
                }
                double s = observe(p, F, seen, noise[i], b);
                for (int j = 0; j < p; j++) {
                    if (free_[j] == 1.0) {
                        theta[j] += b[j] / s * error;
                        b[j] = 0.0;
                    } else if (b[j] != 0.0) {
                        last = j;
                    }
                }
                add_square(p, F, 1.0 / s, b, last);
            }
            again = false;
            for (int j = 0; j < p; j++)
                if (free_[j] == 1.0 && theta[j] < lower[j]) {
                    start[j] = lower[j];
                    free_[j] = 0.0;
                    again = true;
                }
        }
        sum += theta[0];
    }
    return sum;
}

// theta += S^-1 psi' W (y - psi theta), S = forgetting S + psi' W psi by Cholesky, W diagonal; a window of m samples
// whose mean error leaves its limit is used again with the correction times cr, as long as that lessens it.
static void correct(int p, int q, const double* H, const double* z, const double* noise, double forgetting,
                    double multiplier, double* theta, double* S, double* error) {
    double L[P * P], pull[P];
    for (int i = 0; i < q; i++) {
        error[i] = z[i];
        for (int j = 0; j < p; j++) error[i] -= H[i * p + j] * theta[j];
    }
    for (int j = 0; j < p; j++) {
        pull[j] = 0.0;
        for (int i = 0; i < q; i++) pull[j] += H[i * p + j] * error[i] / noise[i];
        for (int k = 0; k < p; k++) {
            double gained = 0.0;
            for (int i = 0; i < q; i++) gained += H[i * p + j] * H[i * p + k] / noise[i];
            S[j * p + k] = forgetting * S[j * p + k] + gained;
        }
    }
    for (int j = 0; j < p; j++)
        for (int k = 0; k <= j; k++) {
            double s = S[j * p + k];
            for (int l = 0; l < k; l++) s -= L[j * p + l] * L[k * p + l];
            L[j * p + k] = j == k ? std::sqrt(std::max(s, 1e-300)) : s / L[k * p + k];
        }
    for (int j = 0; j < p; j++) {
        for (int k = 0; k < j; k++) pull[j] -= L[j * p + k] * pull[k];
        pull[j] /= L[j * p + j];
    }
    for (int j = p - 1; j >= 0; j--) {
        for (int k = j + 1; k < p; k++) pull[j] -= L[k * p + j] * pull[k];
        pull[j] /= L[j * p + j];
        theta[j] += multiplier * pull[j];
    }
}

extern "C" double mrls(int n, int p, int q, const double* psi, const double* y, const double* noise, double forgetting,
                       int m, double cr, double limit, int rewinds, double* theta, double* S) {
    double errors[64 * 8], tried[64 * 8], keptTheta[P], keptS[P * P], sum = 0.0;
    auto excess = [&](const double* e) {
        double largest = 0.0;
        for (int i = 0; i < q; i++) {
            double mean = 0.0;
            for (int t = 0; t < m; t++) mean += e[t * q + i] / m;
            largest = std::max(largest, std::fabs(mean) / (limit * std::sqrt(noise[i] / m)));
        }
        return largest;
    };
    for (int t = 0; t < n; t++) {
        std::memmove(errors, errors + q, (m - 1) * q * sizeof(double));
        correct(p, q, psi + t * q * p, y + t * q, noise, forgetting, 1.0, theta, S, errors + (m - 1) * q);
        if (t < m) continue;
        double now = excess(errors);
        for (int pass = 0; pass < rewinds && now > 1.0; pass++) {
            std::memcpy(keptTheta, theta, p * sizeof(double));
            std::memcpy(keptS, S, p * p * sizeof(double));
            for (int k = 0; k < m; k++) {
                int at = t - m + 1 + k;
                correct(p, q, psi + at * q * p, y + at * q, noise, forgetting, cr, theta, S, tried + k * q);
            }
            double then = excess(tried);
            if (then >= now) {
                std::memcpy(theta, keptTheta, p * sizeof(double));
                std::memcpy(S, keptS, p * p * sizeof(double));
                break;
            }
            std::memcpy(errors, tried, m * q * sizeof(double));
            now = then;
        }
        sum += theta[0];
    }
    return sum;
}
