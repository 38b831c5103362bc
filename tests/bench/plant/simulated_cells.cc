#include "tests/bench/plant/simulated_cells.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <mosquitto.h>
#include <mqtt_protocol.h>
#include <poll.h>

#include <array>
#include <chrono>
#include <stdexcept>
#include <utility>
#include <vector>

#include "daemon/plant/messages/fact.h"

namespace cellcal::bench {

namespace {

namespace plant = daemon::plant;
using Clock = std::chrono::steady_clock;

std::string now() {
  const auto us = std::chrono::duration_cast<std::chrono::microseconds>(
                      std::chrono::system_clock::now().time_since_epoch())
                      .count();
  constexpr std::int64_t kSecond = 1'000'000;
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:06}Z",
                     fmt::gmtime(static_cast<std::time_t>(us / kSecond)), us % kSecond);
}

plant::CellName name_of(std::size_t cell) { return {"bench", fmt::format("cell-{}", cell)}; }

}  // namespace

std::string touch_message(std::size_t cell, std::int64_t number, std::int64_t session) {
  plant::TouchFact touch{
      static_cast<std::size_t>(number), "S1",   false, {0.1, -1.5, 1.5, 0.2, 0.7, -0.3},
      std::array{1.02, 0.13, 0.54},     0.04e-3};
  return to_json(plant::Fact{name_of(cell), fmt::format("journal-{}", cell), number, now(), session,
                             std::move(touch)});
}

std::string touch_topic(std::size_t cell) {
  return to_text(plant::Topic{name_of(cell), plant::Subject::kFact, "touch"});
}

struct SimulatedCells::Impl {
  struct Free {
    void operator()(mosquitto* client) const { mosquitto_destroy(client); }
  };
  struct Cell {
    std::unique_ptr<mosquitto, Free> client;
    std::int64_t number = 0;
  };

  Impl(std::uint16_t port, std::size_t count) {
    mosquitto_lib_init();
    for (std::size_t i = 0; i < count; ++i) connect(port, i + 1);
    turn_until([&] { return connected == count; });
  }
  ~Impl() {
    cells.clear();
    mosquitto_lib_cleanup();
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  void connect(std::uint16_t port, std::size_t number) {
    Cell cell;
    cell.client.reset(mosquitto_new(fmt::format("bench-cell-{}", number).c_str(), true, this));
    mosquitto* client = cell.client.get();
    mosquitto_int_option(client, MOSQ_OPT_PROTOCOL_VERSION, MQTT_PROTOCOL_V5);
    mosquitto_int_option(client, MOSQ_OPT_TCP_NODELAY, 1);
    mosquitto_connect_callback_set(
        client, [](mosquitto*, void* self, int) { ++static_cast<Impl*>(self)->connected; });
    mosquitto_publish_callback_set(
        client, [](mosquitto*, void* self, int) { ++static_cast<Impl*>(self)->acknowledged; });
    require(mosquitto_connect(client, "127.0.0.1", port, 600));
    cells.push_back(std::move(cell));
    turn(0);  // the backlog of connections is short
  }

  static void require(int code) {
    if (code != MOSQ_ERR_SUCCESS) throw std::runtime_error(mosquitto_strerror(code));
  }

  void publish(std::size_t index, std::int64_t session) {
    Cell& cell = cells[index];
    const std::string text = touch_message(index + 1, ++cell.number, session);
    require(mosquitto_publish(cell.client.get(), nullptr, touch_topic(index + 1).c_str(),
                              static_cast<int>(text.size()), text.data(), 1, false));
    ++published;
  }

  /// Handles all pending socket events, waiting up to `wait_ms` for them.
  void turn(int wait_ms) {
    sockets.resize(cells.size());
    for (std::size_t i = 0; i < cells.size(); ++i) {
      mosquitto* client = cells[i].client.get();
      const bool write = mosquitto_want_write(client);
      sockets[i] = {mosquitto_socket(client), static_cast<short>(write ? POLLIN | POLLOUT : POLLIN),
                    0};
    }
    if (::poll(sockets.data(), sockets.size(), wait_ms) <= 0) return;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      if ((sockets[i].revents & POLLOUT) != 0)
        require(mosquitto_loop_write(cells[i].client.get(), 1));
      if ((sockets[i].revents & ~POLLOUT) != 0)
        require(mosquitto_loop_read(cells[i].client.get(), 1));
    }
  }

  template <class Done>
  void turn_until(Done done) {
    while (!done()) turn(100);
  }

  std::vector<Cell> cells;
  std::vector<pollfd> sockets;
  std::size_t connected = 0, published = 0, acknowledged = 0;
};

SimulatedCells::SimulatedCells(std::uint16_t port, std::size_t count)
    : impl_(std::make_unique<Impl>(port, count)) {}

SimulatedCells::~SimulatedCells() = default;

void SimulatedCells::publish_all(std::size_t each, std::int64_t session) {
  for (std::size_t n = 0; n < each; ++n) {
    for (std::size_t i = 0; i < impl_->cells.size(); ++i) impl_->publish(i, session);
    impl_->turn(0);
  }
  impl_->turn_until([this] { return impl_->acknowledged == impl_->published; });
}

void SimulatedCells::publish_paced(double per_second, double seconds, std::int64_t session) {
  const auto begun = Clock::now();
  const auto count = static_cast<std::size_t>(per_second * seconds);
  for (std::size_t i = 0; i < count; ++i) {
    const auto due =
        begun + std::chrono::duration_cast<Clock::duration>(
                    std::chrono::duration<double>(static_cast<double>(i) / per_second));
    while (Clock::now() < due) impl_->turn(1);
    impl_->publish(i % impl_->cells.size(), session);
  }
  impl_->turn_until([this] { return impl_->acknowledged == impl_->published; });
}

}  // namespace cellcal::bench
