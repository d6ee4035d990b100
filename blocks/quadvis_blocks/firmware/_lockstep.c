/* Lets the clock of Betaflight's software in the loop go with the steps of a simulation. Preloaded (LD_PRELOAD).
 *
 * The firmware's loop reads CLOCK_MONOTONIC and sleeps in between. Here that clock goes on by the loop's sleeps alone,
 * so the loop is never late; once it is, its scheduler may never run the gyro again. From the first state of a craft
 * on the sleeps take no time, and each state lets the clock go on by one step. When that is used up the loop stands
 * still until the next state, after it has sent one byte to say so.
 *
 * The threads take turns: one runs until it sleeps or waits for a socket. On a flight controller there is one
 * thread; here loop and sockets share buffers without a lock, and answers were lost and ports not opened.
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

#define SECOND 1000000000LL
#define LOOK 100 /* ns that the loop's clock goes on by each look at it, so that waiting for it ends */

static int (*system_clock)(clockid_t, struct timespec *);
static int (*system_sleep)(const struct timespec *, struct timespec *);
static int (*system_select)(int, fd_set *, fd_set *, fd_set *, struct timeval *);
static int (*system_join)(pthread_t, void **);
static ssize_t (*system_receive)(int, void *, size_t, int, struct sockaddr *, socklen_t *);

static pthread_t loop;
static pthread_key_t end; /* of a thread, which gives its turn */
static pthread_mutex_t turn = PTHREAD_MUTEX_INITIALIZER, lock = PTHREAD_MUTEX_INITIALIZER;
static pthread_cond_t more = PTHREAD_COND_INITIALIZER;
static atomic_llong now, allowed; /* ns: the loop's clock, and how far it may go, before the first state: 0 */
static long long step;
static size_t state_size;
static int done = -1;
static struct sockaddr_in reader;
static __thread int has_turn, has_state; /* a state that has come and is not in place yet */

static void take_turn(void) {
    if (!has_turn) pthread_mutex_lock(&turn);
    has_turn = 1;
    pthread_setspecific(end, &turn);
}

static void give_turn(void) {
    if (has_turn) pthread_mutex_unlock(&turn);
    has_turn = 0;
}

static void ended(void *unused) {
    (void)unused;
    give_turn();
}

static long long number(const char *name) {
    const char *text = getenv(name);
    return text != NULL ? atoll(text) : 0;
}

__attribute__((constructor)) static void begin(void) {
    *(void **)&system_clock = dlsym(RTLD_NEXT, "clock_gettime");
    *(void **)&system_sleep = dlsym(RTLD_NEXT, "nanosleep");
    *(void **)&system_select = dlsym(RTLD_NEXT, "select");
    *(void **)&system_join = dlsym(RTLD_NEXT, "pthread_join");
    *(void **)&system_receive = dlsym(RTLD_NEXT, "recvfrom");
    pthread_key_create(&end, ended);
    loop = pthread_self();
    step = number("QUADVIS_STEP");
    state_size = (size_t)number("QUADVIS_STATE");
    reader.sin_family = AF_INET;
    reader.sin_port = htons((uint16_t)number("QUADVIS_PORT"));
    reader.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    done = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    struct timespec t;
    system_clock(CLOCK_MONOTONIC, &t);
    atomic_store(&now, t.tv_sec * SECOND + t.tv_nsec);
    take_turn();
}

/* Let the clock of the loop go on, which is the calling thread; stand still where it may not. */
static void go_on(long long ns) {
    long long time = atomic_fetch_add(&now, ns) + ns, most = atomic_load(&allowed);
    if (most == 0 || time <= most) return;
    give_turn();
    pthread_mutex_lock(&lock);
    while (time > atomic_load(&allowed)) {
        long long used = atomic_load(&allowed);
        sendto(done, "", 1, 0, (struct sockaddr *)&reader, sizeof reader);
        while (atomic_load(&allowed) == used) pthread_cond_wait(&more, &lock);
    }
    pthread_mutex_unlock(&lock);
    take_turn();
}

/* A state is in place: let the loop go on by a step. */
static void allow(void) {
    pthread_mutex_lock(&lock);
    long long before = atomic_load(&allowed);
    atomic_store(&allowed, step + (before != 0 ? before : atomic_load(&now)));
    pthread_cond_signal(&more);
    pthread_mutex_unlock(&lock);
}

int clock_gettime(clockid_t clock, struct timespec *t) {
    if (clock != CLOCK_MONOTONIC) return system_clock(clock, t);
    if (pthread_equal(pthread_self(), loop)) go_on(LOOK);
    long long time = atomic_load(&now);
    t->tv_sec = time / SECOND;
    t->tv_nsec = time % SECOND;
    return 0;
}

int nanosleep(const struct timespec *wanted, struct timespec *rest) {
    int is_loop = pthread_equal(pthread_self(), loop), result = 0;
    if (!is_loop || atomic_load(&allowed) == 0) {
        give_turn();
        result = system_sleep(wanted, rest);
        take_turn();
    }
    if (is_loop) go_on(wanted->tv_sec * SECOND + wanted->tv_nsec);
    return result;
}

int select(int count, fd_set *readers, fd_set *writers, fd_set *others, struct timeval *patience) {
    if (has_state) {
        has_state = 0;
        allow();
    }
    give_turn();
    int result = system_select(count, readers, writers, others, patience);
    take_turn();
    return result;
}

int pthread_join(pthread_t thread, void **result) {
    give_turn();
    int code = system_join(thread, result);
    take_turn();
    return code;
}

ssize_t recvfrom(int socket, void *to, size_t size, int flags, struct sockaddr *from, socklen_t *length) {
    ssize_t count = system_receive(socket, to, size, flags, from, length);
    if (count == (ssize_t)state_size) has_state = 1;
    return count;
}
