/* Debouncing, with a level and a time in ticks of 0.5 us. The first edge counts: whoever stops for
 * a touch does so at once; only whether it was one is found out by samples afterwards. The samples
 * are of the edges' history, so that a program that is busy elsewhere decides just the same. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
  uint8_t confirm_samples; /* as many equal levels in a row confirm or dismiss, >= 1 */
  uint32_t period;         /* between two samples, ticks */
  uint32_t longest;        /* neither confirmed nor dismissed by then: noise, ticks */
} touch_rule;

typedef struct {
  bool contact; /* debounced */
  bool level;   /* after the last edge; true: closed */
  /* An edge that is being confirmed. */
  bool open;       /* there is one */
  bool target;     /* the level it went to */
  uint32_t first;  /* when */
  uint32_t sample; /* when to look next */
  uint8_t hits, misses, bounces;
} touch_state;

typedef enum { TOUCH_UNDECIDED, TOUCH_CONFIRMED, TOUCH_DISMISSED } touch_outcome;

/* True: this edge is the first one of a change, to be confirmed. An edge to the level that already
 * is does nothing. */
bool touch_edge(touch_state* touch, const touch_rule* rule, uint32_t t, bool closed);

/* Begins a change to 'closed' for another reason than an edge: edges have to confirm it. */
void touch_suspect(touch_state* touch, const touch_rule* rule, uint32_t since, uint32_t now);

/* Call when touch->open and touch->sample has come, before any edge after it: what counts is the
 * level at that time, however late the call is. A confirmed change is in touch->contact; first,
 * target and bounces hold until the next edge. */
touch_outcome touch_sample(touch_state* touch, const touch_rule* rule);

#ifdef __cplusplus
}
#endif
