/* The RP2040's registers used here (data sheet, build 2024-10). */
#pragma once

#include <stdint.h>

#define REGISTER(at) (*(volatile uint32_t*)(at))
/* Alias of a register in which written bits are set or cleared. */
#define SET(at) REGISTER((at) + 0x2000u)
#define CLEAR(at) REGISTER((at) + 0x3000u)

#define PSM_WDSEL 0x40010008u

#define CLOCKS_BASE 0x40008000u
#define CLK_REF_CTRL (CLOCKS_BASE + 0x30u)
#define CLK_REF_SELECTED (CLOCKS_BASE + 0x38u)
#define CLK_SYS_CTRL (CLOCKS_BASE + 0x3Cu)
#define CLK_SYS_SELECTED (CLOCKS_BASE + 0x44u)
#define CLK_PERI_CTRL (CLOCKS_BASE + 0x48u)
#define CLK_ADC_CTRL (CLOCKS_BASE + 0x60u)
enum {
  CLK_REF_SRC_XOSC = 2,
  CLK_SYS_SRC_AUX = 1, /* whose source, 0, is the system's PLL */
  CLK_AUX_XOSC = 3 << 5,
  CLK_ENABLE = 1 << 11
};

#define RESETS_RESET 0x4000C000u
#define RESETS_DONE 0x4000C008u
enum {
  RESET_ADC = 1 << 0,
  RESET_IO_BANK0 = 1 << 5,
  RESET_PADS_BANK0 = 1 << 8,
  RESET_PLL_SYS = 1 << 12,
  RESET_SPI0 = 1 << 16,
  RESET_TIMER = 1 << 21
};

#define IO_BANK0_BASE 0x40014000u
#define GPIO_CTRL(pin) (IO_BANK0_BASE + 8u * (pin) + 4u)
#define GPIO_INTR(pin) (IO_BANK0_BASE + 0xF0u + 4u * ((pin) / 8u))
#define GPIO_INTE(pin) (IO_BANK0_BASE + 0x100u + 4u * ((pin) / 8u))
#define GPIO_INTS(pin) (IO_BANK0_BASE + 0x120u + 4u * ((pin) / 8u))
#define GPIO_FALLS(pin) (4u << (4u * ((pin) % 8u)))
#define GPIO_RISES(pin) (8u << (4u * ((pin) % 8u)))
enum { FUNCTION_SPI = 1, FUNCTION_SIO = 5, FUNCTION_NONE = 31 };

#define PADS_GPIO(pin) (0x4001C004u + 4u * (pin))
enum {
  PAD_SCHMITT = 1 << 1,
  PAD_PULL_DOWN = 1 << 2,
  PAD_PULL_UP = 1 << 3,
  PAD_INPUT = 1 << 6,
  PAD_OFF = 1 << 7
};

#define XOSC_CTRL 0x40024000u
#define XOSC_STATUS 0x40024004u
#define XOSC_STARTUP 0x4002400Cu
#define XOSC_STABLE 0x80000000u

#define PLL_CS 0x40028000u
#define PLL_PWR 0x40028004u
#define PLL_FBDIV 0x40028008u
#define PLL_PRIM 0x4002800Cu
#define PLL_LOCK 0x80000000u
enum { PLL_PD = 1 << 0, PLL_POSTDIVPD = 1 << 3, PLL_VCOPD = 1 << 5 };

#define SPI0_CR0 0x4003C000u
#define SPI0_CR1 0x4003C004u
#define SPI0_DR 0x4003C008u
#define SPI0_SR 0x4003C00Cu
#define SPI0_CPSR 0x4003C010u
enum { SPI_ENABLE = 1 << 1, SPI_SR_RECEIVED = 1 << 2, SPI_8_BITS = 7 };

#define ADC_CS 0x4004C000u
#define ADC_RESULT 0x4004C004u
enum { ADC_ENABLE = 1 << 0, ADC_START = 1 << 2, ADC_READY = 1 << 8, ADC_INPUT_AT = 12 };

#define TIMER_RAW_LOW 0x40054028u

#define WATCHDOG_CTRL 0x40058000u
#define WATCHDOG_LOAD 0x40058004u
#define WATCHDOG_REASON 0x40058008u
#define WATCHDOG_TICK 0x4005802Cu
#define WATCHDOG_ENABLE 0x40000000u
enum { WATCHDOG_TICK_ENABLE = 1 << 9 };

#define ROSC_RANDOM_BIT 0x4006001Cu

#define CHIP_RESET 0x40064008u
enum { CHIP_RESET_BY_POWER = 1 << 8, CHIP_RESET_BY_PIN = 1 << 16 };

#define SIO_IN 0xD0000004u
#define SIO_OUT_SET 0xD0000014u
#define SIO_OUT_CLEAR 0xD0000018u
#define SIO_ENABLE_SET 0xD0000024u
#define SIO_ENABLE_CLEAR 0xD0000028u

#define NVIC_ENABLE 0xE000E100u
enum { IRQ_IO_BANK0 = 13 };
