#include "drivers/contact/firmware/core/touch.h"

static void begin(touch_state* touch, bool target, uint32_t first, uint32_t sample) {
  touch->open = true;
  touch->target = target;
  touch->first = first;
  touch->sample = sample;
  touch->hits = touch->misses = touch->bounces = 0;
}

bool touch_edge(touch_state* touch, const touch_rule* rule, uint32_t t, bool closed) {
  if (closed == touch->level) return false;
  touch->level = closed;
  if (touch->open) {
    if (closed == touch->target && touch->bounces < UINT8_MAX) ++touch->bounces;
    return false;
  }
  if (closed == touch->contact) return false;
  begin(touch, closed, t, t + rule->period);
  return true;
}

void touch_suspect(touch_state* touch, const touch_rule* rule, uint32_t since, uint32_t now) {
  begin(touch, true, since, now + rule->period);
}

touch_outcome touch_sample(touch_state* touch, const touch_rule* rule) {
  const uint32_t age = touch->sample - touch->first;
  touch->sample += rule->period;
  if (touch->level == touch->target) {
    ++touch->hits;
    touch->misses = 0;
  } else {
    ++touch->misses;
    touch->hits = 0;
  }
  if (touch->hits >= rule->confirm_samples) {
    touch->open = false;
    touch->contact = touch->target;
    return TOUCH_CONFIRMED;
  }
  if (touch->misses >= rule->confirm_samples || age > rule->longest) {
    touch->open = false;
    return TOUCH_DISMISSED;
  }
  return TOUCH_UNDECIDED;
}
