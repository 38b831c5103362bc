#include "drivers/io_thread.h"

#include <pthread.h>
#include <sched.h>
#include <spdlog/spdlog.h>
#include <sys/mman.h>
#include <sys/resource.h>

#include <atomic>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstring>
#include <exception>
#include <fstream>
#include <future>
#include <thread>

namespace cellcal::drivers {
namespace {

// Bit of CAP_IPC_LOCK in the capability masks (linux/capability.h).
constexpr unsigned kCapIpcLock = 14;

constexpr std::chrono::milliseconds kBeat{100};

bool may_lock_everything() {
  // With a finite RLIMIT_MEMLOCK and without the capability, mlockall(MCL_FUTURE) succeeds and
  // then makes allocations fail later, when the limit is reached: worse than not locking.
  rlimit limit{};
  if (getrlimit(RLIMIT_MEMLOCK, &limit) == 0 && limit.rlim_cur == RLIM_INFINITY) return true;
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind("CapEff:", 0) == 0) {
      return (std::stoull(line.substr(7), nullptr, 16) >> kCapIpcLock & 1U) != 0;
    }
  }
  return false;
}

void request_realtime(int priority, std::vector<std::string>& warnings) {
  sched_param param{};
  param.sched_priority = priority;
  if (const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &param); error != 0) {
    warnings.push_back("no real-time priority for the robot's thread (SCHED_FIFO: " +
                       std::string(std::strerror(error)) +
                       "): replies can be late under load. Grant LimitRTPRIO or CAP_SYS_NICE");
  }
  if (!may_lock_everything()) {
    warnings.emplace_back(
        "memory is not locked (RLIMIT_MEMLOCK is finite): page faults can delay replies. Grant "
        "LimitMEMLOCK=infinity or CAP_IPC_LOCK");
  } else if (mlockall(MCL_CURRENT | MCL_FUTURE) != 0) {
    warnings.push_back("memory is not locked (mlockall: " + std::string(std::strerror(errno)) +
                       "): page faults can delay replies. Grant LimitMEMLOCK=infinity");
  }
}

}  // namespace

struct IoThread::Impl {
  explicit Impl(IoThreadOptions o) : options(std::move(o)) {}

  IoThreadOptions options;
  boost::asio::io_context context{1};
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work{
      context.get_executor()};
  boost::asio::steady_timer beat{context};
  std::atomic<std::uint64_t> beats{0};
  std::thread thread;
  std::vector<std::string> warnings;

  /// Runs on the thread itself, so that the memory of one wait is reused by the next.
  void send_heartbeats() {
    beat.expires_after(kBeat);
    beat.async_wait([this](const boost::system::error_code& error) {
      if (error) return;
      beats.fetch_add(1, std::memory_order_relaxed);
      send_heartbeats();
    });
  }
};

IoThread::IoThread(IoThreadOptions options) : impl_(std::make_unique<Impl>(std::move(options))) {}

IoThread::~IoThread() { stop(); }

void IoThread::start() {
  if (impl_->thread.joinable()) return;
  std::promise<void> settled;
  impl_->thread = std::thread([impl = impl_.get(), &settled] {
    pthread_setname_np(pthread_self(), impl->options.name.substr(0, 15).c_str());
    if (impl->options.realtime) request_realtime(impl->options.priority, impl->warnings);
    settled.set_value();
    try {
      impl->send_heartbeats();
      impl->context.run();
    } catch (const std::exception& e) {
      // A handler threw: the owner of the robot must not continue in a partial state. Ending the
      // process is safe, since without replies the controller's own time-out keeps the arm at rest.
      spdlog::critical("robot I/O thread failed: {}", e.what());
      std::terminate();
    }
  });
  settled.get_future().wait();
  if (impl_->options.quiet) return;
  for (const std::string& warning : impl_->warnings) spdlog::warn("{}", warning);
}

void IoThread::stop() {
  impl_->work.reset();
  impl_->context.stop();
  if (impl_->thread.joinable()) impl_->thread.join();
}

boost::asio::io_context& IoThread::context() { return impl_->context; }

std::uint64_t IoThread::beats() const { return impl_->beats.load(std::memory_order_relaxed); }

const std::vector<std::string>& IoThread::warnings() const { return impl_->warnings; }

}  // namespace cellcal::drivers
