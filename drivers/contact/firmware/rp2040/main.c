/* Connects the portable sensor to the board on Ethernet. */

#include "board.h"
#include "drivers/contact/firmware/core/host_link.h"
#include "drivers/contact/firmware/core/sensor.h"

enum { FIRMWARE_MAJOR = 1, FIRMWARE_MINOR = 3, FIRMWARE_PATCH = 0 };
enum { CLOCK_HZ = 120000000, WIRE_RATE = 100000000 };

/* From the choice of a PONG to its send command: time to build and to load it. */
enum { PONG_LEAD_TICKS = 300 };
/* Longer than a bounce of a few us. */
enum { PING_GUARD_TICKS = 400, EDGES_PER_TURN = 32 };

static sensor touch_sensor;
static host_link link;

static void apply(sensor_pull pull) {
  static sensor_pull applied = SENSOR_RELEASED;
  if (pull == applied) return;
  applied = pull;
  pin_input(TEST_PIN); /* without a pull */
  if (pull == SENSOR_PULLED_LOW || pull == SENSOR_PULLED_HIGH) {
    pin_output(TEST_PIN, pull == SENSOR_PULLED_HIGH);
  } else if (pull == SENSOR_LIFTED) {
    pin_pull_up(TEST_PIN, true);
  }
}

static void start(void) {
  sensor_identity identity = {0};
  chip_start();
  pin_output(OUTPUT_PIN, false); /* contact */
  pin_output(LAMP_PIN, false);
  pin_input(TEST_PIN);
  pin_output(RELAY_PIN, false); /* released */
  pin_input(MIRROR_PIN);
  pin_input(FITTED_PIN);
  pin_pull_up(MIRROR_PIN, true);
  pin_pull_up(FITTED_PIN, true);
  identity.version = CTP_VERSION;
  identity.firmware[0] = FIRMWARE_MAJOR;
  identity.firmware[1] = FIRMWARE_MINOR;
  identity.firmware[2] = FIRMWARE_PATCH;
  identity.uid = ctp_get_u32(settings.mac + 2);
  identity.boot_id = chip_random();
  identity.clock_hz = CLOCK_HZ;
  identity.reset_cause = chip_reset_cause();
  identity.baud = WIRE_RATE;
  identity.datagrams = true;
  identity.ping_guard = PING_GUARD_TICKS;
  identity.pong_lead = PONG_LEAD_TICKS;
  analog_start();
  ethernet_start(); /* takes 50 ms: the strap's pull-up has settled */
  identity.has_relay = !pin_is_high(FITTED_PIN);
  clock_start();
  sensor_init(&touch_sensor, &identity, clock_now());
  host_link_init(&link, &touch_sensor);
}

/* Reads the events recorded by the hardware. */
static void listen(void) {
  uint32_t t = 0;
  bool pin_high;
  uint8_t taken;
  sensor_voltages mv;
  clock_watch_pin();
  for (taken = 0; taken < EDGES_PER_TURN && clock_take_edge(&t, &pin_high); ++taken) {
    sensor_on_edge(&touch_sensor, t, pin_high);
    if (touch_sensor.trip_due) return; /* the trip has priority over bounces */
    clock_watch_pin();
  }
  ethernet_listen(&link);
  if (touch_sensor.identity.has_relay) {
    sensor_on_mirror(&touch_sensor, clock_now(), pin_is_high(MIRROR_PIN));
  }
  if (analog_take(&mv)) sensor_on_voltages(&touch_sensor, clock_now(), &mv);
}

static void speak(void) {
  static uint8_t wire[CTP_MAX_WIRE];
  uint32_t begin;
  uint32_t now;
  uint8_t size;
  if (!ethernet_free()) return;
  now = clock_now();
  size = sensor_next_frame(&touch_sensor, now, wire, &begin);
  /* Without a host there is no destination. */
  if (size == 0 || !link.there) return;
  ethernet_load(&link, wire, size);
  /* A PONG that is not sent at its stated time is harmful, and waiting for it must not delay a
   * trip. */
  if (begin != now && (int32_t)(begin - clock_now()) < 0) return;
  while (begin != now && (int32_t)(begin - clock_now()) > 0) {
    if (clock_has_edge()) return;
  }
  ethernet_go();
}

static void drive(void) {
  const bool testing = touch_sensor.test != TEST_NONE;
  const bool low = touch_sensor.config[CTP_CONFIG_POLARITY] == CTP_CONTACT_IS_LOW;
  /* Before the line is pulled, so that the output is held during the test's own edge. */
  clock_output(sensor_free(&touch_sensor), low && !testing);
  apply(sensor_drive(&touch_sensor));
  pin_output(RELAY_PIN, sensor_relay(&touch_sensor));
  pin_output(LAMP_PIN, touch_sensor.touch.contact);
}

int main(void) {
  uint32_t now;
  start();
  for (;;) {
    chip_feed();
    now = clock_now(); /* before reading the edges: all edges up to now are included */
    listen();
    if (!touch_sensor.trip_due) { /* which has priority; the output has followed the edge */
      host_link_run(&link, now);
      sensor_run(&touch_sensor, now);
      drive();
    }
    speak();
  }
}
