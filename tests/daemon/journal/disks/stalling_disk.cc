#include "tests/daemon/journal/disks/stalling_disk.h"

#include <sqlite3.h>

#include <condition_variable>
#include <mutex>

namespace cellcal::daemon::testing {

namespace {

struct Gate {
  std::mutex mutex;
  std::condition_variable changed;
  bool closed = false;
  int waiting = 0;

  void pass() {
    std::unique_lock lock(mutex);
    ++waiting;
    changed.notify_all();
    changed.wait(lock, [this] { return !closed; });
    --waiting;
  }
};

Gate& gate() {
  static Gate the_gate;
  return the_gate;
}

/// Wrapper of the system's file, which follows it in memory.
struct File {
  sqlite3_file base;
};
sqlite3_file* real(sqlite3_file* file) {
  return reinterpret_cast<sqlite3_file*>(reinterpret_cast<File*>(file) + 1);
}
sqlite3_vfs* system_of(sqlite3_vfs* vfs) { return static_cast<sqlite3_vfs*>(vfs->pAppData); }

// Version 1 of the methods: with exclusive locking the log needs no shared memory.
const sqlite3_io_methods kMethods{
    1,
    [](sqlite3_file* f) { return real(f)->pMethods->xClose(real(f)); },
    [](sqlite3_file* f, void* to, int n, sqlite3_int64 at) {
      return real(f)->pMethods->xRead(real(f), to, n, at);
    },
    [](sqlite3_file* f, const void* from, int n, sqlite3_int64 at) {
      return real(f)->pMethods->xWrite(real(f), from, n, at);
    },
    [](sqlite3_file* f, sqlite3_int64 size) { return real(f)->pMethods->xTruncate(real(f), size); },
    [](sqlite3_file* f, int flags) {
      gate().pass();
      return real(f)->pMethods->xSync(real(f), flags);
    },
    [](sqlite3_file* f, sqlite3_int64* size) {
      return real(f)->pMethods->xFileSize(real(f), size);
    },
    [](sqlite3_file* f, int lock) { return real(f)->pMethods->xLock(real(f), lock); },
    [](sqlite3_file* f, int lock) { return real(f)->pMethods->xUnlock(real(f), lock); },
    [](sqlite3_file* f, int* out) { return real(f)->pMethods->xCheckReservedLock(real(f), out); },
    [](sqlite3_file* f, int op, void* arg) {
      return real(f)->pMethods->xFileControl(real(f), op, arg);
    },
    [](sqlite3_file* f) { return real(f)->pMethods->xSectorSize(real(f)); },
    [](sqlite3_file* f) { return real(f)->pMethods->xDeviceCharacteristics(real(f)); },
    nullptr,
    nullptr,
    nullptr,
    nullptr,
    nullptr,
    nullptr};

int open_file(sqlite3_vfs* vfs, const char* name, sqlite3_file* file, int flags, int* out) {
  const int code = system_of(vfs)->xOpen(system_of(vfs), name, real(file), flags, out);
  file->pMethods = real(file)->pMethods == nullptr ? nullptr : &kMethods;
  return code;
}

sqlite3_vfs& stalling() {
  static sqlite3_vfs vfs;
  return vfs;
}

}  // namespace

StallingDisk::StallingDisk() {
  sqlite3_vfs* usual = sqlite3_vfs_find("unix");
  stalling() = *usual;
  stalling().szOsFile = static_cast<int>(sizeof(File)) + usual->szOsFile;
  stalling().zName = "stalling";
  stalling().pNext = nullptr;
  stalling().pAppData = usual;
  stalling().xOpen = open_file;
  // The other methods take no file; they may be the system's own, which use their own vfs only.
  stalling().xDelete = [](sqlite3_vfs* v, const char* name, int sync) {
    return system_of(v)->xDelete(system_of(v), name, sync);
  };
  stalling().xAccess = [](sqlite3_vfs* v, const char* name, int flags, int* out) {
    return system_of(v)->xAccess(system_of(v), name, flags, out);
  };
  stalling().xFullPathname = [](sqlite3_vfs* v, const char* name, int n, char* out) {
    return system_of(v)->xFullPathname(system_of(v), name, n, out);
  };
  sqlite3_vfs_register(&stalling(), 1);
}

StallingDisk::~StallingDisk() {
  release();
  sqlite3_vfs_unregister(&stalling());
  sqlite3_vfs_register(sqlite3_vfs_find("unix"), 1);
}

void StallingDisk::stall() {
  const std::lock_guard lock(gate().mutex);
  gate().closed = true;
}

void StallingDisk::release() {
  const std::lock_guard lock(gate().mutex);
  gate().closed = false;
  gate().changed.notify_all();
}

void StallingDisk::wait_until_stalled() {
  std::unique_lock lock(gate().mutex);
  gate().changed.wait(lock, [] { return gate().closed && gate().waiting > 0; });
}

}  // namespace cellcal::daemon::testing
