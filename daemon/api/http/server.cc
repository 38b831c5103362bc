#include "daemon/api/http/server.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/post.hpp>
#include <map>
#include <tuple>
#include <vector>

#include "daemon/api/http/server_impl.h"

namespace cellcal::daemon {

namespace asio = boost::asio;

namespace {

/// Update period of the arm's joints on a page.
constexpr std::chrono::milliseconds kStreamPollPeriod{200};
/// A failing link changes its text up to a thousand times a second.
constexpr std::chrono::milliseconds kPokePeriod{50};
/// Probably out of file descriptors: an immediate retry would only use processor time.
constexpr std::chrono::seconds kAcceptPause{1};

}  // namespace

void HttpServer::Impl::add(const std::shared_ptr<Connection>& connection) {
  make_room();
  connections.push_back(connection);
  connection->start();
}

/// Keeps one slot free, since the next client may have to stop the arm. The least important connection is
/// closed; among equals the oldest of the network that holds most of them.
void HttpServer::Impl::make_room() {
  if (connections.size() < kMostConnections) return;
  const auto rank = [this](const std::shared_ptr<Connection>& one) {
    const auto alike = std::count_if(
        connections.begin(), connections.end(), [&](const std::shared_ptr<Connection>& other) {
          return other->waits() == one->waits() && other->network() == one->network();
        });
    return std::tuple(one->waits(), -alike);
  };
  const auto least =
      std::min_element(connections.begin(), connections.end(),
                       [&](const auto& a, const auto& b) { return rank(a) < rank(b); });
  const std::shared_ptr<Connection> gone = *least;
  gone->close();
}

bool HttpServer::Impl::make_room_for_a_stream(const std::string& caller) {
  std::map<std::string, std::vector<std::shared_ptr<Connection>>>
      followers;  // by caller, oldest first
  std::size_t all = 0;
  for (const auto& one : connections) {
    if (one->waits() != Connection::Waits::kForEvents) continue;
    followers[one->caller()].push_back(one);
    ++all;
  }
  if (all < kMostStreams) return true;
  const auto most = std::ranges::max_element(
      followers, {}, [](const auto& of_one) { return of_one.second.size(); });
  if (most->second.size() < followers[caller].size() + 2) return false;
  most->second.back()->close();
  return true;
}

void HttpServer::Impl::poll_streams() { ask_followers_at(followers_asked_ + kStreamPollPeriod); }

void HttpServer::Impl::ask_followers_at(std::chrono::steady_clock::time_point when) {
  if (stopped) return;
  beat.expires_at(when);  // replaces the previous wait
  beat.async_wait([weak = weak_from_this()](boost::system::error_code cancelled) {
    const auto self = weak.lock();
    if (self && !cancelled) self->ask_followers();
  });
}

void HttpServer::Impl::ask_followers() {
  followers_asked_ = std::chrono::steady_clock::now();
  bool any = false;
  const auto now = connections;  // a copy: closed connections are removed meanwhile
  for (const auto& one : now) {
    if (one->waits() != Connection::Waits::kForEvents) continue;
    any = true;
    one->ask(false);
  }
  if (any) poll_streams();
}

void HttpServer::Impl::ask_all() {
  bool any = false;
  const auto now = connections;  // a copy: an answer may end its connection
  for (const auto& one : now) {
    const bool follows = one->waits() == Connection::Waits::kForEvents;
    any |= follows;
    if (!follows) one->ask(false);
  }
  if (any) ask_followers_at(followers_asked_ + kPokePeriod);
}

void HttpServer::Impl::accept_later() {
  auto pause = std::make_shared<asio::steady_timer>(context, kAcceptPause);
  pause->async_wait([self = shared_from_this(), pause](boost::system::error_code) {
    if (!self->stopped) self->accept();
  });
}

HttpServer::HttpServer(asio::io_context& context, const std::filesystem::path& socket,
                       ServerParts parts)
    : impl_(listen_on(context, socket, std::move(parts))) {
  impl_->accept();
}

HttpServer::HttpServer(asio::io_context& context, const NetworkAddress& address, ServerParts parts)
    : impl_(listen_on(context, address, std::move(parts))) {
  impl_->accept();
}

HttpServer::~HttpServer() { stop(); }

void HttpServer::poke() {
  if (impl_->poked.exchange(true)) return;
  asio::post(impl_->context, [weak = std::weak_ptr<Impl>(impl_)] {
    const auto impl = weak.lock();
    if (!impl) return;
    impl->poked = false;
    impl->ask_all();
  });
}

void HttpServer::stop() {
  if (impl_->stopped) return;
  impl_->stopped = true;
  impl_->beat.cancel();
  impl_->stop_listening();
  const auto connections = impl_->connections;
  for (const auto& connection : connections) connection->close();
  impl_->clerk.reset();  // waits for the current job
}

std::uint16_t HttpServer::port() const { return impl_->port(); }

ServerThread::ServerThread(const std::filesystem::path& socket, ServerParts parts, int nice)
    : server_(context_, socket, std::move(parts)), thread_([this, nice] {
        if (nice > 0) ::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), nice);
        context_.run();
      }) {}

ServerThread::ServerThread(const NetworkAddress& address, ServerParts parts)
    : server_(context_, address, std::move(parts)), thread_([this] { context_.run(); }) {}

void ServerThread::stop() {
  if (!thread_.joinable()) return;
  asio::post(context_, [this] {
    server_.stop();
    work_.reset();
    context_.stop();
  });
  thread_.join();
}

bool Clerk::post(const Request& request, std::function<void()> job) {
  const bool acts = request.method != "GET";
  const std::string& name = request.caller.name;
  {
    const std::lock_guard lock(mutex_);
    std::deque<Waiting>& waiting = acts ? acting_ : reading_;
    const auto own = static_cast<std::size_t>(std::count_if(
        waiting.begin(), waiting.end(), [&](const Waiting& one) { return one.name == name; }));
    if (waiting.size() >= (acts ? kMostActing : kMostReading)) return false;
    if (own >= (acts ? kMostActingOfOne : kMostReadingOfOne)) return false;
    waiting.push_back({name, std::move(job)});
  }
  worker_.post([this] { do_next(); });
  return true;
}

void Clerk::do_next() {
  std::function<void()> job;
  {
    const std::lock_guard lock(mutex_);
    std::deque<Waiting>& waiting = acting_.empty() ? reading_ : acting_;
    job = std::move(waiting.front().job);
    waiting.pop_front();
  }
  job();
}

}  // namespace cellcal::daemon
