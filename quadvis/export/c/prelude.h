/* Memory is read and written byte by byte in name alone: a compiler makes one instruction of each. */
#define LOAD(name, type) static type ld_##name(const char *p) { type v; memcpy(&v, p, sizeof v); return v; }
#define STORE(name, type) static void st_##name(char *p, type v) { memcpy(p, &v, sizeof v); }
LOAD(u8, uint8_t) LOAD(u16, uint16_t) LOAD(u32, uint32_t) LOAD(u64, uint64_t)
LOAD(f32, float) LOAD(f64, double) LOAD(p, char *)
STORE(u8, uint8_t) STORE(u16, uint16_t) STORE(u32, uint32_t) STORE(u64, uint64_t)
STORE(f32, float) STORE(f64, double) STORE(p, char *)
static double from_bits(uint64_t v) { double d; memcpy(&d, &v, sizeof d); return d; }
static uint64_t to_bits(double d) { uint64_t v; memcpy(&v, &d, sizeof v); return v; }

/* Arithmetic with a flag: each returns whether the result does not fit. */
static uint8_t sadd_over(uint64_t a, uint64_t b, uint64_t *r) { *r = a + b; return (uint8_t)(((a ^ *r) & (b ^ *r)) >> 63); }
static uint8_t ssub_over(uint64_t a, uint64_t b, uint64_t *r) { *r = a - b; return (uint8_t)(((a ^ b) & (a ^ *r)) >> 63); }
static uint8_t uadd_over(uint64_t a, uint64_t b, uint64_t *r) { *r = a + b; return *r < a; }
static uint8_t usub_over(uint64_t a, uint64_t b, uint64_t *r) { *r = a - b; return a < b; }
static uint8_t umul_over(uint64_t a, uint64_t b, uint64_t *r) { *r = a * b; return a != 0 && *r / a != b; }
static uint8_t smul_over(uint64_t a, uint64_t b, uint64_t *r) {
    const int64_t x = (int64_t)a, y = (int64_t)b;
    *r = a * b;
    if (x == 0 || y == 0) return 0;
    if ((x == -1 && y == INT64_MIN) || (y == -1 && x == INT64_MIN)) return 1;
    return (int64_t)*r / y != x;
}
static uint64_t bit_count(uint64_t v) { uint64_t n = 0; for (; v; v &= v - 1) n++; return n; }
static uint64_t zeros_above(uint64_t v, int bits) { uint64_t n = 0; for (int k = bits - 1; k >= 0 && !(v >> k & 1); k--) n++; return n; }
static uint64_t zeros_below(uint64_t v, int bits) { uint64_t n = 0; for (int k = 0; k < bits && !(v >> k & 1); k++) n++; return n; }
static double least(double a, double b) { return isnan(a) ? b : isnan(b) ? a : a < b ? a : b; }
static double most(double a, double b) { return isnan(a) ? b : isnan(b) ? a : a > b ? a : b; }
/* The class of a number as LLVM counts them: 1 << 0 to 1 << 9. */
static uint32_t class_of(double v) {
    const int negative = signbit(v) != 0;
    switch (fpclassify(v)) {
    case FP_NAN: return (to_bits(v) >> 51 & 1) ? 2 : 1;
    case FP_INFINITE: return negative ? 4 : 512;
    case FP_NORMAL: return negative ? 8 : 256;
    case FP_SUBNORMAL: return negative ? 16 : 128;
    default: return negative ? 32 : 64;
    }
}
static double to_even(double v) { return nearbyint(v); }
