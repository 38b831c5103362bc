/* The ATmega328P as wired in ../schematic.svg: an Arduino Uno or Nano, or the bare chip, at 16 MHz.
 *
 *   D8  PB0 ICP1  sense line, stamped by timer 1's input capture
 *   A0  PC0 ADC0  sense line's voltage
 *   A1  PC1 ADC1  feed's voltage, behind its resistor
 *   A2  PC2 ADC2  voltage of the wire that comes back from the stands
 *   D7  PD7       test: pulls the sense line down through 100 ohms, or lifts it (pin's pull-up)
 *   D6  PD6       output to a controller's input, by an optocoupler: high while the gun is free
 *   D9  PB1       the relay's coil, by a transistor (where one is fitted)
 *   D10 PB2       its mirror contact, to ground: closed while the relay is released
 *   D3  PD3       to ground: a relay is fitted (read once, after a reset)
 *   D4  PD4       to ground: 250 000 baud (read once, after a reset)
 *   D5  PD5       to ground: 115 200 baud (likewise)
 *   D13 PB5       the board's lamp: contact
 *   D0, D1        serial line */
#pragma once

#include <avr/io.h>
#include <stdbool.h>
#include <stdint.h>

#include "drivers/contact/firmware/core/sensor.h"

#if F_CPU != 16000000UL
#error "timer 1 counts ticks of 0.5 us at 16 MHz only"
#endif

enum { SENSE_BIT = 0, RELAY_BIT = 1, MIRROR_BIT = 2, LAMP_BIT = 5 };         /* of port B */
enum { FITTED_BIT = 3 };                                                     /* of port D */
enum { BAUD_250K_BIT = 4, BAUD_115K_BIT = 5, OUTPUT_BIT = 6, TEST_BIT = 7 }; /* of port D */

/* What the loop is fed with and the converter refers to, in mV. Both follow the same supply, so a
 * supply that is off shifts no band. */
#ifndef SUPPLY_MV
#define SUPPLY_MV 5000
#endif

/* clock.c: time and edges --------------------------------------------------------------------- */

/* Starts the time, at zero, and the capture. */
void clock_start(void);
/* Ticks of 0.5 us, from the main loop. */
uint32_t clock_now(void);
/* The same in an interrupt. */
uint32_t clock_now_in_interrupt(void);
/* The oldest edge that was not taken yet. */
bool clock_take_edge(uint32_t* t, bool* pin_high);
/* There is one. */
bool clock_has_edge(void);
/* Once per turn of the main loop: catches up after an edge that the capture could not follow. */
void clock_watch_pin(void);
/* The output for a controller's input goes with the edge itself, and does not wait for the main
 * loop: from a falling edge on it says 'contact', whatever is asked here, until that edge was
 * taken and `free` still holds. `by_edge` false: edges leave it alone (the self-test makes them).
 */
void clock_output(bool free, bool by_edge);
/* Sleeps until an interrupt calls wake_up(), at most for so many ticks; not at all if one has since
 * stay_up(). What has happened is never slept over: every interrupt that leaves something to do
 * calls it. */
void clock_sleep(uint16_t ticks);
static inline void stay_up(void) { GPIOR0 = 0; }
static inline void wake_up(void) { GPIOR0 = 1; } /* in interrupts */

static inline bool sense_pin(void) { return (PINB & (1u << SENSE_BIT)) != 0; }

/* uart.c: the serial line ---------------------------------------------------------------------- */

/* The rate that the straps ask for. */
uint32_t uart_start(void);
/* The oldest byte that was not taken yet; *t holds for a 0x00 only: when it ended. */
bool uart_take(uint8_t* byte, uint32_t* t);
/* True: uart_send() may be called. */
bool uart_free(void);
/* Sends bytes that stay where they are until uart_free(). */
void uart_send(const uint8_t* bytes, uint8_t size);
/* The same, with the first bit at `begin`: true if it is that time, to 2 us. */
bool uart_send_at(const uint8_t* bytes, uint8_t size, uint32_t begin);

/* analog.c: voltages --------------------------------------------------------------------------- */

void analog_start(void);
/* All voltages were measured anew. Call once per turn of the main loop. */
bool analog_take(sensor_voltages* mv);
