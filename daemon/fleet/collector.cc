#include "daemon/fleet/collector.h"

#include <fmt/format.h>
#include <mosquitto.h>
#include <mqtt_protocol.h>
#include <poll.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <fstream>
#include <optional>
#include <thread>
#include <utility>

#include "calib/files/text.h"
#include "daemon/files/atomic_file.h"
#include "daemon/plant/messages/fact.h"

namespace cellcal::daemon::fleet {

namespace {

using Clock = std::chrono::steady_clock;
constexpr std::size_t kMostMessages = 1000;
constexpr std::chrono::milliseconds kIdle{200};
constexpr std::chrono::minutes kMaintenance{1};
constexpr std::chrono::seconds kShortest{1}, kLongest{30};

/// Exponential backoff that logs loss and recovery of a peer.
class Away {
 public:
  Away(const char* what, std::atomic<bool>& up, std::atomic<std::uint64_t>& lost)
      : what_(what), up_(up), lost_(lost) {}

  void is_back() {
    if (up_.exchange(true)) return;
    wait_ = kShortest;
    spdlog::info("{}: connected", what_);
  }
  void has_gone(const std::string& why) {
    if (up_.exchange(false)) ++lost_;
    const std::string words = printable(why);
    spdlog::warn("{} away: {}. Nothing is lost: messages wait in the broker. Trying again in {} s",
                 what_, words.substr(0, words.find_last_not_of(". ") + 1), wait_.count());
  }
  void wait(const std::atomic<bool>& stop, const std::function<void()>& alive) {
    const auto end = Clock::now() + wait_;
    for (int i = 0; !stop && Clock::now() < end; ++i) {
      if (i % 10 == 0) alive();
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    wait_ = std::min(2 * wait_, kLongest);
  }

 private:
  const char* what_;
  std::atomic<bool>& up_;
  std::atomic<std::uint64_t>& lost_;
  std::chrono::seconds wait_{kShortest};
};

/// Unlimited, since the message was charged when it was received.
constexpr Allowance kAll{.messages_per_s = 1.0, .burst = 1e18, .bytes_per_day = 1e18};

/// Stores a quarantined message; false if it is refused.
bool take(Store& store, const Kept& kept, Meters& meters, Reread& result) {
  Batch batch;
  judge({kept.topic, kept.payload}, meters, {}, batch);
  if (!batch.refused.empty() || batch.empty()) return false;
  const Written written = store.write(batch);
  if (written.refused > 0) return false;
  result.stored += written.facts + batch.presences.size();
  result.twice += written.twice;
  return true;
}

constexpr int kKeepAlive_s = 60, kQos = 1;
constexpr std::uint32_t kSession_s = 30u * 86'400u;
/// Larger ones the broker keeps to itself; those between this and kLargestMessage are quarantined.
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

/// libmosquitto's own start and end.
struct Library {
  Library() { mosquitto_lib_init(); }
  ~Library() { mosquitto_lib_cleanup(); }
};

}  // namespace

Collector::Collector(CollectorConfig config)
    : config_(std::move(config)), meters_(config_.allowance) {}

void Collector::run(const std::atomic<bool>& stop, const std::function<void()>& alive) {
  Away no_store("database", counters_.store_up, counters_.store_lost);
  Away no_broker("broker", counters_.broker_up, counters_.broker_lost);
  std::optional<Store> store;
  while (!stop) {
    try {
      if (!store) store.emplace(config_.store);
      no_store.is_back();
      Broker broker(config_.broker);
      no_broker.is_back();
      serve(*store, broker, stop, alive);
    } catch (const StoreUnavailable& away) {
      store.reset();
      no_store.has_gone(away.what());
      no_store.wait(stop, alive);
    } catch (const BrokerUnavailable& away) {
      no_broker.has_gone(away.what());
      no_broker.wait(stop, alive);
    }
  }
}

void Collector::serve(Store& store, Broker& broker, const std::atomic<bool>& stop,
                      const std::function<void()>& alive) {
  std::optional<Clock::time_point> maintained;
  while (!stop) {
    std::vector<Message> messages = broker.receive(kMostMessages, kIdle);
    if (!messages.empty())
      for (const plant::Stored& stored : write(store, std::move(messages))) broker.report(stored);
    broker.acknowledge();
    alive();
    if (maintained && Clock::now() - *maintained < kMaintenance) continue;
    log_postponed(store.maintain());
    maintained = Clock::now();
  }
}

void Collector::log_postponed(std::vector<std::string> put_off) {
  if (put_off == put_off_) return;
  for (const std::string& words : put_off)
    spdlog::warn(
        "database: put off, others hold the table: {}. Look for long queries in pg_stat_activity",
        words);
  put_off_ = std::move(put_off);
}

void Collector::log_refused(const std::vector<Refused>& refused) {
  constexpr std::size_t kMostNamed = 1000;
  for (const Refused& one : refused)
    if (named_.size() < kMostNamed && named_.emplace(one.of.plant, one.of.cell, one.why).second)
      spdlog::warn(
          "refused, the first of its kind: {}: {}. Kept in fleet.quarantine; after an update of this program: "
          "cellcal-fleet --reread-quarantine",
          calib::shown(one.topic, 120), one.words);
}

std::vector<plant::Stored> Collector::write(Store& store, std::vector<Message> messages) {
  Batch batch;
  const std::size_t count = messages.size();
  // Messages that are not stored are sent again and must not be charged twice.
  const Meters before = meters_;
  for (Message& message : messages) judge(std::move(message), meters_, Clock::now(), batch);
  log_refused(batch.refused);
  Written written;
  try {
    written = store.write(batch);
  } catch (const StoreUnavailable&) {
    meters_ = before;
    throw;
  }
  counters_.messages += count;
  counters_.facts += written.facts;
  counters_.twice += written.twice;
  counters_.refused += written.refused;
  ++counters_.batches;
  return std::move(written.stored);
}

Reread reread_quarantine(Store& store) {
  Reread result;
  Meters meters(kAll);
  std::int64_t last = 0;
  for (std::vector<Kept> few = store.kept(last); !few.empty(); few = store.kept(last)) {
    for (const Kept& kept : few) {
      last = kept.id;
      if (!kept.whole)
        result.cut.push_back(fmt::format("{}, {} bytes", kept.topic, kept.bytes));
      else if (take(store, kept, meters, result))
        store.let_go(kept.id);
      else
        ++result.refused;
    }
  }
  return result;
}

struct Broker::Impl {
  struct Free {
    void operator()(mosquitto* client) const { mosquitto_destroy(client); }
  };

  explicit Impl(const BrokerConfig& given) : config(given) {
    static const Library kLibrary;
    client.reset(mosquitto_new(config.client.c_str(), false, this));
    if (!client) throw BrokerUnavailable("no MQTT client can be made");
    mosquitto_int_option(client.get(), MOSQ_OPT_PROTOCOL_VERSION, MQTT_PROTOCOL_V5);
    // Packets are queued, and the socket is written by mosquitto_loop_write() alone: acknowledgements, too.
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
    // At once: what the broker still holds for this session comes next, and must not be acknowledged with it.
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

  /// Without writing.
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
  // One packet each.
  while (impl_->received.size() < most && impl_->bytes < kMostBytes &&
         impl_->wait(std::chrono::milliseconds(0))) {
    impl_->require(mosquitto_loop_read(client, 1));
  }
  impl_->bytes = 0;
  return std::exchange(impl_->received, {});
}

void Broker::report(const plant::Stored& stored) {
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
