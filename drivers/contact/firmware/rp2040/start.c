/* Start-up of the chip: vectors, at the beginning of memory, and the call of main(). The second
 * stage (boot2.S) has copied the whole program there. */

#include <stdint.h>

extern uint32_t bss_begin, bss_end, stack_top;
int main(void);
void io_bank0_interrupt(void);

static void reset(void) {
  uint32_t* at;
  for (at = &bss_begin; at < &bss_end; ++at) *at = 0;
  main();
}

/* Faults and unexpected interrupts: the watchdog resets the chip. */
static void hang(void) {
  for (;;) continue;
}

enum { RESET = 0, IO_BANK0 = 15 + 13, VECTORS = 15 + 26 }; /* after the stack */
typedef void (*vector)(void);

__attribute__((section(".vectors"), used)) static const struct {
  void* stack;
  vector of[VECTORS];
} vectors = {&stack_top,
             {[RESET] = reset,
              [RESET + 1 ... IO_BANK0 - 1] = hang,
              [IO_BANK0] = io_bank0_interrupt,
              [IO_BANK0 + 1 ... VECTORS - 1] = hang}};
