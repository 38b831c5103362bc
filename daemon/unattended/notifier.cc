#include "daemon/unattended/notifier.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>

#include <condition_variable>
#include <ctime>
#include <deque>
#include <mutex>
#include <random>
#include <thread>

#include "daemon/unattended/transfer.h"

namespace cellcal::daemon {

namespace {

constexpr std::size_t kMostWaiting = 64;
constexpr std::chrono::seconds kFarewell{1};
/// Niceness of a worker: yields to threads with deadlines.
constexpr int kNice = 10;

std::string rfc_5322_now() {
  const std::tm utc = fmt::gmtime(std::time(nullptr));
  return fmt::format("{:%a}, {} {:%b %Y %H:%M:%S} +0000", utc, utc.tm_mday, utc);
}

/// 128 bits.
std::string random_id() {
  std::random_device random;
  return fmt::format("{:08x}{:08x}{:08x}{:08x}", random(), random(), random(), random());
}

Delivery send(const MailConfig& config, const std::string& mail) {
  if (!config.server) return send_mail(config, mail);
  try {
    return send_by_smtp(config, *config.server, read_secret(config.server->password_file), mail);
  } catch (const std::runtime_error& wrong) {
    return {false, false, wrong.what()};
  }
}

}  // namespace

/// Shared with the thread, which may outlive the notifier.
struct Notifier::Shared {
  Parts parts;
  std::mutex mutex;
  std::condition_variable changed;
  std::deque<std::function<std::optional<Notice>()>> waiting;
  std::deque<std::pair<Notice, NotifyConfig>> undelivered;
  bool busy = false, ending = false, ended = false;
  bool asking = false;  ///< a callback into the owner's objects is in progress

  void run();
  /// Takes the oldest waiting one: recorded at once, however long others take to be delivered.
  void ask(std::unique_lock<std::mutex>& lock);
  void deliver(const Notice& notice, const NotifyConfig& config);
  void with_retries(const char* way, const std::string& subject, int retries,
                    const std::function<Delivery()>& act);
  /// False: the daemon is shutting down.
  bool pause(std::chrono::milliseconds time) {
    const auto until = std::chrono::steady_clock::now() + time;
    std::unique_lock lock(mutex);
    while (changed.wait_until(lock, until, [this] { return ending || !waiting.empty(); })) {
      if (ending) return false;
      ask(lock);
    }
    return true;
  }
};

void Notifier::Shared::with_retries(const char* way, const std::string& subject, int retries,
                                    const std::function<Delivery()>& act) {
  std::chrono::milliseconds wait = parts.first_wait;
  for (int attempt = 0;; ++attempt, wait *= 2) {
    const Delivery result = act();
    if (result.delivered) spdlog::info("{}: \"{}\" delivered", way, subject);
    if (result.delivered && result.why.empty()) return;
    const bool last = !result.again || attempt >= retries;
    spdlog::warn("{}: \"{}\" {}{}{}", way, subject,
                 result.delivered ? "" : "not delivered: ", result.why,
                 last ? ". Given up: see [notify] in cellcald.toml" : "");
    if (last || !pause(wait)) return;
  }
}

void Notifier::Shared::deliver(const Notice& notice, const NotifyConfig& config) {
  const Message message = compose(notice, config.language, parts.host);
  // First, since an unresponsive mail server takes minutes.
  if (config.webhook) {
    with_retries("webhook", message.subject, config.webhook->retries, [&]() -> Delivery {
      try {
        return post(*config.webhook, read_secret(config.webhook->secret_file), message.json);
      } catch (const std::runtime_error& wrong) {
        return {false, false, wrong.what()};
      }
    });
  }
  constexpr int kMailRetries = 3;
  if (!config.mail) return;
  const std::string mail = mail_text(*config.mail, message, rfc_5322_now(), random_id());
  MailConfig to = *config.mail;
  with_retries("mail", message.subject, kMailRetries, [&] {
    Delivery result = send(to, mail);
    if (!result.left.empty()) to.to = result.left;
    return result;
  });
}

void Notifier::Shared::ask(std::unique_lock<std::mutex>& lock) {
  const auto next = std::move(waiting.front());
  waiting.pop_front();
  asking = true;
  lock.unlock();
  std::optional<Notice> notice;
  NotifyConfig config;
  try {
    config = parts.config();
    const auto also = parts.also ? parts.also() : nullptr;
    if (config.webhook || config.mail || also) notice = next();
    if (notice && also) also(*notice);
  } catch (const std::exception& failed) {
    spdlog::error("notify: {}", failed.what());
  }
  lock.lock();
  asking = false;
  if (notice) undelivered.emplace_back(std::move(*notice), std::move(config));
  changed.notify_all();
}

void Notifier::Shared::run() {
  ::setpriority(PRIO_PROCESS, 0, kNice);  // of this thread only
  std::unique_lock lock(mutex);
  while (true) {
    changed.wait(lock, [this] { return ending || !waiting.empty() || !undelivered.empty(); });
    if (ending) break;
    if (!waiting.empty()) {
      ask(lock);
      continue;
    }
    const auto [notice, config] = std::move(undelivered.front());
    undelivered.pop_front();
    busy = true;
    lock.unlock();
    deliver(notice, config);
    lock.lock();
    busy = false;
    changed.notify_all();
  }
  ended = true;
  changed.notify_all();
}

Notifier::Notifier(Parts parts) : shared_(std::make_shared<Shared>()) {
  shared_->parts = std::move(parts);
  std::thread([shared = shared_] { shared->run(); }).detach();
}

Notifier::~Notifier() {
  std::unique_lock lock(shared_->mutex);
  shared_->ending = true;
  if (const std::size_t left = shared_->waiting.size() + shared_->undelivered.size(); left > 0)
    spdlog::warn("notify: {} messages not sent: the daemon ends", left);
  // The objects used by pending notices may be destroyed after this returns.
  shared_->waiting.clear();
  shared_->changed.notify_all();
  shared_->changed.wait(lock, [this] { return !shared_->asking; });
  shared_->changed.wait_for(lock, kFarewell, [this] { return shared_->ended; });
}

void Notifier::notify(std::function<std::optional<Notice>()> notice) {
  const std::lock_guard lock(shared_->mutex);
  if (shared_->waiting.size() + shared_->undelivered.size() >= kMostWaiting) {
    if (shared_->undelivered.empty())
      shared_->waiting.pop_front();
    else
      shared_->undelivered.pop_front();
    spdlog::warn("notify: too many messages wait; the oldest is dropped");
  }
  shared_->waiting.push_back(std::move(notice));
  shared_->changed.notify_all();
}

void Notifier::drain() {
  std::unique_lock lock(shared_->mutex);
  shared_->changed.wait(lock, [this] {
    return shared_->waiting.empty() && shared_->undelivered.empty() && !shared_->busy &&
           !shared_->asking;
  });
}

}  // namespace cellcal::daemon
