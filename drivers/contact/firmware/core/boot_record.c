#include "drivers/contact/firmware/core/boot_record.h"

#include "drivers/contact/wire/ctp.h"

enum { kIdSize = 4 };

static uint16_t crc_of(const uint8_t* record) {
  /* Erased memory, all ones, must be invalid. */
  return (uint16_t)~ctp_crc16(record, kIdSize);
}

/* The id in a slot, 0: none. */
static uint32_t stored(const boot_memory* memory, uint8_t slot) {
  uint8_t record[BOOT_RECORD_SIZE];
  uint8_t i;
  for (i = 0; i < BOOT_RECORD_SIZE; ++i) {
    record[i] = memory->read(memory->context, (uint16_t)(slot * BOOT_RECORD_SIZE + i));
  }
  return ctp_get_u16(record + kIdSize) == crc_of(record) ? ctp_get_u32(record) : 0;
}

static bool store(const boot_memory* memory, uint8_t slot, uint32_t id) {
  uint8_t record[BOOT_RECORD_SIZE];
  uint8_t i;
  ctp_put_u32(record, id);
  ctp_put_u16(record + kIdSize, crc_of(record));
  for (i = 0; i < BOOT_RECORD_SIZE; ++i) {
    memory->write(memory->context, (uint16_t)(slot * BOOT_RECORD_SIZE + i), record[i]);
  }
  return stored(memory, slot) == id;
}

bool boot_record_next(const boot_memory* memory, uint32_t* boot_id) {
  uint32_t newest = 0;
  uint8_t at = BOOT_RECORDS - 1;
  uint8_t i;
  for (i = 0; i < BOOT_RECORDS; ++i) {
    const uint32_t id = stored(memory, i);
    if (id > newest) {
      newest = id;
      at = i;
    }
  }
  *boot_id = newest + 1 != 0 ? newest + 1 : 1;
  for (i = 0; i < BOOT_RECORD_TRIES; ++i) {
    at = (uint8_t)((at + 1) % BOOT_RECORDS);
    if (store(memory, at, *boot_id)) return true;
  }
  return false;
}
