/* CTP/1 frames, sensor side: bytes to verified frames and back. No allocation, no input or
 * output; the host side is ../../wire/ctp_codec, both use ../../wire/ctp.h. */
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#include "drivers/contact/wire/ctp.h"

/* Assembles frames byte by byte. After an error it resynchronises at the next 0x00. */
typedef struct {
  uint8_t bytes[CTP_MAX_WIRE]; /* encoded while receiving, type to payload once complete */
  uint8_t size;
  bool skipping;
  bool heard; /* last_seq is valid */
  /* The line is Ethernet: a frame that is not newer than the preceding one is dropped. HELLO
   * restarts the count. */
  bool datagrams;
  uint8_t last_seq;
  /* Counters. `damaged`: wrong CRC, not COBS, too short, too long, of the wrong size. */
  uint16_t frames, damaged, gaps, unknown_types, overtaken;
} link_reader;

void link_reader_init(link_reader* reader);
/* Discards a partial frame at the start of a new datagram. */
static inline void link_reader_begin(link_reader* reader) {
  reader->size = 0;
  reader->skipping = false;
}

/* True: this byte completed a frame of this direction. Type and payload are valid until the next
 * byte; the payload has the size of its type. */
bool link_feed(link_reader* reader, uint8_t byte);

static inline uint8_t link_type(const link_reader* reader) { return reader->bytes[0]; }
static inline const uint8_t* link_payload(const link_reader* reader) {
  return reader->bytes + CTP_HEADER;
}

/* Writes a frame with its delimiter and returns its size. The payload, of at most
 * CTP_MAX_PAYLOAD bytes, must not overlap `wire`, which holds CTP_MAX_WIRE. */
uint8_t link_build(uint8_t type, uint8_t seq, const uint8_t* payload, uint8_t size, uint8_t* wire);

#ifdef __cplusplus
}
#endif
