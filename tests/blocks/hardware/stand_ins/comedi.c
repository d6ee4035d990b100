// Stands in for libcomedi: a card like the PCL-726 with 6 analog outputs, inputs, lines and counters.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef unsigned int count_t;
typedef struct { double min, max; unsigned unit; } range_t;

static range_t ranges[5] = {{0, 5, 0}, {0, 10, 0}, {-5, 5, 0}, {-10, 10, 0}, {4, 20, 1}};
static int card, failing = -1;

static void wrote(const char *what, unsigned channel, count_t value) {
    FILE *log = fopen(getenv("CARD_LOG"), "a");
    fprintf(log, "0 %s %u %u\n", what, channel, value);
    fclose(log);
}

void *comedi_open(const char *path) { return strstr(path, "none") ? 0 : &card; }
int comedi_close(void *d) { return 0; }
int comedi_errno(void) { return 5; }
const char *comedi_strerror(int n) { return "Input/output error"; }
int comedi_find_subdevice_by_type(void *d, int type, unsigned start) { return type == 5 ? -1 : type; }
int comedi_get_n_channels(void *d, unsigned s) { return 6; }
int comedi_get_n_ranges(void *d, unsigned s, unsigned c) { return 5; }
range_t *comedi_get_range(void *d, unsigned s, unsigned c, unsigned r) { return r < 5 ? &ranges[r] : 0; }
count_t comedi_get_maxdata(void *d, unsigned s, unsigned c) { return 4095; }
int comedi_dio_config(void *d, unsigned s, unsigned c, unsigned way) { return -1; }
int comedi_dio_write(void *d, unsigned s, unsigned c, unsigned bit) { wrote("digital", c, bit); return 1; }
int comedi_dio_read(void *d, unsigned s, unsigned c, unsigned *bit) { *bit = c & 1; return 1; }

int comedi_data_write(void *d, unsigned s, unsigned c, unsigned r, unsigned a, count_t value) {
    if (c == 5) return -1;
    wrote("analog", c, value);
    return 1;
}

int comedi_data_read(void *d, unsigned s, unsigned c, unsigned r, unsigned a, count_t *value) {
    *value = 1000 * c + 100 * r;
    return c == 5 ? -1 : 1;
}
