/* Reference statistics of crank-rockers in quadruple precision (113 bits), by the classical vector method.
 *
 * Shares nothing with the package: the position comes from Heron's area of the triangle crank pin, coupler joint,
 * rocker pivot; velocities and accelerations from cross and dot products of the link vectors; integrals from
 * composite Gauss-Legendre rules in the crank angle itself, on panels that double in length away from 0 and pi; extremes
 * from golden sections. Compiled and called by make_campaign.py.
 */
#include <quadmath.h>
#include <stdlib.h>

typedef __float128 real;
enum { MAXIMUM_NODES = 64, EDGES = 4096, SIGNALS = 7, SAMPLES = 16 };
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

/* for unit crank velocity: velocities of coupler and rocker, accelerations of both; if wanted, angles of both and the
 * transmission angle */
static void motion(const Linkage *l, real angle, int wants_angles, real out[SIGNALS]) {
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
    if (!wants_angles) return;
    out[4] = atan2q(uy, ux), out[5] = atan2q(vy, vx);
    out[6] = atan2q(fabsq(area2), (l->r2 * l->r2 + l->r3 * l->r3 - square) / 2);
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

/* panel edges in [low, high], graded towards multiples of pi, with the limit positions among them */
static int grid(const Linkage *l, real low, real high, real *edge) {
    int count = 0, kept = 0;
    for (int k = (int)floorq(low / M_PIq); k <= (int)ceilq(high / M_PIq); k++) {
        real anchor = k * M_PIq;
        edge[count++] = anchor, edge[count++] = anchor + M_PI_2q;
        for (real y = k % 2 ? l->near_pi : l->near_zero; y < M_PI_2q; y *= 2)
            edge[count++] = anchor + y, edge[count++] = anchor - y;
    }
    for (int turn = -1; turn <= 1; turn++)
        edge[count++] = l->extended + turn * 2 * M_PIq, edge[count++] = l->overlapped + turn * 2 * M_PIq;
    for (int j = 0; j < count; j++)
        if (low < edge[j] && edge[j] < high) edge[kept++] = edge[j];
    edge[kept++] = low, edge[kept++] = high;
    qsort(edge, kept, sizeof(real), ascending);
    return kept;
}

/* smallest sign * signal between two crank angles, between which it has one minimum */
static real golden(const Linkage *l, int signal, real sign, real low, real high) {
    const real share = (sqrtq((real)5) - 1) / 2;
    real a = high - share * (high - low), b = low + share * (high - low), v[SIGNALS], fa, fb;
    motion(l, a, signal > 3, v), fa = sign * v[signal];
    motion(l, b, signal > 3, v), fb = sign * v[signal];
    for (int step = 0; step < 60; step++) {
        if (fa < fb) {
            high = b, b = a, fb = fa, a = high - share * (high - low);
            motion(l, a, signal > 3, v), fa = sign * v[signal];
        } else {
            low = a, a = b, fa = fb, b = low + share * (high - low);
            motion(l, b, signal > 3, v), fb = sign * v[signal];
        }
    }
    return fa < fb ? fa : fb;
}

/* smallest sign * signal over a window sampled at `at`, and the number of local minima inside it */
static real smallest(const Linkage *l, int signal, real sign, long points, const real *at, const real *value, int *found) {
    real best = HUGE_VALQ;
    for (long j = 0; j < points; j++) {
        real here = sign * value[SIGNALS * j + signal];
        if (here < best) best = here;
        if (j > 0 && here > sign * value[SIGNALS * (j - 1) + signal]) continue;
        if (j + 1 < points && here > sign * value[SIGNALS * (j + 1) + signal]) continue;
        real refined = golden(l, signal, sign, at[j > 0 ? j - 1 : j], at[j + 1 < points ? j + 1 : j]);
        if (refined < best) best = refined;
        *found += j > 0 && j + 1 < points;
    }
    return best;
}

/* length, then mean, variance, minimum and maximum of each signal; returns local extremes of the rocker velocity inside */
static int statistics(const Linkage *l, real low, real high, real *at, real *value, double *out) {
    real edge[EDGES], sum[SIGNALS] = {0}, squares[SIGNALS] = {0}, now[SIGNALS];
    int count = grid(l, low, high, edge), inside = 0;
    long points = 0;
    for (int p = 0; p + 1 < count; p++) {
        real half = (edge[p + 1] - edge[p]) / 2, centre = (edge[p + 1] + edge[p]) / 2;
        if (!(half > 0)) continue;
        for (int j = 0; j < SAMPLES; j++) at[points++] = edge[p] + 2 * half * j / SAMPLES;
        for (int j = 0; j < nodes; j++) {
            motion(l, centre + half * node[j], 1, now);
            for (int s = 0; s < SIGNALS; s++)
                sum[s] += half * weight[j] * now[s], squares[s] += half * weight[j] * now[s] * now[s];
        }
    }
    at[points++] = high;
    for (long j = 0; j < points; j++) motion(l, at[j], 1, value + SIGNALS * j);
    out[0] = (double)(high - low);
    for (int s = 0; s < SIGNALS; s++) {
        real mean = sum[s] / (high - low);
        int found = 0;
        out[1 + 4 * s] = (double)mean, out[2 + 4 * s] = (double)(squares[s] / (high - low) - mean * mean);
        out[3 + 4 * s] = (double)smallest(l, s, 1, points, at, value, &found);
        out[4 + 4 * s] = (double)-smallest(l, s, -1, points, at, value, &found);
        inside += s == 1 ? found : 0;
    }
    return inside;
}

/* degrees[n][2]: an interval of crank angles. out[n][4][29]: `statistics` from overlapped to extended, from extended to
 * overlapped, over the turn, over the interval. peaks[n]: local extremes of the rocker velocity in one turn */
void windows(long n, const double *lengths, const double *branch, const double *degrees, double *out, int *peaks) {
    real *at = malloc(sizeof(real) * EDGES * SAMPLES), *value = malloc(sizeof(real) * EDGES * SAMPLES * SIGNALS);
    const int size = 1 + 4 * SIGNALS;
    for (long i = 0; i < n; i++) {
        Linkage l = linkage(lengths + 4 * i, branch[i]);
        real turn = 2 * M_PIq, back = l.extended < l.overlapped ? turn : 0;
        double *o = out + 4 * size * i;
        peaks[i] = statistics(&l, l.overlapped - back, l.extended, at, value, o);
        peaks[i] += statistics(&l, l.extended - (turn - back), l.overlapped, at, value, o + size);
        statistics(&l, l.overlapped - back, l.overlapped + (turn - back), at, value, o + 2 * size);
        statistics(&l, degrees[2 * i] * M_PIq / 180, degrees[2 * i + 1] * M_PIq / 180, at, value, o + 3 * size);
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
    real value[SIGNALS];
    *output = 0;
    for (int k = 0; k < c->phases; k++) {
        motion(c->l, angle + k * c->period, 0, value);
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
void clutch(long n, const double *lengths, const double *branch, const int *phases, double *out) {
    real edge[EDGES], *folded = malloc(sizeof(real) * (EDGES + 2)), value[SIGNALS];
    for (long i = 0; i < n; i++) {
        Linkage l = linkage(lengths + 4 * i, branch[i]);
        real period = 2 * M_PIq / phases[i];
        int count = grid(&l, 0, 2 * M_PIq, edge), points = 0;
        folded[points++] = 0, folded[points++] = period;
        for (int p = 0; p < count; p++) {
            real y = edge[p] - period * floorq(edge[p] / period);
            if (y > 0 && y < period) folded[points++] = y;
        }
        qsort(folded, points, sizeof(real), ascending);
        for (int w = 0; w < 2; w++) {
            real middle = (l.extended + l.overlapped) / 2; /* in the stroke that passes pi */
            motion(&l, middle, 0, value);
            real here = value[1] > 0 ? 1 : -1;
            int passes_pi = l.extended < l.overlapped ? 1 : 0; /* index of the stroke that passes pi */
            Clutch c = {&l, phases[i], period, w == passes_pi ? here : -here, 0, 0, HUGE_VALQ, 0, 0};
            for (int p = 0; p + 1 < points; p++) panel(&c, folded[p], folded[p + 1], 0);
            real mean = c.sum / period;
            double *o = out + 10 * i + 5 * w;
            o[0] = (double)mean, o[1] = (double)(c.squares / period - mean * mean);
            o[2] = (double)c.least, o[3] = (double)c.most, o[4] = c.switches;
        }
    }
    free(folded);
}
