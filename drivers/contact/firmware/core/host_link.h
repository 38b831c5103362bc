/* One host at a time over datagrams: which of them are heard, and where answers go.
 *
 * A datagram holds whole frames. The first host that says HELLO is the host, and stays it until it
 * has been silent for HOST_SILENCE_MS; what others say is counted and not heard. Nothing is sent to
 * an address that has not said HELLO. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#include "drivers/contact/firmware/core/sensor.h"

enum {
  HOST_SILENCE_MS = 1000, /* above any pause of a host that is ready or asks for an answer */
  HOST_MAX_DATAGRAM = 256
};

typedef struct {
  uint32_t address; /* IPv4 and port in whatever order the board has them: they are compared */
  uint16_t port;
} host_address;

typedef struct {
  sensor* s;
  bool there;
  host_address host;
  uint32_t heard_at;
  uint16_t foreign;  /* datagrams of others */
  uint16_t unfit;    /* empty or too long */
  uint8_t greetings; /* of hosts, modulo 256: another one, and the way to it may be another */
} host_link;

void host_link_init(host_link* link, sensor* s);
/* A datagram that arrived at `t`. */
void host_link_take(host_link* link, const host_address* from, const uint8_t* bytes, uint16_t size,
                    uint32_t t);
/* Call at least every 15 minutes: forgets a host that is silent. */
void host_link_run(host_link* link, uint32_t now);

#ifdef __cplusplus
}
#endif
