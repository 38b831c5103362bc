/* Serial line: bytes are transferred in interrupts, frames in the main loop. */

#include <avr/cpufunc.h>
#include <avr/interrupt.h>
#include <util/atomic.h>

#include "board.h"

enum {
  BYTES = 128, /* more than two of the longest frames */
  BYTES_MASK = BYTES - 1,
  STAMPS = 16, /* pending ends of frames */
  STAMPS_MASK = STAMPS - 1,
  NEARLY_TICKS = 40, /* waited for with interrupts off: the receiver buffers two bytes, 20 us */
  LATEST_TICKS = 4
};

static uint8_t bytes[BYTES];
static volatile uint8_t bytes_in, bytes_out;
static uint32_t stamps[STAMPS];
static volatile uint8_t stamps_in, stamps_out;

static const uint8_t* volatile sending;
static volatile uint8_t left;

uint32_t uart_start(void) {
  uint32_t baud = CTP_DEFAULT_BAUD;
  uint16_t divider = 1; /* of clock / 8; exact */
  PORTD |= (1 << BAUD_250K_BIT) | (1 << BAUD_115K_BIT);
  _NOP();
  _NOP(); /* a pin is read one clock after it was set */
  if ((PIND & (1 << BAUD_250K_BIT)) == 0) {
    baud = 250000;
    divider = 7; /* exact */
  } else if ((PIND & (1 << BAUD_115K_BIT)) == 0) {
    baud = 115200;
    divider = 16; /* 117 647: 2.1 % fast, within the tolerance of 8N1 */
  }
  UCSR0A = (1 << U2X0); /* before the divider */
  UBRR0 = divider;
  UCSR0C = (1 << UCSZ01) | (1 << UCSZ00);
  UCSR0B = (1 << RXCIE0) | (1 << RXEN0) | (1 << TXEN0);
  return baud;
}

ISR(USART_RX_vect) {
  const uint8_t byte = UDR0;
  const uint8_t next = (uint8_t)((bytes_in + 1) & BYTES_MASK);
  if (next == bytes_out) return; /* lost: detected by the frame's CRC */
  if (byte == 0) {
    const uint8_t stamp = (uint8_t)((stamps_in + 1) & STAMPS_MASK);
    if (stamp == stamps_out) return;
    stamps[stamps_in] = clock_now_in_interrupt();
    stamps_in = stamp;
  }
  bytes[bytes_in] = byte;
  bytes_in = next;
  if (byte == 0) wake_up(); /* a frame ends with it */
}

bool uart_take(uint8_t* byte, uint32_t* t) {
  const uint8_t out = bytes_out;
  if (out == bytes_in) return false;
  *byte = bytes[out];
  if (*byte == 0) {
    const uint8_t stamp = stamps_out;
    *t = stamps[stamp];
    stamps_out = (uint8_t)((stamp + 1) & STAMPS_MASK);
  }
  bytes_out = (uint8_t)((out + 1) & BYTES_MASK);
  return true;
}

ISR(USART_UDRE_vect) {
  const uint8_t* at = sending;
  UDR0 = *at;
  sending = at + 1;
  if (--left == 0) {
    UCSR0B &= (uint8_t) ~(1 << UDRIE0);
    wake_up();
  }
}

bool uart_free(void) { return left == 0; }

void uart_send(const uint8_t* frame, uint8_t size) {
  sending = frame;
  left = size;
  UCSR0B |= (1 << UDRIE0);
}

bool uart_send_at(const uint8_t* frame, uint8_t size, uint32_t begin) {
  bool sent = false;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { /* otherwise other interrupts could separate time and byte */
    const int32_t early = (int32_t)(begin - clock_now_in_interrupt());
    if (early <= NEARLY_TICKS && early >= -LATEST_TICKS) {
      while ((int16_t)((uint16_t)begin - TCNT1) > 0) continue;
      UDR0 = frame[0];
      uart_send(frame + 1, (uint8_t)(size - 1));
      sent = true;
    }
  }
  return sent;
}
