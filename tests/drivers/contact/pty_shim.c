/* Preloaded into a test so that the unmodified libserialport opens a pseudo-terminal. It emulates
 * the two calls that a pseudo-terminal refuses:
 *   - /sys/class/tty/pts/N, where libserialport looks up a port, 'is' a symlink;
 *   - the modem lines (TIOCMGET etc.) exist, and are all off.
 * Other faults of a real port are injected on demand, see pty_shim.h. */
#define _GNU_SOURCE
#include "pty_shim.h"

#include <dlfcn.h>
#include <errno.h>
#include <linux/serial.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

static atomic_int adapter, serial_flags, reads_to_fail, read_errno, writes_to_cut;

void pty_shim_adapter(enum pty_shim_adapter_kind kind) { adapter = (int)kind; }
int pty_shim_serial_flags(void) { return serial_flags; }
void pty_shim_fail_reads(int count, int error) {
  read_errno = error;
  reads_to_fail = count;
}
void pty_shim_cut_writes(int count) { writes_to_cut = count; }

/* True once for each of the `left` times. */
static int take(atomic_int* left) {
  int n = *left;
  while (n > 0) {
    if (atomic_compare_exchange_weak(left, &n, n - 1)) return 1;
  }
  return 0;
}

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
  if (adapter != PTY_SHIM_NONE && request == TIOCGSERIAL) {
    memset(argument, 0, sizeof(struct serial_struct));
    return 0;
  }
  if (adapter != PTY_SHIM_NONE && request == TIOCSSERIAL) {
    if (adapter == PTY_SHIM_REFUSES_LOW_LATENCY) {
      errno = EPERM;
      return -1;
    }
    serial_flags = ((const struct serial_struct*)argument)->flags;
    return 0;
  }
  result = real(fd, request, argument);
  if (result == 0 || errno == EBADF || !isatty(fd)) return result;
  if (request == TIOCMGET) {
    *(int*)argument = 0;
    return 0;
  }
  if (request == TIOCMSET || request == TIOCMBIS || request == TIOCMBIC) return 0;
  return result;
}

/* The timer of an FTDI adapter, as opened by the C++ library, which requires a real descriptor. */
static FILE* timer_file(void) {
  static const char timer[] = "16\n";
  const int fd = memfd_create("latency_timer", 0);
  if (fd < 0 || write(fd, timer, sizeof(timer) - 1) < 0 || lseek(fd, 0, SEEK_SET) != 0) return NULL;
  return fdopen(fd, "r");
}

static int is_timer(const char* path) {
  return adapter == PTY_SHIM_REFUSES_LOW_LATENCY && strstr(path, "/latency_timer") != NULL;
}

FILE* fopen64(const char* path, const char* mode) {
  static FILE* (*real)(const char*, const char*);
  if (is_timer(path)) return timer_file();
  if (!real) *(void**)&real = dlsym(RTLD_NEXT, "fopen64");
  return real(path, mode);
}

ssize_t read(int fd, void* buffer, size_t size) {
  static ssize_t (*real)(int, void*, size_t);
  if (!real) *(void**)&real = dlsym(RTLD_NEXT, "read");
  /* Only the port: it is exclusive, unlike the other end and all other descriptors. */
  int exclusive = 0;
  if (reads_to_fail > 0 && ioctl(fd, TIOCGEXCL, &exclusive) == 0 && exclusive &&
      take(&reads_to_fail)) {
    errno = read_errno;
    return -1;
  }
  return real(fd, buffer, size);
}

ssize_t write(int fd, const void* buffer, size_t size) {
  static ssize_t (*real)(int, const void*, size_t);
  if (!real) *(void**)&real = dlsym(RTLD_NEXT, "write");
  int exclusive = 0;
  if (writes_to_cut > 0 && ioctl(fd, TIOCGEXCL, &exclusive) == 0 && exclusive &&
      take(&writes_to_cut)) {
    return real(fd, buffer, size / 2);
  }
  return real(fd, buffer, size);
}
