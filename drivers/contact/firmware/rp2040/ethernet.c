/* The W5500 on SPI0: 20 MHz, mode 0. */

#include "board.h"
#include "drivers/contact/wire/ctp.h"
#include "registers.h"

enum { DIVISOR = 6 };
/* Duration of the reset, and until its clock has locked afterwards (data sheet, 5.5.1). */
#define RESET_TICKS ((uint32_t)1000 * CTP_TICKS_PER_US)
#define LOCK_TICKS ((uint32_t)50000 * CTP_TICKS_PER_US)
/* Interval of checks that the chip still has its socket, and of restarts of a chip that does not
 * answer. */
#define LOOK_TICKS ((uint32_t)100000 * CTP_TICKS_PER_US)

static w5500 chip;
static bool up;
static uint32_t looked_at, sent_at;
static uint8_t greetings; /* value at the last transmission */

static void select_chip(void* context, bool on) {
  (void)context;
  REGISTER(on ? SIO_OUT_CLEAR : SIO_OUT_SET) = 1u << CS_PIN;
}

static uint8_t exchange(void* context, uint8_t out) {
  (void)context;
  REGISTER(SPI0_DR) = out;
  while ((REGISTER(SPI0_SR) & SPI_SR_RECEIVED) == 0) continue;
  return (uint8_t)REGISTER(SPI0_DR);
}

static void wait(uint32_t ticks) {
  const uint32_t from = clock_now();
  while (clock_now() - from < ticks) chip_feed();
}

static void start_chip(void) {
  pin_output(CHIP_RESET_PIN, false);
  wait(RESET_TICKS);
  pin_output(CHIP_RESET_PIN, true);
  wait(LOCK_TICKS);
  up = w5500_start(&chip);
}

void ethernet_start(void) {
  uint8_t i;
  pin_output(CS_PIN, true);
  pin_input(MISO_PIN);
  pin_input(SCK_PIN);
  pin_input(MOSI_PIN);
  REGISTER(GPIO_CTRL(MISO_PIN)) = FUNCTION_SPI;
  REGISTER(GPIO_CTRL(SCK_PIN)) = FUNCTION_SPI;
  REGISTER(GPIO_CTRL(MOSI_PIN)) = FUNCTION_SPI;
  REGISTER(SPI0_CPSR) = DIVISOR;
  REGISTER(SPI0_CR0) = SPI_8_BITS;
  REGISTER(SPI0_CR1) = SPI_ENABLE;
  chip.bus.select = select_chip;
  chip.bus.exchange = exchange;
  for (i = 0; i < 4; ++i) chip.own.address[i] = settings.address[i];
  for (i = 0; i < 4; ++i) chip.own.mask[i] = settings.mask[i];
  for (i = 0; i < 6; ++i) chip.own.mac[i] = settings.mac[i];
  chip.own.port = (uint16_t)(settings.port[0] << 8 | settings.port[1]);
  start_chip();
}

/* A chip that lost its state by a spike is restarted; meanwhile the host receives silence. An
 * arming does not outlive it, since the keep-alive is missing for as long. */
static void watch_chip(void) {
  const uint32_t now = clock_now();
  if (up && chip.sending && now - sent_at > LOOK_TICKS) up = false;
  if (now - looked_at < LOOK_TICKS) return;
  looked_at = now;
  if (!up || !w5500_alive(&chip)) start_chip();
}

void ethernet_listen(host_link* link) {
  static uint8_t bytes[HOST_MAX_DATAGRAM];
  static bool more = true;
  w5500_peer from;
  host_address host;
  uint32_t t = 0;
  uint16_t size;
  bool called;
  watch_chip();
  if (!up) return;
  called = clock_take_call(&t);
  /* One per turn, so that a flood does not delay a trip. Further ones may be pending, without an
   * interrupt of their own. */
  if (!called && !more) return;
  if (!called) t = clock_now();
  size = w5500_receive(&chip, &from, bytes, sizeof(bytes));
  more = size != 0;
  if (size == 0) return;
  host.address = ctp_get_u32(from.address);
  host.port = from.port;
  host_link_take(link, &host, bytes, size, t);
}

bool ethernet_free(void) { return up && w5500_free(&chip); }

void ethernet_load(const host_link* link, const uint8_t* bytes, uint8_t size) {
  w5500_peer to;
  ctp_put_u32(to.address, link->host.address);
  to.port = link->host.port;
  if (greetings != link->greetings) w5500_retry(&chip);
  greetings = link->greetings;
  w5500_load(&chip, &to, bytes, size);
}

void ethernet_go(void) {
  sent_at = clock_now();
  w5500_go(&chip);
}
