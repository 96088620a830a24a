/* The hand-fused loop that the compiled kernel is measured against: mean and variance of coupler and rocker velocity
 * and acceleration of many crank-rockers at given crank angles. Same algebra as explore/mechanisms/four_bar.py.
 * Build: gcc -O3 -march=native -ffast-math -shared -fPIC. Called by kernel.py. */
#include <math.h>

enum { MOST = 512 };

static double sum4(double a, double b, double c, double d) { /* -ffast-math would drop TwoSum: long double instead */
    return (double)((long double)a + b + c + d);
}

void run(long designs, const double *restrict lengths, long nodes, const double *restrict sin_half,
         const double *restrict cos_half, const double *restrict weight, double length, double *restrict out) {
    static _Thread_local double value[4][MOST];
    for (long i = 0; i < designs; i++) {
        const double r1 = lengths[4 * i], r2 = lengths[4 * i + 1], r3 = lengths[4 * i + 2], r4 = lengths[4 * i + 3];
        const double p0 = sum4(r4, -r1, -r2, r3) * sum4(r4, -r1, r2, -r3);
        const double q0 = sum4(r2, r3, -r4, -r1) * sum4(r1, r2, r3, r4);
        const double four = 4 * r1 * r4, product = r1 * r4, square0 = (r4 - r1) * (r4 - r1);
        const double squares = (r2 - r3) * (r2 + r3), numerator0 = r1 * (r4 - r1);
        double sum0 = 0, sum1 = 0, sum2 = 0, sum3 = 0;
        for (long j = 0; j < nodes; j++) {
            const double s = sin_half[j], c = cos_half[j], ss = s * s, cc = c * c;
            const double d2 = square0 + four * ss, p = p0 + four * ss, q = q0 + four * cc, x = 0.5 * sqrt(p * q);
            const double both = 1 / (d2 * x), over_d2 = x * both, over_x = d2 * both, sine = 2 * product * s * c;
            const double f = sine * over_x, k = 0.5 * squares * over_d2, g = (numerator0 - 2 * product * ss) * over_d2;
            const double d_log = 2 * sine * over_d2;
            const double f_rate = (product * (cc - ss) - 0.25 * f * f * (q - p)) * over_x;
            const double common = -k * d_log * f + 0.5 * d_log * (1 + 2 * g), w = weight[j];
            const double w2 = (k - 0.5) * f - g, w3 = (k + 0.5) * f - g;
            const double a2 = (k - 0.5) * f_rate + common, a3 = (k + 0.5) * f_rate + common;
            value[0][j] = w2, value[1][j] = w3, value[2][j] = a2, value[3][j] = a3;
            sum0 += w * w2, sum1 += w * w3, sum2 += w * a2, sum3 += w * a3;
        }
        const double m0 = sum0 / length, m1 = sum1 / length, m2 = sum2 / length, m3 = sum3 / length;
        double v0 = 0, v1 = 0, v2 = 0, v3 = 0;
        for (long j = 0; j < nodes; j++) {
            const double w = weight[j], d0 = value[0][j] - m0, d1 = value[1][j] - m1;
            const double d2 = value[2][j] - m2, d3 = value[3][j] - m3;
            v0 += w * d0 * d0, v1 += w * d1 * d1, v2 += w * d2 * d2, v3 += w * d3 * d3;
        }
        double *o = out + 8 * i;
        o[0] = m0, o[1] = m1, o[2] = m2, o[3] = m3;
        o[4] = v0 / length, o[5] = v1 / length, o[6] = v2 / length, o[7] = v3 / length;
    }
}
