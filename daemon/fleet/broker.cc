#include "daemon/fleet/broker.h"

#include <mosquitto.h>
#include <mqtt_protocol.h>
#include <poll.h>

#include <algorithm>
#include <fstream>
#include <optional>
#include <utility>

#include "daemon/plant/messages/fact.h"

namespace cellcal::daemon::fleet {

namespace {

constexpr int kKeepAlive_s = 60, kQos = 1;
constexpr std::uint32_t kSession_s = 30u * 86'400u;
/// Larger packets are held back by the broker; those between this and kLargestMessage are
/// quarantined.
constexpr std::uint32_t kMostPacket = 2u * static_cast<std::uint32_t>(plant::kLargestMessage);
constexpr std::uint16_t kMostUnacknowledged = 1000;
constexpr std::chrono::seconds kGreeting{15};
/// Bytes in one batch: certificates are large.
constexpr std::size_t kMostBytes = std::size_t{16} << 20;

struct FreeProperties {
  void operator()(mosquitto_property* properties) const {
    mosquitto_property_free_all(&properties);
  }
};
using Properties = std::unique_ptr<mosquitto_property, FreeProperties>;

Properties connect_properties() {
  mosquitto_property* properties = nullptr;
  mosquitto_property_add_int32(&properties, MQTT_PROP_SESSION_EXPIRY_INTERVAL, kSession_s);
  mosquitto_property_add_int16(&properties, MQTT_PROP_RECEIVE_MAXIMUM, kMostUnacknowledged);
  mosquitto_property_add_int32(&properties, MQTT_PROP_MAXIMUM_PACKET_SIZE, kMostPacket);
  return Properties(properties);
}

std::string first_line_of_file(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string line;
  if (!std::getline(in, line))
    throw BrokerUnavailable(file.string() + ": no password can be read from it");
  return line;
}

const char* c_str_or_null(const std::filesystem::path& path) {
  return path.empty() ? nullptr : path.c_str();
}

/// Initialisation and cleanup of libmosquitto.
struct Library {
  Library() { mosquitto_lib_init(); }
  ~Library() { mosquitto_lib_cleanup(); }
};

}  // namespace

struct Broker::Impl {
  struct Free {
    void operator()(mosquitto* client) const { mosquitto_destroy(client); }
  };

  explicit Impl(const BrokerConfig& given) : config(given) {
    static const Library kLibrary;
    client.reset(mosquitto_new(config.client.c_str(), false, this));
    if (!client) throw BrokerUnavailable("no MQTT client can be made");
    mosquitto_int_option(client.get(), MOSQ_OPT_PROTOCOL_VERSION, MQTT_PROTOCOL_V5);
    // Packets are queued, and mosquitto_loop_write() alone writes to the socket, acknowledgements
    // too.
    mosquitto_threaded_set(client.get(), true);
    mosquitto_connect_v5_callback_set(
        client.get(), [](mosquitto*, void* self, int reason, int, const mosquitto_property*) {
          static_cast<Impl*>(self)->greeted = reason;
        });
    mosquitto_disconnect_v5_callback_set(
        client.get(), [](mosquitto*, void* self, int reason, const mosquitto_property*) {
          static_cast<Impl*>(self)->ended = reason;
        });
    mosquitto_subscribe_callback_set(
        client.get(), [](mosquitto*, void* self, int, int count, const int* granted) {
          auto& impl = *static_cast<Impl*>(self);
          for (int i = 0; i < count; ++i) impl.subscribed += granted[i] <= 2 ? 1 : 0;
          ++impl.answers;
        });
    mosquitto_message_callback_set(
        client.get(), [](mosquitto*, void* self, const mosquitto_message* message) {
          auto& impl = *static_cast<Impl*>(self);
          const auto* payload = static_cast<const char*>(message->payload);
          const auto size = static_cast<std::size_t>(std::max(0, message->payloadlen));
          impl.bytes += size;
          impl.received.push_back(
              {message->topic, size == 0 ? std::string() : std::string(payload, size)});
        });
  }

  [[noreturn]] void away(const std::string& why) const {
    throw BrokerUnavailable("broker " + config.host + " port " + std::to_string(config.port) +
                            ": " + why);
  }

  void require(int code) const {
    if (code == MOSQ_ERR_SUCCESS) return;
    if (ended == MQTT_RC_SESSION_TAKEN_OVER)
      away("another collector came with the client id \"" + config.client +
           "\". Give each its own ([broker] client)");
    away(code == MOSQ_ERR_ERRNO ? "connection lost" : mosquitto_strerror(code));
  }

  void set_access() const {
    if (!config.user.empty())
      require(mosquitto_username_pw_set(client.get(), config.user.c_str(),
                                        first_line_of_file(config.password_file).c_str()));
    if (config.tls)
      require(mosquitto_tls_set(client.get(), config.ca.empty() ? nullptr : config.ca.c_str(),
                                config.ca.empty() ? "/etc/ssl/certs" : nullptr,
                                c_str_or_null(config.certificate), c_str_or_null(config.key),
                                nullptr));
  }

  void greet() {
    set_access();
    const Properties properties = connect_properties();
    const int code = mosquitto_connect_bind_v5(client.get(), config.host.c_str(), config.port,
                                               kKeepAlive_s, nullptr, properties.get());
    if (code == MOSQ_ERR_ERRNO)
      away("no connection. Check that it runs, and [broker] host and port");
    require(code);
    // Reads and writes, as TLS requires; before CONNACK there is nothing to acknowledge. One packet at a time, so that later
    // packets are not acknowledged here.
    const auto end = std::chrono::steady_clock::now() + kGreeting;
    while (!greeted) {
      if (std::chrono::steady_clock::now() > end) away("no answer");
      require(mosquitto_loop_write(client.get(), 1));
      if (wait(std::chrono::milliseconds(20))) require(mosquitto_loop_read(client.get(), 1));
    }
    if (*greeted != MQTT_RC_SUCCESS) away(mosquitto_reason_string(*greeted));
  }

  void subscribe() {
    for (const std::string& filter : {plant::facts_of_all(config.group), plant::presence_of_all()})
      require(mosquitto_subscribe(client.get(), nullptr, filter.c_str(), kQos));
    // Immediately: packets that the broker holds for this session follow and must not be
    // acknowledged.
    send_all();
    read_until([this] { return answers == 2; });
    if (subscribed != 2)
      away("the subscription was refused. Allow the user to read cellcal/# (acl_file)");
  }

  void send_all() const {
    const auto end = std::chrono::steady_clock::now() + kGreeting;
    do {
      if (std::chrono::steady_clock::now() > end) away("takes nothing");
      require(mosquitto_loop_write(client.get(), 1));
    } while (mosquitto_want_write(client.get()));
  }

  /// Reads without writing.
  template <class Done>
  void read_until(Done done) const {
    const auto end = std::chrono::steady_clock::now() + kGreeting;
    while (!done()) {
      if (std::chrono::steady_clock::now() > end) away("no answer");
      if (wait(std::chrono::milliseconds(100))) require(mosquitto_loop_read(client.get(), 1));
    }
  }

  /// Waits until the socket is readable; false after the timeout.
  bool wait(std::chrono::milliseconds most) const {
    pollfd socket{mosquitto_socket(client.get()), POLLIN, 0};
    return socket.fd >= 0 && ::poll(&socket, 1, static_cast<int>(most.count())) > 0;
  }

  BrokerConfig config;
  std::unique_ptr<mosquitto, Free> client;
  std::optional<int> greeted, ended;
  int answers = 0, subscribed = 0;
  std::vector<Message> received;
  std::size_t bytes = 0;
};

Broker::Broker(const BrokerConfig& config) : impl_(std::make_unique<Impl>(config)) {
  impl_->greet();
  impl_->subscribe();
}

Broker::~Broker() = default;

std::vector<Message> Broker::receive(std::size_t most, std::chrono::milliseconds wait) {
  mosquitto* client = impl_->client.get();
  if (impl_->received.empty()) impl_->wait(wait);
  // One packet per call.
  while (impl_->received.size() < most && impl_->bytes < kMostBytes &&
         impl_->wait(std::chrono::milliseconds(0))) {
    impl_->require(mosquitto_loop_read(client, 1));
  }
  impl_->bytes = 0;
  return std::exchange(impl_->received, {});
}

void Broker::tell(const plant::Stored& stored) {
  const std::string topic = plant::to_text({stored.of, plant::Subject::kStored, {}}),
                    payload = plant::to_json(stored);
  constexpr bool kRetained = true;
  mosquitto_publish_v5(impl_->client.get(), nullptr, topic.c_str(),
                       static_cast<int>(payload.size()), payload.data(), 0, kRetained, nullptr);
}

void Broker::acknowledge() {
  mosquitto* client = impl_->client.get();
  impl_->require(mosquitto_loop_misc(client));
  impl_->require(mosquitto_loop_write(client, 1));
}

}  // namespace cellcal::daemon::fleet
