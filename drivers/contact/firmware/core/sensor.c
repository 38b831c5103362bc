/* The sensor: initialisation, timing, and the touch circuit. */

#include <string.h>

#include "drivers/contact/firmware/core/sensor_parts.h"

enum {
  kBitsPerEventAndAck = (CTP_EVENT_SIZE + CTP_ACK_SIZE + 2 * CTP_OVERHEAD) * CTP_BITS_PER_BYTE,
  kBitsPerEvent = (CTP_EVENT_SIZE + CTP_OVERHEAD) * CTP_BITS_PER_BYTE
};

enum { DEFAULT_OPEN_MV = 3500, DEFAULT_CONTACT_MV = 1000 };

/* A single conversion may be a spark; two consecutive ones are not. */
enum { ODD_ENOUGH = 2 };

static uint32_t bit_ticks(uint32_t bits, uint32_t baud) {
  return (bits * (uint32_t)CTP_TICKS_PER_S + baud - 1) / baud;
}

void sensor_init(sensor* s, const sensor_identity* identity, uint32_t now) {
  uint32_t repeat;
  memset(s, 0, sizeof(*s));
  s->identity = *identity;
  /* Three frames and a round trip: allows for an ACK in transit. */
  repeat =
      bit_ticks(3u * kBitsPerEvent + kBitsPerEventAndAck, identity->baud) + identity->pong_lead;
  s->repeat = repeat > CTP_REPEAT_MIN_MS * TICKS_PER_MS ? repeat : CTP_REPEAT_MIN_MS * TICKS_PER_MS;
  link_reader_init(&s->reader);
  s->reader.datagrams = identity->datagrams;
  s->config_crc = CTP_CONFIG_NONE;
  s->pin_high = true;
  /* Default contact level until CONFIG arrives. */
  s->config[CTP_CONFIG_POLARITY] = CTP_CONTACT_IS_LOW;
  ctp_put_u16(s->config + CTP_CONFIG_OPEN_MV, DEFAULT_OPEN_MV);
  ctp_put_u16(s->config + CTP_CONFIG_CONTACT_MV, DEFAULT_CONTACT_MV);
  s->rule.confirm_samples = 5;
  s->rule.period = 100 * TICKS_PER_US;
  s->rule.longest = CTP_CONFIRM_MAX_MS * TICKS_PER_MS;
  s->heartbeat = CTP_KEEPALIVE_MS * TICKS_PER_MS;
  s->next_status = now + CTP_IDLE_STATUS_MS * TICKS_PER_MS;
  s->ident_due = true;
}

bool sensor_near_contact(const sensor* s, uint16_t mv) {
  return s->config[CTP_CONFIG_POLARITY] == CTP_CONTACT_IS_LOW
             ? mv <= ctp_get_u16(s->config + CTP_CONFIG_CONTACT_MV)
             : mv >= ctp_get_u16(s->config + CTP_CONFIG_OPEN_MV);
}

bool sensor_near_open(const sensor* s, uint16_t mv) {
  return s->config[CTP_CONFIG_POLARITY] == CTP_CONTACT_IS_LOW
             ? mv >= ctp_get_u16(s->config + CTP_CONFIG_OPEN_MV)
             : mv <= ctp_get_u16(s->config + CTP_CONFIG_CONTACT_MV);
}

bool sensor_between(const sensor* s, uint16_t mv) {
  return !sensor_near_contact(s, mv) && !sensor_near_open(s, mv);
}

bool sensor_closed(const sensor* s, bool pin_high) {
  return pin_high == (s->config[CTP_CONFIG_POLARITY] == CTP_CONTACT_IS_HIGH);
}

void sensor_disarm(sensor* s) {
  if (s->arm_id != 0) s->used_arm_id = s->arm_id;
  s->arm_id = 0;
}

/* The touch circuit ------------------------------------------------------------------------------
 */

/* The change belongs to the active arming, if any, and ends it. */
static void trip(sensor* s, uint32_t t) {
  s->touch_arm_id = s->arm_id;
  if (s->arm_id == 0) return;
  ctp_put_u16(s->trip + CTP_TRIP_ARM_ID, s->arm_id);
  ctp_put_u32(s->trip + CTP_TRIP_T, t);
  s->trip_due = true;
  sensor_disarm(s);
  s->latched = true;
}

void sensor_level(sensor* s, uint32_t t, bool closed) {
  if (s->test != TEST_NONE) { /* the test's own edge, or evaluated after the test */
    if (closed != s->touch.level) s->test_edge = true;
    s->touch.level = closed;
    return;
  }
  if (!touch_edge(&s->touch, &s->rule, t, closed)) return;
  if (!closed) {
    s->touch_arm_id = s->contact_arm_id;
    return;
  }
  trip(s, t);
}

static void look(sensor* s) {
  const uint32_t t = s->touch.sample;
  const touch_outcome outcome = touch_sample(&s->touch, &s->rule);
  bool level;
  if (outcome == TOUCH_UNDECIDED) return;
  s->status_due = true;
  if (outcome == TOUCH_CONFIRMED) {
    if (s->touch.contact) s->contact_arm_id = s->touch_arm_id;
    sensor_raise(s, s->touch.target ? CTP_CONTACT : CTP_RELEASE, s->touch_arm_id, t);
    return;
  }
  if (s->touch.target && s->touch_arm_id != 0) sensor_raise(s, CTP_REVOKED, s->touch_arm_id, t);
  /* After a dismissed bounce the input may be at the other level: restart. */
  level = s->touch.level;
  s->touch.level = s->touch.contact;
  sensor_level(s, t, level);
}

static void sample_until(sensor* s, uint32_t t) {
  while (s->touch.open && due(s->touch.sample, t)) look(s);
}

void sensor_on_edge(sensor* s, uint32_t t, bool pin_high) {
  sample_until(s, t); /* earlier samples that are due */
  s->last_edge = t;
  s->edge_seen = true;
  s->pin_high = pin_high;
  sensor_level(s, t, sensor_closed(s, pin_high));
}

/* Requires two consecutive conversions that agree. */
static void watch_earth(sensor* s) {
  const bool ok = sensor_between(s, s->mv.earth);
  if (ok == s->earth_was_ok && ok != s->earth_ok) {
    s->earth_ok = ok;
    if (s->greeted) s->status_due = true;
  }
  s->earth_was_ok = ok;
}

/* The edge at the pin is the fastest indication of a touch, but not the only one: through an
 * oxide film (above 430 ohms), or with a broken joint, the voltages change without an edge. */
static void watch_gun(sensor* s, uint32_t t) {
  if (sensor_near_open(s, s->mv.sense) && sensor_near_open(s, s->mv.feed) &&
      sensor_between(s, s->mv.earth)) {
    if (s->odd >= ODD_ENOUGH && s->greeted) s->status_due = true; /* possibly armed again */
    s->odd = 0;
    return;
  }
  if (s->odd == 0) s->odd_since = t;
  if (s->odd < ODD_ENOUGH) ++s->odd;
  if (s->odd < ODD_ENOUGH || s->arm_id == 0 || s->touch.open) return;
  touch_suspect(&s->touch, &s->rule, s->odd_since, t);
  s->voltage_trip = true;
  trip(s, s->odd_since);
}

void sensor_on_voltages(sensor* s, uint32_t t, const sensor_voltages* mv) {
  s->mv.feed = mv->feed;
  s->mv.earth = mv->earth;
  if (s->test != TEST_LIFT) s->mv.sense = mv->sense; /* while lifted it is independent of contact */
  watch_earth(s);
  if (s->test != TEST_NONE) {
    sensor_measure_test(s, mv);
  } else {
    watch_gun(s, t);
  }
}

bool sensor_free(const sensor* s) {
  const bool closing = s->touch.open && s->touch.target;
  if (s->test != TEST_NONE) return s->free_before;
  return !s->touch.level && !s->touch.contact && !closing && s->loop_ok && s->self_test_ok &&
         s->earth_ok && s->odd < ODD_ENOUGH;
}

void sensor_run(sensor* s, uint32_t now) {
  sample_until(s, now);
  if (s->edge_seen && !is_recent(s->last_edge, now, CTP_IDLE_STATUS_MS * TICKS_PER_MS + 1u))
    s->edge_seen = false;
  if (s->test != TEST_NONE) sensor_run_test(s, now);
  sensor_age_test(s, now);
  if (s->identity.has_relay) sensor_run_relay(s, now);
  if (s->arm_id != 0 && (due(s->arm_until, now) || due(s->alive_until, now))) {
    sensor_disarm(s);
    s->status_due = true;
  }
}

void sensor_on_byte(sensor* s, uint8_t byte, uint32_t t) {
  if (link_feed(&s->reader, byte)) sensor_on_frame(s, t);
}

void sensor_log(sensor* s, const char* text) { s->log = text; }

/* The relay in place of plug X1: its state is determined only by its mirror contact. */

static void relay_changed(sensor* s, uint32_t t) {
  s->relay_since = t;
  s->relay_due = true;
}

void sensor_want_relay(sensor* s, uint32_t t, bool on) {
  s->relay_due = true; /* the answer, also without a change */
  if (on == s->relay_wanted) return;
  s->relay_wanted = on;
  if (!on) sensor_disarm(s);
  relay_changed(s, t);
}

void sensor_on_mirror(sensor* s, uint32_t t, bool open) {
  if (open == s->relay_closed) return;
  s->relay_closed = open;
  relay_changed(s, t);
}

void sensor_run_relay(sensor* s, uint32_t now) {
  bool fault = s->relay_wanted != s->relay_closed;
  if (s->relay_wanted && due(s->relay_until, now)) sensor_want_relay(s, now, false);
  if (fault && is_recent(s->relay_since, now, CTP_RELAY_MS * TICKS_PER_MS)) return; /* switching */
  if (fault != s->relay_fault) s->relay_due = true;
  s->relay_fault = fault;
}
