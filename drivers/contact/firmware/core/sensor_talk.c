/* Processing of the host's frames. */

#include <string.h>

#include "drivers/contact/firmware/core/sensor_parts.h"

#define ALIVE_TICKS (CTP_KEEPALIVE_LIMIT_MS * TICKS_PER_MS)

static void on_hello(sensor* s, const uint8_t* p) {
  /* A new conversation: the state of the preceding one is discarded. */
  sensor_disarm(s);
  s->used_arm_id = 0;
  s->latched = false;
  s->voltage_trip = false;
  s->trip_due = false;
  s->event_count = 0;
  s->greeted = p[CTP_HELLO_MIN] <= s->identity.version && s->identity.version <= p[CTP_HELLO_MAX];
  s->ident_due = true;
  s->ident_nonce = ctp_get_u32(p + CTP_HELLO_NONCE);
  if (!s->greeted) sensor_nak_frame(s, CTP_HELLO, CTP_NAK_BAD_VERSION);
}

static bool sensible(const uint8_t* p) {
  const uint8_t samples = p[CTP_CONFIG_CONFIRM_SAMPLES];
  const uint16_t sample_us = ctp_get_u16(p + CTP_CONFIG_SAMPLE_US);
  return p[CTP_CONFIG_POLARITY] <= CTP_CONTACT_IS_HIGH && samples > 0 && sample_us > 0 &&
         /* otherwise nothing would ever be confirmed */
         (uint32_t)samples * sample_us <= CTP_CONFIRM_MAX_MS * (uint32_t)1000 &&
         p[CTP_CONFIG_HEARTBEAT_MS] > 0 &&
         ctp_get_u16(p + CTP_CONFIG_OPEN_MV) > ctp_get_u16(p + CTP_CONFIG_CONTACT_MV);
}

static void on_config(sensor* s, const uint8_t* p, uint32_t t) {
  if (!s->greeted || !sensible(p)) {
    sensor_nak_frame(s, CTP_CONFIG, s->greeted ? CTP_NAK_BAD_ARGUMENT : CTP_NAK_BAD_VERSION);
    return;
  }
  sensor_disarm(s);
  memcpy(s->config, p, CTP_CONFIG_SIZE);
  s->config_crc = ctp_crc16(p, CTP_CONFIG_SIZE);
  s->rule.confirm_samples = p[CTP_CONFIG_CONFIRM_SAMPLES];
  s->rule.period = ctp_get_u16(p + CTP_CONFIG_SAMPLE_US) * TICKS_PER_US;
  s->heartbeat = p[CTP_CONFIG_HEARTBEAT_MS] * TICKS_PER_MS;
  sensor_level(s, t, sensor_closed(s, s->pin_high)); /* the polarity may have changed */
  s->status_due = true;
}

/* Reason for refusing an arming, 0: none. */
static uint8_t objection(const sensor* s, uint16_t arm_id, uint16_t lifetime_ms) {
  const bool contact_voltage = sensor_near_contact(s, s->mv.sense);
  if (!s->greeted) return CTP_NAK_BAD_VERSION;
  if (s->config_crc == CTP_CONFIG_NONE) return CTP_NAK_BAD_ARGUMENT;
  if (arm_id == 0 || lifetime_ms == 0 || arm_id == s->used_arm_id) return CTP_NAK_BAD_ARGUMENT;
  if ((s->ever_tested && !s->loop_ok) || !s->earth_ok) return CTP_NAK_LOOP_BROKEN;
  if (s->test != TEST_NONE) return CTP_NAK_SELF_TEST_OLD;
  if (s->touch.level || s->touch.contact || contact_voltage) return CTP_NAK_IN_CONTACT;
  if (!sensor_near_open(s, s->mv.sense) || !sensor_near_open(s, s->mv.feed)) {
    return CTP_NAK_VOLTAGE_UNDEFINED;
  }
  if (!s->self_test_ok || s->self_test_old) return CTP_NAK_SELF_TEST_OLD;
  return 0;
}

static void on_arm(sensor* s, const uint8_t* p, uint32_t t) {
  const uint16_t arm_id = ctp_get_u16(p + CTP_ARM_ID);
  const uint16_t lifetime_ms = ctp_get_u16(p + CTP_ARM_LIFETIME_MS);
  if (s->arm_id == 0 || arm_id != s->arm_id) { /* otherwise a repeated request: answered again */
    const uint8_t reason = objection(s, arm_id, lifetime_ms);
    if (reason != 0) {
      sensor_nak_frame(s, CTP_ARM, reason);
      return;
    }
    sensor_disarm(s);
    s->arm_id = arm_id;
    s->arm_until = t + lifetime_ms * TICKS_PER_MS;
    s->alive_until = t + ALIVE_TICKS;
    s->latched = false;
    s->voltage_trip = false;
    s->odd = 0;
  }
  s->status_due = true;
}

static void on_ack(sensor* s, const uint8_t* p) {
  const uint16_t event = ctp_get_u16(p + CTP_ACK_EVENT);
  uint8_t i;
  for (i = 0; i < s->event_count; ++i) {
    if (!s->events[i].sent || ctp_get_u16(s->events[i].payload + CTP_EVENT_ID) != event) continue;
    memmove(s->events + i, s->events + i + 1,
            (size_t)(s->event_count - i - 1) * sizeof(sensor_event));
    --s->event_count;
    return;
  }
}

static void on_ping(sensor* s, const uint8_t* p, uint32_t t) {
  if (s->pong_count >= SENSOR_PONGS) return;
  if (s->edge_seen && t + s->identity.ping_guard - s->last_edge < 2ul * s->identity.ping_guard)
    return;
  s->pongs[s->pong_count].nonce = ctp_get_u32(p + CTP_PING_NONCE);
  s->pongs[s->pong_count].t_rx = t;
  ++s->pong_count;
}

void sensor_on_frame(sensor* s, uint32_t t) {
  const uint8_t* p = link_payload(&s->reader);
  s->relay_until = t + CTP_RELAY_SILENCE_MS * TICKS_PER_MS;
  switch (link_type(&s->reader)) {
    case CTP_HELLO:
      on_hello(s, p);
      break;
    case CTP_CONFIG:
      on_config(s, p, t);
      break;
    case CTP_ARM:
      on_arm(s, p, t);
      break;
    case CTP_DISARM:
      if (ctp_get_u16(p + CTP_DISARM_ID) == s->arm_id) sensor_disarm(s);
      s->status_due = true;
      break;
    case CTP_ACK:
      on_ack(s, p);
      break;
    case CTP_PING:
      on_ping(s, p, t);
      break;
    case CTP_SELFTEST:
      if (s->arm_id != 0 || s->test != TEST_NONE || s->touch.open) {
        sensor_nak_frame(s, CTP_SELFTEST, CTP_NAK_BAD_ARGUMENT);
      } else {
        sensor_begin_test(s, t);
      }
      break;
    case CTP_RELAY:
      if (s->identity.has_relay && s->greeted && p[CTP_RELAY_ON] <= 1) {
        sensor_want_relay(s, t, p[CTP_RELAY_ON] == 1);
      } else {
        sensor_nak_frame(s, CTP_RELAY, CTP_NAK_BAD_ARGUMENT);
      }
      break;
    case CTP_KEEPALIVE:
      s->alive_until = t + ALIVE_TICKS;
      break;
    default:
      break;
  }
}
