#include "daemon/main/network_server.h"

#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <boost/asio/post.hpp>

#include "daemon/plant/desk/desk.h"

namespace cellcal::daemon {

namespace {

constexpr int kNice = 10;

}  // namespace

NetworkAddress address_of(const HttpConfig& config) {
  return {config.address, config.port, config.tls_certificate, config.tls_key};
}

NetworkServer::NetworkServer(const HttpConfig& config, Api& api)
    : server_(
          context_, address_of(config),
          {[&api](Request& request) { return api.admit_network(request); },
           [&api](const Request& request, bool give_up) { return api.answer(request, give_up); },
           Api::is_slow,
           {},
           Api::largest_body}),
      thread_([this] { context_.run(); }) {
  spdlog::info("listening on {} port {}, {}", config.address, config.port,
               config.tls() ? "TLS" : "without TLS");
}

/// Its thread queries the journal and composes messages, at the lowest priority.
NetworkServer::NetworkServer(const std::filesystem::path& socket,
                             std::function<Response(const Request&)> answer)
    : server_(
          context_, socket,
          {[](Request&) { return std::nullopt; },
           [answer = std::move(answer)](const Request& request, bool) { return answer(request); },
           {},
           {.body = plant::kMostDeskBody}}),
      thread_([this] {
        ::setpriority(PRIO_PROCESS, static_cast<id_t>(::syscall(SYS_gettid)), kNice);
        context_.run();
      }) {}

void NetworkServer::stop() {
  if (!thread_.joinable()) return;
  boost::asio::post(context_, [this] {
    server_.stop();
    work_.reset();
    context_.stop();
  });
  thread_.join();
}

}  // namespace cellcal::daemon
