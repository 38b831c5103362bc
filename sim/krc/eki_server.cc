#include "sim/krc/eki_server.h"

#include <atomic>
#include <mutex>
#include <thread>

#include "sim/hard_clock.h"
#include "sim/krc/eki_socket.h"

namespace cellcal::sim {

using drivers::TimePoint;

struct EkiServer::Impl {
  Impl(EkiControllerConfig config, EkiServerOptions o, CycleHook hook)
      : options(std::move(o)), on_cycle(std::move(hook)), controller(std::move(config)) {}

  void run() {
    if (options.realtime) run_as_hardware();
    TimePoint next = std::chrono::steady_clock::now();
    while (!stopping.load()) {
      next += controller.cycle();
      sleep_until(next);
      const std::lock_guard lock(mutex);
      cycle(next);
    }
  }

  void cycle(TimePoint now) {
    const bool cable = !unplugged.load();
    if (cable) client.take(controller);
    controller.tick(now);
    if (on_cycle) on_cycle(controller, now);
    client.collect(controller);
    if (cable) client.give(controller);
  }

  EkiServerOptions options;
  CycleHook on_cycle;
  std::mutex mutex;
  EkiController controller;
  OneClientPort<EkiController> client;
  std::atomic<bool> stopping{false}, unplugged{false};
  std::thread thread;
};

EkiServer::EkiServer(EkiControllerConfig config, EkiServerOptions options, CycleHook on_cycle)
    : impl_(std::make_unique<Impl>(std::move(config), std::move(options), std::move(on_cycle))) {}

EkiServer::~EkiServer() { stop(); }

void EkiServer::start() {
  if (impl_->thread.joinable()) return;
  if (!impl_->client.is_open()) {
    impl_->client.open(impl_->options.address,
                       impl_->options.port.value_or(impl_->controller.channel().config().port));
  }
  impl_->stopping = false;
  impl_->controller.start_program();
  impl_->thread = std::thread([impl = impl_.get()] { impl->run(); });
}

void EkiServer::stop() {
  impl_->stopping = true;
  if (impl_->thread.joinable()) impl_->thread.join();
}

void EkiServer::with(const std::function<void(EkiController&)>& use) {
  const std::lock_guard lock(impl_->mutex);
  use(impl_->controller);
}

void EkiServer::unplug(bool unplugged) { impl_->unplugged = unplugged; }
std::uint16_t EkiServer::port() const { return impl_->client.port(); }
std::uint64_t EkiServer::refused_clients() const { return impl_->client.refused(); }

}  // namespace cellcal::sim
