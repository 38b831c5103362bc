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

/* Supply of the loop and reference of the converter, in mV. Both follow the same supply, so that
 * its deviation does not shift the bands. */
#ifndef SUPPLY_MV
#define SUPPLY_MV 5000
#endif

/* clock.c: time and edges --------------------------------------------------------------------- */

/* Starts the time, at zero, and the capture. */
void clock_start(void);
/* Ticks of 0.5 us, from the main loop. */
uint32_t clock_now(void);
/* As clock_now(), in an interrupt. */
uint32_t clock_now_in_interrupt(void);
/* The oldest unread edge. */
bool clock_take_edge(uint32_t* t, bool* pin_high);
/* True if there is an unread edge. */
bool clock_has_edge(void);
/* To be called once per turn of the main loop: resynchronises after edges that the capture
   missed. */
void clock_watch_pin(void);
/* Output for a controller's input. It follows the edge itself, without waiting for the main
 * loop: from a falling edge on it reports 'contact', regardless of `free`, until that edge was
 * read and `free` still holds. `by_edge` false: edges do not affect it (during the self-test). */
void clock_output(bool free, bool by_edge);
/* Sleeps until an interrupt calls wake_up(), at most for this many ticks; not at all if one has
 * done so since stay_up(). Every interrupt that requires processing calls it, so that no event
 * is missed. */
void clock_sleep(uint16_t ticks);
static inline void stay_up(void) { GPIOR0 = 0; }
static inline void wake_up(void) { GPIOR0 = 1; } /* from interrupts */

static inline bool sense_pin(void) { return (PINB & (1u << SENSE_BIT)) != 0; }

/* uart.c: the serial line ---------------------------------------------------------------------- */

/* Returns the baud rate selected by the straps. */
uint32_t uart_start(void);
/* The oldest unread byte; *t is valid for a 0x00 only: its end. */
bool uart_take(uint8_t* byte, uint32_t* t);
/* True: uart_send() may be called. */
bool uart_free(void);
/* Sends bytes, which must stay valid until uart_free(). */
void uart_send(const uint8_t* bytes, uint8_t size);
/* As uart_send(), with the first bit at `begin`: true if it is that time, within 2 us. */
bool uart_send_at(const uint8_t* bytes, uint8_t size, uint32_t begin);

/* analog.c: voltages --------------------------------------------------------------------------- */

void analog_start(void);
/* True if all voltages were measured anew. To be called once per turn of the main loop. */
bool analog_take(sensor_voltages* mv);
