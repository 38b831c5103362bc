/* The actual baud rate of the kernel, also one without a B constant. Its header is incompatible
 * with <termios.h>, hence a file of its own. */
#include "baud_of.h"

#include <asm/termbits.h>
#include <sys/ioctl.h>

int baud_of(int fd) {
  struct termios2 tio;
  if (ioctl(fd, TCGETS2, &tio) != 0) return -1;
  return (int)tio.c_ospeed;
}
