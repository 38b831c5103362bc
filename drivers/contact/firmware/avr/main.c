/* Connects the portable sensor to the board. */

#include <avr/boot.h>
#include <avr/eeprom.h>
#include <avr/interrupt.h>
#include <avr/pgmspace.h>
#include <avr/wdt.h>
#include <util/delay.h>
#include <string.h>

#include "board.h"
#include "drivers/contact/firmware/core/boot_record.h"
#include "drivers/contact/firmware/core/sensor.h"

enum { FIRMWARE_MAJOR = 1, FIRMWARE_MINOR = 3, FIRMWARE_PATCH = 0 };

/* From the choice of a PONG to its first bit: time to build it, and two bytes of the preceding
 * frame possibly still in the transmitter. */
enum { BUILD_TICKS = 400, BYTES_IN_TRANSMITTER = 2 };
/* Longer than a bounce of a few us. */
enum { PING_GUARD_TICKS = 400 };
/* Limits per turn of the main loop, so that a flood does not delay a trip. */
enum { BYTES_PER_TURN = 8, EDGES_PER_TURN = 32 };
/* Shorter sleeps are not worthwhile; longer ones would poll the voltages too rarely. */
enum { SHORTEST_SLEEP = 60, LONGEST_SLEEP = 400 };

static sensor touch_sensor;
static uint8_t wire[CTP_MAX_WIRE];
static bool flooded; /* unread bytes remain for the next turn */

/* Saved before the C runtime clears memory: the cause of the reset, and the copy in r2 by a boot
 * loader that cleared it (optiboot does). */
static uint8_t reset_flags __attribute__((section(".noinit")));

void remember_reset(void) __attribute__((naked, used, section(".init3")));
void remember_reset(void) {
  uint8_t from_loader;
  __asm__ volatile("mov %0, r2" : "=r"(from_loader));
  reset_flags = MCUSR != 0 ? MCUSR : from_loader;
  MCUSR = 0; /* otherwise the watchdog cannot be switched off */
  wdt_disable();
}

static uint8_t read_byte(void* context, uint16_t at) {
  (void)context;
  return eeprom_read_byte((const uint8_t*)at);
}

static void write_byte(void* context, uint16_t at, uint8_t value) {
  (void)context;
  eeprom_update_byte((uint8_t*)at, value);
  eeprom_busy_wait();
  wdt_reset();
}

/* The chip's serial number, ten bytes of its signature row, hashed (FNV-1a). */
static uint32_t chip_id(void) {
  enum { FIRST = 0x0E, LAST = 0x17 };
  uint32_t id = 2166136261u;
  uint8_t at;
  for (at = FIRST; at <= LAST; ++at) id = (id ^ boot_signature_byte_get(at)) * 16777619u;
  return id;
}

static void apply(sensor_pull pull) {
  static sensor_pull applied = SENSOR_RELEASED;
  if (pull == applied) return;
  applied = pull;
  switch (pull) {
    case SENSOR_PULLED_LOW:
      PORTD &= (uint8_t) ~(1 << TEST_BIT);
      DDRD |= (1 << TEST_BIT);
      break;
    case SENSOR_PULLED_HIGH:
      PORTD |= (1 << TEST_BIT);
      DDRD |= (1 << TEST_BIT);
      break;
    case SENSOR_LIFTED:
      DDRD &= (uint8_t) ~(1 << TEST_BIT);
      PORTD |= (1 << TEST_BIT);
      break;
    default:
      DDRD &= (uint8_t) ~(1 << TEST_BIT);
      PORTD &= (uint8_t) ~(1 << TEST_BIT);
      break;
  }
}

/* After uart_start(), once the pull-ups have settled. */
static bool relay_fitted(void) {
  PORTD |= (1 << FITTED_BIT);
  PORTB |= (1 << MIRROR_BIT);
  DDRB |= (1 << RELAY_BIT); /* low: released */
  _delay_us(5);
  return (PIND & (1 << FITTED_BIT)) == 0;
}

static void start(void) {
  const boot_memory memory = {read_byte, write_byte, 0};
  sensor_identity identity;
  bool stored;
  wdt_enable(WDTO_60MS);
  DDRB |= (1 << LAMP_BIT);
  DDRD |= (1 << OUTPUT_BIT); /* low: contact */
  stored = boot_record_next(&memory, &identity.boot_id);
  identity.version = CTP_VERSION;
  identity.firmware[0] = FIRMWARE_MAJOR;
  identity.firmware[1] = FIRMWARE_MINOR;
  identity.firmware[2] = FIRMWARE_PATCH;
  identity.uid = chip_id();
  identity.clock_hz = F_CPU;
  identity.reset_cause =
      reset_flags & (CTP_RESET_POWER | CTP_RESET_PIN | CTP_RESET_BROWN_OUT | CTP_RESET_WATCHDOG);
  identity.has_fuses = true;
  identity.datagrams = false;
  /* Interrupts are still off, as required here. */
  identity.fuses_low = boot_lock_fuse_bits_get(GET_LOW_FUSE_BITS);
  identity.fuses_high = boot_lock_fuse_bits_get(GET_HIGH_FUSE_BITS);
  identity.fuses_extended = boot_lock_fuse_bits_get(GET_EXTENDED_FUSE_BITS);
  identity.loader = pgm_read_word(FLASHEND - 1);
  identity.baud = uart_start();
  identity.has_relay = relay_fitted();
  identity.ping_guard = PING_GUARD_TICKS;
  identity.pong_lead =
      (uint16_t)(BUILD_TICKS + BYTES_IN_TRANSMITTER * CTP_BITS_PER_BYTE *
                                   ((CTP_TICKS_PER_S + identity.baud - 1) / identity.baud));
  analog_start();
  clock_start();
  sei();
  sensor_init(&touch_sensor, &identity, clock_now());
  if (!stored) sensor_log(&touch_sensor, "EEPROM worn out: the boot id may come again");
}

/* Reads the events recorded by the hardware. */
static void listen(void) {
  uint32_t t = 0;
  bool pin_high;
  uint8_t byte;
  uint8_t taken;
  sensor_voltages mv;
  clock_watch_pin();
  for (taken = 0; taken < EDGES_PER_TURN && clock_take_edge(&t, &pin_high); ++taken) {
    sensor_on_edge(&touch_sensor, t, pin_high);
    if (touch_sensor.trip_due) return; /* the trip has priority over bounces */
    clock_watch_pin();
  }
  for (taken = 0; taken < BYTES_PER_TURN && uart_take(&byte, &t); ++taken) {
    sensor_on_byte(&touch_sensor, byte, t);
  }
  flooded = taken == BYTES_PER_TURN;
  if (touch_sensor.identity.has_relay) {
    sensor_on_mirror(&touch_sensor, clock_now(), (PINB & (1 << MIRROR_BIT)) != 0);
  }
  if (analog_take(&mv)) sensor_on_voltages(&touch_sensor, clock_now(), &mv);
}

static void speak(void) {
  static uint8_t trip[CTP_MAX_WIRE];
  static uint8_t trip_size;
  const uint32_t now = clock_now();
  uint32_t begin;
  uint8_t size;
  /* A trip is sent before everything else: it is built while the preceding frame is still being
     sent. */
  if (touch_sensor.trip_due && trip_size == 0) {
    trip_size = sensor_next_frame(&touch_sensor, now, trip, &begin);
  }
  if (!uart_free()) return;
  if (trip_size != 0) {
    memcpy(wire, trip, trip_size);
    uart_send(wire, trip_size);
    trip_size = 0;
    return;
  }
  size = sensor_next_frame(&touch_sensor, now, wire, &begin);
  if (size == 0) return;
  if (begin == now) {
    uart_send(wire, size);
    return;
  }
  /* A PONG that is not sent at its stated time is harmful, and waiting for it must not delay a
   * trip. */
  while (!clock_has_edge() && !uart_send_at(wire, size, begin)) {
    if ((int32_t)(begin - clock_now()) < 0) return;
  }
}

static void rest(void) {
  uint32_t wait;
  if (flooded || clock_has_edge()) return;
  wait = sensor_wait(&touch_sensor, clock_now(), uart_free());
  if (wait >= SHORTEST_SLEEP) {
    clock_sleep((uint16_t)(wait < LONGEST_SLEEP ? wait : LONGEST_SLEEP));
  }
}

static void drive(void) {
  const bool testing = touch_sensor.test != TEST_NONE;
  const bool low = touch_sensor.config[CTP_CONFIG_POLARITY] == CTP_CONTACT_IS_LOW;
  /* Before the line is pulled, so that the output is held during the test's own edge. */
  clock_output(sensor_free(&touch_sensor), low && !testing);
  apply(sensor_drive(&touch_sensor));
  if (sensor_relay(&touch_sensor)) {
    PORTB |= (1 << RELAY_BIT);
  } else {
    PORTB &= (uint8_t) ~(1 << RELAY_BIT);
  }
  if (touch_sensor.touch.contact) {
    PORTB |= (1 << LAMP_BIT);
  } else {
    PORTB &= (uint8_t) ~(1 << LAMP_BIT);
  }
}

int main(void) {
  uint32_t now;
  start();
  for (;;) {
    wdt_reset();
    stay_up();
    now = clock_now(); /* before reading the edges: all edges up to now are included */
    listen();
    if (!touch_sensor.trip_due) { /* which has priority; the output has followed the edge */
      sensor_run(&touch_sensor, now);
      drive();
    }
    speak();
    rest();
  }
}
