/* The time loop of bristle/engine/time_loop.py written in C, for one building and one LuGre damper:
 * what compiled Python is measured against. Same scheme, same order of operations; the building may
 * have any number of levels; effects, other laws and other wirings are left out. */

#include <math.h>
#include <stdlib.h>

typedef struct {
    long n;                               /* levels, the first one isolated */
    const double *phi, *held, *ramp;      /* exact step, flat: (2n, 2n), (2n, n+1), (2n, n+1) */
    const double *m_inverse, *c, *k;      /* (n, n) */
    double mass;                          /* of the first level, kg */
} Structure;

typedef struct {
    double sigma_a, sigma_0, sigma_1, sigma_2, sigma_b, v_n, a_0, voltage, stroke;
} Damper;

typedef struct {
    long size;
    const double *times, *values;         /* s, m/s2 */
} Record;

static double ground_acceleration(const Record *record, double t)
{
    const double *times = record->times, *values = record->values;
    long last = record->size - 1;
    if (!(times[0] <= t && t <= times[last]))
        return 0.0;
    long low = (long)((t - times[0]) / (times[last] - times[0]) * (double)last);
    if (low >= last)
        low = last - 1;
    if (!(times[low] <= t && t < times[low + 1])) {
        long high = last;
        low = 0;
        while (high - low > 1) {
            long middle = (low + high) / 2;
            if (times[middle] <= t)
                low = middle;
            else
                high = middle;
        }
    }
    if (t == times[low + 1])
        return values[low + 1];
    double share = (t - times[low]) / (times[low + 1] - times[low]);
    return values[low] + share * (values[low + 1] - values[low]);
}

static void free_step(const Structure *b, const double *x, double a0, double a1, double *out)
{
    long n = b->n, size = 2 * n;
    for (long i = 0; i < size; i++) {
        double total = b->held[i * (n + 1) + n] * a0 + b->ramp[i * (n + 1) + n] * (a1 - a0);
        for (long j = 0; j < size; j++)
            total += b->phi[i * size + j] * x[j];
        out[i] = total;
    }
}

static void forced_step(const Structure *b, const double *free_motion, double f0, double f1,
                        double *out)
{
    long n = b->n;
    for (long i = 0; i < 2 * n; i++)
        out[i] = free_motion[i] + b->held[i * (n + 1)] * f0 + b->ramp[i * (n + 1)] * (f1 - f0);
}

static double advance_bristle(double z, double v, double dt, double a_0)
{
    double slip = a_0 * fabs(v) * dt;
    if (slip < 1e-9)
        return z + v * dt;
    return z * exp(-slip) - v / (a_0 * fabs(v)) * expm1(-slip);
}

static double damper_force(const Damper *d, double z, double v)
{
    double V = d->voltage;
    return (d->sigma_a + d->sigma_0 * V) * z + d->sigma_1 * (v - d->a_0 * fabs(v) * z)
           + (d->sigma_2 + d->sigma_b * V) * v * exp(-fabs(v) / d->v_n);
}

/* One row of the table: displacement, velocity and absolute acceleration of every level, drifts,
 * holding force, ground acceleration, force, dissipated energy, stroke ratio. */
static void write_row(const Structure *b, const Damper *d, const double *x, double a_g,
                      double force, double energy, double *row)
{
    long n = b->n, at = 3 * n;
    for (long i = 0; i < n; i++) {
        double total = 0.0;
        for (long j = 0; j < n; j++) {
            double load = j == 0 ? force : 0.0;
            for (long l = 0; l < n; l++)
                load += b->k[j * n + l] * x[l] + b->c[j * n + l] * x[n + l];
            total -= b->m_inverse[i * n + j] * load;
        }
        row[3 * i] = x[i];
        row[3 * i + 1] = x[n + i];
        row[3 * i + 2] = total;
    }
    for (long i = 1; i < n; i++)
        row[at++] = x[i] - x[i - 1];
    double holding = -b->mass * a_g;
    for (long j = 0; j < n; j++)
        holding -= b->k[j] * x[j] + b->c[j] * x[n + j];
    row[at++] = holding;
    row[at++] = a_g;
    row[at++] = force;
    row[at++] = energy;
    row[at++] = fabs(x[0]) / d->stroke;
}

/* Fill `table` (rows + 1, width); return how many sweeps were taken, or -1 without memory.
 * In each substep of h [s] the force at its end is extrapolated, then corrected until motion and
 * force agree to `tolerance`, a share of the largest force so far. */
long time_loop(long rows, long substeps, double h, double tolerance, long max_sweeps,
           const Structure *b, const Damper *d, const Record *record, double *table, long width)
{
    long n = b->n, size = 2 * n, sweeps = 0;
    double *x = calloc(3 * (size_t)size, sizeof(double));
    if (!x)
        return -1;
    double *x1 = x + size, *free_motion = x + 2 * size;
    double z = 0.0, energy = 0.0, scale = 1e-9;
    double ground = ground_acceleration(record, 0.0);
    double force = damper_force(d, z, 0.0), before = force, earlier = force;
    write_row(b, d, x, ground, force, energy, table);
    for (long row = 0; row < rows; row++) {
        for (long step = 0; step < substeps; step++) {
            double next = ground_acceleration(record, (double)(row * substeps + step + 1) * h);
            double tried = 3.0 * (force - before) + earlier, found = tried, z1 = z;
            double last_tried = 0.0, last_excess = 0.0, change = INFINITY;
            free_step(b, x, ground, next, free_motion);
            for (long sweep = 0; sweep < max_sweeps && change > tolerance * scale; sweep++) {
                forced_step(b, free_motion, force, tried, x1);
                z1 = advance_bristle(z, 0.5 * (x[n] + x1[n]), h, d->a_0);
                found = damper_force(d, z1, x1[n]);
                double excess = found - tried, slope = -1.0;
                if (sweep > 0 && tried != last_tried) {   /* the secant's correction */
                    slope = (excess - last_excess) / (tried - last_tried);
                    if (slope > -0.5)
                        slope = -0.5;
                }
                last_tried = tried;
                last_excess = excess;
                tried -= excess / slope;
                change = fabs(excess);
                if (fabs(found) > scale)
                    scale = fabs(found);
                sweeps++;
            }
            energy += 0.5 * h * (force * x[n] + found * x1[n]);
            for (long i = 0; i < size; i++)
                x[i] = x1[i];
            z = z1;
            earlier = before;
            before = force;
            force = found;
            ground = next;
        }
        write_row(b, d, x, ground, force, energy, table + (row + 1) * width);
    }
    free(x);
    return sweeps;
}
