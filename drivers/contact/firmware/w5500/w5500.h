/* WIZnet's W5500 as one UDP socket, by its registers over SPI (data sheet 1.1.0). No allocation,
 * no clock: the board selects the chip and exchanges bytes. Nothing waits for the network; a
 * reset and a command wait for the chip, bounded. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
  void (*select)(void* context, bool on);
  uint8_t (*exchange)(void* context, uint8_t out);
  void* context;
} w5500_bus;

typedef struct {
  uint8_t address[4], mask[4], mac[6];
  uint16_t port;
} w5500_own;

typedef struct {
  uint8_t address[4];
  uint16_t port;
} w5500_peer;

typedef struct {
  w5500_bus bus;
  w5500_own own;
  w5500_peer to; /* of the last datagram loaded */
  bool known;    /* the chip has that peer's hardware address: its last ARP was answered */
  bool sending;  /* w5500_go() was called, without a result from the chip yet */
} w5500;

/* Resets the chip and opens the socket. False: no W5500 answers. */
bool w5500_start(w5500* chip);
/* True if the socket is as w5500_start() left it. False: the chip lost it (a spike, a dip) and
   must be restarted. */
bool w5500_alive(const w5500* chip);
/* Size of the oldest datagram, 0: none. One longer than `room` is discarded, but its size is
 * returned. */
uint16_t w5500_receive(const w5500* chip, w5500_peer* from, uint8_t* into, uint16_t room);
/* True if nothing is being sent: w5500_load() may be called. */
bool w5500_free(w5500* chip);
/* Loads a datagram into the chip, replacing one that was loaded and not sent. */
void w5500_load(w5500* chip, const w5500_peer* to, const uint8_t* bytes, uint8_t size);
/* Sends it. The peer's hardware address is requested once, and again after a failure. */
void w5500_go(w5500* chip);
/* The peer's network card may have changed. */
static inline void w5500_retry(w5500* chip) { chip->known = false; }

#ifdef __cplusplus
}
#endif
