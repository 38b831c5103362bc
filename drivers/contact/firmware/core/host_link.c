#include "drivers/contact/firmware/core/host_link.h"

#include <string.h>

#include "drivers/contact/firmware/core/sensor_parts.h"

void host_link_init(host_link* link, sensor* s) {
  memset(link, 0, sizeof(*link));
  link->s = s;
}

/* True if the first frame of the datagram is a HELLO; does not affect the conversation. */
static bool greets(const uint8_t* bytes, uint16_t size) {
  link_reader reader;
  uint16_t i;
  link_reader_init(&reader);
  for (i = 0; i < size; ++i) {
    if (link_feed(&reader, bytes[i])) return link_type(&reader) == CTP_HELLO;
  }
  return false;
}

static bool is_host(const host_link* link, const host_address* from) {
  return link->there && link->host.address == from->address && link->host.port == from->port;
}

void host_link_take(host_link* link, const host_address* from, const uint8_t* bytes, uint16_t size,
                    uint32_t t) {
  uint16_t i, sound;
  if (size == 0 || size > HOST_MAX_DATAGRAM) {
    ++link->unfit;
    return;
  }
  host_link_run(link, t);
  if (!is_host(link, from)) {
    if (link->there || !greets(bytes, size)) {
      ++link->foreign;
      return;
    }
    link->there = true;
    link->host = *from;
    link->heard_at = t;
  }
  if (greets(bytes, size)) ++link->greetings;
  sound = link->s->reader.frames;
  link_reader_begin(&link->s->reader);
  for (i = 0; i < size; ++i) sensor_on_byte(link->s, bytes[i], t);
  if (bytes[size - 1] != 0) sensor_on_byte(link->s, 0, t); /* truncated: ends with its datagram */
  if (link->s->reader.frames != sound) link->heard_at = t;
}

void host_link_run(host_link* link, uint32_t now) {
  if (link->there && !is_recent(link->heard_at, now, HOST_SILENCE_MS * TICKS_PER_MS + 1u))
    link->there = false;
}
