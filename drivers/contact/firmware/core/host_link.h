/* Selection of one host over datagrams: which host is accepted, and the destination of answers.
 *
 * A datagram contains whole frames. The first host that sends HELLO is accepted until it has
 * been silent for HOST_SILENCE_MS; datagrams of others are counted and ignored. Nothing is sent
 * to an address that has not sent HELLO. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#include "drivers/contact/firmware/core/sensor.h"

enum {
  HOST_SILENCE_MS = 1000, /* above any pause of a host that is ready or waits for an answer */
  HOST_MAX_DATAGRAM = 256
};

typedef struct {
  uint32_t address; /* IPv4 and port in the board's byte order: only compared */
  uint16_t port;
} host_address;

typedef struct {
  sensor* s;
  bool there;
  host_address host;
  uint32_t heard_at;
  uint16_t foreign;  /* datagrams of other hosts */
  uint16_t unfit;    /* empty or too long */
  uint8_t greetings; /* of hosts, modulo 256: a change may mean another route */
} host_link;

void host_link_init(host_link* link, sensor* s);
/* Processes a datagram that arrived at `t`. */
void host_link_take(host_link* link, const host_address* from, const uint8_t* bytes, uint16_t size,
                    uint32_t t);
/* To be called at least every 15 minutes: releases a silent host. */
void host_link_run(host_link* link, uint32_t now);

#ifdef __cplusplus
}
#endif
