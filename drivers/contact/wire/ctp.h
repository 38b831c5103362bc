/* CTP/1, the protocol between the contact sensor's microcontroller and the host. This header is
 * compiled as C99 by the firmware and as C++20 by the driver and the emulator, hence its C
 * style.
 *
 *   frame = COBS( type:u8  seq:u8  payload[0..48]  crc:u16 ) 0x00
 *
 * Little endian. The CRC covers type, seq and payload. seq counts up per direction, modulo 256. */
#pragma once

#include <stddef.h>
#include <stdint.h>

enum {
  CTP_VERSION = 1,

  CTP_MAX_PAYLOAD = 48,
  CTP_HEADER = 2, /* type, seq */
  CTP_CRC = 2,
  CTP_MAX_FRAME = CTP_HEADER + CTP_MAX_PAYLOAD + CTP_CRC, /* before COBS */
  CTP_OVERHEAD = CTP_HEADER + CTP_CRC + 2,                /* one COBS byte, one delimiter */
  CTP_MAX_WIRE = CTP_MAX_PAYLOAD + CTP_OVERHEAD,
  CTP_BITS_PER_BYTE = 10, /* 8N1 */

  CTP_TICK_NS = 500, /* unit of every t */
  CTP_TICKS_PER_US = 2
};

/* Not enumerators: an int has 16 bits on an AVR. */
#define CTP_DEFAULT_BAUD 1000000L /* exact on an AVR at 8 and 16 MHz */
#define CTP_TICKS_PER_S 2000000L
/* Configuration CRC of an unconfigured sensor: the CRC of no bytes. */
#define CTP_CONFIG_NONE ((uint16_t)0xFFFFu)

/* Host to microcontroller: below 0x80. */
enum {
  CTP_HELLO = 0x01,
  CTP_CONFIG = 0x02,
  CTP_ARM = 0x03,
  CTP_DISARM = 0x04,
  CTP_ACK = 0x05,
  CTP_PING = 0x06,
  CTP_SELFTEST = 0x07,
  CTP_KEEPALIVE = 0x08,
  CTP_RELAY = 0x09 /* since firmware 1.3 */
};

/* Microcontroller to host. */
enum {
  CTP_IDENT = 0x81,
  CTP_STATUS = 0x82,
  CTP_TRIP = 0x83,
  CTP_CONTACT = 0x84,
  CTP_PONG = 0x85,
  CTP_NAK = 0x86,
  CTP_LOG = 0x87,
  CTP_REVOKED = 0x88,
  CTP_RELEASE = 0x89,
  CTP_BOARD = 0x8A,      /* since firmware 1.1, after the IDENT that answers a HELLO */
  CTP_RELAY_STATE = 0x8B /* since firmware 1.3, with a relay: likewise, and at each change */
};

/* Offsets of the fields within each payload, and the payload's size. */
enum { CTP_HELLO_MIN = 0, CTP_HELLO_MAX = 1, CTP_HELLO_NONCE = 2, CTP_HELLO_SIZE = 6 };
enum {
  CTP_CONFIG_POLARITY = 0,
  CTP_CONFIG_CONFIRM_SAMPLES = 1,
  CTP_CONFIG_SAMPLE_US = 2,
  CTP_CONFIG_HEARTBEAT_MS = 4,
  CTP_CONFIG_OPEN_MV = 5,
  CTP_CONFIG_CONTACT_MV = 7,
  CTP_CONFIG_SIZE = 9
};
enum { CTP_ARM_ID = 0, CTP_ARM_LIFETIME_MS = 2, CTP_ARM_SIZE = 4 };
enum { CTP_DISARM_ID = 0, CTP_DISARM_SIZE = 2 };
enum { CTP_ACK_EVENT = 0, CTP_ACK_SIZE = 2 };
enum { CTP_PING_NONCE = 0, CTP_PING_PAD = 4, CTP_PING_SIZE = 12 };
enum { CTP_SELFTEST_SIZE = 0, CTP_KEEPALIVE_SIZE = 0 };
enum {
  CTP_IDENT_VERSION = 0,
  CTP_IDENT_FIRMWARE = 1,
  CTP_IDENT_UID = 4,
  CTP_IDENT_BOOT_ID = 8,
  CTP_IDENT_CLOCK_HZ = 12,
  CTP_IDENT_RESET_CAUSE = 16,
  CTP_IDENT_NONCE = 17, /* of the HELLO being answered; 0: announced after a reset */
  CTP_IDENT_CONFIG_CRC = 21,
  CTP_IDENT_SIZE = 23
};
enum {
  CTP_STATUS_T = 0,
  CTP_STATUS_FLAGS = 4,
  CTP_STATUS_LAST_EVENT = 5,
  CTP_STATUS_ERRORS = 7, /* damaged frames received, modulo 256 */
  CTP_STATUS_SENSE_MV = 8,
  CTP_STATUS_CONFIG_CRC = 10,
  CTP_STATUS_SIZE = 12
};
enum { CTP_TRIP_ARM_ID = 0, CTP_TRIP_T = 2, CTP_TRIP_SIZE = 6 };
/* CONTACT, REVOKED and RELEASE share one payload. */
enum {
  CTP_EVENT_ID = 0,
  CTP_EVENT_ARM_ID = 2, /* 0: no arming */
  CTP_EVENT_T_FIRST = 4,
  CTP_EVENT_DT_CONFIRM_US = 8,
  CTP_EVENT_BOUNCES = 10,
  CTP_EVENT_LEVEL = 11, /* 1: closed, 0: open */
  CTP_EVENT_SENSE_MV = 12,
  CTP_EVENT_SIZE = 14
};
enum { CTP_PONG_NONCE = 0, CTP_PONG_T_RX = 4, CTP_PONG_T_TX = 8, CTP_PONG_SIZE = 12 };
enum { CTP_RELAY_ON = 0, CTP_RELAY_SIZE = 1 };
enum { CTP_RELAY_STATE_FLAGS = 0, CTP_RELAY_STATE_SIZE = 1 };
enum { CTP_NAK_OF_TYPE = 0, CTP_NAK_REASON = 1, CTP_NAK_SIZE = 2 };

enum {
  CTP_BOARD_FUSES_LOW = 0,
  CTP_BOARD_FUSES_HIGH = 1,
  CTP_BOARD_FUSES_EXTENDED = 2,
  CTP_BOARD_LOADER = 3, /* last word of the flash: optiboot's version; 0xFFFF: none */
  CTP_BOARD_SIZE = 5
};

/* Flags of STATUS. */
enum {
  CTP_FLAG_CONTACT = 0x01,
  CTP_FLAG_ARMED = 0x02,
  CTP_FLAG_LATCHED = 0x04, /* the last arming was ended by an edge */
  CTP_FLAG_LOOP_OK = 0x08,
  CTP_FLAG_SELF_TEST_OK = 0x10,
  /* Since firmware 1.1; 0 in older ones. LOOP_OK is set only with EARTH_OK. */
  CTP_FLAG_EARTH_OK = 0x20,     /* the stands' wire is intact, out and back */
  CTP_FLAG_VOLTAGE_TRIP = 0x40, /* the last arming was ended by a voltage, not by an edge */
  CTP_FLAG_SHORTED = 0x80       /* no LOOP_OK by a short before an end resistor, not a break */
};

/* Flags of RELAY_STATE. */
enum {
  CTP_RELAY_WANTED = 0x01, /* the coil is driven */
  CTP_RELAY_CLOSED = 0x02, /* the mirror contact is open: at least one pole is closed */
  CTP_RELAY_FAULT = 0x04   /* the mirror contact has contradicted the coil for CTP_RELAY_MS */
};

/* Reasons of NAK. */
enum {
  CTP_NAK_IN_CONTACT = 1,
  CTP_NAK_LOOP_BROKEN = 2,
  CTP_NAK_VOLTAGE_UNDEFINED = 3, /* between the contact and the open band */
  CTP_NAK_SELF_TEST_OLD = 4,
  CTP_NAK_BAD_ARGUMENT = 5,
  CTP_NAK_BAD_VERSION = 6
};

/* Polarity in CONFIG. */
enum { CTP_CONTACT_IS_LOW = 0, CTP_CONTACT_IS_HIGH = 1 };

/* Reset causes in IDENT. */
enum { CTP_RESET_POWER = 1, CTP_RESET_PIN = 2, CTP_RESET_BROWN_OUT = 4, CTP_RESET_WATCHDOG = 8 };

/* Times that both sides must agree on. */
enum {
  CTP_IDLE_STATUS_MS = 100,
  CTP_KEEPALIVE_MS = 10,        /* period of the host's keep-alive while armed */
  CTP_KEEPALIVE_LIMIT_MS = 700, /* silence after which the microcontroller disarms: the host's own
                                      dead man (25 ms; 600 with a second stop path) must act first, and
                                      serial delays of about 100 ms occur under load */
  CTP_REPEAT_MIN_MS = 4,        /* minimum interval of repeated events */
  CTP_SELF_TEST_MS = 2,         /* from the request to its result */
  CTP_SELF_TEST_PULL_US = 1500, /* part of it with the sense line pulled; then it settles */
  CTP_SELF_TEST_MAX_AGE_S = 600,
  CTP_RELAY_MS = 100,          /* for a relay to follow its coil, without bounces */
  CTP_RELAY_SILENCE_MS = 2000, /* silence of the host after which the sensor opens the relay */
  CTP_CONFIRM_MAX_MS = 50      /* edges neither confirmed nor dismissed after this are noise */
};

/* CRC-16/CCITT-FALSE (polynomial 0x1021, start 0xFFFF); check value of "123456789" is 0x29B1. */
#define CTP_CRC_START ((uint16_t)0xFFFFu)

static inline uint16_t ctp_crc16_step(uint16_t crc, uint8_t byte) {
  uint8_t x = (uint8_t)((crc >> 8) ^ byte);
  x = (uint8_t)(x ^ (x >> 4));
  return (uint16_t)(((unsigned)crc << 8) ^ ((unsigned)x << 12) ^ ((unsigned)x << 5) ^ (unsigned)x);
}

static inline uint16_t ctp_crc16(const uint8_t* data, size_t size) {
  uint16_t crc = CTP_CRC_START;
  size_t i;
  for (i = 0; i < size; ++i) crc = ctp_crc16_step(crc, data[i]);
  return crc;
}

static inline void ctp_put_u16(uint8_t* p, uint16_t v) {
  p[0] = (uint8_t)(v & 0xFFu);
  p[1] = (uint8_t)(v >> 8);
}

static inline void ctp_put_u32(uint8_t* p, uint32_t v) {
  ctp_put_u16(p, (uint16_t)(v & 0xFFFFu));
  ctp_put_u16(p + 2, (uint16_t)(v >> 16));
}

static inline uint16_t ctp_get_u16(const uint8_t* p) {
  return (uint16_t)(p[0] | ((unsigned)p[1] << 8));
}

static inline uint32_t ctp_get_u32(const uint8_t* p) {
  return (uint32_t)ctp_get_u16(p) | ((uint32_t)ctp_get_u16(p + 2) << 16);
}

/* Payload size of a type; -1: any size up to CTP_MAX_PAYLOAD (LOG); -2: unknown type. */
static inline int ctp_payload_size(uint8_t type) {
  switch (type) {
    case CTP_HELLO: return CTP_HELLO_SIZE;
    case CTP_CONFIG: return CTP_CONFIG_SIZE;
    case CTP_ARM: return CTP_ARM_SIZE;
    case CTP_DISARM: return CTP_DISARM_SIZE;
    case CTP_ACK: return CTP_ACK_SIZE;
    case CTP_PING: return CTP_PING_SIZE;
    case CTP_SELFTEST: return CTP_SELFTEST_SIZE;
    case CTP_KEEPALIVE: return CTP_KEEPALIVE_SIZE;
    case CTP_IDENT: return CTP_IDENT_SIZE;
    case CTP_STATUS: return CTP_STATUS_SIZE;
    case CTP_TRIP: return CTP_TRIP_SIZE;
    case CTP_CONTACT:
    case CTP_REVOKED:
    case CTP_RELEASE: return CTP_EVENT_SIZE;
    case CTP_PONG: return CTP_PONG_SIZE;
    case CTP_NAK: return CTP_NAK_SIZE;
    case CTP_BOARD: return CTP_BOARD_SIZE;
    case CTP_RELAY: return CTP_RELAY_SIZE;
    case CTP_RELAY_STATE: return CTP_RELAY_STATE_SIZE;
    case CTP_LOG: return -1;
    default: return -2;
  }
}
