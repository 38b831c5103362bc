/* WIZnet's W5500 as one UDP socket, by its registers over SPI (data sheet 1.1.0). No allocation, no
 * clock: the board selects the chip and exchanges bytes. Nothing waits for the network; a reset and
 * a command wait for the chip, bounded. */
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
  w5500_peer to; /* of what was loaded last */
  bool known;    /* the chip has that peer's hardware address: it answered the last time */
  bool sending;  /* w5500_go(), and the chip has not said how it went */
} w5500;

/* Resets the chip and opens the socket. False: no W5500 answers. */
bool w5500_start(w5500* chip);
/* The socket is as w5500_start() left it. False: the chip has lost it (a spike, a dip): start again. */
bool w5500_alive(const w5500* chip);
/* The oldest datagram's size, 0: none. One that is longer than `room` is thrown away, and its size
 * is told all the same. */
uint16_t w5500_receive(const w5500* chip, w5500_peer* from, uint8_t* into, uint16_t room);
/* Nothing is being sent: w5500_load() may be called. */
bool w5500_free(w5500* chip);
/* Puts a datagram into the chip, in the place of one that was loaded and not sent. */
void w5500_load(w5500* chip, const w5500_peer* to, const uint8_t* bytes, uint8_t size);
/* Sends it. The network is asked for the peer's hardware address once, and again behind a failure. */
void w5500_go(w5500* chip);
/* The peer may have another network card since. */
static inline void w5500_ask_again(w5500* chip) { chip->known = false; }

#ifdef __cplusplus
}
#endif
