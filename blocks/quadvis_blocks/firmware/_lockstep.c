/* Lets the clock of Betaflight's software in the loop go with the steps of a simulation. Preloaded (LD_PRELOAD).
 *
 * The firmware's loop reads CLOCK_MONOTONIC and sleeps in between. Until the first state of a craft comes, both are
 * the system's. From then on each state lets the loop's clock go on by one step, and when that is used up the loop
 * stands still until the next state, after it has sent one byte to say so. Its sleeps take no time but that of
 * its clock. Other threads are left alone, but they see that clock.
 *
 * QUADVIS_STEP: length of a step (ns); QUADVIS_PORT: port of this machine to which the byte goes;
 * QUADVIS_STATE: bytes of a state. */
#define _GNU_SOURCE
#include <arpa/inet.h>
#include <dlfcn.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/select.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#define SECOND 1000000000LL
#define LOOK 100 /* ns that the loop's clock goes on by each look at it, so that waiting for it ends */

static int (*system_clock)(clockid_t, struct timespec *);
static int (*system_sleep)(const struct timespec *, struct timespec *);
static int (*system_select)(int, fd_set *, fd_set *, fd_set *, struct timeval *);
static ssize_t (*system_receive)(int, void *, size_t, int, struct sockaddr *, socklen_t *);

static pthread_t loop;
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static pthread_cond_t more = PTHREAD_COND_INITIALIZER;
static atomic_llong now, allowed; /* ns: the loop's clock, and how far it may go; 0 before the first state */
static long long step;
static size_t state_size;
static int done = -1;
static struct sockaddr_in reader;
static __thread int has_state; /* the thread that takes states has one that it has not put in place yet */

static long long number(const char *name) {
    const char *text = getenv(name);
    return text != NULL ? atoll(text) : 0;
}

__attribute__((constructor)) static void begin(void) {
    system_clock = (int (*)(clockid_t, struct timespec *))dlsym(RTLD_NEXT, "clock_gettime");
    system_sleep = (int (*)(const struct timespec *, struct timespec *))dlsym(RTLD_NEXT, "nanosleep");
    system_select =
        (int (*)(int, fd_set *, fd_set *, fd_set *, struct timeval *))dlsym(RTLD_NEXT, "select");
    system_receive = (ssize_t (*)(int, void *, size_t, int, struct sockaddr *, socklen_t *))dlsym(
        RTLD_NEXT, "recvfrom");
    loop = pthread_self();
    step = number("QUADVIS_STEP");
    state_size = (size_t)number("QUADVIS_STATE");
    reader.sin_family = AF_INET;
    reader.sin_port = htons((uint16_t)number("QUADVIS_PORT"));
    reader.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    done = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
}

/* Let the clock of the loop go on, which is the calling thread; stand still where it may not. */
static void go_on(long long ns) {
    long long time = atomic_fetch_add(&now, ns) + ns;
    if (time <= atomic_load(&allowed)) return;
    sendto(done, "", 1, 0, (struct sockaddr *)&reader, sizeof reader);
    pthread_mutex_lock(&lock);
    while (time > atomic_load(&allowed)) pthread_cond_wait(&more, &lock);
    pthread_mutex_unlock(&lock);
}

/* A state is in place: let the loop go on by a step. */
static void allow(void) {
    pthread_mutex_lock(&lock);
    if (atomic_load(&allowed) == 0) {
        struct timespec t;
        system_clock(CLOCK_MONOTONIC, &t);
        atomic_store(&now, t.tv_sec * SECOND + t.tv_nsec);
        atomic_store(&allowed, t.tv_sec * SECOND + t.tv_nsec);
    }
    atomic_fetch_add(&allowed, step);
    pthread_cond_signal(&more);
    pthread_mutex_unlock(&lock);
}

int clock_gettime(clockid_t clock, struct timespec *t) {
    if (clock != CLOCK_MONOTONIC || atomic_load(&allowed) == 0) return system_clock(clock, t);
    if (pthread_equal(pthread_self(), loop)) go_on(LOOK);
    long long time = atomic_load(&now);
    t->tv_sec = time / SECOND;
    t->tv_nsec = time % SECOND;
    return 0;
}

int nanosleep(const struct timespec *wanted, struct timespec *rest) {
    if (atomic_load(&allowed) == 0 || !pthread_equal(pthread_self(), loop)) return system_sleep(wanted, rest);
    go_on(wanted->tv_sec * SECOND + wanted->tv_nsec);
    return 0;
}

ssize_t recvfrom(int socket, void *to, size_t size, int flags, struct sockaddr *from, socklen_t *length) {
    ssize_t count = system_receive(socket, to, size, flags, from, length);
    if (count == (ssize_t)state_size) has_state = 1;
    return count;
}

int select(int count, fd_set *readers, fd_set *writers, fd_set *others, struct timeval *patience) {
    if (has_state) {
        has_state = 0;
        allow();
    }
    return system_select(count, readers, writers, others, patience);
}
