#include "daemon/main/network_door.h"

#include <spdlog/spdlog.h>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <thread>

#include "daemon/api/http/server.h"

namespace cellcal::daemon {

namespace asio = boost::asio;

NetworkAddress address_of(const HttpConfig& config) {
  return {config.address, config.port, config.tls_certificate, config.tls_key};
}

struct NetworkDoor::Impl {
  Impl(const HttpConfig& config, Api& api)
      : server(
            context, address_of(config),
            {[&api](Request& request) { return api.admit_network(request); },
             [&api](const Request& request, bool give_up) { return api.answer(request, give_up); },
             Api::is_slow}),
        thread([this] { context.run(); }) {}

  asio::io_context context;
  asio::executor_work_guard<asio::io_context::executor_type> work{context.get_executor()};
  HttpServer server;
  std::thread thread;
};

NetworkDoor::NetworkDoor(const HttpConfig& config, Api& api)
    : impl_(std::make_unique<Impl>(config, api)) {
  spdlog::info("listening on {} port {}, {}", config.address, config.port,
               config.tls() ? "TLS" : "without TLS");
}

NetworkDoor::~NetworkDoor() { stop(); }

void NetworkDoor::poke() { impl_->server.poke(); }

void NetworkDoor::stop() {
  if (!impl_->thread.joinable()) return;
  asio::post(impl_->context, [this] {
    impl_->server.stop();
    impl_->work.reset();
    impl_->context.stop();
  });
  impl_->thread.join();
}

}  // namespace cellcal::daemon
