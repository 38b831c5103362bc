// A disk that stalls, preloaded before the system library: while the file $STALL_WHILE exists, no
// sync returns. The first waiting one creates a file next to it (".met").

#include <dlfcn.h>
#include <fcntl.h>
#include <unistd.h>

#include <cstdlib>
#include <string>

namespace {

void wait_for_disk() {
  const char* file = std::getenv("STALL_WHILE");
  if (file == nullptr) return;
  constexpr useconds_t kPollUs = 1000;
  while (::access(file, F_OK) == 0) {
    const int met = ::open((std::string(file) + ".met").c_str(), O_CREAT | O_WRONLY, 0600);
    if (met >= 0) ::close(met);
    ::usleep(kPollUs);
  }
}

int after_waiting(const char* name, int descriptor) {
  wait_for_disk();
  return reinterpret_cast<int (*)(int)>(::dlsym(RTLD_NEXT, name))(descriptor);
}

}  // namespace

extern "C" int fdatasync(int descriptor) { return after_waiting("fdatasync", descriptor); }
extern "C" int fsync(int descriptor) { return after_waiting("fsync", descriptor); }
