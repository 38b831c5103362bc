/* The converter measures the voltages in turn, 52 us each, by interrupt: the main loop may
 * sleep. At 250 kHz it keeps about nine of its ten bits; the bands require six. */

#include <avr/interrupt.h>
#include <util/atomic.h>

#include "board.h"

enum { SENSE_CHANNEL = 0, FEED_CHANNEL = 1, EARTH_CHANNEL = 2, CHANNELS = 3, FULL_SCALE_BITS = 10 };

static volatile uint16_t counts[CHANNELS]; /* current round */
static volatile uint16_t whole[CHANNELS];  /* last complete round */
static volatile uint8_t channel;
static volatile bool fresh;

static void convert(void) {
  ADMUX = (uint8_t)((1 << REFS0) | channel); /* reference: the supply */
  ADCSRA = (1 << ADEN) | (1 << ADSC) | (1 << ADIE) | (1 << ADPS2) | (1 << ADPS1); /* 250 kHz */
}

ISR(ADC_vect) {
  counts[channel] = ADC;
  if (++channel == CHANNELS) {
    channel = SENSE_CHANNEL;
    whole[SENSE_CHANNEL] = counts[SENSE_CHANNEL];
    whole[FEED_CHANNEL] = counts[FEED_CHANNEL];
    whole[EARTH_CHANNEL] = counts[EARTH_CHANNEL];
    fresh = true; /* the main loop polls often enough */
  }
  convert();
}

static uint16_t millivolts(uint16_t count) {
  return (uint16_t)(((uint32_t)count * SUPPLY_MV) >> FULL_SCALE_BITS);
}

void analog_start(void) {
  DIDR0 = (1 << ADC0D) | (1 << ADC1D) | (1 << ADC2D);
  convert();
}

bool analog_take(sensor_voltages* mv) {
  uint16_t sense, feed, earth;
  if (!fresh) return false;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    fresh = false;
    sense = whole[SENSE_CHANNEL];
    feed = whole[FEED_CHANNEL];
    earth = whole[EARTH_CHANNEL];
  }
  mv->sense = millivolts(sense);
  mv->feed = millivolts(feed);
  mv->earth = millivolts(earth);
  return true;
}
