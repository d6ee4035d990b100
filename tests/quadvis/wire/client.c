/* A host in C: asks a target for its status, becomes the operator and sets a parameter.
 *
 * usage: client ENDPOINT [SERVER_PUBLIC HOST_PUBLIC HOST_PRIVATE, 64 hexadecimal digits each]
 * The messages are msgpack by hand: maps, short texts, small numbers, doubles. See 'quadvis wire'. */
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <zmq.h>

static unsigned char out[512], in[65536];
static size_t used;

static void byte(unsigned value) { out[used++] = (unsigned char)value; }
static void map(unsigned pairs) { byte(0x80 | pairs); }
static void text(const char *value) {
    byte(0xa0 | (unsigned)strlen(value)); /* up to 31 bytes */
    memcpy(out + used, value, strlen(value));
    used += strlen(value);
}
static void number(double value) {
    uint64_t bits;
    memcpy(&bits, &value, 8);
    byte(0xcb);
    for (int shift = 56; shift >= 0; shift -= 8) byte((unsigned)(bits >> shift) & 0xff);
}
static void begin(unsigned id, const char *verb) { /* the arguments follow */
    used = 0;
    map(4);
    text("v"), byte(1);
    text("id"), byte(id);
    text("cmd"), text(verb);
    text("args");
}
static int key(void *socket, int option, const char *digits) {
    unsigned char raw[32];
    for (int n = 0; n < 32; n++) {
        unsigned value;
        if (sscanf(digits + 2 * n, "%2x", &value) != 1) return -1;
        raw[n] = (unsigned char)value;
    }
    return zmq_setsockopt(socket, option, raw, 32);
}
static int holds(int size, const char *part, size_t length) {
    for (int at = 0; at + (int)length <= size; at++)
        if (!memcmp(in + at, part, length)) return 1;
    return 0;
}
static int asked(void *socket, const char *what) { /* 1 if the reply has "ok": true */
    if (zmq_send(socket, out, used, 0) < 0) return perror(what), 0;
    int size = zmq_recv(socket, in, sizeof in, 0);
    if (size < 0 || size > (int)sizeof in) return perror(what), 0;
    int ok = holds(size, "\xa2ok\xc3", 4);
    printf("%s: %s\n", what, ok ? "ok" : "refused");
    if (holds(size, "\xa6Status\xa7stopped", 15)) printf("the application is stopped\n");
    if (holds(size, "\xa4tick", 5)) printf("at a tick\n");
    return ok;
}

int main(int count, char **words) {
    void *context = zmq_ctx_new(), *socket = zmq_socket(context, ZMQ_DEALER);
    int wait = 20000, linger = 0;
    zmq_setsockopt(socket, ZMQ_RCVTIMEO, &wait, sizeof wait);
    zmq_setsockopt(socket, ZMQ_LINGER, &linger, sizeof linger);
    if (count == 5 && (key(socket, ZMQ_CURVE_SERVERKEY, words[2]) || key(socket, ZMQ_CURVE_PUBLICKEY, words[3]) ||
                       key(socket, ZMQ_CURVE_SECRETKEY, words[4])))
        return perror("keys"), 2;
    if ((count != 2 && count != 5) || zmq_connect(socket, words[1])) return perror("connect"), 2;
    begin(1, "status"), map(0);
    int ok = asked(socket, "status");
    begin(2, "lease"), map(0);
    ok = asked(socket, "lease") && ok;
    begin(3, "setparam"), map(1), text("values"), map(1), text("roll.gain"), number(2.5);
    ok = asked(socket, "setparam") && ok;
    zmq_close(socket);
    zmq_ctx_term(context);
    return ok ? 0 : 1;
}
