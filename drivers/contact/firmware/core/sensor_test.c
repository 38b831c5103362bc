/* The self-test: the sensor generates an edge, which it must detect, and tests the loop's
 * current. Sequence:
 *
 *   open:       0 .. 1.5 ms pulled to the contact level. The edge must be detected, the sense
 *               voltage must drop, and the feed must drop with it: this requires both wires. It
 *               drops partially, because the end resistor at the gun is between them. Completely:
 *               the wires are shorted before the gun, which is then not in the circuit.
 *   in contact: 0 .. 0.75 ms released: the touch must hold the feed down (otherwise the feed wire
 *               is broken), then lifted weakly: it must hold the sense line, too (otherwise the
 *               sense wire is broken). There is no edge: 'self-test ok' is unchanged.
 *   both:       released from 1.5 ms on, with the result at 2 ms. A sense line that is open
 *               without having been lifted is fed through both wires: a touch that has ended, not
 *               a break. */

#include "drivers/contact/firmware/core/sensor_parts.h"

/* The board measures both voltages anew within each part, and while the line settles. */
#define PULL_TICKS ((uint32_t)CTP_SELF_TEST_PULL_US * TICKS_PER_US)
#define PART_TICKS (PULL_TICKS / 2)
#define SETTLE_TICKS (CTP_SELF_TEST_MS * TICKS_PER_MS - PULL_TICKS)

sensor_pull sensor_drive(const sensor* s) {
  const bool low = s->config[CTP_CONFIG_POLARITY] == CTP_CONTACT_IS_LOW;
  switch (s->test) {
    case TEST_PULL:
      return low ? SENSOR_PULLED_LOW : SENSOR_PULLED_HIGH;
    case TEST_LIFT: /* the mirrored circuit would need a weak pull-down, which no pin has */
      return low ? SENSOR_LIFTED : SENSOR_RELEASED;
    default:
      return SENSOR_RELEASED;
  }
}

static void enter(sensor* s, sensor_test part, uint32_t end) {
  s->test = part;
  s->test_next = end;
  s->test_measured = false;
}

void sensor_begin_test(sensor* s, uint32_t now) {
  s->test_edge = false;
  s->test_whole = true;
  s->test_drained = s->test_stuck = false;
  s->free_before = sensor_free(s);
  s->status_due = true;
  if (s->touch.contact) {
    enter(s, TEST_LOOK, now + PART_TICKS);
  } else {
    s->self_test_ok = false;
    enter(s, TEST_PULL, now + PULL_TICKS);
  }
}

/* Each part may begin with voltages measured before it; the last ones count. */
void sensor_measure_test(sensor* s, const sensor_voltages* mv) {
  const bool fed = sensor_near_open(s, mv->sense);
  const bool drained = sensor_near_contact(s, mv->feed);
  switch (s->test) {
    case TEST_PULL:
      s->test_measured = sensor_between(s, mv->feed);
      s->test_stuck = !sensor_near_contact(s, mv->sense);
      s->test_drained = drained;
      break;
    case TEST_LOOK:
      s->test_measured = drained || fed;
      break;
    case TEST_LIFT:
      /* Without a touch at this moment this part adds no information to the preceding one. */
      s->test_measured = !drained || sensor_near_contact(s, mv->sense);
      break;
    default:
      s->test_measured = s->touch.contact && fed;
      break;
  }
}

static void finish(sensor* s, uint32_t now) {
  const bool level = s->touch.level;
  /* A touch that began meanwhile drains the feed, too, and persists after the pull. */
  const bool touched = s->test_drained && level;
  s->test = TEST_NONE;
  s->tested_at = now;
  s->ever_tested = true;
  s->self_test_old = false;
  s->loop_ok = s->test_whole || s->test_measured || touched || s->test_stuck;
  s->shorted = s->test_drained && !touched;
  if (!s->touch.contact) s->self_test_ok = s->loop_ok && s->test_edge && !touched && !s->test_stuck;
  if (!s->loop_ok) s->self_test_ok = false;
  s->status_due = true;
  /* Changes meanwhile are treated as an edge at this moment. */
  s->touch.level = s->touch.contact;
  sensor_level(s, now, level);
}

void sensor_run_test(sensor* s, uint32_t now) {
  if (!due(s->test_next, now)) return;
  switch (s->test) {
    case TEST_LOOK:
      s->test_whole = s->test_measured;
      enter(s, TEST_LIFT, s->test_next + PART_TICKS);
      break;
    case TEST_PULL:
    case TEST_LIFT:
      s->test_whole = s->test_whole && s->test_measured;
      enter(s, TEST_SETTLE, s->test_next + SETTLE_TICKS);
      break;
    default:
      finish(s, now);
      break;
  }
}

void sensor_age_test(sensor* s, uint32_t now) {
  /* Recorded here, because the age itself would wrap. */
  if (s->ever_tested && now - s->tested_at > CTP_SELF_TEST_MAX_AGE_S * (uint32_t)CTP_TICKS_PER_S) {
    s->self_test_old = true;
  }
}
