/* The contact sensor: all of CTP/1's device side, without input or output of its own.
 *
 * Time is `uint32_t` in ticks of 0.5 us and wraps; no call may be later than 17 minutes after the
 * one before it. The board calls, in this order and as often as it can:
 *
 *   sensor_on_edge()      for every edge, with the time at which the hardware captured it
 *   sensor_on_byte()      for every byte from the host
 *   sensor_on_voltages()  when all voltages were measured
 *   sensor_on_mirror()    where a relay is fitted: its mirror contact
 *   sensor_run()          always; then sensor_drive() says what the test pin has to do, and
 *                         sensor_free() what the output for a controller's input has to say
 *   sensor_next_frame()   when the line is free
 *
 * The touch circuit: the gun is fed through a resistor (its near end is `feed`) and the feed wire,
 * and sensed through a second wire (`sense`) that the board pulls down. A touch earths the gun:
 * both voltages are low. A broken wire lets the sense voltage fall and the feed voltage rise.
 * The wire to the stands leads through all of them and back (`earth`), where a resistor pulls it
 * up. The sense wire and the way back each end in a resistor, at the gun and at the last stand:
 * with it in the way a voltage lies between the bands, without it (a short before it) in the
 * contact band, and behind a break in the open band. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "drivers/contact/firmware/core/link.h"
#include "drivers/contact/firmware/core/touch.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
  SENSOR_EVENTS = 8, /* unacknowledged at a time; a new one pushes the oldest out */
  SENSOR_NAKS = 4,
  SENSOR_PONGS = 4
};

/* What IDENT tells, and what the answers' timing depends on. */
typedef struct {
  uint8_t version; /* of the protocol: CTP_VERSION */
  uint8_t firmware[3];
  uint32_t uid, boot_id, clock_hz;
  uint8_t reset_cause; /* CTP_RESET_... */
  bool has_fuses;      /* BOARD is told */
  uint8_t fuses_low, fuses_high, fuses_extended;
  uint16_t loader; /* as BOARD has it */
  uint32_t baud;
  bool has_relay; /* in the place of plug X1 */
  bool datagrams;      /* as in link_reader */
  uint16_t pong_lead;  /* ticks from the choice of a PONG to its first bit */
  uint16_t ping_guard; /* a PING so near to an edge, in ticks, is not answered: a bouncing line
                          keeps interrupts busy, and its time would be wrong */
} sensor_identity;

/* In mV, of one round of the converter. */
typedef struct {
  uint16_t sense, feed, earth;
} sensor_voltages;

/* What the test pin does to the sense line. */
typedef enum {
  SENSOR_RELEASED, /* high impedance */
  SENSOR_PULLED_LOW,
  SENSOR_PULLED_HIGH,
  SENSOR_LIFTED /* by some ten kiloohms: stronger than the pull-down, weaker than any touch */
} sensor_pull;

typedef enum { TEST_NONE, TEST_PULL, TEST_LOOK, TEST_LIFT, TEST_SETTLE } sensor_test;

typedef struct {
  uint8_t type;
  bool sent;
  uint8_t payload[CTP_EVENT_SIZE];
  uint32_t due; /* valid until it was first sent: at once */
} sensor_event;

typedef struct {
  uint32_t nonce, t_rx;
} sensor_pong;

typedef struct {
  uint8_t of_type, reason;
} sensor_nak;

typedef struct {
  sensor_identity identity;
  uint32_t repeat; /* ticks between two sendings of an event */

  link_reader reader;
  bool greeted; /* a HELLO named our version */

  /* CONFIG, as it came */
  uint8_t config[CTP_CONFIG_SIZE];
  uint16_t config_crc;
  uint32_t heartbeat; /* ticks */
  touch_rule rule;

  /* the touch circuit */
  bool pin_high;
  sensor_voltages mv; /* sense: not while the line is lifted */
  uint8_t odd;        /* conversions in a row that no free gun explains, saturating */
  uint32_t odd_since;
  bool earth_ok, earth_was_ok; /* as published, and by the last conversion */
  bool voltage_trip;           /* the last arming was used up by odd voltages */
  uint32_t last_edge;
  bool edge_seen; /* within the last minutes: last_edge holds */
  touch_state touch;
  uint16_t touch_arm_id;   /* arming of the change that is being confirmed */
  uint16_t contact_arm_id; /* arming that the present contact belongs to */

  /* arming; 0: none */
  uint16_t arm_id, used_arm_id;
  bool latched;
  uint32_t arm_until, alive_until;

  /* self-test */
  sensor_test test;
  uint32_t test_next; /* when its present part ends */
  uint32_t tested_at;
  bool test_edge;     /* its own edge was seen */
  bool test_measured; /* what was measured last in this part speaks for a whole loop */
  bool test_whole;    /* so far the loop is whole */
  bool test_drained;  /* pulled, the feed went all the way: a touch, or no end resistor */
  bool test_stuck;    /* pulled, the sense voltage stayed: of the wires it tells nothing */
  bool free_before;   /* what the output said before the test */
  bool loop_ok, shorted, self_test_ok, self_test_old, ever_tested;

  /* the relay: four poles that close, and one of the same forced guidance that then opens */
  bool relay_wanted, relay_closed, relay_fault;
  uint32_t relay_since;   /* when the coil or the mirror contact last changed */
  uint32_t relay_until;   /* without a frame of the host it opens then */
  bool relay_due;         /* its state is to be told */

  /* what waits to be sent */
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

/* After a reset, with the pin open; announces itself. */
void sensor_init(sensor* s, const sensor_identity* identity, uint32_t now);

void sensor_on_edge(sensor* s, uint32_t t, bool pin_high);
/* `t` is the end of the byte. */
void sensor_on_byte(sensor* s, uint8_t byte, uint32_t t);
/* `t`: when they had been measured. */
void sensor_on_voltages(sensor* s, uint32_t t, const sensor_voltages* mv);
/* `open`: the mirror contact is, so that some pole is closed. */
void sensor_on_mirror(sensor* s, uint32_t t, bool open);
/* Does what is due. Every edge up to `now` has been told. */
void sensor_run(sensor* s, uint32_t now);
sensor_pull sensor_drive(const sensor* s);
/* The relay's coil. */
static inline bool sensor_relay(const sensor* s) { return s->relay_wanted; }
/* The gun is free, and everything that would tell otherwise is whole. False in contact, from the
 * first edge on, and at any fault. A self-test leaves it as it was. */
bool sensor_free(const sensor* s);

/* The next frame to send, 0: none. Its first bit must begin at *start, which is `now` for all but
 * PONG. `wire` holds CTP_MAX_WIRE bytes. */
uint8_t sensor_next_frame(sensor* s, uint32_t now, uint8_t* wire, uint32_t* start);

/* Ticks until sensor_run() or, if `line_free`, sensor_next_frame() next has something to do. */
uint32_t sensor_wait(const sensor* s, uint32_t now, bool line_free);

/* Text for a person, at most CTP_MAX_PAYLOAD characters that stay where they are; the newest wins.
 */
void sensor_log(sensor* s, const char* text);

#ifdef __cplusplus
}
#endif
