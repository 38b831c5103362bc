/* Start-up, pins, and watchdog of the chip. */

#include "board.h"
#include "drivers/contact/wire/ctp.h"
#include "registers.h"

enum {
  STARTUP = 47,      /* of 256 cycles of 12 MHz: 1 ms */
  MULTIPLY = 100,    /* 1200 MHz, of which the divisors 5 and 2 make 120 */
  DIVISORS = 5 << 16 | 2 << 12,
  CYCLES_PER_US = 12,
  WATCHDOG_COUNTS = 2 * 60000 /* it counts each microsecond twice (erratum E1) */
};
#define XOSC_ON ((0xFABu << 12) | 0xAA0u)
#define ALL_BUT_OSCILLATORS 0x1FFFCu

const board_settings settings __attribute__((section(".settings"), used)) = {
    {'c', 'e', 'l', 'l', 'c', 'a', 'l', '1'},
    {169, 254, 67, 84},
    {255, 255, 0, 0},
    {0x02, 'c', 'e', 'l', 0, 1},
    {4300 >> 8, 4300 & 0xFF}};

static void start_clocks(void) {
  REGISTER(XOSC_STARTUP) = STARTUP;
  REGISTER(XOSC_CTRL) = XOSC_ON;
  while ((REGISTER(XOSC_STATUS) & XOSC_STABLE) == 0) continue;
  REGISTER(CLK_REF_CTRL) = CLK_REF_SRC_XOSC;
  while (REGISTER(CLK_REF_SELECTED) != 1u << CLK_REF_SRC_XOSC) continue;
  REGISTER(PLL_CS) = 1;
  REGISTER(PLL_FBDIV) = MULTIPLY;
  CLEAR(PLL_PWR) = PLL_PD | PLL_VCOPD;
  while ((REGISTER(PLL_CS) & PLL_LOCK) == 0) continue;
  REGISTER(PLL_PRIM) = DIVISORS;
  CLEAR(PLL_PWR) = PLL_POSTDIVPD;
  SET(CLK_SYS_CTRL) = CLK_SYS_SRC_AUX;
  while (REGISTER(CLK_SYS_SELECTED) != 1u << CLK_SYS_SRC_AUX) continue;
  REGISTER(CLK_PERI_CTRL) = CLK_ENABLE;
  REGISTER(CLK_ADC_CTRL) = CLK_AUX_XOSC | CLK_ENABLE;
  REGISTER(WATCHDOG_TICK) = WATCHDOG_TICK_ENABLE | CYCLES_PER_US; /* also for the timer */
}

static void release(uint32_t blocks) {
  CLEAR(RESETS_RESET) = blocks;
  while ((REGISTER(RESETS_DONE) & blocks) != blocks) continue;
}

void chip_start(void) {
  release(RESET_IO_BANK0 | RESET_PADS_BANK0 | RESET_PLL_SYS);
  start_clocks();
  release(RESET_ADC | RESET_SPI0 | RESET_TIMER);
  REGISTER(PSM_WDSEL) = ALL_BUT_OSCILLATORS;
  chip_feed();
  SET(WATCHDOG_CTRL) = WATCHDOG_ENABLE;
}

void chip_feed(void) { REGISTER(WATCHDOG_LOAD) = WATCHDOG_COUNTS; }

uint8_t chip_reset_cause(void) {
  const uint32_t why = REGISTER(CHIP_RESET);
  if (REGISTER(WATCHDOG_REASON) != 0) return CTP_RESET_WATCHDOG;
  return (uint8_t)((why & CHIP_RESET_BY_POWER ? CTP_RESET_POWER : 0) |
                   (why & CHIP_RESET_BY_PIN ? CTP_RESET_PIN : 0));
}

/* From the ring oscillator, which drives nothing else: two bits for one, which removes its bias
 * (von Neumann), mixed with the time needed. */
uint32_t chip_random(void) {
  uint32_t value = 2166136261u;
  uint8_t bits;
  for (bits = 0; bits < 64;) {
    const uint32_t a = REGISTER(ROSC_RANDOM_BIT) & 1u, since = clock_now();
    while (clock_now() == since) continue;
    if ((REGISTER(ROSC_RANDOM_BIT) & 1u) == a) continue;
    value = ((value ^ a) * 16777619u) ^ (value >> 15);
    ++bits;
  }
  return value != 0 ? value : 1;
}

static void function(unsigned pin, uint32_t what) {
  REGISTER(PADS_GPIO(pin)) = PAD_INPUT | PAD_SCHMITT;
  REGISTER(GPIO_CTRL(pin)) = what;
}

void pin_output(unsigned pin, bool high) {
  REGISTER(high ? SIO_OUT_SET : SIO_OUT_CLEAR) = 1u << pin;
  REGISTER(SIO_ENABLE_SET) = 1u << pin;
  function(pin, FUNCTION_SIO);
}

void pin_input(unsigned pin) {
  REGISTER(SIO_ENABLE_CLEAR) = 1u << pin;
  function(pin, FUNCTION_SIO);
}

bool pin_is_high(unsigned pin) { return (REGISTER(SIO_IN) & (1u << pin)) != 0; }

void pin_pull_up(unsigned pin, bool on) {
  if (on) {
    SET(PADS_GPIO(pin)) = PAD_PULL_UP;
  } else {
    CLEAR(PADS_GPIO(pin)) = PAD_PULL_UP;
  }
}
