/* The yardstick: one evaluation of total Lagrangian forces, as a careful C programmer writes it
 * without knowing anything about the arrangement of the particles.
 *
 * Neighbours in rows; a first pass gathers the deformation gradient with linearly corrected
 * weights (Bonet & Lok 1999) and finds the neo-Hookean stress, a second one gathers the symmetric
 * pair forces. Only plain weights are stored: F and P are corrected once a particle.
 *
 * Build: cc -O3 -march=native -fopenmp -shared -fPIC
 */

#include <math.h>
#include <stdint.h>

/* Arrays of n particles and m pairs:
 *   starts (n + 1), columns (m)   rows of neighbours, without the particle itself
 *   plain (m, 3)                  V_q dW/dx_p(x_p - x_q) [1/m], so that V_p plain_pq = -V_q plain_qp
 *   volumes (n) [m^3], corrections (n, 3, 3) K_p [-]
 *   u (n, 3) displacements [m], work (n, 3, 3) for P K
 *   forces (n, 3) [N]
 */
void forces(int64_t n, const int64_t *restrict starts, const int32_t *restrict columns,
            const double *restrict plain, const double *restrict volumes,
            const double *restrict corrections, double lambda, double mu,
            const double *restrict u, double *restrict work, double *restrict out)
{
#pragma omp parallel
    {
#pragma omp for schedule(static)
        for (int64_t p = 0; p < n; p++) {
            double h[3][3] = {{0.0}};
            const double ux = u[3 * p], uy = u[3 * p + 1], uz = u[3 * p + 2];
            for (int64_t m = starts[p]; m < starts[p + 1]; m++) {
                const int64_t q = columns[m];
                const double dx = u[3 * q] - ux, dy = u[3 * q + 1] - uy, dz = u[3 * q + 2] - uz;
                const double gx = plain[3 * m], gy = plain[3 * m + 1], gz = plain[3 * m + 2];
                h[0][0] += dx * gx; h[0][1] += dx * gy; h[0][2] += dx * gz;
                h[1][0] += dy * gx; h[1][1] += dy * gy; h[1][2] += dy * gz;
                h[2][0] += dz * gx; h[2][1] += dz * gy; h[2][2] += dz * gz;
            }
            const double *K = corrections + 9 * p;
            double F[3][3], c[3][3];
            for (int i = 0; i < 3; i++)
                for (int k = 0; k < 3; k++)
                    F[i][k] = (i == k) + K[3 * k] * h[i][0] + K[3 * k + 1] * h[i][1]
                              + K[3 * k + 2] * h[i][2];
            c[0][0] = F[1][1] * F[2][2] - F[1][2] * F[2][1];
            c[0][1] = F[1][2] * F[2][0] - F[1][0] * F[2][2];
            c[0][2] = F[1][0] * F[2][1] - F[1][1] * F[2][0];
            c[1][0] = F[0][2] * F[2][1] - F[0][1] * F[2][2];
            c[1][1] = F[0][0] * F[2][2] - F[0][2] * F[2][0];
            c[1][2] = F[0][1] * F[2][0] - F[0][0] * F[2][1];
            c[2][0] = F[0][1] * F[1][2] - F[0][2] * F[1][1];
            c[2][1] = F[0][2] * F[1][0] - F[0][0] * F[1][2];
            c[2][2] = F[0][0] * F[1][1] - F[0][1] * F[1][0];
            const double J = F[0][0] * c[0][0] + F[0][1] * c[0][1] + F[0][2] * c[0][2];
            const double a = (lambda * log(J) - mu) / J;
            double P[3][3];
            for (int i = 0; i < 3; i++)
                for (int k = 0; k < 3; k++)
                    P[i][k] = mu * F[i][k] + a * c[i][k];
            for (int i = 0; i < 3; i++)
                for (int k = 0; k < 3; k++)
                    work[9 * p + 3 * i + k] =
                        P[i][0] * K[k] + P[i][1] * K[3 + k] + P[i][2] * K[6 + k];
        }
#pragma omp for schedule(static)
        for (int64_t p = 0; p < n; p++) {
            const double *A = work + 9 * p;
            double fx = 0.0, fy = 0.0, fz = 0.0;
            for (int64_t m = starts[p]; m < starts[p + 1]; m++) {
                const int64_t q = columns[m];
                const double *B = work + 9 * q;
                const double gx = plain[3 * m], gy = plain[3 * m + 1], gz = plain[3 * m + 2];
                fx += (A[0] + B[0]) * gx + (A[1] + B[1]) * gy + (A[2] + B[2]) * gz;
                fy += (A[3] + B[3]) * gx + (A[4] + B[4]) * gy + (A[5] + B[5]) * gz;
                fz += (A[6] + B[6]) * gx + (A[7] + B[7]) * gy + (A[8] + B[8]) * gz;
            }
            out[3 * p] = volumes[p] * fx;
            out[3 * p + 1] = volumes[p] * fy;
            out[3 * p + 2] = volumes[p] * fz;
        }
    }
}
