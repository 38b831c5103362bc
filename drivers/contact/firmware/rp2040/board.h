/* A W5500-EVB-Pico as wired in ../README.md, 'Ethernet': an RP2040 at 120 MHz with a W5500 on SPI0.
 *
 *   GP2       sense line, stamped by the pin's interrupt
 *   GP26 A0   sense line's voltage
 *   GP27 A1   feed's voltage, behind its resistor
 *   GP28 A2   voltage of the wire that comes back from the stands
 *   GP3       test: pulls the sense line down through 47 ohms, or lifts it (pin's pull-up)
 *   GP6       output to a controller's input, by an optocoupler: high while the gun is free
 *   GP7       the relay's coil, by a transistor (where one is fitted)
 *   GP8       its mirror contact, to ground: closed while the relay is released
 *   GP9       to ground: a relay is fitted (read once, after a reset)
 *   GP25      the board's lamp: contact
 *   GP16..19  MISO, CS, SCK, MOSI of the W5500; GP20 its reset, GP21 its interrupt */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "drivers/contact/firmware/core/host_link.h"
#include "drivers/contact/firmware/core/sensor.h"
#include "drivers/contact/firmware/w5500/w5500.h"

enum {
  SENSE_PIN = 2,
  TEST_PIN = 3,
  OUTPUT_PIN = 6,
  RELAY_PIN = 7,
  MIRROR_PIN = 8,
  FITTED_PIN = 9,
  MISO_PIN = 16,
  CS_PIN = 17,
  SCK_PIN = 18,
  MOSI_PIN = 19,
  CHIP_RESET_PIN = 20,
  CHIP_CALL_PIN = 21,
  LAMP_PIN = 25,
  SENSE_VOLTAGE_PIN = 26
};

/* Supply of the loop and reference of the converter, in the bands' units: see ../README.md. */
#define SUPPLY_MV 5000

/* Written into the image by image.py, after its magic word. */
typedef struct {
  char magic[8];
  uint8_t address[4], mask[4], mac[6];
  uint8_t port[2]; /* big endian */
} board_settings;
extern const board_settings settings;

/* chip.c: clocks, pins, watchdog --------------------------------------------------------------- */

void chip_start(void);
void chip_feed(void); /* the watchdog: 60 ms */
/* CTP_RESET_... */
uint8_t chip_reset_cause(void);
uint32_t chip_random(void);
void pin_output(unsigned pin, bool high);
void pin_input(unsigned pin);
void pin_pull_up(unsigned pin, bool on);
bool pin_is_high(unsigned pin);

/* clock.c: time and edges ---------------------------------------------------------------------- */

void clock_start(void);
/* Ticks of 0.5 us; the underlying timer counts whole microseconds. */
uint32_t clock_now(void);
bool clock_has_edge(void);
bool clock_take_edge(uint32_t* t, bool* pin_high);
/* To be called once per turn of the main loop: resynchronises after edges that the interrupt
   missed. */
void clock_watch_pin(void);
/* As on the AVR: the output reports 'contact' with the falling edge itself. */
void clock_output(bool free, bool by_edge);
/* True once for each interrupt of the W5500; *t: its time. */
bool clock_take_call(uint32_t* t);

/* analog.c: voltages --------------------------------------------------------------------------- */

void analog_start(void);
/* True if all voltages were measured anew. To be called once per turn of the main loop. */
bool analog_take(sensor_voltages* mv);

/* ethernet.c: datagrams ------------------------------------------------------------------------ */

void ethernet_start(void);
/* Passes received datagrams to the link. */
void ethernet_listen(host_link* link);
/* True: ethernet_load() may be called. */
bool ethernet_free(void);
void ethernet_load(const host_link* link, const uint8_t* bytes, uint8_t size);
void ethernet_go(void);
