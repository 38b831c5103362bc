/* Timer 1 counts ticks of 0.5 us and captures its count at every edge of the sense line in
 * hardware: the stamp does not depend on the program's timing. Its noise canceller requires four
 * equal samples of the pin, 0.25 us, and delays the stamp by that. */

#include <avr/interrupt.h>
#include <avr/sleep.h>
#include <util/atomic.h>
#include <util/delay.h>

#include "board.h"

enum { EDGES = 32, EDGES_MASK = EDGES - 1, CHASES = 3 };
#define HALF_TURN 0x8000u
#define CANCELLER_US 0.5

typedef struct {
  uint32_t t;
  bool pin_high;
} edge;

static volatile uint16_t turns; /* overflows of the 16-bit counter */
static edge edges[EDGES];
static volatile uint8_t edges_in, edges_out;
static volatile bool last_high; /* the level after the last edge */
static volatile bool output_by_edge;

void clock_start(void) {
  last_high = true;
  TCCR1A = 0;
  TCNT1 = 0;
  TIFR1 = (1 << ICF1) | (1 << TOV1) | (1 << OCF1A);
  TIMSK1 = (1 << ICIE1) | (1 << TOIE1);
  TCCR1B = (1 << ICNC1) | (1 << CS11); /* falling edge, clock / 8 */
}

ISR(TIMER1_OVF_vect) { ++turns; }

/* Extends a count by a possibly pending overflow. The counter overflows every 32 ms. */
static uint32_t extend(uint16_t count) {
  uint16_t high = turns;
  if ((TIFR1 & (1 << TOV1)) != 0 && count < HALF_TURN) ++high;
  return ((uint32_t)high << 16) | count;
}

uint32_t clock_now_in_interrupt(void) { return extend(TCNT1); }

uint32_t clock_now(void) {
  uint32_t now;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { now = extend(TCNT1); }
  return now;
}

/* False: no room. Interrupts are off. */
static bool note(uint32_t t, bool high) {
  const uint8_t next = (uint8_t)((edges_in + 1) & EDGES_MASK);
  if (next == edges_out) return false;
  edges[edges_in].t = t;
  edges[edges_in].pin_high = high;
  edges_in = next;
  last_high = high;
  wake_up();
  return true;
}

/* Arms the capture for the edge away from this level. */
static void wait_for_other(bool high) {
  if (high) {
    TCCR1B &= (uint8_t) ~(1 << ICES1);
  } else {
    TCCR1B |= (1 << ICES1);
  }
  TIFR1 = (1 << ICF1); /* changing the edge may have set it */
}

ISR(TIMER1_CAPT_vect) {
  bool high = (TCCR1B & (1 << ICES1)) != 0;
  uint32_t t = extend(ICR1);
  uint8_t tries = CHASES;
  if (output_by_edge && !high) PORTD &= (uint8_t) ~(1 << OUTPUT_BIT);
  do {
    if (!note(t, high)) {
      /* A line that chatters faster than the main loop can process must not block the main loop. */
      TIMSK1 &= (uint8_t) ~(1 << ICIE1);
      return;
    }
    wait_for_other(high);
    if (sense_pin() == high) return;
    high = !high; /* it has already returned, unnoticed */
    t = clock_now_in_interrupt();
  } while (--tries != 0);
}

bool clock_has_edge(void) { return edges_in != edges_out; }

bool clock_take_edge(uint32_t* t, bool* pin_high) {
  const uint8_t out = edges_out;
  if (out == edges_in) return false;
  *t = edges[out].t;
  *pin_high = edges[out].pin_high;
  edges_out = (uint8_t)((out + 1) & EDGES_MASK);
  return true;
}

void clock_watch_pin(void) {
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    const bool stopped = (TIMSK1 & (1 << ICIE1)) == 0;
    if (stopped || sense_pin() != last_high) {
      bool high;
      _delay_us(CANCELLER_US); /* which lags slightly behind the pin */
      high = sense_pin();
      if (stopped || (high != last_high && (TIFR1 & (1 << ICF1)) == 0)) {
        if (high != last_high) note(clock_now_in_interrupt(), high);
        wait_for_other(high);
        TIMSK1 |= (1 << ICIE1);
      }
    }
  }
}

void clock_output(bool free, bool by_edge) {
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    const bool edge_pending = edges_in != edges_out || (TIFR1 & (1 << ICF1)) != 0;
    output_by_edge = by_edge;
    if (!free) {
      PORTD &= (uint8_t) ~(1 << OUTPUT_BIT);
    } else if (!edge_pending || !by_edge) {
      PORTD |= (1 << OUTPUT_BIT);
    }
  }
}

ISR(TIMER1_COMPA_vect) { wake_up(); }

void clock_sleep(uint16_t ticks) {
  set_sleep_mode(SLEEP_MODE_IDLE);
  cli();
  OCR1A = (uint16_t)(TCNT1 + ticks);
  TIFR1 = (1 << OCF1A);
  TIMSK1 |= (1 << OCIE1A);
  while (GPIOR0 == 0) { /* most interrupts require no processing */
    sleep_enable();
    sei(); /* the next instruction is executed before any interrupt: no race */
    sleep_cpu();
    sleep_disable();
    cli();
  }
  TIMSK1 &= (uint8_t) ~(1 << OCIE1A);
  sei();
}
