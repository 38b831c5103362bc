/* The converter measures the voltages in turn, 8 us each (96 cycles of the crystal's 12 MHz);
 * the main loop polls for completion. */

#include "board.h"
#include "registers.h"

enum { SENSE, FEED, EARTH, CHANNELS, FULL_SCALE_BITS = 12 };

static uint16_t counts[CHANNELS];
static uint8_t channel;

static void convert(void) {
  REGISTER(ADC_CS) = ADC_ENABLE | ADC_START | (uint32_t)channel << ADC_INPUT_AT;
}

void analog_start(void) {
  unsigned pin;
  for (pin = SENSE_VOLTAGE_PIN; pin < SENSE_VOLTAGE_PIN + CHANNELS; ++pin) {
    REGISTER(PADS_GPIO(pin)) = PAD_OFF; /* neither driven nor read digitally */
    REGISTER(GPIO_CTRL(pin)) = FUNCTION_NONE;
  }
  REGISTER(ADC_CS) = ADC_ENABLE;
  while ((REGISTER(ADC_CS) & ADC_READY) == 0) continue;
  convert();
}

static uint16_t millivolts(uint16_t count) {
  return (uint16_t)(((uint32_t)count * SUPPLY_MV) >> FULL_SCALE_BITS);
}

bool analog_take(sensor_voltages* mv) {
  bool whole;
  if ((REGISTER(ADC_CS) & ADC_READY) == 0) return false;
  counts[channel] = (uint16_t)REGISTER(ADC_RESULT);
  whole = ++channel == CHANNELS;
  if (whole) channel = SENSE;
  convert();
  mv->sense = millivolts(counts[SENSE]);
  mv->feed = millivolts(counts[FEED]);
  mv->earth = millivolts(counts[EARTH]);
  return whole;
}
