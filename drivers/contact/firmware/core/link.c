#include "drivers/contact/firmware/core/link.h"

#include <string.h>

enum { kFromSensorBit = 0x80 };

void link_reader_init(link_reader* reader) { memset(reader, 0, sizeof(*reader)); }

/* Decodes COBS in place: reading is always ahead of writing. Returns the size, 0: not COBS. */
static uint8_t unstuff(uint8_t* bytes, uint8_t size) {
  uint8_t out = 0;
  uint8_t at = 0;
  while (at < size) {
    const uint8_t code = bytes[at++];
    uint8_t k;
    if ((uint16_t)at + code > (uint16_t)size + 1u) return 0;
    for (k = 1; k < code; ++k) bytes[out++] = bytes[at++];
    if (at < size) bytes[out++] = 0;
  }
  return out;
}

static bool in_order(link_reader* reader, uint8_t type, uint8_t seq) {
  const uint8_t ahead = (uint8_t)(seq - reader->last_seq);
  const uint8_t behind = (uint8_t)(reader->last_seq - seq);
  const uint8_t longest_overtaken = 64;
  if (reader->heard && !(reader->datagrams && type == CTP_HELLO)) {
    if (reader->datagrams && behind < longest_overtaken) {
      ++reader->overtaken;
      return false;
    }
    reader->gaps = (uint16_t)(reader->gaps + (uint8_t)(ahead - 1));
  }
  reader->heard = true;
  reader->last_seq = seq;
  return true;
}

static bool finish(link_reader* reader) {
  uint8_t* raw = reader->bytes;
  const uint8_t size = unstuff(raw, reader->size);
  uint8_t body;
  int expected;
  if (size < CTP_HEADER + CTP_CRC) {
    ++reader->damaged;
    return false;
  }
  body = (uint8_t)(size - CTP_CRC);
  if (ctp_crc16(raw, body) != ctp_get_u16(raw + body)) {
    ++reader->damaged;
    return false;
  }
  /* The CRC is valid, so that the sequence number counts in any case. */
  if (!in_order(reader, raw[0], raw[1])) return false;
  expected = ctp_payload_size(raw[0]);
  if (expected < 0 || (raw[0] & kFromSensorBit) != 0) {
    ++reader->unknown_types;
    return false;
  }
  if (body - CTP_HEADER != expected) {
    ++reader->damaged;
    return false;
  }
  ++reader->frames;
  return true;
}

bool link_feed(link_reader* reader, uint8_t byte) {
  if (byte == 0) {
    const bool there = reader->size > 0 && !reader->skipping && finish(reader);
    reader->size = 0;
    reader->skipping = false;
    return there;
  }
  if (reader->skipping) return false;
  /* The delimiter is not stored, so the longest frame leaves one byte free. */
  if (reader->size + 1 >= CTP_MAX_WIRE) {
    ++reader->damaged;
    reader->skipping = true;
    return false;
  }
  reader->bytes[reader->size++] = byte;
  return false;
}

/* State of the COBS encoder. */
typedef struct {
  uint8_t* wire;
  uint8_t size, code_at;
  uint16_t crc;
} stuffer;

static inline void stuff(stuffer* s, uint8_t byte) {
  if (byte == 0) {
    s->wire[s->code_at] = (uint8_t)(s->size - s->code_at);
    s->code_at = s->size++;
  } else {
    s->wire[s->size++] = byte;
  }
}

static inline void stuff_checked(stuffer* s, uint8_t byte) {
  s->crc = ctp_crc16_step(s->crc, byte);
  stuff(s, byte);
}

uint8_t link_build(uint8_t type, uint8_t seq, const uint8_t* payload, uint8_t size, uint8_t* wire) {
  stuffer s;
  uint8_t i;
  s.wire = wire;
  s.code_at = 0;
  s.size = 1;
  s.crc = CTP_CRC_START;
  stuff_checked(&s, type);
  stuff_checked(&s, seq);
  for (i = 0; i < size; ++i) stuff_checked(&s, payload[i]);
  {
    const uint16_t crc = s.crc;
    stuff(&s, (uint8_t)(crc & 0xFFu));
    stuff(&s, (uint8_t)(crc >> 8));
  }
  wire[s.code_at] = (uint8_t)(s.size - s.code_at);
  wire[s.size++] = 0;
  return s.size;
}
