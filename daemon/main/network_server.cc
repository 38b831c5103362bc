#include "daemon/main/network_server.h"

#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <thread>

#include "daemon/plant/desk/desk.h"

namespace cellcal::daemon {

namespace asio = boost::asio;

namespace {

constexpr int kNice = 10;

}  // namespace

NetworkAddress address_of(const HttpConfig& config) {
  return {config.address, config.port, config.tls_certificate, config.tls_key};
}

struct NetworkServer::Impl {
  Impl(const HttpConfig& config, Api& api)
      : server(
            context, address_of(config),
            {[&api](Request& request) { return api.admit_network(request); },
             [&api](const Request& request, bool give_up) { return api.answer(request, give_up); },
             Api::is_slow,
             {},
             Api::largest_body}),
        thread([this] { context.run(); }) {}
  /// Its thread queries the journal and composes messages, at the lowest priority.
  Impl(const std::filesystem::path& socket, std::function<Response(const Request&)> answer)
      : server(
            context, socket,
            {[](Request&) { return std::nullopt; },
             [answer = std::move(answer)](const Request& request, bool) { return answer(request); },
             {},
             {.body = plant::kMostDeskBody}}),
        thread([this] {
          ::setpriority(PRIO_PROCESS, static_cast<id_t>(::syscall(SYS_gettid)), kNice);
          context.run();
        }) {}

  asio::io_context context;
  asio::executor_work_guard<asio::io_context::executor_type> work{context.get_executor()};
  HttpServer server;
  std::thread thread;
};

NetworkServer::NetworkServer(const HttpConfig& config, Api& api)
    : impl_(std::make_unique<Impl>(config, api)) {
  spdlog::info("listening on {} port {}, {}", config.address, config.port,
               config.tls() ? "TLS" : "without TLS");
}

NetworkServer::NetworkServer(const std::filesystem::path& socket,
                             std::function<Response(const Request&)> answer)
    : impl_(std::make_unique<Impl>(socket, std::move(answer))) {}

NetworkServer::~NetworkServer() { stop(); }

void NetworkServer::poke() { impl_->server.poke(); }

void NetworkServer::stop() {
  if (!impl_->thread.joinable()) return;
  asio::post(impl_->context, [this] {
    impl_->server.stop();
    impl_->work.reset();
    impl_->context.stop();
  });
  impl_->thread.join();
}

}  // namespace cellcal::daemon
