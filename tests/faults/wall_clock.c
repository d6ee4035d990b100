/* A wall clock that jumps, for whoever is started with this library before the others: see test_surroundings.py.
 *
 * The seconds that it is off stand in the file that WALL_CLOCK names, and may change at any time. Other clocks
 * and all sleeps are left alone; libfaketime is no help, since it changes sleeps up to an instant of the
 * monotonic clock, too.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

static const volatile long *off;
static int (*real_gettime)(clockid_t, struct timespec *);

__attribute__((constructor)) static void begin(void)
{
    const char *path = getenv("WALL_CLOCK");
    int file = path ? open(path, O_RDONLY | O_CLOEXEC) : -1;

    real_gettime = dlsym(RTLD_NEXT, "clock_gettime");
    if (file < 0)
        return;
    off = mmap(NULL, sizeof *off, PROT_READ, MAP_SHARED, file, 0);
    if (off == MAP_FAILED)
        off = NULL;
    close(file);
}

int clock_gettime(clockid_t clock, struct timespec *found)
{
    int result = real_gettime(clock, found);

    if (off && !result && (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE))
        found->tv_sec += *off;
    return result;
}

int gettimeofday(struct timeval *restrict found, void *restrict zone)
{
    struct timespec now;
    int result = clock_gettime(CLOCK_REALTIME, &now);

    (void)zone;
    found->tv_sec = now.tv_sec;
    found->tv_usec = now.tv_nsec / 1000;
    return result;
}

time_t time(time_t *found)
{
    struct timespec now;

    clock_gettime(CLOCK_REALTIME, &now);
    if (found)
        *found = now.tv_sec;
    return now.tv_sec;
}
