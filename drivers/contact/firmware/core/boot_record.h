/* The boot id: a number unique to each reset, kept in EEPROM. Records form a ring, so that cells
 * wear evenly (64 records, 100 000 writes each), and carry a CRC, so that one truncated by a
 * power failure is ignored. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { BOOT_RECORDS = 64, BOOT_RECORD_SIZE = 6, BOOT_RECORD_TRIES = 4 };

/* Bytes at 0 .. BOOT_RECORDS * BOOT_RECORD_SIZE - 1. write() returns when the byte is stored. */
typedef struct {
  uint8_t (*read)(void* context, uint16_t at);
  void (*write)(void* context, uint16_t at, uint8_t value);
  void* context;
} boot_memory;

/* Increments the boot id, 1 or more, and stores it. False: it could not be stored, the memory is
 * worn out, and the same id may recur. */
bool boot_record_next(const boot_memory* memory, uint32_t* boot_id);

#ifdef __cplusplus
}
#endif
