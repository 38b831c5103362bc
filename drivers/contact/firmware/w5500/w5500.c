#include "drivers/contact/firmware/w5500/w5500.h"

#include <string.h>

/* Blocks, in bits 7..3 of the control byte. */
enum { COMMON = 0x00, SOCKET = 0x08, TX_BUFFER = 0x10, RX_BUFFER = 0x18, WRITE = 0x04 };

/* Common registers. */
enum {
  MR = 0x0000,
  SUBR = 0x0005,
  SHAR = 0x0009,
  SIPR = 0x000F,
  SIMR = 0x0018,
  RTR = 0x0019,
  RCR = 0x001B,
  VERSIONR = 0x0039
};
enum { MR_RESET = 0x80, VERSION = 0x04 };

/* Registers of the socket. */
enum {
  SN_MR = 0x00,
  SN_CR = 0x01,
  SN_IR = 0x02,
  SN_SR = 0x03,
  SN_PORT = 0x04,
  SN_DIPR = 0x0C,
  SN_DPORT = 0x10,
  SN_TX_RD = 0x22,
  SN_TX_WR = 0x24,
  SN_RX_RSR = 0x26,
  SN_RX_RD = 0x28,
  SN_IMR = 0x2C
};
enum { MR_UDP = 0x02 };
enum { CR_OPEN = 0x01, CR_SEND = 0x20, CR_SEND_MAC = 0x21, CR_RECV = 0x40 };
enum { IR_RECV = 0x04, IR_TIMEOUT = 0x08, IR_SEND_OK = 0x10 };
enum { SR_UDP = 0x22 };

enum {
  UDP_HEADER = 8,     /* peer's address, port, size: before each datagram in the buffer */
  BUFFER = 2048,      /* of one direction, as after a reset */
  CHIP_TRIES = 10000, /* a command is taken within some microseconds */
  RETRY_100US = 100,  /* of an unanswered ARP */
  RETRIES = 1
};

static void begin(const w5500_bus* bus, uint16_t at, uint8_t control) {
  bus->select(bus->context, true);
  bus->exchange(bus->context, (uint8_t)(at >> 8));
  bus->exchange(bus->context, (uint8_t)at);
  bus->exchange(bus->context, control);
}

static void end(const w5500_bus* bus) { bus->select(bus->context, false); }

static void put(const w5500_bus* bus, uint8_t block, uint16_t at, const uint8_t* bytes,
                uint16_t size) {
  uint16_t i;
  begin(bus, at, (uint8_t)(block | WRITE));
  for (i = 0; i < size; ++i) bus->exchange(bus->context, bytes[i]);
  end(bus);
}

static void get(const w5500_bus* bus, uint8_t block, uint16_t at, uint8_t* bytes, uint16_t size) {
  uint16_t i;
  begin(bus, at, block);
  for (i = 0; i < size; ++i) bytes[i] = bus->exchange(bus->context, 0);
  end(bus);
}

static void put8(const w5500_bus* bus, uint8_t block, uint16_t at, uint8_t value) {
  put(bus, block, at, &value, 1);
}

static uint8_t get8(const w5500_bus* bus, uint8_t block, uint16_t at) {
  uint8_t value;
  get(bus, block, at, &value, 1);
  return value;
}

/* The chip's numbers are big endian. */
static void put16(const w5500_bus* bus, uint8_t block, uint16_t at, uint16_t value) {
  const uint8_t bytes[2] = {(uint8_t)(value >> 8), (uint8_t)value};
  put(bus, block, at, bytes, 2);
}

static uint16_t big16(const uint8_t* p) { return (uint16_t)(((unsigned)p[0] << 8) | p[1]); }

static uint16_t get16(const w5500_bus* bus, uint8_t block, uint16_t at) {
  uint8_t bytes[2];
  get(bus, block, at, bytes, 2);
  return big16(bytes);
}

static void command(const w5500_bus* bus, uint8_t what) {
  uint16_t tries = CHIP_TRIES;
  put8(bus, SOCKET, SN_CR, what);
  while (get8(bus, SOCKET, SN_CR) != 0 && --tries != 0) continue;
}

bool w5500_start(w5500* chip) {
  const w5500_bus* bus = &chip->bus;
  const w5500_own* own = &chip->own;
  uint16_t tries = CHIP_TRIES;
  put8(bus, COMMON, MR, MR_RESET);
  while ((get8(bus, COMMON, MR) & MR_RESET) != 0 && --tries != 0) continue;
  if (tries == 0 || get8(bus, COMMON, VERSIONR) != VERSION) return false;
  put(bus, COMMON, SUBR, own->mask, sizeof(own->mask));
  put(bus, COMMON, SHAR, own->mac, sizeof(own->mac));
  put(bus, COMMON, SIPR, own->address, sizeof(own->address));
  put16(bus, COMMON, RTR, RETRY_100US);
  put8(bus, COMMON, RCR, RETRIES);
  put8(bus, SOCKET, SN_MR, MR_UDP);
  put16(bus, SOCKET, SN_PORT, own->port);
  put8(bus, SOCKET, SN_IMR, IR_RECV);
  put8(bus, COMMON, SIMR, 1);
  command(bus, CR_OPEN);
  chip->sending = chip->known = false;
  return w5500_alive(chip);
}

bool w5500_alive(const w5500* chip) {
  const w5500_bus* bus = &chip->bus;
  const w5500_own* own = &chip->own;
  uint8_t address[4];
  get(bus, COMMON, SIPR, address, sizeof(address));
  return get8(bus, SOCKET, SN_SR) == SR_UDP && get16(bus, SOCKET, SN_PORT) == own->port &&
         address[0] == own->address[0] && address[1] == own->address[1] &&
         address[2] == own->address[2] && address[3] == own->address[3];
}

/* The chip updates the value while it is read: repeated until two readings agree. */
static uint16_t received(const w5500_bus* bus) {
  uint16_t last = get16(bus, SOCKET, SN_RX_RSR);
  uint8_t tries;
  for (tries = 8; tries != 0; --tries) {
    const uint16_t again = get16(bus, SOCKET, SN_RX_RSR);
    if (again == last) break;
    last = again;
  }
  return last;
}

static void consume_until(const w5500_bus* bus, uint16_t read) {
  put16(bus, SOCKET, SN_RX_RD, read);
  command(bus, CR_RECV);
}

uint16_t w5500_receive(const w5500* chip, w5500_peer* from, uint8_t* into, uint16_t room) {
  const w5500_bus* bus = &chip->bus;
  uint8_t header[UDP_HEADER];
  uint16_t waiting, read, size;
  uint8_t i;
  put8(bus, SOCKET, SN_IR, IR_RECV); /* before reading: later data causes another interrupt */
  waiting = received(bus);
  if (waiting == 0) return 0;
  read = get16(bus, SOCKET, SN_RX_RD);
  get(bus, RX_BUFFER, read, header, UDP_HEADER);
  size = big16(header + 6);
  if (waiting < UDP_HEADER || waiting > BUFFER || size > waiting - UDP_HEADER) {
    consume_until(bus, (uint16_t)(read + waiting)); /* no datagram begins here: discard all */
    return 0;
  }
  for (i = 0; i < 4; ++i) from->address[i] = header[i];
  from->port = big16(header + 4);
  if (size <= room) get(bus, RX_BUFFER, (uint16_t)(read + UDP_HEADER), into, size);
  consume_until(bus, (uint16_t)(read + UDP_HEADER + size));
  return size;
}

bool w5500_free(w5500* chip) {
  const uint8_t done = IR_SEND_OK | IR_TIMEOUT;
  if (chip->sending) {
    const uint8_t how = get8(&chip->bus, SOCKET, SN_IR) & done;
    if (how == 0) return false;
    put8(&chip->bus, SOCKET, SN_IR, done);
    chip->sending = false;
    chip->known = (how & IR_TIMEOUT) == 0;
  }
  return true;
}

void w5500_load(w5500* chip, const w5500_peer* to, const uint8_t* bytes, uint8_t size) {
  const w5500_bus* bus = &chip->bus;
  const uint16_t sent = get16(bus, SOCKET, SN_TX_RD);
  if (memcmp(to->address, chip->to.address, sizeof(to->address)) != 0) chip->known = false;
  chip->to = *to;
  put(bus, SOCKET, SN_DIPR, to->address, sizeof(to->address));
  put16(bus, SOCKET, SN_DPORT, to->port);
  put(bus, TX_BUFFER, sent, bytes, size);
  put16(bus, SOCKET, SN_TX_WR, (uint16_t)(sent + size));
}

void w5500_go(w5500* chip) {
  chip->sending = true;
  command(&chip->bus, chip->known ? CR_SEND_MAC : CR_SEND);
}
