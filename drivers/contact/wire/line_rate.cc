#include "drivers/contact/wire/line_rate.h"

// In a separate file, since its header conflicts with <termios.h>.
#include <asm/termbits.h>
#include <sys/ioctl.h>

namespace cellcal::drivers {

bool set_line_rate(int fd, int baud) {
  termios2 tio{};
  if (::ioctl(fd, TCGETS2, &tio) != 0) return false;
  tio.c_cflag = (tio.c_cflag & ~static_cast<tcflag_t>(CBAUD)) | BOTHER;
  tio.c_cflag &= ~static_cast<tcflag_t>(CIBAUD);
  tio.c_ispeed = tio.c_ospeed = static_cast<speed_t>(baud);
  return ::ioctl(fd, TCSETS2, &tio) == 0;
}

int line_rate(int fd) {
  termios2 tio{};
  return ::ioctl(fd, TCGETS2, &tio) == 0 ? static_cast<int>(tio.c_ospeed) : 0;
}

}  // namespace cellcal::drivers
