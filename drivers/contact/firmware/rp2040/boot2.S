/* The second stage of the start: the first 256 bytes of the flash, whose last four are a checksum
 * (image.py). The chip's ROM runs it from memory. It makes the flash readable by plain READ (03h), which every
 * chip knows, copies the program into memory, and begins it there: no fetch from the flash ever holds
 * up an interrupt. */

  .syntax unified
  .cpu cortex-m0plus
  .thumb
  .section .boot2, "ax"

  .equ SSI, 0x18000000
  .equ CTRLR0, 0x00
  .equ CTRLR1, 0x04
  .equ ENABLE, 0x08
  .equ DIVISOR, 0x14
  .equ VTOR, 0xE000ED08

  ldr r0, =SSI
  movs r1, #0
  str r1, [r0, #ENABLE]
  movs r1, #2
  str r1, [r0, #DIVISOR]
  ldr r1, =0x001F0300        /* 32 bits a word, reading behind a command */
  str r1, [r0, #CTRLR0]
  ldr r2, =SSI + 0xF4        /* SPI_CTRLR0 */
  ldr r1, =0x03000218        /* command 03h, of 8 bits; address of 24 */
  str r1, [r2]
  movs r1, #0
  str r1, [r0, #CTRLR1]
  movs r1, #1
  str r1, [r0, #ENABLE]

  ldr r0, =image_load
  ldr r1, =image_begin
  ldr r2, =image_end
1:
  ldmia r0!, {r3}
  stmia r1!, {r3}
  cmp r1, r2
  blo 1b

  ldr r0, =image_begin
  ldr r1, =VTOR
  str r0, [r1]
  ldmia r0!, {r1, r2}
  msr msp, r1
  bx r2
  .ltorg
