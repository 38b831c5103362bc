/* The shared header must compile as in the firmware. */
#include "drivers/contact/wire/ctp.h"

int ctp_c99_compiles(void);

int ctp_c99_compiles(void) {
  uint8_t bytes[4];
  ctp_put_u32(bytes, 0x01020304u);
  return ctp_get_u32(bytes) == 0x01020304u && ctp_crc16(bytes, 0) == CTP_CONFIG_NONE;
}
