/* Preloaded into a test so that the unmodified libserialport opens a pseudo-terminal. It answers
 * the two calls that a pseudo-terminal refuses, and nothing else:
 *   - /sys/class/tty/pts/N, which libserialport looks a port up in, 'is' a symlink;
 *   - the modem lines (TIOCMGET and its kin) are there, and all off. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <stdarg.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>

static const char kTtys[] = "/sys/class/tty/pts/";
static const char kTarget[] = "../../devices/virtual/tty/pts";

static int is_pseudo(const char* path) { return strncmp(path, kTtys, sizeof(kTtys) - 1) == 0; }

int __lxstat(int version, const char* path, struct stat* info);

int __lxstat(int version, const char* path, struct stat* info) {
  static int (*real)(int, const char*, struct stat*);
  if (is_pseudo(path)) {
    memset(info, 0, sizeof(*info));
    info->st_mode = S_IFLNK | 0777;
    return 0;
  }
  if (!real) *(void**)&real = dlsym(RTLD_NEXT, "__lxstat");
  return real(version, path, info);
}

ssize_t readlink(const char* path, char* buffer, size_t size) {
  static ssize_t (*real)(const char*, char*, size_t);
  if (is_pseudo(path)) {
    const size_t n = sizeof(kTarget) - 1 < size ? sizeof(kTarget) - 1 : size;
    memcpy(buffer, kTarget, n);
    return (ssize_t)n;
  }
  if (!real) *(void**)&real = dlsym(RTLD_NEXT, "readlink");
  return real(path, buffer, size);
}

int ioctl(int fd, unsigned long request, ...) {
  static int (*real)(int, unsigned long, void*);
  va_list args;
  void* argument;
  int result;
  va_start(args, request);
  argument = va_arg(args, void*);
  va_end(args);
  if (!real) *(void**)&real = dlsym(RTLD_NEXT, "ioctl");
  result = real(fd, request, argument);
  if (result == 0 || errno == EBADF || !isatty(fd)) return result;
  if (request == TIOCMGET) {
    *(int*)argument = 0;
    return 0;
  }
  if (request == TIOCMSET || request == TIOCMBIS || request == TIOCMBIC) return 0;
  return result;
}
