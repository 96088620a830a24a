/* Reference statistics of crank-rockers in quadruple precision (113 bits), by the classical vector method.
 *
 * Shares nothing with the package: the position comes from Heron's area of the triangle crank pin, coupler joint,
 * rocker pivot; velocities and accelerations from cross and dot products of the link vectors; integrals from
 * composite Gauss-Legendre rules in the crank angle itself, on panels that double in length away from 0 and pi.
 * Compiled and called by make_campaign.py.
 */
#include <quadmath.h>
#include <stdlib.h>

typedef __float128 real;
enum { MAXIMUM_NODES = 64, EDGES = 4096 };
static real node[MAXIMUM_NODES], weight[MAXIMUM_NODES];
static int nodes;

typedef struct {
    real r1, r2, r3, r4, sign, near_zero, near_pi, overlapped, extended;
} Linkage;

void gauss(int count) {
    nodes = count;
    for (int i = 0; i < count; i++) {
        real x = cosq(M_PIq * (4 * i + 3) / (4 * count + 2)), slope = 1;
        for (int step = 0; step < 12; step++) {
            real before = 1, now = x;
            for (int k = 2; k <= count; k++) {
                real next = ((2 * k - 1) * x * now - (k - 1) * before) / k;
                before = now, now = next;
            }
            slope = count * (x * now - before) / (x * x - 1);
            x -= now / slope;
        }
        node[i] = -x, weight[i] = 2 / ((1 - x * x) * slope * slope);
    }
}

/* coupler velocity, rocker velocity, coupler acceleration, rocker acceleration for unit crank velocity */
static void motion(const Linkage *l, real angle, real out[4]) {
    real s, c, sine, cosine;
    sincosq(angle / 2, &s, &c);
    sine = 2 * s * c, cosine = 1 - 2 * s * s;
    real bx = l->r1 * cosine, by = l->r1 * sine;
    real dx = (l->r4 - l->r1) + 2 * l->r1 * s * s, dy = -by;
    real square = (l->r4 - l->r1) * (l->r4 - l->r1) + 4 * l->r1 * l->r4 * s * s, d = sqrtq(square);
    /* near pi the distance is short of r1 + r4, and r2 + r3 - d must not lose that */
    real short_of = 4 * l->r1 * l->r4 * c * c / (l->r1 + l->r4 + d);
    real slack = (l->r2 + l->r3 - l->r4 - l->r1) + short_of;
    real excess = 4 * l->r1 * l->r4 * s * s / (d + (l->r4 - l->r1)); /* d - (r4 - r1) */
    real area2 = l->sign * sqrtq((d + l->r2 + l->r3) * slack * ((l->r4 - l->r1 + l->r2 - l->r3) + excess)
                                 * ((l->r4 - l->r1 - l->r2 + l->r3) + excess)) / 2; /* twice the area */
    real along = (square + l->r2 * l->r2 - l->r3 * l->r3) / (2 * square), across = area2 / square;
    real ux = along * dx - across * dy, uy = along * dy + across * dx;
    along = (l->r2 * l->r2 - l->r3 * l->r3 - square) / (2 * square);
    real vx = along * dx - across * dy, vy = along * dy + across * dx;
    real w2 = (vx * by - vy * bx) / area2, w3 = (ux * by - uy * bx) / area2;
    real px = -bx - w2 * w2 * ux + w3 * w3 * vx, py = -by - w2 * w2 * uy + w3 * w3 * vy;
    out[0] = w2, out[1] = w3;
    out[2] = -(px * vx + py * vy) / area2, out[3] = -(px * ux + py * uy) / area2;
}

static real half_angle(real a, real b, real c) { /* angle between sides a and b, opposite c */
    return 2 * atan2q(sqrtq((c + b - a) * (c + a - b)), sqrtq((a + b + c) * (a + b - c)));
}

static Linkage linkage(const double lengths[4], double branch) {
    Linkage l = {lengths[0], lengths[1], lengths[2], lengths[3], branch, 0, 0, 0, 0};
    real four = 4 * l.r1 * l.r4, e1 = l.r4 - l.r1 - l.r2 + l.r3, e2 = l.r4 - l.r1 + l.r2 - l.r3;
    real e3 = l.r2 + l.r3 - l.r4 - l.r1, e4 = l.r1 + l.r2 + l.r3 + l.r4;
    l.near_zero = 2 * asinhq(sqrtq(e1 * e2 / four)), l.near_pi = 2 * asinhq(sqrtq(e3 * e4 / four));
    /* crank angles of the limit positions, in (0, 2 pi) */
    l.extended = half_angle(l.r2 + l.r1, l.r4, l.r3);
    l.overlapped = M_PIq + half_angle(l.r2 - l.r1, l.r4, l.r3);
    if (branch < 0) l.extended = 2 * M_PIq - l.extended, l.overlapped = 2 * M_PIq - l.overlapped;
    return l;
}

static int ascending(const void *a, const void *b) {
    real x = *(const real *)a, y = *(const real *)b;
    return (x > y) - (x < y);
}

/* panel edges in [0, 2 pi], graded towards 0, pi and 2 pi, with the limit positions among them */
static int grid(const Linkage *l, real *edge) {
    int count = 0;
    for (int side = 0; side < 4; side++) {
        real anchor = side == 0 ? 0 : side == 3 ? 2 * M_PIq : M_PIq, direction = side % 2 ? -1 : 1;
        edge[count++] = anchor;
        for (real y = side == 0 || side == 3 ? l->near_zero : l->near_pi; y < M_PI_2q; y *= 2)
            edge[count++] = anchor + direction * y;
    }
    edge[count++] = M_PI_2q, edge[count++] = 3 * M_PI_2q;
    edge[count++] = l->extended, edge[count++] = l->overlapped;
    qsort(edge, count, sizeof(real), ascending);
    return count;
}

/* strokes[n][2][9]: overlapped to extended, extended to overlapped: length, sums of 4 signals, of their squares */
void strokes(long n, const double *lengths, const double *branch, double *out) {
    for (long i = 0; i < n; i++) {
        Linkage l = linkage(lengths + 4 * i, branch[i]);
        real edge[EDGES], sum[2][9] = {{0}}, value[4], moment[3][8];
        int count = grid(&l, edge);
        real low = l.extended < l.overlapped ? l.extended : l.overlapped, high = l.extended < l.overlapped ? l.overlapped : l.extended;
        for (int p = 0; p + 1 < count; p++) {
            real half = (edge[p + 1] - edge[p]) / 2, centre = (edge[p + 1] + edge[p]) / 2;
            int between = low < centre && centre < high;
            /* between the two limits in (0, 2 pi) the crank passes pi: extended to overlapped if that is the order */
            int stroke = between == (l.extended < l.overlapped);
            for (int j = 0; j < nodes && half > 0; j++) {
                motion(&l, centre + half * node[j], value);
                sum[stroke][0] += half * weight[j];
                for (int s = 0; s < 4; s++) {
                    sum[stroke][1 + s] += half * weight[j] * value[s];
                    sum[stroke][5 + s] += half * weight[j] * value[s] * value[s];
                }
            }
        }
        for (int w = 0; w < 3; w++) {
            real length = w < 2 ? sum[w][0] : sum[0][0] + sum[1][0];
            for (int s = 0; s < 4; s++) {
                real mean = (w < 2 ? sum[w][1 + s] : sum[0][1 + s] + sum[1][1 + s]) / length;
                real square = (w < 2 ? sum[w][5 + s] : sum[0][5 + s] + sum[1][5 + s]) / length;
                moment[w][s] = mean, moment[w][4 + s] = square - mean * mean;
            }
            out[27 * i + 9 * w] = (double)length;
            for (int s = 0; s < 8; s++) out[27 * i + 9 * w + 1 + s] = (double)moment[w][s];
        }
    }
}

static real golden(const Linkage *l, int signal, real sign, real low, real high) {
    const real share = (sqrtq((real)5) - 1) / 2;
    real a = high - share * (high - low), b = low + share * (high - low), v[4], fa, fb;
    motion(l, a, v), fa = sign * v[signal];
    motion(l, b, v), fb = sign * v[signal];
    for (int step = 0; step < 60; step++) {
        if (fa < fb) {
            high = b, b = a, fb = fa, a = high - share * (high - low);
            motion(l, a, v), fa = sign * v[signal];
        } else {
            low = a, a = b, fa = fb, b = low + share * (high - low);
            motion(l, b, v), fb = sign * v[signal];
        }
    }
    return fa < fb ? fa : fb;
}

/* out[n][3][2][2]: per window (strokes as above, cycle), rocker velocity and acceleration: min, max.
 * peaks[n]: local extremes of the rocker velocity in the turn */
void extremes(long n, const double *lengths, const double *branch, double *out, int *peaks) {
    real *at = malloc(sizeof(real) * EDGES * 20), *value = malloc(sizeof(real) * EDGES * 20 * 4);
    for (long i = 0; i < n; i++) {
        Linkage l = linkage(lengths + 4 * i, branch[i]);
        real edge[EDGES];
        int count = grid(&l, edge);
        real low = l.extended < l.overlapped ? l.extended : l.overlapped, high = l.extended < l.overlapped ? l.overlapped : l.extended;
        int first_is_middle = l.extended < l.overlapped;
        long points = 0;
        for (int p = 0; p + 1 < count; p++)
            for (int j = 0; j < 16 && edge[p + 1] > edge[p]; j++) at[points++] = edge[p] + (edge[p + 1] - edge[p]) * j / 16;
        for (long j = 0; j < points; j++) motion(&l, at[j], value + 4 * j);
        peaks[i] = 0;
        for (int s = 0; s < 2; s++)
            for (int m = 0; m < 2; m++) {
                real sign = m ? -1 : 1, best[2] = {HUGE_VALQ, HUGE_VALQ};
                for (long j = 0; j < points; j++) {
                    long left = (j + points - 1) % points, right = (j + 1) % points;
                    real here = sign * value[4 * j + 1 + 2 * s];
                    int limit = at[j] == low || at[j] == high;
                    int stroke = (low < at[j] && at[j] < high) == first_is_middle;
                    if (limit) { /* an end of both strokes */
                        if (here < best[0]) best[0] = here;
                        if (here < best[1]) best[1] = here;
                        continue;
                    }
                    if (here < best[stroke]) best[stroke] = here;
                    if (here <= sign * value[4 * left + 1 + 2 * s] && here <= sign * value[4 * right + 1 + 2 * s]) {
                        real a = left < j ? at[left] : at[left] - 2 * M_PIq, b = right > j ? at[right] : at[right] + 2 * M_PIq;
                        real found = golden(&l, 1 + 2 * s, sign, a, b);
                        if (found < best[stroke]) best[stroke] = found;
                        if (s == 0) peaks[i]++;
                    }
                }
                /* a minimum bracketed across a limit belongs to the cycle; sampled limits bound it from one side:
                 * refine there as well, clipped to each stroke */
                for (long j = 0; j < points; j++)
                    if (at[j] == low || at[j] == high) {
                        long left = (j + points - 1) % points, right = (j + 1) % points;
                        real a = left < j ? at[left] : at[left] - 2 * M_PIq, b = right > j ? at[right] : at[right] + 2 * M_PIq;
                        real before = golden(&l, 1 + 2 * s, sign, a, at[j]), after = golden(&l, 1 + 2 * s, sign, at[j], b);
                        int stroke_before = (at[j] == high) == first_is_middle, stroke_after = !stroke_before;
                        if (before < best[stroke_before]) best[stroke_before] = before;
                        if (after < best[stroke_after]) best[stroke_after] = after;
                    }
                for (int w = 0; w < 3; w++) {
                    real of = w < 2 ? best[w] : best[0] < best[1] ? best[0] : best[1];
                    out[12 * i + 4 * w + 2 * s + m] = (double)(sign * of);
                }
            }
    }
    free(at), free(value);
}

typedef struct {
    const Linkage *l;
    int phases;
    real period, sense, sum, squares, least, most;
    int switches;
} Clutch;

/* which phase drives (-1: none), brute force over all of them, and the output velocity */
static int leader(const Clutch *c, real angle, real *output) {
    int best = -1;
    real value[4];
    *output = 0;
    for (int k = 0; k < c->phases; k++) {
        motion(c->l, angle + k * c->period, value);
        if (c->sense * value[1] > *output) *output = c->sense * value[1], best = k;
    }
    return best;
}

static void panel(Clutch *c, real low, real high, int depth) {
    real half = (high - low) / 2, centre = (high + low) / 2, output[MAXIMUM_NODES + 2], at[MAXIMUM_NODES + 2];
    int who[MAXIMUM_NODES + 2];
    if (!(half > 1e-28Q)) return;
    at[0] = low + half * 1e-10Q, at[nodes + 1] = high - half * 1e-10Q;
    for (int j = 0; j < nodes; j++) at[j + 1] = centre + half * node[j];
    for (int j = 0; j < nodes + 2; j++) who[j] = leader(c, at[j], output + j);
    for (int j = 0; j < nodes + 1 && depth < 40; j++)
        if (who[j] != who[j + 1]) {
            real a = at[j], b = at[j + 1], ignored;
            for (int step = 0; step < 200 && b - a > 1e-32Q; step++) {
                real middle = (a + b) / 2;
                if (leader(c, middle, &ignored) == who[j]) a = middle; else b = middle;
            }
            leader(c, a, &ignored);
            if (ignored < c->least) c->least = ignored;
            c->switches++;
            panel(c, low, a, depth + 1), panel(c, b, high, depth + 1);
            return;
        }
    for (int j = 0; j < nodes; j++) {
        real share = half * weight[j];
        c->sum += share * output[j + 1], c->squares += share * output[j + 1] * output[j + 1];
    }
    for (int j = 0; j < nodes + 2; j++) {
        if (output[j] < c->least) c->least = output[j];
        if (output[j] > c->most) c->most = output[j];
    }
}

/* out[n][2][5]: sense of overlapped to extended, of extended to overlapped: mean, variance, min, max, switches */
void clutch(long n, const double *lengths, const double *branch, int phases, double *out) {
    real edge[EDGES], *folded = malloc(sizeof(real) * EDGES * 12), value[4];
    for (long i = 0; i < n; i++) {
        Linkage l = linkage(lengths + 4 * i, branch[i]);
        real period = 2 * M_PIq / phases;
        int count = grid(&l, edge), points = 0;
        folded[points++] = 0, folded[points++] = period;
        for (int p = 0; p < count; p++) {
            real y = edge[p] - period * floorq(edge[p] / period);
            if (y > 0 && y < period) folded[points++] = y;
        }
        qsort(folded, points, sizeof(real), ascending);
        for (int w = 0; w < 2; w++) {
            real middle = (l.extended + l.overlapped) / 2; /* in the stroke that passes pi */
            motion(&l, middle, value);
            real here = value[1] > 0 ? 1 : -1;
            int passes_pi = l.extended < l.overlapped ? 1 : 0; /* index of the stroke that passes pi */
            Clutch c = {&l, phases, period, w == passes_pi ? here : -here, 0, 0, HUGE_VALQ, 0, 0};
            for (int p = 0; p + 1 < points; p++) panel(&c, folded[p], folded[p + 1], 0);
            real mean = c.sum / period;
            double *o = out + 10 * i + 5 * w;
            o[0] = (double)mean, o[1] = (double)(c.squares / period - mean * mean);
            o[2] = (double)c.least, o[3] = (double)c.most, o[4] = c.switches;
        }
    }
    free(folded);
}
