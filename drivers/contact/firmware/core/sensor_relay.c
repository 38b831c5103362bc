/* The relay in place of plug X1: its state is determined only by its mirror contact. */

#include "drivers/contact/firmware/core/sensor_parts.h"

static void changed(sensor* s, uint32_t t) {
  s->relay_since = t;
  s->relay_due = true;
}

void sensor_want_relay(sensor* s, uint32_t t, bool on) {
  s->relay_due = true; /* the answer, also without a change */
  if (on == s->relay_wanted) return;
  s->relay_wanted = on;
  if (!on) sensor_disarm(s);
  changed(s, t);
}

void sensor_on_mirror(sensor* s, uint32_t t, bool open) {
  if (open == s->relay_closed) return;
  s->relay_closed = open;
  changed(s, t);
}

void sensor_run_relay(sensor* s, uint32_t now) {
  bool fault = s->relay_wanted != s->relay_closed;
  if (s->relay_wanted && due(s->relay_until, now)) sensor_want_relay(s, now, false);
  if (fault && now - s->relay_since < CTP_RELAY_MS * TICKS_PER_MS) return; /* switching time */
  if (fault != s->relay_fault) s->relay_due = true;
  s->relay_fault = fault;
}
