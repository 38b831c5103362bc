/* Internal interface between the parts of the sensor. */
#pragma once

#include "drivers/contact/firmware/core/sensor.h"

/* Not enumerators: an int has 16 bits on an AVR. */
#define TICKS_PER_US ((uint32_t)CTP_TICKS_PER_US)
#define TICKS_PER_MS ((uint32_t)(1000 * CTP_TICKS_PER_US))

/* True if `deadline` has passed. */
/* A stamp may be later than the time that the board's loop took before: that is no age of half an hour. */
static inline bool is_recent(uint32_t t, uint32_t now, uint32_t ticks) {
  return now - t < ticks || t - now < ticks;
}
static inline bool due(uint32_t deadline, uint32_t now) { return (int32_t)(deadline - now) <= 0; }

void sensor_disarm(sensor* s);
void sensor_nak_frame(sensor* s, uint8_t of_type, uint8_t reason);
/* Queues CONTACT, REVOKED or RELEASE for the change in s->touch. */
void sensor_raise(sensor* s, uint8_t type, uint16_t arm_id, uint32_t now);

/* True in the contact band, for either polarity. */
bool sensor_near_contact(const sensor* s, uint16_t mv);
bool sensor_near_open(const sensor* s, uint16_t mv);
/* True between the bands: through an end resistor. */
bool sensor_between(const sensor* s, uint16_t mv);
/* State of the pin under the configured polarity. */
bool sensor_closed(const sensor* s, bool pin_high);
/* An edge, or a level that is treated as one. */
void sensor_level(sensor* s, uint32_t t, bool closed);

void sensor_begin_test(sensor* s, uint32_t now);
void sensor_run_test(sensor* s, uint32_t now);
void sensor_measure_test(sensor* s, const sensor_voltages* mv);
void sensor_age_test(sensor* s, uint32_t now);

void sensor_want_relay(sensor* s, uint32_t t, bool on);
void sensor_run_relay(sensor* s, uint32_t now);

void sensor_on_frame(sensor* s, uint32_t t);
