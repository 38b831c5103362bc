/* The timer counts microseconds; the sense pin's interrupt, which has the highest priority,
 * reads it at every edge. The chip has no input capture: the stamp is late by the interrupt
 * latency, about 0.2 us, and truncated to a whole microsecond. */

#include "board.h"
#include "drivers/contact/wire/ctp.h"
#include "registers.h"

enum { EDGES = 32, EDGES_MASK = EDGES - 1 };

typedef struct {
  uint32_t t;
  bool pin_high;
} edge;

static edge edges[EDGES];
static volatile uint8_t edges_in, edges_out;
static volatile bool last_high; /* the level after the last edge */
static volatile bool output_by_edge;
static volatile bool called;
static volatile uint32_t called_at;

uint32_t clock_now(void) { return REGISTER(TIMER_RAW_LOW) * CTP_TICKS_PER_US; }

static inline void interrupts(bool on) {
  if (on) {
    __asm__ volatile("cpsie i" ::: "memory");
  } else {
    __asm__ volatile("cpsid i" ::: "memory");
  }
}

static bool sense_high(void) { return (REGISTER(SIO_IN) & (1u << SENSE_PIN)) != 0; }

/* False: no room. Interrupts are off, or called from one. */
static bool note(uint32_t t, bool high) {
  const uint8_t next = (uint8_t)((edges_in + 1) & EDGES_MASK);
  if (next == edges_out) return false;
  edges[edges_in].t = t;
  edges[edges_in].pin_high = high;
  edges_in = next;
  last_high = high;
  if (output_by_edge && !high) REGISTER(SIO_OUT_CLEAR) = 1u << OUTPUT_PIN;
  return true;
}

static void on_edges(uint32_t t) {
  const bool high = sense_high();
  bool fits = true;
  /* It changed back before it was read. */
  if (high == last_high) fits = note(t, !high);
  /* A line that chatters faster than the main loop can process must not block the main loop. */
  if (!fits || !note(t, high)) {
    CLEAR(GPIO_INTE(SENSE_PIN)) = GPIO_FALLS(SENSE_PIN) | GPIO_RISES(SENSE_PIN);
  }
}

void io_bank0_interrupt(void) {
  const uint32_t t = clock_now();
  const uint32_t both = GPIO_FALLS(SENSE_PIN) | GPIO_RISES(SENSE_PIN);
  const uint32_t edge_bits = REGISTER(GPIO_INTS(SENSE_PIN)) & both;
  if (edge_bits != 0) {
    REGISTER(GPIO_INTR(SENSE_PIN)) = edge_bits; /* before reading the level */
    on_edges(t);
  }
  if ((REGISTER(GPIO_INTS(CHIP_CALL_PIN)) & GPIO_FALLS(CHIP_CALL_PIN)) != 0) {
    REGISTER(GPIO_INTR(CHIP_CALL_PIN)) = GPIO_FALLS(CHIP_CALL_PIN);
    if (!called) called_at = t;
    called = true;
  }
}

void clock_start(void) {
  pin_input(SENSE_PIN);
  pin_input(CHIP_CALL_PIN);
  pin_pull_up(CHIP_CALL_PIN, true);
  last_high = true; /* at start-up: clock_watch_pin() determines the actual level */
  REGISTER(GPIO_INTR(SENSE_PIN)) = GPIO_FALLS(SENSE_PIN) | GPIO_RISES(SENSE_PIN);
  REGISTER(GPIO_INTR(CHIP_CALL_PIN)) = GPIO_FALLS(CHIP_CALL_PIN);
  SET(GPIO_INTE(SENSE_PIN)) = GPIO_FALLS(SENSE_PIN) | GPIO_RISES(SENSE_PIN);
  SET(GPIO_INTE(CHIP_CALL_PIN)) = GPIO_FALLS(CHIP_CALL_PIN);
  REGISTER(NVIC_ENABLE) = 1u << IRQ_IO_BANK0;
  interrupts(true);
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
  const uint32_t both = GPIO_FALLS(SENSE_PIN) | GPIO_RISES(SENSE_PIN);
  interrupts(false);
  if ((REGISTER(GPIO_INTE(SENSE_PIN)) & both) == 0) {
    REGISTER(GPIO_INTR(SENSE_PIN)) = both;
    SET(GPIO_INTE(SENSE_PIN)) = both;
  }
  if (sense_high() != last_high && (REGISTER(GPIO_INTS(SENSE_PIN)) & both) == 0) {
    note(clock_now(), sense_high());
  }
  interrupts(true);
}

void clock_output(bool free, bool by_edge) {
  interrupts(false);
  output_by_edge = by_edge;
  if (!free) {
    REGISTER(SIO_OUT_CLEAR) = 1u << OUTPUT_PIN;
  } else if (!clock_has_edge() || !by_edge) {
    REGISTER(SIO_OUT_SET) = 1u << OUTPUT_PIN;
  }
  interrupts(true);
}

bool clock_take_call(uint32_t* t) {
  bool was;
  interrupts(false);
  was = called;
  *t = called_at;
  called = false;
  interrupts(true);
  return was;
}
