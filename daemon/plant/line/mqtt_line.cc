#include "daemon/plant/line/mqtt_line.h"

#include <fmt/format.h>
#include <mosquitto.h>
#include <mqtt_protocol.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cerrno>
#include <cstring>
#include <mutex>
#include <system_error>
#include <thread>

#include "calib/files/input_file.h"
#include "daemon/files/atomic_file.h"
#include "daemon/runner/backend.h"

namespace cellcal::daemon::plant {

namespace asio = boost::asio;

namespace {

constexpr int kQos = 1;  ///< of subscriptions
constexpr int kFirstRefusal = 0x80;
constexpr std::chrono::seconds kMisc{1};
constexpr std::size_t kLargestHeard = std::size_t{1} << 18;
/// Announced to the broker, which withholds larger packets: no message of the plant is larger.
constexpr std::uint32_t kLargestPacket = 2 * kLargestHeard;

/// Once per process and never undone: a thread waiting for the resolver may outlive the last line.
bool library_is_there() {
  static const bool made = mosquitto_lib_init() == MOSQ_ERR_SUCCESS;
  return made;
}

int qos_of(const MqttLine::Message& message) {
  return message.delivery == MqttLine::Delivery::kAtLeastOnce ? 1 : 0;
}

std::string first_line_of(const std::filesystem::path& file) {
  const std::string text = calib::read_file(file);
  return text.substr(0, text.find_first_of("\r\n"));
}

const char* or_null(const std::string& text) { return text.empty() ? nullptr : text.c_str(); }

}  // namespace

/// Handle of libmosquitto with the state of its callbacks. Shared with the thread that opens it.
struct MqttLine::Handle {
  Handle() = default;
  ~Handle() { mosquitto_destroy(raw); }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;

  mosquitto* raw = nullptr;
  Impl* line = nullptr;  ///< for callbacks within its loop; never set while opening
  std::string tls_words;
};

/// Result of the opening thread for the line's own thread, if that still exists.
struct MqttLine::OpeningGuard {
  std::mutex mutex;
  bool closed = false;
};

struct MqttLine::Impl : std::enable_shared_from_this<MqttLine::Impl> {
  Impl(asio::io_context& io, const PlantConfig& plant, Events callbacks, Times limits)
      : config(plant),
        events(std::move(callbacks)),
        times(limits),
        context(io),
        socket(io),
        misc(io),
        opening(io) {}
  ~Impl() { socket.release(); }

  std::string broker() const { return fmt::format("broker {}:{}", config.host, config.port); }
  void open(const std::optional<Message>& will);
  void set_up(const std::optional<Message>& will);
  void connect();
  /// While opening these belong to another thread.
  std::string tls_words() const {
    return handle != nullptr ? opening_handle->tls_words : std::string();
  }
  void opened(int code, int error_number);
  LineFailure failure_of(int code) const;
  LineFailure failure_of_reason(int reason) const;
  void settle(int code);
  void watch();
  void tick();
  void end(LineFailure failure);

  // Callbacks of libmosquitto, within its calls.
  void on_connect(int reason, const mosquitto_property* properties) {
    std::uint32_t bytes = 0;
    if (mosquitto_property_read_int32(properties, MQTT_PROP_MAXIMUM_PACKET_SIZE, &bytes, false) !=
        nullptr)
      largest_packet = bytes;
    if (reason < kFirstRefusal && reason == 0)
      post([this] {
        opening.cancel();
        is_up = true;
        events.up();
      });
    else
      refusal = LineFailure{
          reason == MQTT_RC_SERVER_BUSY || reason == MQTT_RC_SERVER_UNAVAILABLE
              ? LineProblem::kUnreachable
              : LineProblem::kLogin,
          fmt::format("{}: login refused ({}). Check user and password_file under [plant], "
                      "and that user at the broker",
                      broker(), mosquitto_reason_string(reason))};
  }
  void on_answer(int message, int reason) {
    std::optional<LineFailure> refused;
    if (reason >= kFirstRefusal || reason == MQTT_RC_NO_MATCHING_SUBSCRIBERS)
      refused = failure_of_reason(reason);
    post([this, message, refused = std::move(refused)] { events.answered(message, refused); });
  }
  void on_message(const mosquitto_message& message) {
    // Retained or not: larger messages than any of the plant's are not parsed.
    if (message.payloadlen < 0 || static_cast<std::size_t>(message.payloadlen) > kLargestHeard)
      return;
    const auto* bytes = static_cast<const char*>(message.payload);
    std::string payload =
        bytes == nullptr ? "" : std::string(bytes, static_cast<std::size_t>(message.payloadlen));
    post([this, topic = std::string(message.topic), payload = std::move(payload)] {
      events.heard(topic, payload);
    });
  }
  void on_disconnect(int reason) {
    if (!refusal && reason >= kFirstRefusal) refusal = failure_of_reason(reason);
    gone = true;
  }
  template <class F>
  void post(F act) {
    asio::post(context, [self = shared_from_this(), act = std::move(act)] {
      if (!self->ended) act();
    });
  }

  PlantConfig config;
  std::string role;
  Events events;
  Times times;
  asio::io_context& context;
  asio::posix::stream_descriptor socket;
  asio::steady_timer misc, opening;
  std::shared_ptr<Handle> opening_handle = std::make_shared<Handle>();
  mosquitto* handle = nullptr;  ///< the handle, once no other thread uses it
  std::shared_ptr<OpeningGuard> guard = std::make_shared<OpeningGuard>();
  std::optional<std::uint32_t> largest_packet;
  std::optional<LineFailure> refusal;  ///< the broker's reason before the line ended
  bool is_up = false, gone = false, ended = false, closing = false, reading = false,
       writing = false;
};

LineFailure MqttLine::Impl::failure_of(int code) const {
  const auto say = [&](LineProblem problem, const std::string& words) {
    return LineFailure{problem, broker() + ": " + words};
  };
  switch (code) {
    case MOSQ_ERR_EAI:
    case MOSQ_ERR_LOOKUP:
      return say(LineProblem::kNoName,
                 "unknown host name. Check broker under [plant], and the name resolution (DNS)");
    case MOSQ_ERR_TLS:
    case MOSQ_ERR_TLS_HANDSHAKE:
      return say(
          LineProblem::kCertificate,
          fmt::format(
              "TLS failed ({}). Check ca, certificate and key under [plant], and the name in "
              "the broker's certificate",
              tls_words().empty() ? "handshake failed" : tls_words()));
    case MOSQ_ERR_OVERSIZE_PACKET:
    case MOSQ_ERR_PAYLOAD_SIZE:
      return say(LineProblem::kTooLarge,
                 "message larger than its limit. Raise message_size_limit there");
    default: break;
  }
  if (is_up) return say(LineProblem::kLost, "connection lost. Connecting again");
  const char* why = code == MOSQ_ERR_ERRNO     ? std::strerror(errno)
                    : code == MOSQ_ERR_UNKNOWN ? "connection not accepted"
                                               : mosquitto_strerror(code);
  if (config.tls && !tls_words().empty()) return failure_of(MOSQ_ERR_TLS);
  return say(
      LineProblem::kUnreachable,
      fmt::format(
          "not reached ({}). Check the cable, broker and port under [plant], and that it runs",
          why));
}

LineFailure MqttLine::Impl::failure_of_reason(int reason) const {
  const char* why = mosquitto_reason_string(reason);
  if (reason == MQTT_RC_SESSION_TAKEN_OVER) return taken_over(config);
  if (reason == MQTT_RC_NO_MATCHING_SUBSCRIBERS)
    return {
        LineProblem::kNoCollector,
        fmt::format("{}: no subscriber. Start cellcal-fleet; nothing is lost meanwhile", broker())};
  if (reason == MQTT_RC_PACKET_TOO_LARGE) return failure_of(MOSQ_ERR_OVERSIZE_PACKET);
  if (!is_up || reason == MQTT_RC_SERVER_SHUTTING_DOWN || reason == MQTT_RC_KEEP_ALIVE_TIMEOUT)
    return {LineProblem::kLost,
            fmt::format("{}: connection lost ({}). Connecting again", broker(), why)};
  return {
      LineProblem::kRefused,
      fmt::format(
          "{}: publishing refused for {}/{} ({}). Check the rights of its user there; nothing is "
          "lost meanwhile",
          broker(), config.plant, config.cell, why)};
}

void MqttLine::Impl::set_up(const std::optional<Message>& will) {
  const auto check = [&](int code, const char* what) {
    if (code != MOSQ_ERR_SUCCESS)
      throw std::runtime_error(
          fmt::format("{}: {} ({})", broker(), what, mosquitto_strerror(code)));
  };
  const std::string id =
      "cellcal-" + config.plant + "-" + config.cell + (role.empty() ? "" : "-" + role);
  Handle& own = *opening_handle;
  own.line = this;
  // A client without a will has no identity and takes over no session.
  mosquitto* const raw = own.raw = mosquitto_new(will ? id.c_str() : nullptr, true, &own);
  if (raw == nullptr) throw std::bad_alloc();
  check(mosquitto_int_option(raw, MOSQ_OPT_PROTOCOL_VERSION, MQTT_PROTOCOL_V5), "MQTT 5");
  mosquitto_connect_v5_callback_set(
      raw, [](mosquitto*, void* self, int reason, int, const mosquitto_property* properties) {
        static_cast<Handle*>(self)->line->on_connect(reason, properties);
      });
  mosquitto_publish_v5_callback_set(
      raw, [](mosquitto*, void* self, int message, int reason, const mosquitto_property*) {
        static_cast<Handle*>(self)->line->on_answer(message, reason);
      });
  mosquitto_message_callback_set(raw, [](mosquitto*, void* self, const mosquitto_message* message) {
    static_cast<Handle*>(self)->line->on_message(*message);
  });
  mosquitto_disconnect_v5_callback_set(
      raw, [](mosquitto*, void* self, int reason, const mosquitto_property*) {
        static_cast<Handle*>(self)->line->on_disconnect(reason);
      });
  mosquitto_log_callback_set(raw, [](mosquitto*, void* self, int level, const char* words) {
    std::string& kept = static_cast<Handle*>(self)->tls_words;
    if (level == MOSQ_LOG_ERR && kept.empty()) kept = printable(words);
  });
  if (config.tls) {
    const std::string ca = config.ca.string(), certificate = config.certificate.string(),
                      key = config.key.string();
    for (const std::string& file : {ca, certificate, key})
      if (!file.empty()) calib::read_file(file);  // names the file that cannot be read
    check(mosquitto_tls_set(raw, or_null(ca), ca.empty() ? "/etc/ssl/certs" : nullptr,
                            or_null(certificate), or_null(key), nullptr),
          "TLS cannot be used with ca, certificate and key under [plant]");
  }
  if (!config.user.empty()) {
    const std::string password =
        config.password_file.empty() ? "" : first_line_of(config.password_file);
    check(mosquitto_username_pw_set(raw, config.user.c_str(), or_null(password)),
          "user under [plant]");
  }
  if (!will) return;
  check(mosquitto_will_set_v5(raw, will->topic.c_str(), static_cast<int>(will->payload.size()),
                              will->payload.data(), qos_of(*will), will->retained, nullptr),
        "will");
}

void MqttLine::Impl::open(const std::optional<Message>& will) {
  try {
    if (!library_is_there()) throw std::runtime_error("libmosquitto cannot be used");
    set_up(will);
  } catch (const std::exception& failed) {
    end({LineProblem::kFiles, fmt::format("under [plant]: {}", failed.what())});
    return;
  }
  opening.expires_after(times.opening);
  opening.async_wait([self = shared_from_this()](boost::system::error_code cancelled) {
    if (!cancelled && !self->is_up) self->end(self->failure_of(MOSQ_ERR_TIMEOUT));
  });
  connect();
}

/// The resolver may block indefinitely; it runs on a thread that is never joined.
void MqttLine::Impl::connect() {
  try {
    std::thread([own = opening_handle, guard = guard, weak = weak_from_this(), &context = context,
                 host = config.host, port = config.port,
                 keepalive = static_cast<int>(times.keepalive.count())] {
      mosquitto_property* limit = nullptr;
      mosquitto_property_add_int32(&limit, MQTT_PROP_MAXIMUM_PACKET_SIZE, kLargestPacket);
      const int code =
          mosquitto_connect_bind_v5(own->raw, host.c_str(), port, keepalive, nullptr, limit);
      const int error_number = errno;
      mosquitto_property_free_all(&limit);
      const std::lock_guard lock(guard->mutex);
      if (guard->closed) return;
      asio::post(context, [weak, code, error_number] {
        if (const auto self = weak.lock(); self && !self->ended) self->opened(code, error_number);
      });
    }).detach();
  } catch (const std::system_error& none) {
    end({LineProblem::kUnreachable, broker() + ": " + none.what()});
  }
}

void MqttLine::Impl::opened(int code, int error_number) {
  handle = opening_handle->raw;
  errno = error_number;
  settle(code);
  if (!ended) tick();
}

/// Every second: pings, and detection of missing answers.
void MqttLine::Impl::tick() {
  misc.expires_after(kMisc);
  misc.async_wait([self = shared_from_this()](boost::system::error_code cancelled) {
    if (cancelled || self->ended) return;
    self->settle(mosquitto_loop_misc(self->handle));
    if (!self->ended) self->tick();
  });
}

/// After each library call that may have met the end of the line.
void MqttLine::Impl::settle(int code) {
  if (ended) return;
  if (gone || (code != MOSQ_ERR_SUCCESS && code != MOSQ_ERR_CONN_PENDING)) {
    end(closing ? LineFailure{} : refusal ? *refusal : failure_of(code));
    return;
  }
  watch();
}

void MqttLine::Impl::watch() {
  const int descriptor = mosquitto_socket(handle);
  if (descriptor < 0) return;
  if (!socket.is_open()) socket.assign(descriptor);
  if (!std::exchange(reading, true)) {
    socket.async_wait(asio::posix::stream_descriptor::wait_read,
                      [self = shared_from_this()](boost::system::error_code cancelled) {
                        self->reading = false;
                        if (!cancelled && !self->ended)
                          self->settle(mosquitto_loop_read(self->handle, 1));
                      });
  }
  if (!mosquitto_want_write(handle) || std::exchange(writing, true)) return;
  socket.async_wait(asio::posix::stream_descriptor::wait_write,
                    [self = shared_from_this()](boost::system::error_code cancelled) {
                      self->writing = false;
                      if (!cancelled && !self->ended)
                        self->settle(mosquitto_loop_write(self->handle, 1));
                    });
}

/// The descriptor is closed by libmosquitto.
void MqttLine::Impl::end(LineFailure failure) {
  if (std::exchange(ended, true)) return;
  {
    const std::lock_guard lock(guard->mutex);
    guard->closed = true;
  }
  misc.cancel();
  opening.cancel();
  socket.release();
  asio::post(context, [self = shared_from_this(), failure = std::move(failure)] {
    if (self->events.down) self->events.down(failure);
  });
}

MqttLine::MqttLine(asio::io_context& context, const PlantConfig& config,
                   const std::optional<Message>& will, Events events, Times times,
                   const std::string& role)
    : impl_(std::make_shared<Impl>(context, config, std::move(events), times)) {
  impl_->role = role;
  impl_->open(will);
}

MqttLine::~MqttLine() {
  impl_->events = {};
  impl_->end({});
}

int MqttLine::publish(const Message& message) {
  int id = 0;
  const int code =
      impl_->ended || impl_->handle == nullptr
          ? MOSQ_ERR_NO_CONN
          : mosquitto_publish_v5(impl_->handle, &id, message.topic.c_str(),
                                 static_cast<int>(message.payload.size()), message.payload.data(),
                                 qos_of(message), message.retained, nullptr);
  if (code != MOSQ_ERR_SUCCESS) {
    const LineFailure failure = impl_->failure_of(code);
    if (failure.problem != LineProblem::kTooLarge) impl_->settle(code);
    throw NotPublished(failure.problem, failure.words);
  }
  impl_->settle(code);
  return id;
}

void MqttLine::listen(const std::vector<std::string>& filters) {
  for (const std::string& filter : filters)
    if (!impl_->ended && impl_->handle != nullptr)
      impl_->settle(mosquitto_subscribe(impl_->handle, nullptr, filter.c_str(), kQos));
}

std::optional<std::uint32_t> MqttLine::largest_packet() const { return impl_->largest_packet; }

void MqttLine::close() {
  impl_->closing = true;
  if (!impl_->ended && impl_->handle != nullptr)
    impl_->settle(mosquitto_disconnect_v5(impl_->handle, 0, nullptr));
}

LineFailure taken_over(const PlantConfig& of) {
  return {
      LineProblem::kTakenOver,
      fmt::format("broker {}:{}: another cell uses this name, {}/{}. Give each its own name under "
                  "[plant]",
                  of.host, of.port, of.plant, of.cell)};
}

LineFailure Takeovers::judged(LineFailure failure, const PlantConfig& of, Time now) {
  constexpr std::chrono::seconds kShort{10};
  /// After a series each line is reopened a minute later, by this cell and by the other.
  constexpr std::chrono::minutes kSound{10};
  constexpr int kSeries = 3;
  if (!up_) {  // not logged in: no evidence of another cell
    short_lines_ = 0;
    return failure;
  }
  const auto lasted = now - *std::exchange(up_, std::nullopt);
  const bool suspect = short_lines_ >= kSeries;
  if (failure.problem != LineProblem::kLost ||
      lasted > (suspect ? Time::duration(kSound) : kShort)) {
    short_lines_ = 0;
    return failure;
  }
  if (!suspect && ++short_lines_ < kSeries) return failure;
  LineFailure taken = taken_over(of);
  taken.words += fmt::format("; or the broker ended {} lines at once: see its log", kSeries);
  return taken;
}

void LineThread::start() {
  constexpr int kNice = 10;
  status.since = wall_clock_utc();
  asio::post(context, [this] { connect(); });
  thread = std::thread([this] {
    ::setpriority(PRIO_PROCESS, static_cast<id_t>(::syscall(SYS_gettid)), kNice);
    const auto work = asio::make_work_guard(context);
    context.run();
  });
}

void LineThread::connect_later() {
  retry.expires_after(backoff.next());
  retry.async_wait([this](boost::system::error_code cancelled) {
    if (!cancelled) connect();
  });
}

bool LineThread::has_come_up() {
  const auto now = std::chrono::steady_clock::now();
  is_up = true;
  takeovers.up(now);
  set([&](LineStatus& to) {
    to = {true, LineProblem::kNone, {}, wall_clock_utc(), to.acknowledged};
  });
  return connections.count(now).has_value();
}

LineFailure LineThread::has_gone(const LineFailure& lost, const PlantConfig& of) {
  LineFailure failure = takeovers.judged(lost, of, std::chrono::steady_clock::now());
  line.reset();
  is_up = false;
  set([&](LineStatus& now) {
    if (std::exchange(now.connected, false)) now.since = wall_clock_utc();
  });
  return failure;
}

void LineThread::go_on_after(const LineFailure& failure) {
  if (stopping) {
    context.stop();
    return;
  }
  say(failure);
  // Two cells of the same name would disconnect each other endlessly.
  if (failure.problem == LineProblem::kTakenOver) backoff.exhaust();
  connect_later();
}

void LineThread::say(const LineFailure& failure) {
  bool news = false;
  set([&](LineStatus& now) {
    news = now.words != failure.words;
    now.problem = failure.problem;
    now.words = failure.words;
  });
  if (news && failure.problem != LineProblem::kNone &&
      warnings[failure.problem].count(std::chrono::steady_clock::now()))
    spdlog::warn("{}: {}", name_in_log, failure.words);
}

bool LineThread::begin_farewell(std::chrono::milliseconds longest) {
  stopping = true;
  retry.cancel();
  if (!orderly) line.reset();  // the will is sent instead
  if (!is_up || !orderly) {
    context.stop();
    return false;
  }
  last.expires_after(longest);
  last.async_wait([this](boost::system::error_code cancelled) {
    if (!cancelled) context.stop();
  });
  return true;
}

void LineThread::set(const std::function<void(LineStatus&)>& change) {
  const std::lock_guard lock(status_mutex);
  change(status);
}

LineStatus LineThread::status_now() const {
  const std::lock_guard lock(status_mutex);
  return status;
}

}  // namespace cellcal::daemon::plant
