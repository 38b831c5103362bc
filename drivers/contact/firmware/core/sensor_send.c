/* Transmission of the sensor's frames, and their order. */

#include <string.h>

#include "drivers/contact/firmware/core/sensor_parts.h"

void sensor_nak_frame(sensor* s, uint8_t of_type, uint8_t reason) {
  if (s->nak_count >= SENSOR_NAKS) return;
  s->naks[s->nak_count].of_type = of_type;
  s->naks[s->nak_count].reason = reason;
  ++s->nak_count;
}

void sensor_raise(sensor* s, uint8_t type, uint16_t arm_id, uint32_t now) {
  const uint32_t us = (now - s->touch.first) / TICKS_PER_US;
  sensor_event* event;
  uint8_t* p;
  if (s->event_count >= SENSOR_EVENTS) {
    memmove(s->events, s->events + 1, (SENSOR_EVENTS - 1) * sizeof(sensor_event));
    --s->event_count;
    ++s->lost_events;
    sensor_log(s, "an event was never acknowledged and is gone");
  }
  event = &s->events[s->event_count++];
  event->type = type;
  event->sent = false;
  event->due = now;
  p = event->payload;
  ctp_put_u16(p + CTP_EVENT_ID, ++s->last_event);
  ctp_put_u16(p + CTP_EVENT_ARM_ID, arm_id);
  ctp_put_u32(p + CTP_EVENT_T_FIRST, s->touch.first);
  ctp_put_u16(p + CTP_EVENT_DT_CONFIRM_US, us < UINT16_MAX ? (uint16_t)us : UINT16_MAX);
  p[CTP_EVENT_BOUNCES] = s->touch.bounces;
  p[CTP_EVENT_LEVEL] = s->touch.level ? 1 : 0;
  ctp_put_u16(p + CTP_EVENT_SENSE_MV, s->mv.sense);
}

static uint8_t flags(const sensor* s) {
  uint8_t f = 0;
  if (s->touch.contact) f |= CTP_FLAG_CONTACT;
  if (s->arm_id != 0) f |= CTP_FLAG_ARMED;
  if (s->latched) f |= CTP_FLAG_LATCHED;
  if (s->loop_ok && s->earth_ok) f |= CTP_FLAG_LOOP_OK;
  if (s->earth_ok) f |= CTP_FLAG_EARTH_OK;
  if (s->voltage_trip) f |= CTP_FLAG_VOLTAGE_TRIP;
  /* Between the bands the return is intact, in the contact band it is shorted. */
  if (s->earth_ok ? s->shorted : sensor_near_contact(s, s->mv.earth)) f |= CTP_FLAG_SHORTED;
  if (s->self_test_ok) f |= CTP_FLAG_SELF_TEST_OK;
  return f;
}

static uint8_t build(sensor* s, uint8_t type, const uint8_t* payload, uint8_t size, uint8_t* wire) {
  return link_build(type, s->seq++, payload, size, wire);
}

static sensor_event* event_due(sensor* s, uint32_t now) {
  uint8_t i;
  for (i = 0; i < s->event_count; ++i) {
    if (!s->events[i].sent || due(s->events[i].due, now)) return &s->events[i];
  }
  return 0;
}

static uint8_t build_event(sensor* s, sensor_event* event, uint32_t now, uint8_t* wire) {
  if (event->sent) ++s->repeats;
  event->sent = true;
  event->due = now + s->repeat;
  return build(s, event->type, event->payload, CTP_EVENT_SIZE, wire);
}

static uint8_t build_ident(sensor* s, uint8_t* wire) {
  uint8_t p[CTP_IDENT_SIZE];
  p[CTP_IDENT_VERSION] = s->identity.version;
  memcpy(p + CTP_IDENT_FIRMWARE, s->identity.firmware, sizeof(s->identity.firmware));
  ctp_put_u32(p + CTP_IDENT_UID, s->identity.uid);
  ctp_put_u32(p + CTP_IDENT_BOOT_ID, s->identity.boot_id);
  ctp_put_u32(p + CTP_IDENT_CLOCK_HZ, s->identity.clock_hz);
  p[CTP_IDENT_RESET_CAUSE] = s->identity.reset_cause;
  ctp_put_u32(p + CTP_IDENT_NONCE, s->ident_nonce);
  ctp_put_u16(p + CTP_IDENT_CONFIG_CRC, s->config_crc);
  s->ident_due = false;
  s->board_due = s->identity.has_fuses && s->ident_nonce != 0;
  s->relay_due = s->identity.has_relay;
  return build(s, CTP_IDENT, p, CTP_IDENT_SIZE, wire);
}

static uint8_t build_board(sensor* s, uint8_t* wire) {
  uint8_t p[CTP_BOARD_SIZE];
  p[CTP_BOARD_FUSES_LOW] = s->identity.fuses_low;
  p[CTP_BOARD_FUSES_HIGH] = s->identity.fuses_high;
  p[CTP_BOARD_FUSES_EXTENDED] = s->identity.fuses_extended;
  ctp_put_u16(p + CTP_BOARD_LOADER, s->identity.loader);
  s->board_due = false;
  return build(s, CTP_BOARD, p, CTP_BOARD_SIZE, wire);
}

static uint8_t build_relay(sensor* s, uint8_t* wire) {
  const uint8_t relay = (uint8_t)((s->relay_wanted ? CTP_RELAY_WANTED : 0) |
                                  (s->relay_closed ? CTP_RELAY_CLOSED : 0) |
                                  (s->relay_fault ? CTP_RELAY_FAULT : 0));
  s->relay_due = false;
  return build(s, CTP_RELAY_STATE, &relay, CTP_RELAY_STATE_SIZE, wire);
}

static uint8_t build_nak(sensor* s, uint8_t* wire) {
  uint8_t p[CTP_NAK_SIZE];
  p[CTP_NAK_OF_TYPE] = s->naks[0].of_type;
  p[CTP_NAK_REASON] = s->naks[0].reason;
  --s->nak_count;
  memmove(s->naks, s->naks + 1, s->nak_count * sizeof(s->naks[0]));
  return build(s, CTP_NAK, p, CTP_NAK_SIZE, wire);
}

static uint8_t build_pong(sensor* s, uint32_t start, uint8_t* wire) {
  uint8_t p[CTP_PONG_SIZE];
  ctp_put_u32(p + CTP_PONG_NONCE, s->pongs[0].nonce);
  ctp_put_u32(p + CTP_PONG_T_RX, s->pongs[0].t_rx);
  ctp_put_u32(p + CTP_PONG_T_TX, start);
  --s->pong_count;
  memmove(s->pongs, s->pongs + 1, s->pong_count * sizeof(s->pongs[0]));
  return build(s, CTP_PONG, p, CTP_PONG_SIZE, wire);
}

static uint8_t build_status(sensor* s, uint32_t now, uint8_t* wire) {
  uint8_t p[CTP_STATUS_SIZE];
  ctp_put_u32(p + CTP_STATUS_T, now);
  p[CTP_STATUS_FLAGS] = flags(s);
  ctp_put_u16(p + CTP_STATUS_LAST_EVENT, s->last_event);
  p[CTP_STATUS_ERRORS] = (uint8_t)s->reader.damaged;
  ctp_put_u16(p + CTP_STATUS_SENSE_MV, s->mv.sense);
  ctp_put_u16(p + CTP_STATUS_CONFIG_CRC, s->config_crc);
  s->status_due = false;
  s->next_status = now + (s->arm_id != 0 ? s->heartbeat : CTP_IDLE_STATUS_MS * TICKS_PER_MS);
  return build(s, CTP_STATUS, p, CTP_STATUS_SIZE, wire);
}

static uint8_t build_log(sensor* s, uint8_t* wire) {
  const size_t length = strlen(s->log);
  const uint8_t size = (uint8_t)(length < CTP_MAX_PAYLOAD ? length : CTP_MAX_PAYLOAD);
  const uint8_t* text = (const uint8_t*)s->log;
  s->log = 0;
  return build(s, CTP_LOG, text, size, wire);
}

uint8_t sensor_next_frame(sensor* s, uint32_t now, uint8_t* wire, uint32_t* start) {
  sensor_event* event;
  *start = now;
  if (s->trip_due) {
    s->trip_due = false;
    return build(s, CTP_TRIP, s->trip, CTP_TRIP_SIZE, wire);
  }
  event = event_due(s, now);
  if (event != 0) return build_event(s, event, now, wire);
  if (s->ident_due) return build_ident(s, wire);
  if (s->nak_count > 0) return build_nak(s, wire);
  if (s->pong_count > 0) {
    *start = now + s->identity.pong_lead;
    return build_pong(s, *start, wire);
  }
  if (s->status_due || due(s->next_status, now)) return build_status(s, now, wire);
  if (s->relay_due) return build_relay(s, wire);
  if (s->board_due) return build_board(s, wire);
  if (s->log != 0) return build_log(s, wire);
  return 0;
}

/* Next wake-up
   ----------------------------------------------------------------------------------- */

static void sooner(uint32_t* wait, uint32_t deadline, uint32_t now) {
  const uint32_t left = due(deadline, now) ? 0 : deadline - now;
  if (left < *wait) *wait = left;
}

uint32_t sensor_wait(const sensor* s, uint32_t now, bool line_free) {
  uint32_t wait = UINT32_MAX / 2;
  uint8_t i;
  if (s->touch.open) sooner(&wait, s->touch.sample, now);
  if (s->test != TEST_NONE) sooner(&wait, s->test_next, now);
  if (s->arm_id != 0) {
    sooner(&wait, s->arm_until, now);
    sooner(&wait, s->alive_until, now);
  }
  if (s->relay_wanted) sooner(&wait, s->relay_until, now);
  if (s->relay_wanted != s->relay_closed && !s->relay_fault)
    sooner(&wait, s->relay_since + CTP_RELAY_MS * TICKS_PER_MS, now);
  if (!line_free) return wait;
  if (s->trip_due || s->ident_due || s->status_due || s->nak_count > 0 || s->pong_count > 0 ||
      s->board_due || s->relay_due || s->log != 0) {
    return 0;
  }
  for (i = 0; i < s->event_count; ++i)
    sooner(&wait, s->events[i].sent ? s->events[i].due : now, now);
  sooner(&wait, s->next_status, now);
  return wait;
}
