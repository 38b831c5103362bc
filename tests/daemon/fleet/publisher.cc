#include <mosquitto.h>

#include <atomic>
#include <stdexcept>

#include "tests/daemon/fleet/servers.h"

namespace cellcal::daemon::fleet::testing {

void publish(std::uint16_t port, const std::vector<Publication>& all) {
  std::atomic<std::size_t> taken{0};
  std::atomic<bool> connected{false};
  struct Progress {
    std::atomic<std::size_t>& taken;
    std::atomic<bool>& connected;
  } progress{taken, connected};
  mosquitto_lib_init();
  mosquitto* client = mosquitto_new(nullptr, true, &progress);
  mosquitto_connect_callback_set(
      client, [](mosquitto*, void* to, int) { static_cast<Progress*>(to)->connected = true; });
  mosquitto_publish_callback_set(
      client, [](mosquitto*, void* to, int) { ++static_cast<Progress*>(to)->taken; });
  const bool began = mosquitto_connect(client, "127.0.0.1", port, 60) == MOSQ_ERR_SUCCESS &&
                     mosquitto_loop_start(client) == MOSQ_ERR_SUCCESS &&
                     within_reach([&] { return connected.load(); });
  if (began)
    for (const Publication& one : all)
      mosquitto_publish(client, nullptr, one.topic.c_str(), static_cast<int>(one.payload.size()),
                        one.payload.data(), 1, one.retain);
  const bool done = began && within_reach([&] { return taken == all.size(); });
  mosquitto_disconnect(client);
  mosquitto_loop_stop(client, !began);
  mosquitto_destroy(client);
  if (!done) throw std::runtime_error("the broker did not take all");
}

}  // namespace cellcal::daemon::fleet::testing
