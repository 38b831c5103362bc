#include "listener.h"

#include <mosquitto.h>
#include <mqtt_protocol.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <set>
#include <stdexcept>

#include "daemon/plant/messages/fact.h"
#include "daemon/plant/messages/presence.h"

namespace cellcal::daemon::testing {

namespace {
constexpr std::chrono::seconds kLongest{60};  ///< after this wait the test has failed
constexpr const char* kMarker = "cellcal/marker/marker/proposal/marker";
}  // namespace

struct Listener::Impl {
  mosquitto* handle = nullptr;
  std::string subscribe;
  mutable std::mutex mutex;
  mutable std::condition_variable changed;
  std::vector<Heard> heard;
  bool ready = false;
  std::atomic<bool> stores{false};
  int gone = 0;
  std::optional<int> answer;

  template <class F>
  void change(F act) {
    const std::lock_guard lock(mutex);
    act();
    changed.notify_all();
  }
  /// All received facts of the newest journal.
  void publish_stored() {
    plant::Stored stored;
    {
      const std::lock_guard lock(mutex);
      std::set<std::int64_t> numbers;
      for (const plant::Fact& fact : facts_in(heard)) {
        if (stored.journal != fact.journal) numbers.clear();
        stored = {fact.of, fact.journal, {}};
        numbers.insert(fact.number);
      }
      for (const std::int64_t number : numbers) {
        auto& ranges = stored.numbers;
        if (!ranges.empty() && ranges.back().second + 1 == number)
          ranges.back().second = number;
        else
          ranges.emplace_back(number, number);
      }
    }
    if (stored.journal.empty()) return;
    const std::string topic = to_text(plant::Topic{stored.of, plant::Subject::kStored, {}}),
                      payload = to_json(stored);
    mosquitto_publish_v5(handle, nullptr, topic.c_str(), static_cast<int>(payload.size()),
                         payload.data(), 0, true, nullptr);
  }
  std::string last_topics() const {
    std::string text;
    for (std::size_t i = heard.size() > 6 ? heard.size() - 6 : 0; i < heard.size(); ++i)
      text += heard[i].topic + " " + heard[i].payload.substr(0, 200) + "\n";
    return text;
  }
  template <class F>
  void wait(F done) const {
    std::unique_lock lock(mutex);
    if (!changed.wait_for(lock, kLongest, done))
      throw std::runtime_error("it was never heard. Last:\n" + last_topics());
  }
};

Listener::Listener(std::uint16_t port, const std::string& id, const std::string& subscribe,
                   const Login& login)
    : impl_(std::make_unique<Impl>()) {
  mosquitto_lib_init();
  impl_->subscribe = subscribe;
  impl_->handle = mosquitto_new(id.c_str(), false, impl_.get());
  mosquitto_int_option(impl_->handle, MOSQ_OPT_PROTOCOL_VERSION, MQTT_PROTOCOL_V5);
  if (!login.user.empty())
    mosquitto_username_pw_set(impl_->handle, login.user.c_str(), login.password.c_str());
  if (!login.ca.empty())
    mosquitto_tls_set(impl_->handle, login.ca.c_str(), nullptr, nullptr, nullptr, nullptr);
  mosquitto_connect_v5_callback_set(
      impl_->handle, [](mosquitto* mosq, void* self, int reason, int, const mosquitto_property*) {
        auto& impl = *static_cast<Impl*>(self);
        if (reason != 0) return;
        if (impl.subscribe.empty())
          impl.change([&] { impl.ready = true; });
        else
          mosquitto_subscribe_v5(mosq, nullptr, impl.subscribe.c_str(), 1, 0, nullptr);
      });
  mosquitto_subscribe_v5_callback_set(
      impl_->handle, [](mosquitto*, void* self, int, int, const int*, const mosquitto_property*) {
        auto& impl = *static_cast<Impl*>(self);
        impl.change([&] { impl.ready = true; });
      });
  mosquitto_publish_v5_callback_set(
      impl_->handle, [](mosquitto*, void* self, int, int reason, const mosquitto_property*) {
        auto& impl = *static_cast<Impl*>(self);
        impl.change([&] { impl.answer = reason; });
      });
  mosquitto_disconnect_v5_callback_set(impl_->handle,
                                       [](mosquitto*, void* self, int, const mosquitto_property*) {
                                         auto& impl = *static_cast<Impl*>(self);
                                         impl.change([&] { ++impl.gone; });
                                       });
  mosquitto_message_v5_callback_set(impl_->handle, [](mosquitto*, void* self,
                                                      const mosquitto_message* message,
                                                      const mosquitto_property*) {
    auto& impl = *static_cast<Impl*>(self);
    impl.change([&] {
      impl.heard.push_back({message->topic,
                            std::string(static_cast<const char*>(message->payload),
                                        static_cast<std::size_t>(message->payloadlen)),
                            message->retain});
    });
    if (impl.stores && std::string_view(message->topic).find("/fact/") != std::string_view::npos)
      impl.publish_stored();
  });
  mosquitto_property* properties = nullptr;
  mosquitto_property_add_int32(&properties, MQTT_PROP_SESSION_EXPIRY_INTERVAL, 3600);
  const int code =
      mosquitto_connect_bind_v5(impl_->handle, "127.0.0.1", port, 60, nullptr, properties);
  mosquitto_property_free_all(&properties);
  if (code != MOSQ_ERR_SUCCESS) throw std::runtime_error("no connection to the broker");
  mosquitto_loop_start(impl_->handle);
  impl_->wait([this] { return impl_->ready; });
}

Listener::~Listener() {
  mosquitto_disconnect(impl_->handle);
  mosquitto_loop_stop(impl_->handle, true);
  mosquitto_destroy(impl_->handle);
}

void Listener::store() {
  impl_->stores = true;
  impl_->publish_stored();
}

std::vector<Heard> Listener::until(
    const std::function<bool(const std::vector<Heard>&)>& enough) const {
  impl_->wait([&] { return enough(impl_->heard); });
  return all();
}

std::vector<Heard> Listener::all() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->heard;
}

std::vector<Heard> Listener::all_acknowledged() {
  // The broker delivers in the order in which it accepts; of another cell, so that none reacts to it.
  const auto markers = [](const std::vector<Heard>& heard) {
    return std::ranges::count(heard, std::string(kMarker), &Heard::topic);
  };
  const auto before = markers(all());
  say(kMarker, "");
  return until([&](const std::vector<Heard>& heard) { return markers(heard) > before; });
}

std::optional<int> Listener::say(const std::string& topic, const std::string& payload,
                                 bool retained) {
  int before = 0;
  impl_->change([&] {
    impl_->answer.reset();
    before = impl_->gone;
  });
  mosquitto_publish_v5(impl_->handle, nullptr, topic.c_str(), static_cast<int>(payload.size()),
                       payload.data(), 1, retained, nullptr);
  impl_->wait([&] { return impl_->answer.has_value() || impl_->gone > before; });
  const std::lock_guard lock(impl_->mutex);
  return impl_->answer;
}

std::vector<plant::Fact> facts_in(const std::vector<Heard>& heard) {
  std::vector<plant::Fact> facts;
  for (const Heard& one : heard) {
    const auto topic = plant::topic_of(one.topic);
    if (!topic) throw std::runtime_error("no topic of ours: " + one.topic);
    if (topic->subject == plant::Subject::kFact)
      facts.push_back(plant::fact_from_json(one.payload, *topic));
  }
  return facts;
}

std::optional<plant::Presence> presence_in(const std::vector<Heard>& heard) {
  std::optional<plant::Presence> newest;
  for (const Heard& one : heard) {
    const auto topic = plant::topic_of(one.topic);
    if (topic && topic->subject == plant::Subject::kPresence)
      newest = plant::presence_from_json(one.payload, *topic);
  }
  return newest;
}

}  // namespace cellcal::daemon::testing
