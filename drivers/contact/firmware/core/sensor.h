/* The contact sensor: the complete device side of CTP/1, without input or output of its own.
 *
 * Time is `uint32_t` in ticks of 0.5 us and wraps; the interval between two calls must be below
 * 17 minutes. The board calls, in this order and as often as it can:
 *
 *   sensor_on_edge()      for every edge, with the time captured by the hardware
 *   sensor_on_byte()      for every byte from the host
 *   sensor_on_voltages()  when all voltages were measured
 *   sensor_on_mirror()    if a relay is fitted: its mirror contact
 *   sensor_run()          always; then sensor_drive() is the state of the test pin, and
 *                         sensor_free() that of the output for a controller's input
 *   sensor_next_frame()   when the line is free
 *
 * The touch circuit: the gun is fed through a resistor (its near end is `feed`) and the feed
 * wire, and sensed through a second wire (`sense`) that the board pulls down. A touch earths the
 * gun: both voltages are low. With a broken wire the sense voltage falls and the feed voltage
 * rises. The wire to the stands passes all of them and returns (`earth`), with a pull-up
 * resistor. The sense wire and the return each end in a resistor, at the gun and at the last
 * stand: with it in series the voltage is between the bands, without it (a short before it) in
 * the contact band, and after a break in the open band. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "drivers/contact/firmware/core/link.h"
#include "drivers/contact/firmware/core/touch.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
  SENSOR_EVENTS = 8, /* unacknowledged; a new one replaces the oldest */
  SENSOR_NAKS = 4,
  SENSOR_PONGS = 4
};

/* Content of IDENT, and parameters of the answers' timing. */
typedef struct {
  uint8_t version; /* of the protocol: CTP_VERSION */
  uint8_t firmware[3];
  uint32_t uid, boot_id, clock_hz;
  uint8_t reset_cause; /* CTP_RESET_... */
  bool has_fuses;      /* BOARD is sent */
  uint8_t fuses_low, fuses_high, fuses_extended;
  uint16_t loader; /* as in BOARD */
  uint32_t baud;
  bool has_relay;      /* in place of plug X1 */
  bool datagrams;      /* as in link_reader */
  uint16_t pong_lead;  /* ticks from the choice of a PONG to its first bit */
  uint16_t ping_guard; /* PINGs within this many ticks of an edge are not answered: a bouncing
                          line keeps interrupts busy, and the time would be wrong */
} sensor_identity;

/* In mV, of one round of the converter. */
typedef struct {
  uint16_t sense, feed, earth;
} sensor_voltages;

/* Drive of the sense line by the test pin. */
typedef enum {
  SENSOR_RELEASED, /* high impedance */
  SENSOR_PULLED_LOW,
  SENSOR_PULLED_HIGH,
  SENSOR_LIFTED /* by about ten kiloohms: stronger than the pull-down, weaker than any touch */
} sensor_pull;

typedef enum { TEST_NONE, TEST_PULL, TEST_LOOK, TEST_LIFT, TEST_SETTLE } sensor_test;

typedef struct {
  uint8_t type;
  bool sent;
  uint8_t payload[CTP_EVENT_SIZE];
  uint32_t due; /* valid until first sent: immediately */
} sensor_event;

typedef struct {
  uint32_t nonce, t_rx;
} sensor_pong;

typedef struct {
  uint8_t of_type, reason;
} sensor_nak;

typedef struct {
  sensor_identity identity;
  uint32_t repeat; /* ticks between repetitions of an event */

  link_reader reader;
  bool greeted; /* a HELLO with our version was received */

  /* CONFIG, as received */
  uint8_t config[CTP_CONFIG_SIZE];
  uint16_t config_crc;
  uint32_t heartbeat; /* ticks */
  touch_rule rule;

  /* the touch circuit */
  bool pin_high;
  sensor_voltages mv; /* sense: not updated while the line is lifted */
  uint8_t odd;        /* consecutive conversions inconsistent with a free gun, saturating */
  uint32_t odd_since;
  bool earth_ok, earth_was_ok; /* as published, and by the last conversion */
  bool voltage_trip;           /* the last arming was ended by odd voltages */
  uint32_t last_edge;
  bool edge_seen; /* within the last minutes: last_edge is valid */
  touch_state touch;
  uint16_t touch_arm_id;   /* arming of the change being confirmed */
  uint16_t contact_arm_id; /* arming of the present contact */

  /* arming; 0: none */
  uint16_t arm_id, used_arm_id;
  bool latched;
  uint32_t arm_until, alive_until;

  /* self-test */
  sensor_test test;
  uint32_t test_next; /* end of its current part */
  uint32_t tested_at;
  bool test_edge;     /* its own edge was detected */
  bool test_measured; /* the last measurement in this part indicates an intact loop */
  bool test_whole;    /* the loop is intact so far */
  bool test_drained;  /* pulled, the feed dropped completely: a touch, or no end resistor */
  bool test_stuck;    /* pulled, the sense voltage stayed: no information on the wires */
  bool free_before;   /* state of the output before the test */
  bool loop_ok, shorted, self_test_ok, self_test_old, ever_tested;

  /* the relay: four normally open poles, and one normally closed of the same forced guidance */
  bool relay_wanted, relay_closed, relay_fault;
  uint32_t relay_since; /* last change of the coil or the mirror contact */
  uint32_t relay_until; /* opens at this time without a frame of the host */
  bool relay_due;       /* its state is to be sent */

  /* pending transmissions */
  uint8_t seq;
  bool trip_due;
  uint8_t trip[CTP_TRIP_SIZE];
  sensor_event events[SENSOR_EVENTS];
  uint8_t event_count;
  uint16_t last_event;
  uint16_t repeats, lost_events;
  bool ident_due, board_due;
  uint32_t ident_nonce;
  sensor_nak naks[SENSOR_NAKS];
  uint8_t nak_count;
  sensor_pong pongs[SENSOR_PONGS];
  uint8_t pong_count;
  bool status_due;
  uint32_t next_status;
  const char* log; /* 0: none */
} sensor;

/* After a reset, with the pin open; announces the sensor. */
void sensor_init(sensor* s, const sensor_identity* identity, uint32_t now);

void sensor_on_edge(sensor* s, uint32_t t, bool pin_high);
/* `t` is the end of the byte. */
void sensor_on_byte(sensor* s, uint8_t byte, uint32_t t);
/* `t`: time of the measurement. */
void sensor_on_voltages(sensor* s, uint32_t t, const sensor_voltages* mv);
/* `open`: the mirror contact is open, so that at least one pole is closed. */
void sensor_on_mirror(sensor* s, uint32_t t, bool open);
/* Performs due actions. Every edge up to `now` has been reported. */
void sensor_run(sensor* s, uint32_t now);
sensor_pull sensor_drive(const sensor* s);
/* Drive of the relay's coil. */
static inline bool sensor_relay(const sensor* s) { return s->relay_wanted; }
/* True if the gun is free, and everything required to detect the opposite is intact. False in
 * contact, from the first edge on, and at any fault. Unchanged by a self-test. */
bool sensor_free(const sensor* s);

/* The next frame to send, 0: none. Its first bit must begin at *start, which is `now` for all
 * except PONG. `wire` holds CTP_MAX_WIRE bytes. */
uint8_t sensor_next_frame(sensor* s, uint32_t now, uint8_t* wire, uint32_t* start);

/* Ticks until the next action of sensor_run() or, if `line_free`, of sensor_next_frame(). */
uint32_t sensor_wait(const sensor* s, uint32_t now, bool line_free);

/* Diagnostic text of at most CTP_MAX_PAYLOAD characters, which must stay valid; the newest
   replaces older ones. */
void sensor_log(sensor* s, const char* text);

#ifdef __cplusplus
}
#endif
