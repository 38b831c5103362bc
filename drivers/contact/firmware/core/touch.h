/* Debouncing of a level, with time in ticks of 0.5 us. The first edge counts, so that a touch
 * stops the arm immediately; samples afterwards only decide whether it was one. The samples are
 * taken from the history of edges, so that the result does not depend on the program's timing. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
  uint8_t confirm_samples; /* this many equal consecutive samples confirm or dismiss, >= 1 */
  uint32_t period;         /* between two samples, ticks */
  uint32_t longest;        /* neither confirmed nor dismissed after this: noise, ticks */
} touch_rule;

typedef struct {
  bool contact; /* debounced */
  bool level;   /* after the last edge; true: closed */
  /* An edge being confirmed. */
  bool open;       /* true: in progress */
  bool target;     /* the level after it */
  uint32_t first;  /* its time */
  uint32_t sample; /* time of the next sample */
  uint8_t hits, misses, bounces;
} touch_state;

typedef enum { TOUCH_UNDECIDED, TOUCH_CONFIRMED, TOUCH_DISMISSED } touch_outcome;

/* True: this edge is the first one of a change, to be confirmed. An edge to the current level
 * has no effect. */
bool touch_edge(touch_state* touch, const touch_rule* rule, uint32_t t, bool closed);

/* Starts a change to 'closed' without an edge: edges have to confirm it. */
void touch_suspect(touch_state* touch, const touch_rule* rule, uint32_t since, uint32_t now);

/* To be called when touch->open and touch->sample is due, before any later edge: the level at
 * that time counts, regardless of the time of the call. A confirmed change is in touch->contact;
 * first, target and bounces are valid until the next edge. */
touch_outcome touch_sample(touch_state* touch, const touch_rule* rule);

#ifdef __cplusplus
}
#endif
