// Acknowledgements of Debian's libmosquitto: a collector relies on storing before acknowledging.

#include <gtest/gtest.h>
#include <mosquitto.h>
#include <mqtt_protocol.h>
#include <poll.h>

#include <chrono>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "tests/daemon/fleet/servers.h"

namespace cellcal::daemon::fleet::testing {
namespace {

using Texts = std::vector<std::string>;
constexpr const char* kTopic = "cellcal/graz/weld-3/fact/alarm";
constexpr const char* kShared = "$share/fleet/cellcal/+/+/fact/+";

enum class Packets { kQueued, kSentAtOnce };

/// A client whose loop is called manually, with a persistent session.
class Client {
 public:
  Client(const MqttBroker& broker, const std::string& id, Packets packets) {
    static const int kLibrary = mosquitto_lib_init();
    (void)kLibrary;
    client_.reset(mosquitto_new(id.c_str(), false, this));
    mosquitto_int_option(client_.get(), MOSQ_OPT_PROTOCOL_VERSION, MQTT_PROTOCOL_V5);
    if (packets == Packets::kQueued) mosquitto_threaded_set(client_.get(), true);
    mosquitto_connect_callback_set(client_.get(), [](mosquitto*, void* self, int) {
      static_cast<Client*>(self)->connected_ = true;
    });
    mosquitto_subscribe_callback_set(client_.get(),
                                     [](mosquitto*, void* self, int, int, const int*) {
                                       static_cast<Client*>(self)->subscribed_ = true;
                                     });
    mosquitto_publish_callback_set(client_.get(), [](mosquitto*, void* self, int) {
      ++static_cast<Client*>(self)->published_;
    });
    mosquitto_message_callback_set(client_.get(),
                                   [](mosquitto*, void* self, const mosquitto_message* message) {
                                     static_cast<Client*>(self)->received_.emplace_back(
                                         static_cast<const char*>(message->payload),
                                         static_cast<std::size_t>(message->payloadlen));
                                   });
    mosquitto_property* session = nullptr;
    mosquitto_property_add_int32(&session, MQTT_PROP_SESSION_EXPIRY_INTERVAL, 3600);
    // libmosquitto's default is 20.
    mosquitto_property_add_int16(&session, MQTT_PROP_RECEIVE_MAXIMUM, 1000);
    const int code =
        mosquitto_connect_bind_v5(client_.get(), "127.0.0.1", broker.port(), 60, nullptr, session);
    mosquitto_property_free_all(&session);
    if (code != MOSQ_ERR_SUCCESS) throw std::runtime_error(mosquitto_strerror(code));
    turn_until([this] { return connected_; });
  }

  void subscribe() {
    mosquitto_subscribe(client_.get(), nullptr, kShared, 1);
    turn_until([this] { return subscribed_; });
  }

  /// Returns when the broker has acknowledged it.
  void publish(const std::string& text, const char* topic = kTopic) {
    const int before = published_;
    mosquitto_publish(client_.get(), nullptr, topic, static_cast<int>(text.size()), text.data(), 1,
                      false);
    turn_until([&] { return published_ > before; });
  }

  /// Reads this many messages, without writing.
  Texts read_only(std::size_t count) {
    while (received_.size() < count && wait()) mosquitto_loop_read(client_.get(), 1);
    return std::exchange(received_, {});
  }

  void write() { mosquitto_loop_write(client_.get(), 1); }
  bool wants_to_write() const { return mosquitto_want_write(client_.get()); }

 private:
  struct Free {
    void operator()(mosquitto* client) const { mosquitto_destroy(client); }
  };

  bool wait() const {
    constexpr int kLong_ms = 20'000;
    pollfd socket{mosquitto_socket(client_.get()), POLLIN, 0};
    return ::poll(&socket, 1, kLong_ms) > 0;
  }

  template <class Done>
  void turn_until(Done done) {
    while (!done()) {
      write();
      if (!wait()) throw std::runtime_error("the broker does not answer");
      if (const int code = mosquitto_loop_read(client_.get(), 1); code != MOSQ_ERR_SUCCESS)
        throw std::runtime_error(mosquitto_strerror(code));
    }
  }

  std::unique_ptr<mosquitto, Free> client_;
  bool connected_ = false, subscribed_ = false;
  int published_ = 0;
  Texts received_;
};

/// Messages on the collector's next connection, after one was closed with one message read.
Texts after_letting_go(Packets packets, bool write) {
  MqttBroker broker;
  std::optional<Client> collector(std::in_place, broker, "collector", packets);
  collector->subscribe();
  Client cell(broker, "cell", Packets::kQueued);
  cell.publish("1");
  EXPECT_EQ(collector->read_only(1), Texts{"1"});
  if (write) collector->write();
  collector.reset();
  cell.publish("2");
  Client again(broker, "collector", packets);
  return again.read_only(write || packets == Packets::kSentAtOnce ? 1 : 2);
}

TEST(Acknowledgement, OfQueuedPacketsWaitsForTheLoopToWrite) {
  EXPECT_EQ(after_letting_go(Packets::kQueued, false), (Texts{"1", "2"}));
}

TEST(Acknowledgement, ThatWasWrittenIsTheEndOfTheMessage) {
  EXPECT_EQ(after_letting_go(Packets::kQueued, true), Texts{"2"});
}

TEST(Acknowledgement, OtherwiseIsGoneBeforeAnybodyCouldStoreTheMessage) {
  EXPECT_EQ(after_letting_go(Packets::kSentAtOnce, false), Texts{"2"});
}

TEST(Acknowledgement, OfABatchGoesOutWithOneWrite) {
  MqttBroker broker;
  std::optional<Client> collector(std::in_place, broker, "collector", Packets::kQueued);
  collector->subscribe();
  Client cell(broker, "cell", Packets::kQueued);
  for (int i = 0; i < 100; ++i) cell.publish(std::to_string(i));
  EXPECT_EQ(collector->read_only(100).size(), 100u);
  EXPECT_TRUE(collector->wants_to_write());
  collector->write();
  EXPECT_FALSE(collector->wants_to_write());
  collector.reset();
  // The broker reads one packet per connection in turn; unread data is lost when the next connection takes over.
  for (int i = 0; i < 200; ++i) cell.publish("", "cellcal/nobody");
  cell.publish("last");
  EXPECT_EQ(Client(broker, "collector", Packets::kQueued).read_only(1), Texts{"last"});
}

TEST(MqttBroker, StoppedInOrderGoesOnWithAllMessagesThatWait) {
  MqttBroker broker;
  std::optional<Client> collector(std::in_place, broker, "collector", Packets::kQueued);
  collector->subscribe();
  collector.reset();
  {
    Client cell(broker, "cell", Packets::kQueued);
    for (const char* text : {"1", "2", "3"}) cell.publish(text);
  }
  broker.stop();
  broker.start();
  Client again(broker, "collector", Packets::kQueued);
  EXPECT_EQ(again.read_only(3), (Texts{"1", "2", "3"}));
}

// Mosquitto acknowledges before it saves, with every setting of autosave: acknowledged messages of a cell may be lost,
// which is then a gap in the numbers of its journal.
TEST(MqttBroker, KilledHasLostWhatItAcknowledgedAndDidNotSave) {
  MqttBroker broker("autosave_interval 1800\n");
  Client(broker, "collector", Packets::kQueued).subscribe();
  Client(broker, "cell", Packets::kQueued).publish("1");
  broker.kill();
  broker.start();
  Client again(broker, "collector", Packets::kQueued);
  again.subscribe();  // its session was not saved, either
  Client(broker, "cell", Packets::kQueued).publish("2");
  EXPECT_EQ(again.read_only(1), Texts{"2"});
}

}  // namespace
}  // namespace cellcal::daemon::fleet::testing
