/* What the machine can do: memory read and streamed through, and multiply-adds in registers. */

#include <stdint.h>

/* Sum of n numbers: each is read once. */
double read_all(int64_t n, const double *restrict a)
{
    double sum = 0.0;
#pragma omp parallel for simd schedule(static) reduction(+ : sum)
    for (int64_t i = 0; i < n; i++)
        sum += a[i];
    return sum;
}

/* The triad of McCalpin's STREAM: two numbers read and one written. */
void triad(int64_t n, double *restrict a, const double *restrict b, const double *restrict c)
{
#pragma omp parallel for simd schedule(static)
    for (int64_t i = 0; i < n; i++)
        a[i] = b[i] + 3.0 * c[i];
}

#if defined(__AVX512F__)
#define BYTES 64
#elif defined(__AVX__)
#define BYTES 32
#else
#define BYTES 16
#endif

/* Chains of multiply-adds that do not wait for each other: twelve fill two units with a latency of
 * up to six. Every thread does `steps` of each; returns how many multiply-adds a thread has done. */
#define CHAINS(name, number)                                                                      \
    int64_t name(int64_t steps, int64_t threads, number *restrict out)                            \
    {                                                                                             \
        typedef number lanes __attribute__((vector_size(BYTES)));                                 \
        enum { COUNT = BYTES / sizeof(number) };                                                  \
        _Pragma("omp parallel for schedule(static, 1)") for (int64_t t = 0; t < threads; t++)     \
        {                                                                                         \
            lanes zero = {0}, a = zero + (number)0.999, b = zero + (number)0.001 * (t + 1);       \
            lanes x0 = b, x1 = b + 1, x2 = b + 2, x3 = b + 3, x4 = b + 4, x5 = b + 5;             \
            lanes x6 = b + 6, x7 = b + 7, x8 = b + 8, x9 = b + 9, x10 = b + 10, x11 = b + 11;     \
            for (int64_t i = 0; i < steps; i++) {                                                 \
                x0 = x0 * a + b; x1 = x1 * a + b; x2 = x2 * a + b; x3 = x3 * a + b;               \
                x4 = x4 * a + b; x5 = x5 * a + b; x6 = x6 * a + b; x7 = x7 * a + b;               \
                x8 = x8 * a + b; x9 = x9 * a + b; x10 = x10 * a + b; x11 = x11 * a + b;           \
            }                                                                                     \
            lanes sum = x0 + x1 + x2 + x3 + x4 + x5 + x6 + x7 + x8 + x9 + x10 + x11;              \
            out[t] = sum[0];                                                                      \
        }                                                                                         \
        return steps * 12 * COUNT;                                                                \
    }

CHAINS(chains_float64, double)
CHAINS(chains_float32, float)
