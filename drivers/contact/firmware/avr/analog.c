/* The converter measures both voltages in turn, 104 us each. */

#include "board.h"

enum { SENSE_CHANNEL = 0, FEED_CHANNEL = 1, FULL_SCALE_BITS = 10 };

static uint16_t sense;

static void convert(uint8_t channel) {
  ADMUX = (uint8_t)((1 << REFS0) | channel); /* refers to the supply */
  ADCSRA = (1 << ADEN) | (1 << ADSC) | (1 << ADPS2) | (1 << ADPS1) | (1 << ADPS0); /* 125 kHz */
}

static uint16_t millivolts(void) {
  return (uint16_t)(((uint32_t)ADC * SUPPLY_MV) >> FULL_SCALE_BITS);
}

void analog_start(void) {
  DIDR0 = (1 << ADC0D) | (1 << ADC1D);
  convert(SENSE_CHANNEL);
}

bool analog_take(uint16_t* sense_mv, uint16_t* feed_mv) {
  if ((ADCSRA & (1 << ADSC)) != 0) return false;
  if ((ADMUX & 0x0F) == SENSE_CHANNEL) {
    sense = millivolts();
    convert(FEED_CHANNEL);
    return false;
  }
  *sense_mv = sense;
  *feed_mv = millivolts();
  convert(SENSE_CHANNEL);
  return true;
}
